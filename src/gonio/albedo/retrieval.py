"""Kernel weights of every pixel from its reflectances over several looks, and their covariance.

With the reflectance factors y of a pixel and pi times the terms of a model at its looks as columns of A, the weights
minimise |A x - y| and are not negative: a bounded linear fit, solved exactly for every pixel (`bounded_least_squares`).
Each pixel may have angles of its own. `as_stack` makes of looks that all pixels share a stack for `gonio.fit_many` and
`gonio fit-stack`, which fit any model.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.covariance_kinds import ABSOLUTE
from gonio.fitting.search.linear import bounded_least_squares
from gonio.geometry import Geometry
from gonio.measured.dataset import ABSOLUTE as PER_STERADIAN
from gonio.model import Model
from gonio.options import one_of
from gonio.outside import printable

Values = npt.NDArray[np.float64]

LOOK = "look"
# The coordinates of the angles [deg]: as gonio names them, or as remote sensing does.
ANGLES = {"theta_i": "solar_zenith", "theta_r": "view_zenith", "phi": "relative_azimuth"}
SCALED = "scaled"
KINDS = (SCALED, ABSOLUTE)
FULL = 7  # clear looks that a full inversion needs, as in the MODIS product
AT_ONCE = 200_000  # looks that are fitted together: more take more memory and no less time


def as_stack(reflectance: xr.DataArray, uncertainty: xr.DataArray | None = None) -> xr.Dataset:
    """A stack of scans of reflectance factors over pixels and looks whose angles all pixels share.

    Parameters
    ----------
    reflectance : xarray.DataArray
        As `retrieve` takes it, with angles along `look` alone.
    uncertainty : xarray.DataArray, optional
        Its standard uncertainty.

    Returns
    -------
    xarray.Dataset
        `brdf` [1/sr], the reflectance factor over pi, for `fit_many`, or after `to_zarr` for `gonio fit-stack`.

    Raises
    ------
    ValueError
        An angle is missing or impossible, or differs from pixel to pixel.

    """
    angles = _angles(reflectance)
    if own := [name for name, values in angles.items() if values.ndim > 1]:
        raise ValueError(f"{own[0]} differs from pixel to pixel, and scans of a stack share it: ask retrieve(..)")
    lanes = [d for d in reflectance.dims if d != LOOK]
    order = [*lanes, LOOK]
    units = {"units": PER_STERADIAN}
    columns = {"brdf": (reflectance.transpose(*order) / np.pi).astype(float)}
    if uncertainty is not None:
        columns["uncertainty"] = (uncertainty.transpose(*order) / np.pi).astype(float)
    dims = [*lanes, "direction"]
    data = {name: (dims, np.asarray(values.values), units) for name, values in columns.items()}
    of_pixels = {n: c.variable for n, c in reflectance.coords.items() if c.dims and set(c.dims) <= set(lanes)}
    coords = {name: ("direction", values, {"units": "degree"}) for name, values in angles.items()}
    return xr.Dataset(data, coords={**of_pixels, **coords}, attrs={"Conventions": "CF-1.11"})


def retrieve(
    reflectance: xr.DataArray,
    model: Model,
    *,
    uncertainty: xr.DataArray | None = None,
    covariance: str = "",
    least: int = FULL,
    prior: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Kernel weights of every pixel, none below 0, with their covariance.

    Parameters
    ----------
    reflectance : xarray.DataArray
        Reflectance factors over `look` and any other dimensions; NaN is no look. Its coordinates have the angles [deg],
        along `look` alone or of every pixel: `theta_i`, `theta_r` and `phi`, or `solar_zenith`, `view_zenith` and
        `relative_azimuth`, which is 0 where sun and sensor are on one side (backscatter).
    model : Model
        `gonio.catalogue["ross-li"]`, or another without shape parameters.
    uncertainty : xarray.DataArray, optional
        Standard uncertainty of every reflectance, by which looks are weighted.
    covariance : str
        `scaled`, from what the fit of the pixel leaves over, or `absolute`, from `uncertainty`; by default absolute
        where that is given.
    least : int
        Looks that a full fit needs; a pixel with fewer has no values, or the prior's.
    prior : mapping, optional
        Weights of the model whose multiple is fitted to pixels of fewer looks, with the shape of the prior as exact.

    Returns
    -------
    xarray.Dataset
        Over the pixels and `parameter`, as `fit_many` gives it: `value` and its standard `uncertainty`, `covariance`,
        `at_bound`; over the pixels `rmse` of the reflectance, `points`, and `freedom`, the degrees of freedom of the
        covariance, infinite for an absolute one. `full` says where a full fit was made.

    Raises
    ------
    ValueError
        The model has shape parameters, an angle is missing or impossible, or an option does not fit to another.

    """
    kind = covariance or (ABSOLUTE if uncertainty is not None else SCALED)
    _refuse(model, kind, uncertainty, least, prior)
    lanes = [str(d) for d in reflectance.dims if d != LOOK]
    angles = _angles(reflectance)
    pixels = reflectance.transpose(*lanes, LOOK).astype(float)
    shape = pixels.shape
    y = pixels.values.reshape(-1, shape[-1])
    error = np.ones(1)
    if uncertainty is not None:
        error = np.broadcast_to(uncertainty.transpose(..., LOOK).values, shape).reshape(y.shape)
        if not (error[np.isfinite(y)] > 0).all():
            raise ValueError("an uncertainty of a look is not above 0")
    full = [np.broadcast_to(values, shape).reshape(y.shape) for values in angles.values()]
    block = max(AT_ONCE // max(shape[-1], 1), 1)
    parts = [
        _fitted(model, y[k : k + block], error if error.size == 1 else error[k : k + block],
                [a[k : k + block] for a in full], kind, least, prior)
        for k in range(0, len(y), block)
    ]  # fmt: skip
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return _dataset(found, reflectance, model, lanes, shape[:-1], kind)


def _refuse(
    model: Model, kind: str, uncertainty: xr.DataArray | None, least: int, prior: Mapping[str, float] | None
) -> None:
    if model.shape:
        raise ValueError(
            f"{model.name} has shape parameters, and pixels are fitted by weights alone: take ross-li, or as_stack and "
            "fit_many"
        )
    if kind not in KINDS:
        raise ValueError(f"no covariance {printable(kind)!r}: choose {one_of(KINDS)}")
    if kind == ABSOLUTE and uncertainty is None:
        raise ValueError("absolute covariance needs the uncertainty of the reflectances: give it, or choose scaled")
    if least <= len(model.weights):
        raise ValueError(f"least is {least}: a fit of {len(model.weights)} weights needs more looks than that")
    if prior is not None and set(prior) != set(model.weights):
        raise ValueError(f"a prior gives {', '.join(model.weights)}: one number for each weight")


def _angles(reflectance: xr.DataArray) -> dict[str, Values]:
    """The angles by gonio's names: along looks, or over pixels and looks in the order of the dimensions."""
    if LOOK not in reflectance.dims:
        raise ValueError(f"reflectance has no dimension {LOOK!r}; it has {', '.join(map(str, reflectance.dims))}")
    found = {}
    for name, other in ANGLES.items():
        chosen = [n for n in (name, other) if n in reflectance.coords]
        if len(chosen) != 1:
            raise ValueError(
                f"reflectance has {' and '.join(chosen) or 'no'} coordinate {name!r} or {other!r}: give one"
            )
        column = reflectance[chosen[0]].astype(float)
        if LOOK not in column.dims:
            column = column.broadcast_like(reflectance[LOOK] if LOOK in reflectance.coords else reflectance)
        if column.dims != (LOOK,):
            lanes = [d for d in reflectance.dims if d != LOOK]
            column = column.broadcast_like(reflectance).transpose(*lanes, LOOK)
        found[name] = column.values
    used = np.isfinite(reflectance.transpose(..., LOOK).values)
    for name in ("theta_i", "theta_r"):
        angle = np.broadcast_to(found[name], used.shape)[used]
        if not ((angle >= 0) & (angle < 90)).all():
            raise ValueError(f"{name} is outside 0 to below 90 deg at a look that has a reflectance: mask that look")
    if not np.isfinite(np.broadcast_to(found["phi"], used.shape)[used]).all():
        raise ValueError("phi is no number at a look that has a reflectance: mask that look")
    return found


def _fitted(
    model: Model,
    y: Values,
    error: Values,
    angles: list[Values],
    kind: str,
    least: int,
    prior: Mapping[str, float] | None,
) -> dict[str, Any]:
    """Weights (pixels, n), their covariance and the rest of some pixels."""
    seen, n = np.isfinite(y), len(model.weights)
    scale = np.where(seen, 1 / np.where(seen, error, 1.0), 0.0)
    matrix, target = _design(model, seen, angles) * scale[..., None], np.where(seen, y, 0.0) * scale
    points = seen.sum(axis=1)
    full = points >= least
    value, covariance = np.full((len(y), n), np.nan), np.full((len(y), n, n), np.nan)
    freedom = np.full(len(y), np.nan)
    if full.any():
        value[full] = bounded_least_squares(matrix[full], target[full], np.zeros(n), np.full(n, np.inf))
        covariance[full] = _inverse(matrix[full])
        freedom[full] = points[full] - n
    few = ~full & (points > 0)
    if prior is not None and few.any():
        value[few], covariance[few] = _scaled(matrix[few], target[few], np.array([prior[w] for w in model.weights]))
        freedom[few] = points[few] - 1
    left = np.where(seen, target - np.einsum("pkn,pn->pk", matrix, value), 0.0)
    rmse = np.sqrt(np.sum((left / np.where(seen, scale, 1.0)) ** 2, axis=1) / np.maximum(points, 1))
    if kind == SCALED:
        covariance = _by_residual(covariance, np.sum(left**2, axis=1), freedom)
    else:
        freedom = np.where(np.isfinite(freedom), np.inf, np.nan)
    return {
        "value": value,
        "covariance": covariance,
        "uncertainty": np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)),
        "at_bound": value == 0,
        "rmse": np.where(np.isfinite(value[:, 0]), rmse, np.nan),
        "points": points,
        "freedom": freedom,
        "full": full,
    }


def _design(model: Model, seen: Values, angles: list[Values]) -> Values:
    """Columns A (pixels, looks, n): pi times every term at the looks that there are."""
    basis = model.basis(Geometry.from_degrees(*(np.where(seen, a, 0.0) for a in angles)), {})
    columns = [np.broadcast_to(np.asarray(basis[name], dtype=float), seen.shape) for name in model.weights]
    return np.pi * np.stack(columns, axis=-1)


def _scaled(matrix: Values, target: Values, prior: Values) -> tuple[Values, Values]:
    """The multiple of a prior (n,) that fits each pixel (pixels, n), and its covariance for errors of 1."""
    along = matrix @ prior
    size = np.sum(along**2, axis=1)
    value = (np.sum(along * target, axis=1) / size)[:, None] * prior
    return value, np.outer(prior, prior) / size[:, None, None]


def _by_residual(covariance: Values, squares: Values, freedom: Values) -> Values:
    """Covariances (pixels, n, n) for errors of 1 times the variance of the errors, from the squares of what is left.

    Infinite for a pixel without degrees of freedom; what no look determines stays infinite.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.where(freedom > 0, squares / freedom, np.inf)[:, None, None]
        scaled = covariance * variance
    return np.where(np.isinf(covariance), np.inf, np.where(covariance == 0, 0.0, scaled))


def _inverse(matrix: Values) -> Values:
    """The inverse of A'A (pixels, n, n) from the QR factors of A, infinite on the diagonal where it has none."""
    r = np.asarray(np.linalg.qr(matrix, mode="r"))
    size = np.abs(np.diagonal(r, axis1=1, axis2=2))
    sound = size.min(axis=1) > 1e-12 * size.max(axis=1)
    out = np.zeros((len(r), r.shape[-1], r.shape[-1]))
    inverse = np.linalg.inv(r[sound])
    out[sound] = inverse @ np.swapaxes(inverse, 1, 2)
    out[~sound] = np.diag(np.full(r.shape[-1], np.inf))
    return out


def _dataset(
    found: dict[str, Any], reflectance: xr.DataArray, model: Model, lanes: list[str], shape: tuple[int, ...], kind: str
) -> xr.Dataset:
    dims = {"value": ["parameter"], "uncertainty": ["parameter"], "at_bound": ["parameter"]}
    dims["covariance"] = ["parameter", "parameter_b"]
    data = {
        name: ([*lanes, *dims.get(name, [])], values.reshape(*shape, *values.shape[1:]))
        for name, values in found.items()
    }
    of_pixels = {n: c.variable for n, c in reflectance.coords.items() if c.dims and set(c.dims) <= set(lanes)}
    attributes = {"model": model.name, "unit": PER_STERADIAN, "covariance": kind}
    return xr.Dataset(data, coords={**of_pixels, "parameter": list(model.weights)}, attrs=attributes)
