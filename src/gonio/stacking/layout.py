"""What the scans of a stack have in common: their directions, sets, unit and dimensions; and where one differs.

The first scan says what they are. Another may have its directions in another order, on a grid or in a list, and may
write an azimuth as 0 or as 360 deg: its values are put in the places of the first.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import SYSTEMATIC, TOTAL, causes
from gonio.measured.dataset import AXES, DIRECTIONS, MODES, SETS, flatten, unit
from gonio.measured.stack import NODE
from gonio.outside import printable
from gonio.resampling.lookup import GRID
from gonio.resampling.resample import without_masked
from gonio.stacking.refusal import MisfitError

Values = npt.NDArray[np.float64]
LANED = (
    "brdf",
    "uncertainty",
    SYSTEMATIC,
    TOTAL,
)  # what each scan has of its own in a stack; masked values are gaps there
WAVELENGTH_STEP = 1e-3  # nm; a format in single precision keeps a wavelength to a tenth of this
OTHER_DIRECTIONS = (
    "gonio stack --resample takes all scans at the directions of the first, --onto FILE at those of a file, between "
    "measured ones by interpolation"
)
OTHER_UNIT = "relative and absolute values make no stack; calibrate the relative ones, or leave them out"
OTHER_SETS = "choose what all have by gonio stack --select, or make a stack of each kind"


@dataclass(frozen=True)
class Taken:
    """The values of one scan in the shape of the stack's, and their uncertainties, None where the scan states none."""

    brdf: Values
    uncertainty: Values | None
    shifts: Mapping[str, Values] = field(default_factory=dict)  # by each cause of systematic uncertainty that it states


class Layout:
    """The directions, sets and unit of the scans of a stack, as the first of them has them."""

    def __init__(self, first: xr.Dataset, path: Path) -> None:
        """path: the file that messages name. Raises ValueError for a scan that says no unit."""
        self.path, self.unit = path, unit(first)
        self.dims, self.shape = first["brdf"].dims, first["brdf"].shape
        own = {AXES: first.attrs[AXES]} if AXES in first.attrs else {}
        kept = [str(n) for n in first.coords if n in (*DIRECTIONS, *SETS, *self.dims)]
        self.coords = xr.Dataset(coords={n: first[n].variable for n in kept}, attrs=own)
        nodes = np.arange(first["brdf"].size).reshape(self.shape)
        flat = flatten(first.assign({NODE: (self.dims, nodes)}))
        self._nodes: npt.NDArray[np.intp] = flat[NODE].values
        self._columns = _columns(flat)
        self._order = _order(self._columns)

    @property
    def points(self) -> int:
        """How many values each scan has, those of nodes below the horizon included."""
        return int(np.prod(self.shape))

    def taken(self, scan: xr.Dataset, path: Path) -> Taken:
        """The values of a scan in the places of the first, gaps and masked ones as NaN.

        Raises ValueError with the file, what is different in it and where, and the remedy.
        """
        if (own := unit(scan)) != self.unit:
            raise MisfitError(path, f"is in {own}, and {self.path} in {self.unit}", OTHER_UNIT)
        flat = flatten(without_masked(scan))
        rows = self._rows(_columns(flat), path)
        stated = "uncertainty" in flat and bool(np.isfinite(flat["uncertainty"].values).any())
        return Taken(
            self._placed(flat["brdf"].values, rows),
            self._placed(flat["uncertainty"].values, rows) if stated else None,
            {name: self._placed(values, rows) for name, values in causes(flat).items()},
        )

    def _placed(self, column: Values, rows: npt.NDArray[np.intp]) -> Values:
        out = np.full(self.points, np.nan)
        out[self._nodes] = column.astype(float)[rows]
        return out.reshape(self.shape)

    def _rows(self, columns: dict[str, Any], path: Path) -> npt.NDArray[np.intp]:
        """The row of a scan (n,) for each of the first one's; ValueError where their directions or sets differ."""
        if columns.keys() == self._columns.keys():
            if _are_alike(columns, self._columns):
                return np.arange(len(self._nodes))
            order = _order(columns)
            in_order = {n: c[order] for n, c in columns.items()}
            if _are_alike(in_order, {n: c[self._order] for n, c in self._columns.items()}):
                rows = np.empty(len(order), dtype=np.intp)
                rows[self._order] = order
                return rows
        raise MisfitError(path, *self._difference(columns))

    def _difference(self, columns: dict[str, Any]) -> tuple[str, str]:
        """In what the directions or sets of a scan differ from those of the first, and the remedy."""
        mine, first = set(columns), set(self._columns)
        for lacking, says, says_none in ((first - mine, self.path, "it"), (mine - first, "it", str(self.path))):
            for name in sorted(lacking):
                return f"{says} says a {name}, and {says_none} says none", OTHER_SETS
        for name in (n for n in SETS if n in first):
            extra = np.setdiff1d(columns[name], self._columns[name])
            lacking_values = np.setdiff1d(self._columns[name], columns[name])
            if len(extra) or len(lacking_values):
                has, value = ("has", extra[0]) if len(extra) else ("lacks", lacking_values[0])
                other = "has not" if has == "has" else "has"
                return f"{has} {name} {_shown(name, value)}, which {self.path} {other}", OTHER_SETS
        return self._other_direction(columns), OTHER_DIRECTIONS

    def _other_direction(self, columns: dict[str, Any]) -> str:
        """The first direction that only one of the two has, or that one has more often."""
        names = list(self._columns)
        count, first_count = (len(next(iter(c.values()))) for c in (columns, self._columns))
        sizes = f" ({count} directions, and {first_count} there)" if count != first_count else ""
        own, first = ([*zip(*(c[n].tolist() for n in names), strict=True)] for c in (columns, self._columns))
        for rows, others, words in ((own, set(first), "has {}, and {} has not"), (first, set(own), "lacks {} of {}")):
            for row in (r for r in rows if r not in others):
                where = ", ".join(f"{n} {_shown(n, v)}" for n, v in zip(names, row, strict=True) if n in DIRECTIONS)
                return words.format(where, self.path) + sizes
        return f"has another number of values at the same directions as {self.path}{sizes}"


def _columns(flat: xr.Dataset) -> dict[str, Any]:
    """The directions and sets of a flat scan, by which two are compared: angles as whole multiples of GRID.

    What has no mode is of reflection. An azimuth means nothing at the normal.
    """
    angles = {n: np.round(flat[n].values.astype(float) / GRID).astype(np.int64) for n in DIRECTIONS if n in flat.coords}
    turn = round(360.0 / GRID)
    for name in angles.keys() - {"theta_i", "theta_r"}:
        angles[name] = angles[name] % turn
    angles["phi"] = np.where(angles["theta_r"] == 0, 0, angles["phi"])
    columns: dict[str, Any] = dict(angles)
    for name in (n for n in SETS if n in flat.coords):
        values = flat[name].values
        is_number = values.dtype.kind in "iuf"
        columns[name] = np.round(values / WAVELENGTH_STEP).astype(np.int64) if is_number else values.astype(str)
    columns.setdefault("mode", np.full(flat.sizes["direction"], MODES[0]))
    return columns


def _order(columns: dict[str, Any]) -> npt.NDArray[np.intp]:
    """The rows sorted by all columns; equal ones, as repeated readings are, stay in the order of the file."""
    return np.lexsort([np.unique(columns[name], return_inverse=True)[1].ravel() for name in sorted(columns)])


def _are_alike(some: dict[str, Any], others: dict[str, Any]) -> bool:
    return all(np.array_equal(some[name], others[name]) for name in others)


def _shown(name: str, value: Any) -> str:
    """A value of a column with its unit."""
    if name in DIRECTIONS:
        return f"{value * GRID:.6g} deg"
    return f"{value * WAVELENGTH_STEP:.6g} nm" if name == "wavelength" else printable(str(value))
