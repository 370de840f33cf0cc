"""Systematic uncertainty by cause: one number that is uncertain, and shifts many values of a scan at once.

`systematic` (cause, direction) holds, in the unit of the BRDF and with its sign, by how much each value moves where the
cause is one standard uncertainty larger: a calibration shifts all values by one factor, the zero of an arm those of
both sides in opposite directions. Causes are independent of one another. `uncertainty_systematic` is the root of the
sum of their squares. A scan that states that one column alone has one cause, named `systematic`, which shifts all
values to the same side.

Causes of OF_ONE_SCAN, such as the reading of a dark, belong to their own scan: `join` keeps those of different scans
apart, by the name of the scan, and takes other causes of one name for the same one.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

Values = npt.NDArray[np.float64]
SYSTEMATIC, CAUSE = "systematic", "cause"  # the variable, and its dimension and coordinate
TOTAL = "uncertainty_systematic"
WHOLE = "systematic"  # the one cause of a scan that names none
OF_ONE_SCAN = ("dark", "incident", "standard-reading", "drift")  # before any bracket of the name
_COLUMN = re.compile(r"systematic\[(.+)\]")
AGREES = 1e-4  # relative: to which a stated total agrees with the root of the sum of squares, digits of files allowed


def total(shifts: npt.ArrayLike) -> Values:
    """The root of the sum of squares over causes, the first axis."""
    found: Values = np.sqrt(np.sum(np.square(np.asarray(shifts, dtype=float)), axis=0))
    return found


def with_causes(scan: xr.Dataset, shifts: Mapping[str, npt.ArrayLike]) -> xr.Dataset:
    """The scan with its systematic shifts by cause, each an array over the BRDF's dimensions, and with their total.

    Without any cause the scan has neither. Raises ValueError for a shift that is of another shape or not finite.
    """
    scan = scan.drop_vars([n for n in (SYSTEMATIC, CAUSE, TOTAL) if n in scan.variables])
    if not shifts:
        return scan
    names = list(shifts)
    for name, values in shifts.items():
        found = np.asarray(values, dtype=float)
        if found.shape != scan["brdf"].shape:
            raise ValueError(f"the cause {name!r} has the shape {found.shape}, and brdf has {scan['brdf'].shape}")
    stacked = np.stack([np.asarray(shifts[name], dtype=float) for name in names])
    unit = {"units": scan["brdf"].attrs.get("units", "1")}
    dims = scan["brdf"].dims
    return scan.assign(
        {SYSTEMATIC: ((CAUSE, *dims), stacked, unit), TOTAL: (dims, total(stacked), unit)}
    ).assign_coords({CAUSE: np.array(names, dtype=str)})


def causes(scan: xr.Dataset) -> dict[str, Values]:
    """The shifts of a scan by cause, each of the BRDF's dimensions; empty where it states no systematic uncertainty."""
    if SYSTEMATIC in scan:
        shifts = scan[SYSTEMATIC].transpose(CAUSE, *scan["brdf"].dims)
        names = scan[CAUSE].values.astype(str).tolist() if CAUSE in scan.coords else range(shifts.sizes[CAUSE])
        return {str(name): np.asarray(v, dtype=float) for name, v in zip(names, shifts.values, strict=True)}
    return {WHOLE: scan[TOTAL].values.astype(float)} if TOTAL in scan else {}


def fault(scan: xr.Dataset, *, values: bool = True) -> str:
    """What is wrong with the causes of a scan, in words; empty where nothing is, and where it has none.

    values: whether to look at the shifts themselves, which of many scans may be more than memory holds.
    """
    if SYSTEMATIC not in scan.variables:
        return ""
    variable, brdf = scan[SYSTEMATIC], scan["brdf"]
    if variable.dtype.kind not in "fiu" or set(variable.dims) != {CAUSE, *brdf.dims}:
        return f"is no array of numbers along {CAUSE} and the dimensions of brdf"
    if CAUSE not in scan.coords or scan[CAUSE].dtype.kind not in "OSU":
        return f"has no names of its causes, in the coordinate {CAUSE}"
    names = scan[CAUSE].values.astype(str).tolist()
    if len(set(names)) < len(names) or "" in names:
        return "names a cause twice, or one without a name"
    if values and np.isinf(variable.values).any():
        return "is infinite"
    if variable.attrs.get("units", brdf.attrs.get("units")) != brdf.attrs.get("units"):
        return "is in another unit than brdf"
    if (
        values
        and TOTAL in scan
        and not _agree(scan[TOTAL].transpose(*brdf.dims).values, variable.transpose(CAUSE, *brdf.dims))
    ):
        return f"does not add up to {TOTAL}: that is the root of the sum of their squares; delete it to have it made"
    return ""


def _agree(stated: npt.NDArray[Any], shifts: xr.DataArray) -> bool:
    found = total(shifts.values)
    both = np.isfinite(found) & np.isfinite(stated)
    return bool(np.allclose(stated[both], found[both], rtol=AGREES, atol=1e-12 * np.abs(found[both]).max(initial=0.0)))


def apart(name: str, scan: str) -> str:
    """The name of a cause among those of several scans: with the scan's, where it belongs to that scan alone."""
    return f"{name} of {scan}" if re.split(r"[\[ ]", name, maxsplit=1)[0] in OF_ONE_SCAN else name


def in_common(scans: Sequence[xr.Dataset], names: Iterable[str] | None = None) -> list[xr.Dataset]:
    """Flat scans that all have the same causes, so that they can be put together.

    names: those of the scans, by which causes that belong to one scan are told apart. A cause that a scan does not have
    shifts none of its values. Where no scan has causes by name, they stay as they are, but one that states no
    systematic uncertainty among others that do gets none, zero: its values would otherwise take part in no shift.
    """
    found = [causes(scan) for scan in scans]
    if not any(found):
        return list(scans)
    if names is not None:
        found = [{apart(n, own): v for n, v in of.items()} for of, own in zip(found, names, strict=True)]
    every = list(dict.fromkeys(name for of in found for name in of))
    if every == [WHOLE]:
        zero = [xr.zeros_like(scan["brdf"]) for scan in scans]
        return [s if TOTAL in s else s.assign({TOTAL: z}) for s, z in zip(scans, zero, strict=True)]
    return [
        with_causes(scan, {name: of.get(name, np.zeros(scan["brdf"].shape)) for name in every})
        for scan, of in zip(scans, found, strict=True)
    ]


def spread(scan: xr.Dataset) -> xr.Dataset:
    """The scan with each cause as a variable of its own, `systematic[NAME]`, for files of columns."""
    if SYSTEMATIC not in scan:
        return scan
    unit = {"units": scan["brdf"].attrs.get("units", "1")}
    columns = {f"{SYSTEMATIC}[{n}]": (scan["brdf"].dims, v, unit) for n, v in causes(scan).items()}
    return scan.drop_vars([SYSTEMATIC, CAUSE], errors="ignore").assign(columns)


def cause_of(name: str) -> str:
    """The cause whose column is called `systematic[NAME]`; empty for another column."""
    found = _COLUMN.fullmatch(name)
    return found[1] if found else ""


def gathered(scan: xr.Dataset) -> xr.Dataset:
    """The scan whose causes are variables of their own, with `systematic` in place of them.

    Raises ValueError where they do not add up to the total that the scan states, or are not in the unit of the BRDF.
    """
    names = {str(n): cause for n in scan.data_vars if (cause := cause_of(str(n)))}
    if not names:
        return scan
    unit = scan["brdf"].attrs.get("units")
    for name in names:
        if scan[name].attrs.get("units") != unit or scan[name].dtype.kind not in "fiu":
            raise ValueError(f"{name} is no column of numbers in {unit}, the unit of brdf")
    shifts = {cause: scan[name].values.astype(float) for name, cause in names.items()}
    done = with_causes(scan.drop_vars(list(names)), shifts)
    stated = done.assign({TOTAL: scan[TOTAL]}) if TOTAL in scan else done
    if wrong := fault(stated):
        raise ValueError(f"{SYSTEMATIC}[..] {wrong}")
    return done
