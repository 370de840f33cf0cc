"""A scan on the nodes of RGL's adaptive grid (dupuy2018), with the tensors that interpolation between them needs.

The nodes are the Dataset's directions; the tensors are variables `tensor_*` on dimensions of their own. `evaluate` and
the writer use the values that the scan has now, so that changed and masked values count.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.rgl.adaptive import RglMeasurement
from gonio.measured.dataset import ABSOLUTE, AXES, PARAMETERISATION

Values = npt.NDArray[np.float64]

NAME = "rgl"
GRAZING, BELOW = 89.99, 90.001  # deg; nodes nearer to the horizon count as below it, as f cos(theta_r) gives no f there
Y, X = "warped_phi", "warped_theta"  # axes of the samples: the half vector's azimuth along y, its polar angle along x
TURN, INCIDENCE = "tensor_turn", "tensor_incidence"
DIMENSIONS: dict[str, tuple[str, ...]] = {
    "theta_i": (INCIDENCE,),
    "phi_i": (TURN,),
    "sigma": ("sigma_y", "sigma_x"),
    "ndf": ("ndf_y", "ndf_x"),
    "vndf": (TURN, INCIDENCE, "vndf_y", "vndf_x"),
    "luminance": (TURN, INCIDENCE, "tensor_y", "tensor_x"),
    "jacobian": ("tensor_jacobian_",),
    "valid": ("tensor_valid_",),
    "version": ("tensor_version_",),
}


def as_scan(tensors: dict[str, Any], sets: dict[str, Any]) -> xr.Dataset:
    """The scan on the nodes of the tensors; `sets` has the coordinate of its sets (channel or wavelength), or none."""
    measurement = measurement_of(tensors, len(sets))
    grid = grid_of(measurement)
    theta_r, _, cosine, scale = measurement.nodes
    values = _brdf(measurement.values, theta_r, cosine, scale)
    if not sets:
        values = values[0]
    if len(measurement.phi_i) == 1:
        values = values[..., 0, :, :, :]
    attrs = {
        "Conventions": "CF-1.11",
        "history": "divided by cos(theta_r), in the parameterisation of the file",
        "provenance": "",
        "stored": "BRDF x cos(theta_r)",
        "symmetry": "isotropic" if measurement.isotropic else "anisotropic",
        PARAMETERISATION: NAME,
        AXES: grid.attrs[AXES],
    }
    dims = (*sets, *grid["theta_r"].dims)
    set_coords = {n: (n, v, {"units": "nm"} if n == "wavelength" else {}) for n, v in sets.items()}
    coords = {name: grid.variables[name] for name in grid.coords} | set_coords
    return xr.Dataset(
        {"brdf": (dims, values, {"units": ABSOLUTE})} | tensor_variables(tensors, tuple(sets)),
        coords=coords,
        attrs=attrs,
    )


def tensor_variables(tensors: dict[str, Any], sets: tuple[str, ...]) -> dict[str, tuple[tuple[str, ...], Any]]:
    """The tensors as variables `tensor_*`, on dimensions of their own; `spectra` also has those of the sets."""
    dims = DIMENSIONS | {"spectra": (*sets, TURN, INCIDENCE, "tensor_y", "tensor_x")}
    return {f"tensor_{name}": (dims[name], values) for name, values in tensors.items()}


def _brdf(stored: Any, theta_r: Values, cosine: Values, scale: Values) -> Values:
    """The BRDF at the nodes, NaN where they count as below the horizon."""
    factor = np.divide(scale, cosine, out=np.full_like(scale, np.nan), where=_above_horizon(theta_r))
    brdf: Values = stored * factor
    return brdf


def _above_horizon(theta_r: Values) -> npt.NDArray[np.bool_]:
    """Which nodes are far enough above the horizon to divide by cos(theta_r)."""
    above: npt.NDArray[np.bool_] = np.degrees(theta_r) <= GRAZING
    return above


def measurement_of(tensors: dict[str, Any], sets: int) -> RglMeasurement:
    """The measurement with these tensors; `spectra` has a leading axis of sets unless `sets` is 0."""
    spectra = np.asarray(tensors["spectra"])
    jacobian = tensors.get("jacobian")
    theta_i, phi_i, ndf, sigma = (np.asarray(tensors[n], dtype=float) for n in ("theta_i", "phi_i", "ndf", "sigma"))
    return RglMeasurement(
        np.minimum(theta_i, math.pi / 2),
        phi_i,
        ndf,
        sigma,
        np.asarray(tensors["vndf"]),
        spectra if sets else spectra[None],
        jacobian is None or bool(np.ravel(jacobian)[0]),
    )


def grid_of(measurement: RglMeasurement) -> xr.Dataset:
    """The directions of the nodes as coordinates [deg] on (phi_i,) theta_i, Y and X."""
    theta_r, phi, _, _ = measurement.nodes
    turned = len(measurement.phi_i) > 1
    dims = (*(["phi_i"] if turned else []), "theta_i", Y, X)
    seen = np.where(_above_horizon(theta_r), np.degrees(theta_r), np.maximum(np.degrees(theta_r), BELOW))
    angles = {n: v if turned else v[0] for n, v in (("theta_r", seen), ("phi", np.degrees(phi)))}
    axes = {"theta_i": _plain(measurement.theta_i)} | ({"phi_i": _plain(measurement.phi_i)} if turned else {})
    coords: dict[str, Any] = {n: (n, v, {"units": "degree"}) for n, v in axes.items()}
    coords |= {n: (dims, v, {"units": "degree"}) for n, v in angles.items()}
    size = measurement.values.shape[-2:]
    warped = {n: (n, np.linspace(0, 1, k)) for n, k in zip((Y, X), size, strict=True)}
    return xr.Dataset(coords=coords | warped, attrs={AXES: f"{Y} {X}"})


def _plain(radians: Values) -> Values:
    """Degrees; without the spurious digits of single precision where the angle was a round number."""
    degrees = np.degrees(radians)
    short = np.round(degrees, 4)
    return np.where(np.radians(short).astype(np.float32) == radians.astype(np.float32), short, degrees)


def tensors_of(scan: xr.Dataset) -> dict[str, Any]:
    """The tensors of a scan by name. Raises ValueError where it lacks one that is needed."""
    names = [str(n) for n in scan.variables if str(n).startswith("tensor_") and str(n)[7:] in {*DIMENSIONS, "spectra"}]
    tensors: dict[str, Any] = {n[7:]: scan[n].values for n in names}
    if missing := [n for n in ("theta_i", "phi_i", "ndf", "sigma", "vndf") if n not in tensors]:
        raise ValueError(
            f"the scan is not laid out as RGL files are: it has no tensor_{missing[0]}; use gonio.convert to write it"
        )
    return tensors


def with_values(scan: xr.Dataset) -> tuple[dict[str, Any], tuple[str, ...], bool]:
    """The tensors with the values that the scan has now, the dimensions of its sets, and whether they are unchanged.

    Raises ValueError for a scan that has lost a part of its grid.
    """
    tensors = tensors_of(scan)
    wide = [d for d in ("phi_i", "theta_i", Y, X) if d in scan["brdf"].dims]
    sets = tuple(str(d) for d in scan["brdf"].dims if d not in wide)
    brdf = scan["brdf"].transpose(*sets, *wide).values
    brdf = brdf if sets else brdf[None]
    stored = tensors.get("spectra")
    if stored is None:
        size = (scan.sizes.get(Y, 0), scan.sizes.get(X, 0))
        tensors["spectra"] = np.zeros((len(tensors["phi_i"]), len(tensors["theta_i"]), *size), dtype=np.float32)
    measurement = measurement_of(tensors, len(sets) if stored is not None else 0)
    if stored is None:
        measurement = replace(
            measurement, values=np.broadcast_to(measurement.values, (len(brdf), *measurement.values.shape[1:]))
        )
    if len(measurement.phi_i) == 1:
        brdf = np.expand_dims(brdf, -4)
    if brdf.shape != measurement.values.shape:
        raise ValueError(
            f"the scan has {brdf.shape} values where its tensors have {measurement.values.shape}: flatten it"
        )
    theta_r, _, cosine, scale = measurement.nodes
    if stored is not None and np.array_equal(_brdf(measurement.values, theta_r, cosine, scale), brdf, equal_nan=True):
        return tensors, sets, True
    spectra = _stored_from(brdf, theta_r, cosine, scale, measurement.values if stored is not None else None)
    tensors["spectra"] = spectra if sets else spectra[0]
    return tensors, sets, False


def _stored_from(brdf: Values, theta_r: Values, cosine: Values, scale: Values, before: Any) -> Values:
    """The numbers to store so that the nodes above the horizon have the values `brdf`.

    Nodes below it repeat the last value above it in their row, or the first where that comes later; in a row without
    any they are zero. Where `before` has stored numbers, those below the horizon are scaled by the ratio in which that
    value changed.
    """
    above = _above_horizon(theta_r)
    last = np.maximum.accumulate(np.where(above, np.arange(above.shape[-1]), -1), axis=-1)
    last = np.broadcast_to(np.where(last < 0, above.argmax(axis=-1)[..., None], last), brdf.shape)
    factor = np.divide(cosine, scale, out=np.zeros_like(scale), where=scale > 0)
    if before is None:
        stored: Values = np.where(
            above.any(axis=-1, keepdims=True), np.take_along_axis(brdf, last, axis=-1) * factor, 0.0
        )
        return stored
    new = np.where(above & ((scale > 0) | np.isnan(brdf)), brdf * factor, before)
    old = before.astype(float)
    ratio = np.divide(new, old, out=np.ones_like(new), where=old != 0)
    return np.where(above, new, old * np.take_along_axis(ratio, last, axis=-1))


def evaluate(scan: xr.Dataset, theta_i: Any, theta_r: Any, phi: Any, phi_i: Any = None) -> Values:
    """The BRDF [1/sr] (sets.., n) at directions [deg] (n,), interpolated as readers of RGL files do.

    NaN at and below the horizon and outside the file's incidence angles. Raises ValueError for a scan without tensors.
    """
    tensors, sets, _ = with_values(scan)
    measurement = measurement_of(tensors, len(sets))
    angles = np.broadcast_arrays(theta_i, theta_r, phi, 0.0 if phi_i is None else phi_i)
    shape = angles[0].shape
    radians = [np.radians(np.asarray(a, dtype=float).ravel()) for a in angles]
    brdf = measurement.evaluate(*radians)
    last = measurement.theta_i[-1] if measurement.theta_i[-1] < math.radians(89.99) else math.pi / 2
    tolerance = math.radians(1e-5)
    within = (radians[0] >= measurement.theta_i[0] - tolerance) & (radians[0] <= last + tolerance)
    brdf[:, ~within] = np.nan
    return brdf.reshape(*([len(brdf)] if sets else []), *shape)
