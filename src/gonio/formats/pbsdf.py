"""KAIST's polarimetric BRDF files (baek2020): Mueller matrices on half-difference angles, in a tensor_file.

The fields are theta_h, theta_d, phi_d [rad], wvls [nm] and M, the matrices; the container is in door/tensor_file.py.
A public reader is Mitsuba's measured_polarized.cpp.

`brdf` is element 00. `mueller` holds all sixteen elements as a view into the file, of which only the parts that are
used are read: real files have 0.9 GB (five wavelengths) and more. On both rays the x axis of the Stokes parameters is
w_i x w_r, perpendicular to the plane of the two rays, and y = k x x with k the direction of travel. These axes are not
gonio's s and p, which refer to the planes of the normal and each ray.
"""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.tensor_file import MAGIC, Fields
from gonio.formats.format import Format, Holds
from gonio.measured import coordinates
from gonio.measured.dataset import ABSOLUTE, HORIZON, add_history

MOST = 10_000_000_000  # matrix elements; they are mapped, not loaded
FRAMES = "x = w_i x w_r, y = k x x on both rays, k the direction of travel"
AXES = ("phi_d", "theta_d", "theta_h")  # in the order of the file
LARGEST = {"phi_d": 180.0, "theta_d": 90.0, "theta_h": 90.0}  # deg
ROUNDING = 1e-4  # deg; error of angles in single precision


def _recognises(head: bytes) -> bool:
    return head.startswith(MAGIC) and all(name in head for name in (b"theta_h", b"theta_d", b"phi_d", b"wvls"))


def _read(path: Path) -> xr.Dataset:
    fields = Fields(path, MOST)
    matrices = fields.get("M", "<f4", 6)
    axes = {name: _axis(fields, name) for name in AXES}
    wavelengths = fields.get("wvls", "<u2", 1)
    fields.check("wvls", np.diff(wavelengths.astype(int), prepend=0) > 0, "not above the one before")
    shape = (*(len(v) for v in axes.values()), len(wavelengths), 4, 4)
    if matrices.shape != shape:
        raise fields.wrong("M", f"its shape is {matrices.shape}, not {shape} as the other fields say")
    history = ""
    if axes["phi_d"][-1] - axes["phi_d"][0] > 360 - ROUNDING and len(axes["phi_d"]) > 2:
        matrices, axes["phi_d"] = matrices[:-1], axes["phi_d"][:-1]
        history = "left out the last phi_d, which is the first one again"
    axes["phi_d"] = axes["phi_d"] % 360.0
    scan = _dataset(fields, matrices, axes, wavelengths.astype(float))
    return add_history(scan, history) if history else scan


def _axis(fields: Fields, name: str) -> npt.NDArray[np.float64]:
    """The nodes of one axis [deg], from radians (1, n)."""
    stored = fields.get(name, "<f4", 2)
    if stored.shape[0] != 1:
        raise fields.wrong(name, f"its shape is {stored.shape}, not one row")
    with np.errstate(invalid="ignore"):  # a signalling NaN; it is refused below like any other
        degrees: npt.NDArray[np.float64] = np.degrees(stored.astype(float))
    least = -LARGEST[name] if name == "phi_d" else 0.0
    most = 360.0 if name == "phi_d" else LARGEST[name]
    inside = (degrees >= least - ROUNDING) & (degrees <= most + ROUNDING)
    fields.check(name, inside, f"outside {least:g} to {most:g} deg in radians")
    fields.check(name, np.diff(stored, prepend=-9) > 0, "not above the one before")
    short = np.round(degrees[0], 4)
    near = np.radians(short).astype(np.float32) == stored[0]
    return np.clip(np.where(near, short, degrees[0]), least, most)


def _dataset(fields: Fields, matrices: Any, axes: dict[str, Any], wavelengths: Any) -> xr.Dataset:
    grid = coordinates.grid("half-difference", **{n: axes[n] for n in ("theta_h", "theta_d", "phi_d")})
    above = ((grid["theta_i"] <= HORIZON) & (grid["theta_r"] <= HORIZON)).values
    f00 = _above(fields, matrices[..., 0, 0].transpose(3, 2, 1, 0), above)
    dims = ("wavelength", "theta_h", "theta_d", "phi_d")
    scan = xr.Dataset(
        {
            "brdf": (dims, f00, {"units": ABSOLUTE}),
            "mueller": (
                ("wavelength", "theta_h", "theta_d", "phi_d", "stokes_out", "stokes_in"),
                matrices.transpose(3, 2, 1, 0, 4, 5),
                {"units": ABSOLUTE, "frames": FRAMES},
            ),
        },
        coords=grid.coords,
        attrs={"Conventions": "CF-1.11", "history": "", "provenance": "", "symmetry": "isotropic"},
    )
    scan = scan.assign_coords(wavelength=("wavelength", wavelengths, {"units": "nm"}))
    return add_history(scan, f"brdf is element 00 of the Mueller matrices; Stokes frames: {FRAMES}")


def _above(fields: Fields, f00: Any, above: npt.NDArray[np.bool_]) -> Any:
    """Element 00 with NaN below the horizon: a view into the file where it is NaN there already, else a copy."""
    says_so, any_value = True, False
    for part in f00:  # one wavelength at a time: a large file is never in memory as a whole
        if np.isinf(part).any():
            raise fields.wrong("M", "element 00 is infinite somewhere")
        with np.errstate(invalid="ignore"):
            any_value = any_value or bool((above & (np.abs(part) > 0)).any())
        says_so = says_so and bool(np.isnan(part[~above]).all())
    if not any_value:
        raise fields.wrong("M", "every brdf value is zero or missing: the detector saw nothing, or the file is damaged")
    return f00 if says_so else np.where(above, f00, np.float32(np.nan))


FORMAT = Format(
    name="pbsdf",
    title="KAIST pBRDF",
    suffix=".pbsdf",
    recognises=_recognises,
    read=_read,
    holds=Holds(sets=("wavelength",), variables=("mueller",), gaps=True),
)
