"""What a file says of n or of k, checked row by row, and both joined into one Material."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from gonio.files import FormatError
from gonio.materials.formulas import Formula
from gonio.materials.material import Material

LARGEST = 1e5  # of n or k; metals reach some hundreds in the far infrared
LONGEST_UM = 1e9  # a kilometre
SAMPLES = 257  # wavelengths at which a formula is looked at and listed
EITHER = "give a refractiveindex.info YAML, or columns under a header like wavelength_um,n,k"


@dataclass(frozen=True)
class Curve:
    """n or k over a range of wavelengths [um]: a table, or a formula and its range with no values."""

    wavelength_um: np.ndarray
    values: np.ndarray | None
    formula: Formula | None = None

    @property
    def range(self) -> tuple[float, float]:
        return float(self.wavelength_um[0]), float(self.wavelength_um[-1])

    def at(self, wavelength_um: np.ndarray) -> np.ndarray:
        if self.formula:
            return self.formula(wavelength_um)
        assert self.values is not None
        return np.interp(wavelength_um, self.wavelength_um, self.values)


def number(text: str) -> float | None:
    """A finite number, None for any other text."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in text else None


def tabulated(path: Path, name: str, rows: Sequence[tuple[int, float, float]]) -> Curve:
    """The curve of n or k from rows (line, wavelength [um], value), which may run up or down.

    Raises FormatError with the line of the first row that cannot be.
    """
    if not rows:
        raise FormatError(path, f"holds no row of {name}: {EITHER}")
    for line, w, value in rows:
        if not 0 < w <= LONGEST_UM:
            raise FormatError(path, f"the wavelength is {w:g} um: it must be above 0 and below 1e9", f"line {line}")
        if value > LARGEST or value < 0 or (name == "n" and value == 0):
            wanted = "above 0" if name == "n" else "0 or more (k > 0 absorbs here)"
            raise FormatError(path, f"{name} is {value:g}: it must be {wanted}, and below 1e5", f"line {line}")
    kept = [rows[0], *(row for before, row in pairwise(rows) if row[1:] != before[1:])]
    falling = len(kept) > 1 and kept[1][1] < kept[0][1]
    for (_, before, _), (line, w, _) in pairwise(kept):
        if w == before:
            raise FormatError(path, f"{w:g} um occurs twice with different {name}: keep one", f"line {line}")
        if (w < before) is not falling:
            raise FormatError(path, f"{w:g} um follows {before:g} um: sort the rows by wavelength", f"line {line}")
    ordered = np.array([row[1:] for row in (kept[::-1] if falling else kept)])
    return Curve(ordered[:, 0], ordered[:, 1])


def joined(path: Path, n: Curve | None, k: Curve | None, cite: str, note: str) -> Material:
    """The Material of a file, over the wavelengths where both n and k are known.

    A file without k is one of a transparent material: k is 0, and the note says so.
    Raises FormatError where there is no n, no common wavelength, or no real index.
    """
    if n is None:
        raise FormatError(path, f"gives k and no n: {EITHER}")
    remarks = [note] if note else []
    low, high = n.range
    if k is None:
        remarks.append("The file gives no k: taken as 0, which is true of transparent materials only.")
    else:
        low, high = max(low, k.range[0]), min(high, k.range[1])
        if low > high:
            spans = [f"{name} from {c.range[0]:g} to {c.range[1]:g} um" for name, c in (("n", n), ("k", k))]
            raise FormatError(path, f"gives {' and '.join(spans)}: there is no wavelength with both")
        if n.range != k.range:
            remarks.append(f"n and k are both known from {low:g} to {high:g} um only.")
    nodes = np.concatenate(
        [c.wavelength_um for c in (n, k) if c] + ([np.geomspace(low, high, SAMPLES)] if n.formula else [])
    )
    nodes = np.unique(np.clip(nodes, low, high))
    index = n.at(nodes)
    if not ((index > 0) & (index <= LARGEST)).all():
        at = nodes[~((index > 0) & (index <= LARGEST))][0]
        raise FormatError(path, f"{n.formula} gives no index at {at:g} um: check its coefficients and its range")
    return Material(
        name=path.name,
        title=path.stem,
        cite=cite,
        where=str(path),
        wavelength_um=nodes,
        n=index,
        k=k.at(nodes) if k else np.zeros_like(nodes),
        note=" ".join(remarks),
        formula=n.formula,
    )
