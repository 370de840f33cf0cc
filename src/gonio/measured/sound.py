"""What the coordinates of a scan must be, wherever they come from."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import SYSTEMATIC, fault
from gonio.measured.dataset import ANGLES, DIRECTIONS, HORIZON, UNITS
from gonio.measured.stack import foreign_dims

UNCERTAINTIES = ("uncertainty", "uncertainty_systematic")
VALUES_AT_ONCE = 1_048_576  # of an array that stays in a file


# Fits square values, uncertainties and residuals. Squares beyond these are zero or infinite in double precision.
SMALLEST_SQUARED, LARGEST_SQUARED = 1e-150, 1e150
LEAST_PEAK, MOST_PEAK = 1e-100, 1e100  # of the largest value of a scan, which leaves room for what is smaller


def is_stated(uncertainty: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Which standard uncertainties can be used: above zero, and with a square that is neither zero nor infinite.

    Zero and NaN stand where none is stated.
    """
    stated: npt.NDArray[np.bool_] = (uncertainty >= SMALLEST_SQUARED) & (uncertainty <= LARGEST_SQUARED)
    return stated


def beyond_arithmetic(values: npt.NDArray[Any]) -> str:
    """What is wrong with the size of values whose squares a fit takes, in words; empty where nothing is."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0 or LEAST_PEAK <= largest <= MOST_PEAK:
        return ""
    return f"the largest brdf value is {largest:g}, and squares of such values overflow or vanish"


IN_RANGE = (
    f"multiply the values by a power of ten, so that it lies between {LEAST_PEAK:g} and {MOST_PEAK:g}"  # the remedy
)


def missing(scan: xr.Dataset) -> str:
    """The variables that a scan needs and this one lacks, with commas; empty where none is."""
    return ", ".join(name for name in ("brdf", *ANGLES) if name not in scan.variables)


def faults(scan: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Each variable that no scan can have, and what is wrong with it; of the BRDF its type and unit alone.

    Arrays that stay in a file are looked at piece by piece.
    """
    for name in ("brdf", *(n for n in (*UNCERTAINTIES, *DIRECTIONS, "wavelength") if n in scan.variables)):
        if scan[name].dtype.kind not in "fiu":
            yield name, "is no array of numbers"
            return
        if not set(scan[name].dims) <= set(scan["brdf"].dims):
            yield name, "has dimensions that brdf has not"
            return
    if scan["brdf"].attrs.get("units") not in UNITS:
        yield "brdf", "has no unit sr-1, a.u. or 1"
    most = 180.0 if "direction" not in scan["brdf"].dims else HORIZON
    for name in (n for n in DIRECTIONS if n in scan.variables):
        low, high = (0.0, most) if name.startswith("theta") else (-np.inf, np.inf)
        for piece in pieces(scan[name]):
            inside = np.isfinite(piece) & (piece >= low) & (piece <= high)
            if not inside.all():
                yield name, f"holds {piece[~inside].flat[0]:g}, which is no such angle [deg]"
                break
    if wrong := fault(scan, values=not foreign_dims(scan)):
        yield SYSTEMATIC, wrong
    if "wavelength" in scan.variables:
        wavelength = scan["wavelength"].values
        if not (np.isfinite(wavelength) & (wavelength > 0)).all():
            yield "wavelength", "holds a value that is not finite and positive"


def pieces(variable: xr.DataArray) -> Iterator[Any]:
    """The values along the first dimension, so many at a time as a chunk holds."""
    if not variable.ndim:
        yield variable.values
        return
    rows = max(1, VALUES_AT_ONCE // max(1, variable.size // max(1, variable.shape[0])))
    for start in range(0, variable.shape[0], rows):
        yield variable[start : start + rows].values
