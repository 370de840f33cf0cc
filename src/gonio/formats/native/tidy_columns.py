"""The header of a tidy CSV: which names and units its columns may have, and the headings that are written."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from gonio.door.text import clip
from gonio.files import FormatError
from gonio.measured.causes import cause_of
from gonio.measured.dataset import DEGREE, is_degree
from gonio.measured.polarimetry.degree import UNCERTAINTIES
from gonio.measured.polarisers import DOLP
from gonio.tables.vocabulary import SPELLINGS
from gonio.units import CF_STRINGS, UNITS

_OF_VALUES = ("brdf", "relative", "degree of polarisation")
QUANTITIES = {
    "theta_i": ("angle",),
    "theta_r": ("angle",),
    "phi": ("angle",),
    "phi_i": ("angle",),
    "phi_r": ("angle",),
    "wavelength": ("length",),
    "brdf": _OF_VALUES,
    "uncertainty": _OF_VALUES,
    "uncertainty_systematic": _OF_VALUES,
}
OF_VALUES = ("sr-1", "a.u.", DOLP)  # the units of values
REFLECTED_AZIMUTH = "phi_r"  # a column of the file alone: the scan has phi, from the azimuth of the source
OF_DIRECTIONS = tuple(f"_{u}" for u, entry in UNITS.items() if entry.quantity in ("angle", "length"))
_NAMED = {other: name for name, others in SPELLINGS.items() for other in others}
UNITLESS = ("channel", "scan", "mode", "side", "polarisation", "mask")
REQUIRED = ("theta_i", "theta_r", "brdf")
EXAMPLE = "theta_i_deg,theta_r_deg,brdf_sr-1"
FURTHER = "further columns: "


@dataclass(frozen=True)
class Column:
    """One column of the header: its quantity and its unit, which is empty for names, flags and unknown columns."""

    name: str
    unit: str

    @property
    def scale(self) -> float:
        """The factor from the unit of the column to gonio's."""
        return UNITS[self.unit].size if self.unit else 1.0

    @property
    def cf_unit(self) -> str:
        """The unit that the variable gets, in the spelling of the CF conventions."""
        return CF_STRINGS[UNITS[self.unit].quantity] if self.unit else "1"

    @property
    def is_number(self) -> bool:
        """Whether every cell must be a number; other columns may hold texts."""
        return self.name in QUANTITIES or self.name == "mask" or bool(cause_of(self.name))


def columns_of(
    path: Path, line: int, header: list[str], further: set[str], required: Sequence[str] = REQUIRED
) -> list[Column]:
    """What each column of a header is; `further` names those that the file says are further variables."""
    where = f"line {line}"
    if header and not header[-1]:
        raise FormatError(path, "the last column has no name: delete it where it is empty", where)
    if len(header) == 1 and ";" in header[0]:
        message = f"no column theta_i and theta_r and brdf in the header {clip(header[0])!r}"
        raise FormatError(
            path, f"{message}: separate columns by commas, not semicolons, and name them like {EXAMPLE}", where
        )
    header, is_degree = _of_degrees(header)
    columns = [_column(path, where, cell, cell in further, is_degree) for cell in header]
    names = [column.name for column in columns]
    if missing := [name for name in required if name not in names]:
        message = f"no column {' and '.join(missing)} in the header {clip(','.join(header))!r}"
        raise FormatError(path, f"{message}: name the columns like {EXAMPLE}", where)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise FormatError(path, f"the column {clip(twice[0])} occurs twice: keep one", where)
    if {"phi", REFLECTED_AZIMUTH} <= set(names):
        raise FormatError(path, "has phi and phi_r, of which each gives the other: keep one", where)
    values = [c for c in columns if QUANTITIES.get(c.name) == _OF_VALUES or cause_of(c.name) or c.unit == "a.u."]
    by_unit = {c.unit: c.name for c in sorted(values, key=lambda c: c.name, reverse=True)}
    if len(by_unit) > 1:
        one, other = sorted(by_unit)[:2]
        raise FormatError(path, f"{by_unit[one]} is in {one} and {by_unit[other]} in {other}: one unit for both", where)
    return columns


def _of_degrees(header: list[str]) -> tuple[list[str], bool]:
    """The header with the names of a BRDF where `dolp` stands in its place, and whether it does."""
    plain = [cell.lower() for cell in header]
    names = {cell.rpartition("_")[0] or cell for cell in plain} | {*plain}
    if DOLP not in plain or "brdf" in {_NAMED.get(name, name) for name in names}:
        return header, False
    said = dict.fromkeys((*UNCERTAINTIES, "uncertainty", "std", "u"), f"uncertainty_{DOLP}") | {DOLP: f"brdf_{DOLP}"}
    return [said.get(cell.lower(), cell) for cell in header], True


def _column(path: Path, where: str, cell: str, is_further: bool, is_degree: bool) -> Column:
    plain = _NAMED.get(cell.lower(), cell.lower())
    if plain in UNITLESS:
        return Column(plain, "")
    own, _, unit = cell.rpartition("_")
    name = _NAMED.get(own.lower(), own.lower())
    if cause_of(own) or cause_of(cell):
        if unit not in OF_VALUES:
            remedy = f"write {clip(cell if cause_of(cell) else own)}_sr-1 or _a.u., as brdf is"
            raise FormatError(path, f"column {clip(cell)!r} has no unit of a systematic uncertainty: {remedy}", where)
        return Column(own, unit)
    if unit == DOLP and not is_degree:  # beside a BRDF they are further variables
        return Column(cell, "")
    if name in QUANTITIES and plain not in QUANTITIES:
        known = [u for u, entry in UNITS.items() if entry.quantity in QUANTITIES[name]]
        if unit not in known:
            raise FormatError(
                path,
                f"column {clip(cell)!r} has the unit {clip(unit)!r}: {own} needs one of {', '.join(known)}",
                where,
            )
        return Column(name, unit)
    if plain in QUANTITIES:
        known = [f"{plain}_{u}" for u, entry in UNITS.items() if entry.quantity in QUANTITIES[plain]]
        raise FormatError(path, f"column {clip(cell)!r} names no unit: write {' or '.join(known)}", where)
    if unit not in UNITS or not own:
        return Column(cell, "")
    if not is_further and UNITS[unit].quantity in ("angle", "length"):
        remedy = f"rename it; or keep it as a further variable by a line '# {FURTHER}{clip(cell)}' before the header"
        raise FormatError(
            path, f"column {clip(cell)!r} is not understood, the nearest is {_nearest(own, unit)}: {remedy}", where
        )
    return Column(own, unit)


def _nearest(name: str, unit: str) -> str:
    """The known column of the same kind of unit whose name is most alike."""
    from difflib import SequenceMatcher

    kinds = [n for n, quantities in QUANTITIES.items() if UNITS[unit].quantity in quantities]
    spelt = {other: n for n in kinds for other in (n, *SPELLINGS.get(n, ()))}
    best = max(spelt, key=lambda other: SequenceMatcher(None, name.lower(), other).ratio())
    return f"{spelt[best]}_{unit}"


def heading(name: str, flat: xr.Dataset) -> str:
    """The heading of a variable of a flat scan, with its unit."""
    cf_unit = flat[name].attrs.get("units", "1")
    if cf_unit == DEGREE:  # of any number without a unit
        of_values = is_degree(flat) and (QUANTITIES.get(name) == _OF_VALUES or cause_of(name))
        return DOLP if of_values and name == "brdf" else f"{name}_{DOLP}" if of_values else name
    quantity = next((q for q, text in CF_STRINGS.items() if text == cf_unit), None)
    suffix = next((u for u, entry in UNITS.items() if entry.quantity == quantity and entry.size == 1.0), None)
    return f"{name}_{suffix}" if suffix and name not in UNITLESS else name
