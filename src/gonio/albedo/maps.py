"""Albedo of every pixel from the weights that were fitted to it, with its uncertainty u = sqrt(g C g').

g: the albedo of every term of the model; C: the covariance of the weights of the pixel.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.albedo.integrals import QUADRATURE, black_sky_of_terms, nadir_of_terms, white_sky_of_terms
from gonio.fitting.quantiles import normal, student_t
from gonio.measured.dataset import ABSOLUTE as PER_STERADIAN
from gonio.model import Model

Values = npt.NDArray[np.float64]

LEVEL = 0.95  # of `coverage_factor`


def albedo_maps(
    fits: xr.Dataset,
    model: Model,
    theta_i: float | Sequence[float],
    diffuse: float | None = None,
    *,
    method: str = QUADRATURE,
    nodes: int = 0,
) -> xr.Dataset:
    """Black-, white- and blue-sky albedo and NBAR of every pixel.

    Parameters
    ----------
    fits : xarray.Dataset
        What `retrieve`, `fit_many` or `gonio fit-stack` made: `value` and `covariance` over pixels and `parameter`.
    model : Model
        The model that was fitted.
    theta_i : float or sequence of float
        Angles of the sun [deg], 0 to below 90.
    diffuse : float, optional
        Share of diffuse light, 0 to 1, for the blue-sky albedo, which is left out without it.
    method, nodes : str, int
        As `black_sky` takes them.

    Returns
    -------
    xarray.Dataset
        `black_sky`, `blue_sky` and `nbar` over pixels and `theta_i`, `white_sky` over pixels; each with its standard
        uncertainty as `black_sky_uncertainty` and so on, which is left out where the fits have no covariance, and
        infinite where the looks do not determine it. `coverage_factor` times these is half the 95 % interval.

    Raises
    ------
    ValueError
        The fits are of another model or relative, pixels differ in shape parameters, or as `black_sky` raises it.

    """
    if str(fits.attrs.get("model", model.name)) != model.name:
        raise ValueError(f"these are fits of {fits.attrs['model']}, and not of {model.name}")
    if str(fits.attrs.get("unit", PER_STERADIAN)) != PER_STERADIAN:
        raise ValueError("the data are relative: without a calibration there is no albedo")
    if diffuse is not None and not 0 <= diffuse <= 1:
        raise ValueError("the diffuse share of the light is outside 0 to 1")
    angles = np.atleast_1d(np.asarray(theta_i, dtype=float)).tolist()
    names = [str(n) for n in fits["parameter"].values]
    if lacking := [n for n in model.parameters if n not in names]:
        raise ValueError(f"the fits have no single value of {lacking[0]} for a pixel: group by nothing, and fit anew")
    shape = _shape(fits, model)
    white = np.array([white_sky_of_terms(model, shape, method, nodes)[n] for n in model.weights])
    black = np.array([black_sky_of_terms(model, shape, angles, method, nodes)[n] for n in model.weights]).T
    nadir = nadir_of_terms(model, shape, angles)
    by_name = {"black_sky": black, "white_sky": white[None]}
    if diffuse is not None:
        by_name["blue_sky"] = (1 - diffuse) * black + diffuse * white
    by_name["nbar"] = np.array([nadir[n] for n in model.weights]).T
    places = [names.index(n) for n in model.weights]
    lanes = [str(d) for d in fits["value"].dims if d != "parameter"]
    data: dict[str, Any] = {}
    for name, terms in by_name.items():
        dims, single = ([*lanes], True) if name == "white_sky" else ([*lanes, "theta_i"], False)
        for suffix, numbers in _numbers(fits, places, lanes, terms).items():
            data[name + suffix] = (dims, numbers[..., 0] if single else numbers, {"units": "1"})
    data["coverage_factor"] = (lanes, _coverage_factor(fits, lanes))
    of_pixels = {n: c.variable for n, c in fits.coords.items() if c.dims and set(c.dims) <= set(lanes)}
    attributes = {"model": model.name, "method": method} | ({} if diffuse is None else {"diffuse": diffuse})
    theta = ("theta_i", angles, {"units": "degree"})
    return xr.Dataset(data, coords={**of_pixels, "theta_i": theta}, attrs=attributes)


def _numbers(fits: xr.Dataset, places: list[int], lanes: list[str], terms: Values) -> dict[str, Values]:
    """The albedos (pixels, angles) of weights whose terms have these (angles, n), and their uncertainties."""
    value = fits["value"].transpose(*lanes, "parameter").values[..., places]
    found = {"": np.asarray(value @ terms.T)}
    if "covariance" in fits:
        whole = fits["covariance"].transpose(*lanes, "parameter", "parameter_b").values
        covariance = np.array(whole[..., places, :][..., places])
        held = np.isnan(covariance) & ~np.isnan(value)[..., None]  # a weight that was held is exact
        covariance[held] = 0.0
        unknown = np.isinf(covariance).any(axis=(-1, -2))
        covariance[unknown] = 0.0
        variance = np.einsum("an,...nm,am->...a", terms, covariance, terms)
        found["_uncertainty"] = np.where(unknown[..., None], np.inf, np.sqrt(np.maximum(variance, 0.0)))
    return found


def _shape(fits: xr.Dataset, model: Model) -> dict[str, float]:
    """The shape parameters, which all pixels have in common."""
    shape = {}
    for name in model.shape:
        values = fits["value"].sel(parameter=name).values.ravel()
        known = np.unique(values[np.isfinite(values)])
        if len(known) > 1:
            raise ValueError(f"{name} differs from pixel to pixel: hold it in the fit, or take the pixels one by one")
        shape[name] = float(known[0]) if len(known) else model.shape[name].default
    return shape


def _coverage_factor(fits: xr.Dataset, lanes: list[str]) -> Values:
    """Half the 95 % interval over the standard uncertainty, of every pixel."""
    if fits.attrs.get("covariance") == "absolute":
        return np.full([fits.sizes[d] for d in lanes], float(normal(0.5 + LEVEL / 2)))
    if "freedom" in fits:
        freedom = fits["freedom"].transpose(*lanes).values
    else:
        free: xr.DataArray = xr.apply_ufunc(np.isfinite, fits["value"])
        if "held" in fits:
            free = free & ~fits["held"]
        freedom = (fits["points"] - free.sum(dim="parameter")).transpose(*lanes).values
    return np.asarray(student_t(np.maximum(freedom, 1), 0.5 + LEVEL / 2))
