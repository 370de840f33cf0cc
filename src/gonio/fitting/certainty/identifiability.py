"""Which values the data tell, which trade off against each other, and which combinations of them are told anyway."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.profile import Profile
from gonio.fitting.solution import Solution
from gonio.model import Model

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

INFLATED = 10**0.5  # a variance ten times that of the value alone is the customary sign of collinearity (belsley1980)
TOGETHER = 0.8  # correlation of two values, in size, from which one makes up for the other
STABLE = 1 / 3  # of the relative uncertainty of either part: a ratio or product that is told although they are not
NAMED = 4  # partners that a verdict in words names at most
STEEP = 85.0  # deg: beyond, goniometers see little
DIFFERENCE = 1e-6  # relative step of the derivative of a declared combination


@dataclass(frozen=True)
class Verdict:
    """What the data say of one free value.

    determined: False where it trades off or is not told at all. inflation: its standard uncertainty over the one that
    it would have if all others were known. partners: the values that make up for it.
    """

    name: str
    determined: bool
    inflation: float
    partners: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class Combination:
    """A number made of several values, and its standard uncertainty."""

    name: str
    value: float
    uncertainty: float

    @property
    def relative(self) -> float:
        return abs(self.uncertainty / self.value) if self.value else np.inf


def verdicts(solution: Solution, farthest: float = 90.0, profiles: Sequence[Profile] = ()) -> list[Verdict]:
    """One verdict for each free value, from the covariance of a fit to a scan that reaches theta_r `farthest` [deg].

    A value whose profile was computed is told with what the data allow, which holds where the covariance does not.
    """
    allowed = {p.name: f"; the data allow {p.name} {p.words}" for p in profiles}
    return [replace(v, words=v.words + allowed.get(v.name, "")) for v in _verdicts(solution, farthest)]


def _verdicts(solution: Solution, farthest: float) -> list[Verdict]:
    names, _, covariance = _free(solution)
    told = np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0)
    at_bound = dict(zip(solution.values, solution.dataset["at_bound"].values.tolist(), strict=True))
    inside = np.flatnonzero(told & np.array([not at_bound[name] for name in names], dtype=bool))
    sub = covariance[np.ix_(inside, inside)]
    spread = np.sqrt(np.diag(sub))
    correlation = sub / np.outer(spread, spread) if inside.size else sub
    near = ~_apart(solution)[np.ix_(inside, inside)]
    inflation = _inflation(correlation, near)
    out = []
    for k, name in enumerate(names):
        if at_bound[name]:
            out.append(
                Verdict(name, False, np.nan, (), "at its bound: the data would have it beyond, or do not tell it")
            )
        elif not told[k]:
            out.append(Verdict(name, False, np.inf, (), "not determined: no value fits better than another; hold it"))
        else:
            at = int(np.flatnonzero(inside == k)[0])
            others = [names[inside[j]] for j in np.argsort(-np.abs(correlation[at])) if near[at, j] and j != at]
            strong = tuple(o for o in others if abs(correlation[at, _at(names, inside, o)]) > TOGETHER)
            traded = bool(inflation[at] > INFLATED and strong)
            words = _traded(inflation[at], strong, farthest) if traded else "determined"
            out.append(Verdict(name, not traded, float(inflation[at]), strong if traded else (), words))
    return out


def _inflation(correlation: Values, near: Mask) -> Values:
    """Each value's standard uncertainty over the one that it would have if all that are near it were known."""
    if near.all():
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(correlation, hermitian=True)), 1.0))
    variances = np.ones(len(correlation))
    for k, some in enumerate(near):
        block = np.linalg.pinv(correlation[np.ix_(some, some)], hermitian=True)
        variances[k] = block[some[:k].sum(), some[:k].sum()]
    return np.sqrt(np.maximum(variances, 1.0))


def _apart(solution: Solution) -> Mask:
    """Which free values are of different groups of a smooth parameter, where neighbours go together anyway."""
    rows = np.flatnonzero(~solution.dataset["held"].values)
    if not solution.smooth:
        return np.zeros((len(rows), len(rows)), dtype=bool)
    free = solution.dataset.isel(parameter=rows)
    smooth = np.isin(free["name"].values, list(solution.smooth))
    by, group = free["by"].values, free["group"].values
    alike = (by[:, None] == by) & (group[:, None] != group)
    apart: Mask = alike & (smooth[:, None] | smooth)
    return apart


def combinations(model: Model, solution: Solution) -> list[Combination]:
    """Numbers that the data tell although their parts trade off: what the model declares, then ratios and products."""
    names, values, covariance = _free(solution)
    known = dict(zip(names, values, strict=True))
    out = []
    for name, of in model.combinations.items():
        try:
            declared = _declared(name, of, known, solution.values, covariance, names)
        except KeyError:  # a part of it has one value a group
            continue
        if declared.relative < _surest_part(name, names, values, covariance):
            out.append(declared)
    traded = [v for v in verdicts(solution) if not v.determined and v.partners]
    pairs = {tuple(sorted((v.name, p), key=names.index)) for v in traded for p in v.partners}
    for one, two in sorted(pairs, key=lambda pair: (names.index(pair[0]), names.index(pair[1]))):
        for sign, mark in ((-1, "/"), (1, " ")):
            found = _pair(one, two, sign, mark, known, covariance, names)
            if found and not any(set(_words(c.name)) >= {one, two} for c in out):
                out.append(found)
    return out


def _pair(
    one: str, two: str, sign: int, mark: str, known: Mapping[str, float], covariance: Values, names: list[str]
) -> Combination | None:
    """One times two to the power of `sign`, where that is much better known than either."""
    if not known[one] or not known[two]:
        return None
    at = [names.index(one), names.index(two)]
    scaled = covariance[np.ix_(at, at)] / np.outer([known[one], known[two]], [known[one], known[two]])
    direction = np.array([1.0, sign])
    relative = float(np.sqrt(max(direction @ scaled @ direction, 0.0)))
    if not relative < STABLE * np.sqrt(min(scaled[0, 0], scaled[1, 1])):
        return None
    value = known[one] * known[two] ** sign
    return Combination(f"{one}{mark}{two}", value, abs(value) * relative)


def _declared(
    name: str,
    of: object,
    known: Mapping[str, float],
    all_values: Mapping[str, float],
    covariance: Values,
    names: list[str],
) -> Combination:
    assert callable(of)
    values = {**all_values, **known}
    value = float(of(values))
    slope = np.zeros(len(names))
    for k, parameter in enumerate(names):
        step = DIFFERENCE * max(abs(values[parameter]), DIFFERENCE)
        ahead, behind = ({**values, parameter: values[parameter] + s} for s in (step, -step))
        slope[k] = (float(of(ahead)) - float(of(behind))) / (2 * step)
    parts = np.flatnonzero(slope)
    variance = slope[parts] @ covariance[np.ix_(parts, parts)] @ slope[parts]
    return Combination(name, value, float(np.sqrt(variance)) if np.isfinite(variance) else np.inf)


def _surest_part(name: str, names: list[str], values: Values, covariance: Values) -> float:
    """Least relative uncertainty of the values that a combination's name names, infinite where they are held."""
    at = [names.index(word) for word in _words(name) if word in names]
    relative = [np.sqrt(covariance[k, k]) / abs(values[k]) for k in at if values[k]]
    return float(min(relative, default=np.inf))


def _words(name: str) -> list[str]:
    return [
        w for w in itertools.chain(*(part.split("/") for part in name.replace("(", " ").replace(")", " ").split())) if w
    ]


def _at(names: list[str], inside: npt.NDArray[np.intp], name: str) -> int:
    return int(np.flatnonzero(inside == names.index(name))[0])


def _traded(inflation: float, partners: tuple[str, ...], farthest: float) -> str:
    named = partners if len(partners) <= NAMED else (*partners[: NAMED - 1], f"{len(partners) - NAMED + 1} others")
    listed = " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)
    elsewhere = f"scan beyond {farthest:g} deg" if farthest < STEEP else "scan other directions"
    return f"trades off with {listed}, {inflation:.0f} times as uncertain as alone: hold one, or {elsewhere}"


def _free(solution: Solution) -> tuple[list[str], Values, Values]:
    """Names, values and covariance of what the fit was free to change."""
    free = np.flatnonzero(~solution.dataset["held"].values)
    names = solution.dataset["parameter"].values[free].tolist()
    return names, solution.dataset["value"].values[free], solution.dataset["covariance"].values[np.ix_(free, free)]
