"""Which fitted values make up for each other: their correlations, and by how much these inflate an uncertainty.

With R the correlation matrix, the standard uncertainty of value k is sqrt((R^-1)_kk) times the one that it would have
if all others were known (belsley1980). Of very many values, such as two or three a wavelength of a spectrum, neither R
nor its inverse is formed. Values then count for each other that are of one wavelength, or that all wavelengths share:
values of different wavelengths are only correlated through the shared ones, and independent once these are known. With
g the shared values, c those of one wavelength, M = R_cg R_gg^-1 and P = R_cc - M R_gc, that is

    (R^-1)_gg = R_gg^-1 + sum over wavelengths of M' P^-1 M.
"""

import functools
import weakref
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.fitting.solution import Solution

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

MANY = 400  # values from which R is taken in parts
TOGETHER = 0.8  # correlation of two values, in size, from which one makes up for the other


@dataclass(frozen=True)
class Free:
    """What a fit was free to change: names, values (n,), and where they are among all values of the solution (n,)."""

    names: list[str]
    values: Values
    places: Places
    solution: Solution

    @classmethod
    def of(cls, solution: Solution) -> "Free":
        """Those of a solution, in its order."""
        free = np.flatnonzero(~solution.dataset["held"].values)
        names = solution.dataset["parameter"].values[free].tolist()
        return cls(names, solution.dataset["value"].values[free], free, solution)

    @functools.cached_property
    def by_name(self) -> dict[str, float]:
        """The values by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @functools.cached_property
    def place_of(self) -> dict[str, int]:
        """Each name's place among the free values."""
        return {name: place for place, name in enumerate(self.names)}

    @functools.cached_property
    def variance(self) -> Values:
        """Of every value (n,)."""
        return np.diag(self.solution.dataset["covariance"].values)[self.places]

    def covariance(self, some: Places | list[int]) -> Values:
        """The covariance of some of the values (m, m)."""
        at = self.places[some]
        out: Values = self.solution.dataset["covariance"].values[np.ix_(at, at)]
        return out

    def correlation(self, some: Places) -> Values:
        """The correlation matrix of some of the values (m, m), which must be known."""
        covariance = self.covariance(some)
        spread = np.sqrt(np.diag(covariance))
        return covariance / np.outer(spread, spread) if some.size else covariance

    def near(self, some: Places) -> Mask:
        """Which pairs of some of the values (m, m) count for each other.

        Not those that belong to different groups where either's parameter is smooth over them: smoothing itself
        correlates these, which says nothing of what the data determine.
        """
        if not self.solution.smooth:
            return np.ones((len(some), len(some)), dtype=bool)
        part = {name: self.solution.dataset[name].values[self.places[some]] for name in ("name", "by", "group")}
        smooth = np.isin(part["name"], list(self.solution.smooth))
        other_group = (part["by"][:, None] == part["by"]) & (part["group"][:, None] != part["group"])
        near: Mask = ~(other_group & (smooth[:, None] | smooth))
        return near


@dataclass(frozen=True)
class Correlated:
    """Of each value (m,): its inflation, and the names of those that make up for it, the most correlated first."""

    inflation: Values
    partners: list[tuple[str, ...]]


_KNOWN: "weakref.WeakKeyDictionary[Solution, Correlated]" = weakref.WeakKeyDictionary()


def correlated(free: Free, some: Places) -> Correlated:
    """How some of the values, those whose uncertainty means something, make up for each other.

    They are the same at every call for one solution: it is found once, and kept as long as the solution.
    """
    if free.solution not in _KNOWN:
        _KNOWN[free.solution] = _correlated(free, some)
    return _KNOWN[free.solution]


def _correlated(free: Free, some: Places) -> Correlated:
    if len(free.names) > MANY:
        cells = _cells(free, some)
        if len(cells) > 1:
            return _in_cells(free, some, cells)
    correlation, near = free.correlation(some), free.near(some)
    names = [free.names[k] for k in some]
    partners = [_partners(names, correlation[k], near[k], k) for k in range(len(some))]
    return Correlated(_inflation(correlation, near), partners)


def _in_cells(free: Free, some: Places, cells: list[Places]) -> Correlated:
    """The same from the correlations within each cell, and of those with the values that all cells share.

    cells: places among `some` of the values of each; the last has the shared ones, and may be empty.
    """
    shared, inflation = cells.pop(), np.ones(len(some))
    partners: list[tuple[str, ...]] = [()] * len(some)
    strong: dict[int, list[tuple[float, str]]] = {int(k): [] for k in shared}
    of_shared = free.correlation(some[shared])
    known = np.linalg.pinv(of_shared, hermitian=True)
    inverse = np.diag(known).copy()
    for cell in cells:
        both = np.concatenate([cell, shared])
        correlation, near = free.correlation(some[both]), free.near(some[both])
        names = [free.names[k] for k in some[both]]
        inflation[cell] = _inflation(correlation, near)[: len(cell)]
        for place, k in enumerate(cell):
            partners[k] = _partners(names, correlation[place], near[place], place)
        across = correlation[: len(cell), len(cell) :]
        follows = across @ known
        alone = np.linalg.pinv(correlation[: len(cell), : len(cell)] - follows @ across.T, hermitian=True)
        inverse += np.einsum("cg,cd,dg->g", follows, alone, follows)
        for place, k in enumerate(shared):
            sizes = np.abs(across[:, place])
            strong[int(k)] += [(-sizes[at], names[at]) for at in np.flatnonzero(sizes > TOGETHER)]
    inflation[shared] = np.sqrt(np.maximum(inverse, 1.0))
    names = [free.names[k] for k in some[shared]]
    for place, k in enumerate(shared):
        others = _partners(names, of_shared[place], np.ones(len(shared), dtype=bool), place)
        partners[k] = (*others, *(name for _, name in sorted(strong[int(k)])))
    return Correlated(inflation, partners)


def _cells(free: Free, some: Places) -> list[Places]:
    """Places among some values by the label of the coordinate that groups most of them; last those that it does not."""
    stored = free.solution.dataset
    pairs = zip(*(stored[name].values[free.places[some]].tolist() for name in ("by", "group")), strict=True)
    labels = [dict(zip(by.split(","), group.split(",", by.count(",")), strict=True)) for by, group in pairs]
    groups: dict[str, set[str]] = {}
    for own in labels:
        for name, label in own.items():
            groups.setdefault(name, set()).add(label)
    groups.pop("", None)  # the coordinate of values that have no group
    coordinate = max(groups, key=lambda name: len(groups[name]), default="-")
    cells: dict[str | None, list[int]] = {}
    for place, own in enumerate(labels):
        cells.setdefault(own.get(coordinate), []).append(place)
    shared = cells.pop(None, [])
    return [*(np.array(cell, dtype=np.intp) for cell in cells.values()), np.array(shared, dtype=np.intp)]


def _partners(names: Sequence[str], correlation: Values, near: Mask, at: int) -> tuple[str, ...]:
    """The values that make up for one, the strongest first, from its correlation (n,) with every value.

    near (n,): which values count. at: its own place, at which the correlation is one.
    """
    strong = [k for k in np.argsort(-np.abs(correlation)) if near[k] and k != at and abs(correlation[k]) > TOGETHER]
    return tuple(names[k] for k in strong)


def _inflation(correlation: Values, near: Mask) -> Values:
    """Each value's standard uncertainty over the one that it would have if all that are near it were known (n,).

    near (n, n): which values count for which. R of values that nearly make up for each other can be singular to
    rounding, hence the pseudoinverse. An inflation below one is rounding too.
    """
    if near.all():
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(correlation, hermitian=True)), 1.0))
    variances = np.ones(len(correlation))
    for k, counted in enumerate(near):
        inverse = np.linalg.pinv(correlation[np.ix_(counted, counted)], hermitian=True)
        place = counted[:k].sum()  # of value k among those that count
        variances[k] = inverse[place, place]
    return np.sqrt(np.maximum(variances, 1.0))
