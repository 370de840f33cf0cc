"""How a scan is mended: a function for each mistake, and the flags of every command that reads a scan.

Each gives a new scan with a line of history. Values change with their uncertainties. Where angles change the scan
becomes flat, as the axes of its grid no longer hold.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

from gonio.findings.angles import in_radians
from gonio.measured import dataset
from gonio.measured.causes import SYSTEMATIC
from gonio.measured.dataset import add_history, flatten
from gonio.measured.masking import mask
from gonio.measured.polarimetry.degree import dolp
from gonio.measured.sound import UNCERTAINTIES
from gonio.options import Option, Panel

OF_VALUES = ("brdf", *UNCERTAINTIES, SYSTEMATIC, "mueller")  # the variables that scale with the BRDF
DUST = 9  # decimals of a degree, beyond which a shift leaves the digits of its arithmetic


def flip(scan: xr.Dataset) -> xr.Dataset:
    """The forward and the backward side exchanged: theta_r with the other sign in plane, phi + 180 deg out of plane."""
    flat = flatten(scan)
    return add_history(_with(flat, phi=(flat["phi"].values + 180.0) % 360.0), "exchanged the sides: phi + 180 deg")


def mirror_azimuth(scan: xr.Dataset) -> xr.Dataset:
    """The azimuth counted from the other side and the other way round: 180 deg - phi."""
    flat = flatten(scan)
    return add_history(_with(flat, phi=(180.0 - flat["phi"].values) % 360.0), "mirrored the azimuth: 180 deg - phi")


def from_radians(scan: xr.Dataset) -> xr.Dataset:
    """Angles that were radians and called degrees as degrees; ValueError where none can be radians.

    Which of theta_i, theta_r and phi are radians is what the finding `radians` says.
    """
    flat = flatten(scan)
    names = in_radians({name: flat[name].values.astype(float) for name in dataset.ANGLES})
    if not names:
        raise ValueError("no angle of the scan can be radians that are called degrees: --radians does not mend it")
    changed = {name: np.degrees(flat[name].values.astype(float)).round(DUST) for name in names}
    return add_history(_with(flat, **changed), f"took {', '.join(names)} for radians")


def shift_theta_r(scan: xr.Dataset, degrees: float) -> xr.Dataset:
    """theta_r [deg, signed] moved by an angle, in plane; ValueError for directions out of plane."""
    flat = flatten(scan)
    if not math.isfinite(degrees) or abs(degrees) >= 90:
        raise ValueError(f"theta_r cannot be shifted by {degrees:g} deg: give an angle between -90 and 90")
    if not dataset.is_in_plane(flat).all():
        raise ValueError("a shift of theta_r is one of a scan in plane, and this one has directions out of plane")
    signed = (dataset.signed_theta_r(flat) + degrees).round(DUST)
    moved = _with(flat, theta_r=np.abs(signed), phi=np.where(signed >= 0, 180.0, 0.0))
    return add_history(moved, f"shifted theta_r by {degrees:g} deg")


def divide(scan: xr.Dataset, by: float) -> xr.Dataset:
    """Values and uncertainties divided by a positive number; ValueError for any other."""
    if not (math.isfinite(by) and by > 0):
        raise ValueError(f"values cannot be divided by {by:g}: give a positive number")
    return add_history(_divided(scan, xr.DataArray(by)), f"divided the values by {by:.12g}")


def divide_cosine(scan: xr.Dataset) -> xr.Dataset:
    """Values and uncertainties divided by cos(theta_r); at the horizon, where that is 0, they are missing."""
    polar = scan["theta_r"]
    horizon = polar >= 90.0 - 1e-9
    cosine = xr.DataArray(np.cos(np.radians(polar))).where(~horizon)
    lost = int((horizon & np.isfinite(scan["brdf"]) & (polar <= dataset.HORIZON)).sum())
    words = f"; {lost} values at the horizon have no quotient and are missing" if lost else ""
    return add_history(_divided(scan, cosine), f"divided the values by cos(theta_r){words}")


def mask_saturated(scan: xr.Dataset, value: float) -> xr.Dataset:
    """Values from `value` [unit of the BRDF] on masked, as the detector was saturated there."""
    if not math.isfinite(value):
        raise ValueError(f"the saturation is {value:g}: give a finite number in the unit of the BRDF")
    return mask(scan, exclude=flatten(scan)["brdf"] >= value)


def _with(flat: xr.Dataset, **angles: np.ndarray) -> xr.Dataset:
    """A flat scan with other angles."""
    return flat.assign_coords({name: ("direction", value, flat[name].attrs) for name, value in angles.items()})


def _divided(scan: xr.Dataset, by: xr.DataArray) -> xr.Dataset:
    """A scan with every variable of OF_VALUES divided, on the same dimensions in the same order."""
    plain = by.drop_vars(list(by.coords))
    changed = {}
    for name in (n for n in OF_VALUES if n in scan):
        old = scan[name].variable
        changed[name] = (old / plain.variable).transpose(*old.dims)
        changed[name].attrs = old.attrs
    return scan.assign(changed)


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """What mends the mistakes that `gonio info` finds, in the order in which it is done."""

    PANEL: ClassVar = Panel.DATA
    radians: Annotated[bool, Option("take angles that are called degrees for radians")] = False
    flip: Annotated[bool, Option("exchange the forward and the backward side: the sign of theta_r")] = False
    mirror_azimuth: Annotated[bool, Option("count phi from the other side: 180 deg - phi")] = False
    shift_theta_r: Annotated[
        float, Option("move theta_r of an in-plane scan by this angle", metavar="DEG", lowest=-90, highest=90)
    ] = 0.0
    divide_cosine: Annotated[bool, Option("divide the values by cos(theta_r), where they are f cos(theta_r)")] = False
    divide: Annotated[str, Option("divide the values by this, such as pi, or 100 for per cent", metavar="VALUE|pi")] = (
        ""
    )
    dolp: Annotated[
        bool,
        Option("take the degree of linear polarisation: of readings in s and in p, or of the column dolp"),
    ] = False
    saturation: Annotated[
        str, Option("leave out values from this on, where the detector was saturated", metavar="VALUE")
    ] = ""

    def mended(self, scan: xr.Dataset) -> xr.Dataset:
        """The scan with what was asked for done; ValueError where that cannot be."""
        scan = from_radians(scan) if self.radians else scan
        scan = flip(scan) if self.flip else scan
        scan = mirror_azimuth(scan) if self.mirror_azimuth else scan
        scan = shift_theta_r(scan, self.shift_theta_r) if self.shift_theta_r else scan
        scan = divide_cosine(scan) if self.divide_cosine else scan
        scan = dolp(scan) if self.dolp else scan
        scan = divide(scan, _number(self.divide, "--divide")) if self.divide else scan
        return mask_saturated(scan, _number(self.saturation, "--saturation")) if self.saturation else scan


def _number(text: str, flag: str) -> float:
    """A number, or pi."""
    try:
        return math.pi if text.strip().lower() == "pi" else float(text)
    except ValueError:
        raise ValueError(f"{flag} is {text!r}, not a number") from None
