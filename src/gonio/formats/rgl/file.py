"""The measured BRDF files of RGL (dupuy2018): values at directions warped by the visible normals, in a tensor_file.

The fields are theta_i, phi_i, ndf, sigma, vndf, luminance, description, jacobian, and rgb or wavelengths with spectra.
A stored value is f cos(theta_r) / (ndf/(4 sigma)). The paper and the public readers (powitacq.inl, Mitsuba's
measured.cpp) document them; door/tensor_file.py reads the container.

`evaluate` interpolates as these readers do (adaptive.py); layout.py has the directions at which any other scan is
stored. Nodes below the horizon repeat the last value above it, so that interpolation is undisturbed up to the horizon.
In RGL's own files f cos(theta_r) does not vanish at the horizon, so that f grows beyond about 87 deg.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.tensor_file import MAGIC, Fields, write_fields
from gonio.door.text import clip
from gonio.formats.format import Format, Holds
from gonio.formats.rgl.layout import layout
from gonio.formats.rgl.scan import BELOW, DIMENSIONS, GRAZING, NAME, as_scan, evaluate, measurement_of, with_values
from gonio.measured.dataset import add_history

MOST_SLICES = 4096  # directions of incidence
INTEGERS = {"jacobian": "u1", "valid": "u1", "version": "<u4"}
GREY = "grey"  # a field that only gonio writes: the three channels repeat one set of values


def _recognises(head: bytes) -> bool:
    return head.startswith(MAGIC) and b"vndf" in head


def _read(path: Path) -> xr.Dataset:
    fields = Fields(path)
    stored, sets = _stored(fields)
    tensors = _tensors(fields, stored)
    along = {} if GREY in fields.arrays else sets
    spectra = np.moveaxis(stored, 2, 0) if along else stored[:, :, 0]
    scan = as_scan(tensors | {"spectra": spectra}, along)
    if grazing := int((scan["theta_r"] == BELOW).sum()):
        scan = add_history(
            scan, f"{grazing} nodes beyond {GRAZING} deg count as below the horizon: f cos(theta_r) gives no f there"
        )
    if "description" in fields.arrays and (size := fields.get("description", "u1", 1, least=0).size):
        fields.bytes.at = fields.starts["description"]
        scan.attrs["provenance"] = fields.bytes.text(size, "description")
    known = {*DIMENSIONS, "spectra", "rgb", "wavelengths", "description", GREY}
    if unknown := [name for name in fields.arrays if name not in known]:
        scan = add_history(
            scan, f"left out fields that gonio does not know: {clip(', '.join(map(ascii, unknown)), 200)}"
        )
    return scan


def _stored(fields: Fields) -> tuple[npt.NDArray[np.floating], dict[str, Any]]:
    """The values (phi_i, theta_i, sets, y, x) and the coordinate of their sets."""
    name = "spectra" if "spectra" in fields.arrays else "rgb"
    values = fields.get(name, "<f4", 5)
    if min(values.shape[-2:]) < 2:
        raise fields.wrong(name, f"its shape {values.shape} is no grid: 2 samples are the least along both")
    fields.check(name, np.isfinite(values), "not finite")
    if not values.any():
        raise fields.wrong(name, "every brdf value is zero: the detector saw nothing, or the file is damaged")
    if name == "rgb":
        if values.shape[2] != 3:
            raise fields.wrong(name, f"it has {values.shape[2]} channels, not 3")
        if GREY in fields.arrays and not (values == values[:, :, :1]).all():
            raise fields.wrong(GREY, "the file is said to be grey, and its channels differ")
        return values, {"channel": np.array(["R", "G", "B"])}
    wavelengths = fields.get("wavelengths", "<f4", 1)
    fields.check("wavelengths", np.isfinite(wavelengths) & (wavelengths > 0), "no wavelength")
    fields.check("wavelengths", np.diff(wavelengths, prepend=-1) > 0, "not above the one before")
    if values.shape[2] != len(wavelengths):
        raise fields.wrong(name, f"it has {values.shape[2]} wavelengths, and the field wavelengths {len(wavelengths)}")
    return values, {"wavelength": wavelengths.astype(float)}


def _tensors(fields: Fields, stored: npt.NDArray[np.floating]) -> dict[str, Any]:
    theta_i, phi_i = fields.get("theta_i", "<f4", 1), fields.get("phi_i", "<f4", 1)
    fields.check("theta_i", (theta_i >= 0) & (theta_i < math.pi / 2 + 1e-6), "outside 0 to pi/2")
    fields.check("theta_i", np.diff(theta_i, prepend=-1) > 0, "not above the one before")
    fields.check("phi_i", np.abs(phi_i) < math.pi + 1e-6, "outside -pi to pi")
    fields.check("phi_i", np.diff(phi_i, prepend=-4) > 0, "not above the one before")
    slices = (len(phi_i), len(theta_i))
    if math.prod(slices) > MOST_SLICES:
        raise fields.wrong("theta_i", f"{math.prod(slices)} incidences are more than {MOST_SLICES}")
    tensors = {"theta_i": theta_i, "phi_i": phi_i}
    for name, dimensions in (("sigma", 2), ("ndf", 2), ("vndf", 4)):
        tensors[name] = fields.get(name, "<f4", dimensions)
        if min(tensors[name].shape[-2:]) < 2:
            raise fields.wrong(name, f"its shape {tensors[name].shape} is no grid: 2 samples are the least along both")
        with np.errstate(invalid="ignore"):
            fields.check(name, np.isfinite(tensors[name]) & (tensors[name] >= 0), "not a finite positive number")
    if "luminance" in fields.arrays:
        tensors["luminance"] = fields.get("luminance", "<f4", 4)
    for name, size in (("vndf", tensors["vndf"].shape[:2]), (_values_name(fields), stored.shape[:2])):
        if size != slices:
            raise fields.wrong(name, f"it holds {size} incidences where phi_i and theta_i have {slices}")
    if "luminance" in tensors and tensors["luminance"].shape != (*slices, *stored.shape[-2:]):
        raise fields.wrong(
            "luminance", f"its shape is {tensors['luminance'].shape}, not {(*slices, *stored.shape[-2:])}"
        )
    if (empty := np.flatnonzero(~tensors["vndf"].any(axis=(2, 3)).ravel())).size:
        cells = math.prod(tensors["vndf"].shape[2:])
        raise fields.wrong(
            "vndf", f"slice {empty[0]} is zero everywhere: no direction is visible", int(empty[0]) * cells
        )
    return tensors | {n: fields.get(n, kind, 1).astype(np.int32) for n, kind in INTEGERS.items() if n in fields.arrays}


def _values_name(fields: Fields) -> str:
    return "spectra" if "spectra" in fields.arrays else "rgb"


def _write(scan: xr.Dataset, path: Path) -> None:
    _refuse_channels(scan)
    tensors, sets, is_unchanged = with_values(scan)
    if sets not in ((), ("channel",), ("wavelength",)):
        raise ValueError(f"RGL files hold channels or wavelengths, not {' and '.join(sets)}: choose one with --select")
    with np.errstate(over="ignore"):  # what is too large becomes infinite, and is refused below
        stored = np.asarray(tensors["spectra"]).astype(np.float32)
    if sets == ("channel",):
        stored = stored[[list(scan["channel"].values).index(name) for name in "RGB"]]
    if sets:
        stored = np.moveaxis(stored, 0, 2)
    else:
        stored = np.repeat(stored[:, :, None], 1 if "wavelength" in scan.coords else 3, axis=2)
    if not np.isfinite(stored).all():
        raise ValueError("RGL files hold no gaps and no values beyond 3e38: fill them with --fill, or write tidy-csv")
    if not is_unchanged:
        tensors["luminance"] = _luminance(tensors, stored)
        tensors.pop("valid", None)
    write_fields(path, _fields(scan, tensors, stored, sets))


def _refuse_channels(scan: xr.Dataset) -> None:
    """ValueError where the scan has other channels than R, G and B."""
    if "channel" not in scan.coords or "wavelength" in scan.coords:
        return
    channels = list(dict.fromkeys(map(str, scan["channel"].values.ravel())))
    if len(channels) == 1:
        raise ValueError(f"RGL files hold R, G and B together, not {channels[0]} alone")
    if sorted(channels) != ["B", "G", "R"]:
        raise ValueError(f"RGL files hold the channels R, G and B, not {', '.join(channels)}")


def _fields(scan: xr.Dataset, tensors: dict[str, Any], stored: Any, sets: tuple[str, ...]) -> dict[str, Any]:
    """The fields of the file, in the order of RGL's files."""
    description = scan.attrs.get("provenance", "").encode()
    values = {"rgb": stored}
    extra: dict[str, Any] = {}
    if "wavelength" in scan.coords:
        wavelengths = np.atleast_1d(scan["wavelength"].values).astype(np.float32)
        values = {"wavelengths": wavelengths, "spectra": stored}
    elif not sets:
        extra = {GREY: np.ones(1, dtype=np.uint8)}
    fields = {
        "version": tensors.get("version", np.array([1, 0])).astype("<u4"),
        "description": np.frombuffer(description, dtype=np.uint8),
        **{n: np.asarray(tensors[n], dtype="<f4") for n in ("phi_i", "theta_i", "sigma", "ndf", "vndf", "luminance")},
        **values,
        "jacobian": np.asarray(tensors.get("jacobian", [1])).astype(np.uint8),
    }
    valid = {"valid": tensors["valid"].astype(np.uint8)} if "valid" in tensors else {}
    return fields | valid | extra


def _luminance(tensors: dict[str, Any], stored: Any) -> npt.NDArray[np.float32]:
    """The density (phi_i, theta_i, y, x) by which renderers draw samples; positive, so that none is excluded.

    It changes how fast an image converges, not the image itself.
    """
    mean = np.maximum(stored.astype(float).mean(axis=2), 0.0)
    if not np.ptp(tensors["vndf"]):  # a constant vndf: this density must include the solid angle
        mean = mean * measurement_of(tensors | {"spectra": stored[:, :, 0]}, 0).solid_angles()
    largest = mean.max(axis=(2, 3), keepdims=True)
    density: npt.NDArray[np.float32] = np.where(largest > 0, np.maximum(mean, 1e-3 * largest), 1.0).astype(np.float32)
    return density


FORMAT = Format(
    name=NAME,
    title="RGL tensor file",
    suffix=".bsdf",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=layout,
    evaluate=evaluate,
    holds=Holds(anisotropic=True, sets=("channel", "wavelength"), channels=(("R", "G", "B"),)),
)
