"""RGL's measured BRDF files (dupuy2018): values on directions warped by the visible normals, in a tensor_file.

The nodes of the file's own grid are the Dataset's directions; the tensors needed between them stay beside as variables
`tensor_*`, and `evaluate` interpolates as the files are meant to be read. A scan in any other form is laid out on half
vectors, evenly in sqrt(theta_h) and phi_h: `vndf` is constant, `ndf` 4 and `sigma` 1, so that a value stored is
f cos(theta_r) itself. What lies below the horizon continues the last value above it, so that interpolation is straight
up to the horizon. An anisotropic scan covers the whole circle of phi_i, because not every reader folds it back.
"""

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.adaptive import Surface
from gonio.measured.dataset import ABSOLUTE, PARAMETERISATION, add_history
from gonio.measured.format import Format, Holds
from gonio.measured.tensor_file import MAGIC, Fields, write_fields
from gonio.measured.text import clip

Values = npt.NDArray[np.float64]

NAME = "rgl"
MOST_SLICES = 4096  # incidences of light
SIZE = 64  # samples along each warped axis of a file that gonio lays out
MOST_ANGLES = 91  # incidence angles of a scan that are kept as they are
EVEN_ANGLES = 31  # otherwise
WIDEST_TURN = 15.0  # deg
GRAZING, BELOW = 89.99, 90.001  # deg; nearer to the horizon f cos(theta_r) says nothing of f: nodes count as below it
Y, X = "warped_phi", "warped_theta"  # the sample's axes: its half vector's azimuth runs with y, its polar angle with x
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
INTEGERS = {"jacobian": "u1", "valid": "u1", "version": "<u4"}
GREY = "grey"  # a field of gonio's own: the three channels are one set of values


def _recognises(head: bytes) -> bool:
    return head.startswith(MAGIC) and b"vndf" in head


def _read(path: Path) -> xr.Dataset:
    fields = Fields(path)
    stored, sets = _stored(fields)
    tensors = _tensors(fields, stored)
    along = {} if GREY in fields.arrays else sets
    spectra = np.moveaxis(stored, 2, 0) if along else stored[:, :, 0]
    scan = _dataset(tensors | {"spectra": spectra}, along)
    if grazing := int((scan["theta_r"] == BELOW).sum()):
        scan = add_history(
            scan, f"{grazing} nodes beyond {GRAZING} deg count as below the horizon: f cos tells no f there"
        )
    if "description" in fields.arrays:
        size = fields.get("description", "u1", 1).size
        fields.bytes.at = fields.starts["description"]
        scan.attrs["provenance"] = fields.bytes.text(size, "description")
    known = {*DIMENSIONS, "spectra", "rgb", "wavelengths", "description", GREY}
    if strangers := [name for name in fields.arrays if name not in known]:
        scan = add_history(
            scan, f"left out fields that gonio does not know: {clip(', '.join(map(ascii, strangers)), 200)}"
        )
    return scan


def _stored(fields: Fields) -> tuple[npt.NDArray[np.floating], dict[str, Any]]:
    """The values (phi_i, theta_i, sets, y, x) and the coordinate of their sets."""
    name = "spectra" if "spectra" in fields.arrays else "rgb"
    found = fields.get(name, "<f4", 5)
    if min(found.shape[-2:]) < 2:
        raise fields.wrong(name, f"its shape {found.shape} is no grid: 2 samples are the least along both")
    fields.check(name, np.isfinite(found), "not finite")
    if not found.any():
        raise fields.wrong(name, "every brdf value is zero: the detector saw nothing, or the file is damaged")
    if name == "rgb":
        if found.shape[2] != 3:
            raise fields.wrong(name, f"it has {found.shape[2]} channels, not 3")
        if GREY in fields.arrays and not (found == found[:, :, :1]).all():
            raise fields.wrong(GREY, "the file is said to be grey, and its channels differ")
        return found, {"channel": np.array(["R", "G", "B"])}
    wavelengths = fields.get("wavelengths", "<f4", 1)
    fields.check("wavelengths", np.isfinite(wavelengths) & (wavelengths > 0), "no wavelength")
    fields.check("wavelengths", np.diff(wavelengths, prepend=-1) > 0, "not above the one before")
    if found.shape[2] != len(wavelengths):
        raise fields.wrong(name, f"it has {found.shape[2]} wavelengths, and the field wavelengths {len(wavelengths)}")
    return found, {"wavelength": wavelengths.astype(float)}


def _tensors(fields: Fields, stored: npt.NDArray[np.floating]) -> dict[str, Any]:
    theta_i, phi_i = fields.get("theta_i", "<f4", 1), fields.get("phi_i", "<f4", 1)
    fields.check("theta_i", (theta_i >= 0) & (theta_i < math.pi / 2 + 1e-6), "outside 0 to pi/2")
    fields.check("theta_i", np.diff(theta_i, prepend=-1) > 0, "not above the one before")
    fields.check("phi_i", np.abs(phi_i) < math.pi + 1e-6, "outside -pi to pi")
    fields.check("phi_i", np.diff(phi_i, prepend=-4) > 0, "not above the one before")
    slices = (len(phi_i), len(theta_i))
    if math.prod(slices) > MOST_SLICES:
        raise fields.wrong("theta_i", f"{math.prod(slices)} incidences are more than {MOST_SLICES}")
    found = {"theta_i": theta_i, "phi_i": phi_i}
    for name, dimensions in (("sigma", 2), ("ndf", 2), ("vndf", 4)):
        found[name] = fields.get(name, "<f4", dimensions)
        if min(found[name].shape[-2:]) < 2:
            raise fields.wrong(name, f"its shape {found[name].shape} is no grid: 2 samples are the least along both")
        with np.errstate(invalid="ignore"):
            fields.check(name, np.isfinite(found[name]) & (found[name] >= 0), "not a finite positive number")
    if "luminance" in fields.arrays:
        found["luminance"] = fields.get("luminance", "<f4", 4)
    for name, size in (("vndf", found["vndf"].shape[:2]), (_values_name(fields), stored.shape[:2])):
        if size != slices:
            raise fields.wrong(name, f"it holds {size} incidences where phi_i and theta_i have {slices}")
    if "luminance" in found and found["luminance"].shape != (*slices, *stored.shape[-2:]):
        raise fields.wrong("luminance", f"its shape is {found['luminance'].shape}, not {(*slices, *stored.shape[-2:])}")
    if (empty := np.flatnonzero(~found["vndf"].any(axis=(2, 3)).ravel())).size:
        cells = math.prod(found["vndf"].shape[2:])
        raise fields.wrong(
            "vndf", f"slice {empty[0]} is zero everywhere: no direction is visible", int(empty[0]) * cells
        )
    return found | {n: fields.get(n, kind, 1).astype(np.int32) for n, kind in INTEGERS.items() if n in fields.arrays}


def _values_name(fields: Fields) -> str:
    return "spectra" if "spectra" in fields.arrays else "rgb"


def _dataset(tensors: dict[str, Any], sets: dict[str, Any]) -> xr.Dataset:
    """The scan on the nodes of the tensors' grid."""
    surface = _surface(tensors, len(sets))
    grid = _grid(surface)
    theta_r, _, cosine, scale = surface.nodes
    values = _brdf(surface.values, theta_r, cosine, scale)
    if not sets:
        values = values[0]
    if len(surface.phi_i) == 1:
        values = values[..., 0, :, :, :]
    attrs = {
        "Conventions": "CF-1.11",
        "history": "divided by cos(theta_r), in the parameterisation of the file",
        "provenance": "",
        "stored": "BRDF x cos(theta_r)",
        "symmetry": "isotropic" if surface.isotropic else "anisotropic",
        PARAMETERISATION: NAME,
    }
    dims = (*sets, *grid["theta_r"].dims)
    scan = xr.Dataset({"brdf": (dims, values, {"units": ABSOLUTE})}, coords=grid.coords, attrs=attrs)
    scan = scan.assign_coords({n: (n, v, {"units": "nm"} if n == "wavelength" else {}) for n, v in sets.items()})
    return scan.assign(_named(tensors, tuple(sets)))


def _named(tensors: dict[str, Any], sets: tuple[str, ...]) -> dict[str, tuple[tuple[str, ...], Any]]:
    """The tensors as variables, on dimensions of their own beside those of the sets."""
    dims = DIMENSIONS | {"spectra": (*sets, TURN, INCIDENCE, "tensor_y", "tensor_x")}
    return {f"tensor_{name}": (dims[name], values) for name, values in tensors.items()}


def _brdf(stored: Any, theta_r: Values, cosine: Values, scale: Values) -> Values:
    """The BRDF at the nodes, NaN below the horizon and where the cosine is too small to divide by."""
    factor = np.divide(scale, cosine, out=np.full_like(scale, np.nan), where=_told(theta_r))
    found: Values = stored * factor
    return found


def _told(theta_r: Values) -> npt.NDArray[np.bool_]:
    """Which nodes say what the BRDF is."""
    told: npt.NDArray[np.bool_] = np.degrees(theta_r) <= GRAZING
    return told


def _surface(tensors: dict[str, Any], sets: int) -> Surface:
    spectra = np.asarray(tensors["spectra"])
    jacobian = tensors.get("jacobian")
    theta_i, phi_i, ndf, sigma = (np.asarray(tensors[n], dtype=float) for n in ("theta_i", "phi_i", "ndf", "sigma"))
    return Surface(
        np.minimum(theta_i, math.pi / 2),
        phi_i,
        ndf,
        sigma,
        np.asarray(tensors["vndf"]),
        spectra if sets else spectra[None],
        jacobian is None or bool(np.ravel(jacobian)[0]),
    )


def _grid(surface: Surface) -> xr.Dataset:
    """The directions of the nodes as coordinates [deg] on (phi_i,) theta_i and the two warped axes."""
    theta_r, phi, _, _ = surface.nodes
    turned = len(surface.phi_i) > 1
    dims = (*(["phi_i"] if turned else []), "theta_i", Y, X)
    seen = np.where(_told(theta_r), np.degrees(theta_r), np.maximum(np.degrees(theta_r), BELOW))
    angles = {n: v if turned else v[0] for n, v in (("theta_r", seen), ("phi", np.degrees(phi)))}
    own = {"theta_i": _plain(surface.theta_i)} | ({"phi_i": _plain(surface.phi_i)} if turned else {})
    coords: dict[str, Any] = {n: (n, v, {"units": "degree"}) for n, v in own.items()}
    coords |= {n: (dims, v, {"units": "degree"}) for n, v in angles.items()}
    size = surface.values.shape[-2:]
    return xr.Dataset(coords=coords | {n: (n, np.linspace(0, 1, k)) for n, k in zip((Y, X), size, strict=True)})


def _plain(radians: Values) -> Values:
    """Degrees, without the digits that single precision added to a round number."""
    degrees = np.degrees(radians)
    short = np.round(degrees, 4)
    return np.where(np.radians(short).astype(np.float32) == radians.astype(np.float32), short, degrees)


def _tensors_of(scan: xr.Dataset) -> dict[str, Any]:
    names = [str(n) for n in scan.variables if str(n).startswith("tensor_") and str(n)[7:] in {*DIMENSIONS, "spectra"}]
    found: dict[str, Any] = {n[7:]: scan[n].values for n in names}
    if missing := [n for n in ("theta_i", "phi_i", "ndf", "sigma", "vndf") if n not in found]:
        raise ValueError(
            f"the scan is not laid out as RGL files are: it has no tensor_{missing[0]}; use gonio.convert to write it"
        )
    return found


def _with_values(scan: xr.Dataset) -> tuple[dict[str, Any], tuple[str, ...], bool]:
    """The tensors with the values that the scan has now, the dimensions of its sets, and whether these are the file's.

    Raises ValueError for a scan that lost a part of its grid.
    """
    tensors = _tensors_of(scan)
    wide = [d for d in ("phi_i", "theta_i", Y, X) if d in scan["brdf"].dims]
    sets = tuple(str(d) for d in scan["brdf"].dims if d not in wide)
    brdf = scan["brdf"].transpose(*sets, *wide).values
    brdf = brdf if sets else brdf[None]
    kept = tensors.get("spectra")
    if kept is None:
        size = (scan.sizes.get(Y, 0), scan.sizes.get(X, 0))
        tensors["spectra"] = np.zeros((len(tensors["phi_i"]), len(tensors["theta_i"]), *size), dtype=np.float32)
    surface = _surface(tensors, len(sets) if kept is not None else 0)
    if kept is None:
        surface = replace(surface, values=np.broadcast_to(surface.values, (len(brdf), *surface.values.shape[1:])))
    if len(surface.phi_i) == 1:
        brdf = np.expand_dims(brdf, -4)
    if brdf.shape != surface.values.shape:
        raise ValueError(f"the scan has {brdf.shape} values where its tensors have {surface.values.shape}: flatten it")
    theta_r, _, cosine, scale = surface.nodes
    if kept is not None and np.array_equal(_brdf(surface.values, theta_r, cosine, scale), brdf, equal_nan=True):
        return tensors, sets, True
    own = _stored_from(brdf, theta_r, cosine, scale, surface.values if kept is not None else None)
    tensors["spectra"] = own if sets else own[0]
    return tensors, sets, False


def _stored_from(brdf: Values, theta_r: Values, cosine: Values, scale: Values, before: Any) -> Values:
    """What must be stored so that the nodes above the horizon have these values.

    Below it the last value of the row above goes on; where something was stored, in proportion to the change of that.
    """
    above = _told(theta_r)
    last = np.maximum.accumulate(np.where(above, np.arange(above.shape[-1]), 0), axis=-1)
    last = np.broadcast_to(last, brdf.shape)
    factor = np.divide(cosine, scale, out=np.zeros_like(scale), where=scale > 0)
    if before is None:
        found: Values = np.take_along_axis(brdf, last, axis=-1) * factor
        return found
    new = np.where(above & ((scale > 0) | np.isnan(brdf)), brdf * factor, before)
    old = before.astype(float)
    ratio = np.divide(new, old, out=np.ones_like(new), where=old != 0)
    return np.where(above, new, old * np.take_along_axis(ratio, last, axis=-1))


def evaluate(scan: xr.Dataset, theta_i: Any, theta_r: Any, phi: Any, phi_i: Any = None) -> Values:
    """BRDF [1/sr] (sets.., n) of a scan from a RGL file at directions [deg] (n,), as RGL files are interpolated.

    NaN at and below the horizon and outside the file's incidence angles. Raises ValueError for a scan without tensors.
    """
    tensors, sets, _ = _with_values(scan)
    surface = _surface(tensors, len(sets))
    angles = np.broadcast_arrays(theta_i, theta_r, phi, 0.0 if phi_i is None else phi_i)
    shape = angles[0].shape
    radians = [np.radians(np.asarray(a, dtype=float).ravel()) for a in angles]
    found = surface.evaluate(*radians)
    last = surface.theta_i[-1] if surface.theta_i[-1] < math.radians(89.99) else math.pi / 2
    tolerance = math.radians(1e-5)
    within = (radians[0] >= surface.theta_i[0] - tolerance) & (radians[0] <= last + tolerance)
    found[:, ~within] = np.nan
    return found.reshape(*([len(found)] if sets else []), *shape)


def _layout(scan: xr.Dataset) -> xr.Dataset:
    """The grid of the scan's own tensors, else half vectors at the scan's incidence angles and turns."""
    if all(f"tensor_{n}" in scan.variables for n in ("theta_i", "phi_i", "ndf", "sigma", "vndf", "spectra")):
        tensors = _tensors_of(scan)
        tensors["spectra"] = tensors["spectra"].reshape(-1, *tensors["spectra"].shape[-4:])[0]
        own = scan["brdf"].dims if "brdf" in scan else ()
        if {Y, X} <= set(own):
            names = [n for n in ("theta_i", "theta_r", "phi", "phi_i", Y, X) if n in scan.coords and scan[n].ndim]
            return xr.Dataset(coords={n: scan[n].variable for n in names} | _kept(tensors))
    tensors = _plain_tensors(scan)
    return _grid(_surface(tensors, 0)).assign_coords(_kept(tensors))


def _kept(tensors: dict[str, Any]) -> dict[str, Any]:
    """The tensors that a resampled scan must bring to be written."""
    names = ("theta_i", "phi_i", "ndf", "sigma", "vndf", "jacobian")
    return _named({n: tensors[n] for n in names if n in tensors}, ())


def _plain_tensors(scan: xr.Dataset) -> dict[str, Any]:
    angles = _distinct(scan["theta_i"].values)
    if len(angles) > MOST_ANGLES:
        angles = np.linspace(angles[0], min(angles[-1], 89.0), EVEN_ANGLES)
    turns = np.zeros(1)
    if "phi_i" in scan.variables and len(_distinct(scan["phi_i"].values % 360.0)) > 1:
        within = (scan["phi_i"].values.astype(float).ravel() + 180.0) % 360.0 - 180.0
        turns = _dense(_distinct(np.concatenate([within, [-180.0, 180.0]])))
    theta_i, phi_i = (np.radians(v).astype(np.float32) for v in (angles, turns))
    slices = (len(phi_i), len(theta_i))
    return {
        "theta_i": theta_i,
        "phi_i": phi_i,
        "sigma": np.ones((2, 2), dtype=np.float32),
        "ndf": np.full((2, 2), 4.0, dtype=np.float32),
        "vndf": np.ones((*slices, 2, 2), dtype=np.float32),
        "jacobian": np.ones(1, dtype=np.int32),
        "spectra": np.zeros((*slices, SIZE, SIZE), dtype=np.float32),
    }


def _dense(turns: Values) -> Values:
    """Turns of the surface no further apart than WIDEST_TURN: between them the format keeps half vectors in place."""
    parts = [np.linspace(a, b, math.ceil((b - a) / WIDEST_TURN) + 1)[:-1] for a, b in itertools.pairwise(turns)]
    return np.concatenate([*parts, turns[-1:]])


def _distinct(angles: Any) -> Values:
    found: Values = np.unique(np.round(np.asarray(angles, dtype=float), 5))
    return found


def _write(scan: xr.Dataset, path: Path) -> None:
    tensors, sets, is_own = _with_values(scan)
    if sets not in ((), ("channel",), ("wavelength",)):
        raise ValueError(f"RGL files hold channels or wavelengths, not {' and '.join(sets)}: choose one with --select")
    stored = np.moveaxis(np.asarray(tensors["spectra"], dtype=np.float32), 0, 2) if sets else tensors["spectra"]
    if not sets:
        single = "wavelength" in scan.coords
        stored = np.repeat(np.asarray(stored, dtype=np.float32)[:, :, None], 1 if single else 3, axis=2)
    if not np.isfinite(stored).all():
        raise ValueError("RGL files hold no gaps and no values beyond 3e38: fill them with --fill, or write tidy-csv")
    if not is_own:
        tensors["luminance"] = _luminance(tensors, stored)
        tensors.pop("valid", None)
    write_fields(path, _fields(scan, tensors, stored, sets))


def _fields(scan: xr.Dataset, tensors: dict[str, Any], stored: Any, sets: tuple[str, ...]) -> dict[str, Any]:
    """The fields of the file in the order of RGL's own."""
    description = scan.attrs.get("provenance", "").encode() or b"-"
    values = {"rgb": stored}
    extra: dict[str, Any] = {}
    if "wavelength" in scan.coords:
        wavelengths = np.atleast_1d(scan["wavelength"].values).astype(np.float32)
        values = {"wavelengths": wavelengths, "spectra": stored}
    elif sets:
        channels = [str(c) for c in scan["channel"].values]
        if channels != ["R", "G", "B"]:
            raise ValueError(f"RGL files hold the channels R, G and B, not {', '.join(channels)}")
    elif "channel" in scan.coords:
        raise ValueError(f"RGL files hold R, G and B together, not {scan['channel'].item()} alone")
    else:
        extra = {GREY: np.ones(1, dtype=np.uint8)}
    found = {
        "version": tensors.get("version", np.array([1, 0])).astype("<u4"),
        "description": np.frombuffer(description, dtype=np.uint8),
        **{n: np.asarray(tensors[n], dtype="<f4") for n in ("phi_i", "theta_i", "sigma", "ndf", "vndf", "luminance")},
        **values,
        "jacobian": np.asarray(tensors.get("jacobian", [1])).astype(np.uint8),
    }
    valid = {"valid": tensors["valid"].astype(np.uint8)} if "valid" in tensors else {}
    return found | valid | extra


def _luminance(tensors: dict[str, Any], stored: Any) -> npt.NDArray[np.float32]:
    """The density (phi_i, theta_i, y, x) by which renderers draw samples, nowhere zero so that they can draw any.

    It changes how fast an image converges, not what it shows.
    """
    mean = np.maximum(stored.astype(float).mean(axis=2), 0.0)
    if not np.ptp(tensors["vndf"]):  # the warp leaves the solid angle of a sample to this density
        mean = mean * _surface(tensors | {"spectra": stored[:, :, 0]}, 0).solid_angles()
    largest = mean.max(axis=(2, 3), keepdims=True)
    found: npt.NDArray[np.float32] = np.where(largest > 0, np.maximum(mean, 1e-3 * largest), 1.0).astype(np.float32)
    return found


FORMAT = Format(
    name=NAME,
    title="RGL tensor file",
    suffix=".bsdf",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    evaluate=evaluate,
    holds=Holds(anisotropic=True, sets=("channel", "wavelength")),
)
