"""Which values the data determine, which trade off against each other, and which combinations are determined anyway.

Two values trade off where a change of one makes up for a change of the other, so that the data determine some
combination of both and neither alone. With R the correlation matrix of the fitted values, the standard uncertainty of
value k is sqrt((R^-1)_kk) times the one that it would have if all others were known: its inflation, the root of the
variance inflation factor (belsley1980).

A ratio or product of two such values, or a combination that the model declares, can be determined although its parts
are not: an example is kdd/(pi gamma), the height of a Cauchy-Lorentz lobe. Everything here is read from the covariance
of a Solution, so that no fit is made. What it says holds near the optimum; `profile` looks farther.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gonio.fitting.certainty.correlation import Free, correlated
from gonio.fitting.certainty.profile import Profile
from gonio.fitting.solution import Solution

INFLATED = 10**0.5  # a variance ten times that of the value alone is the customary sign of collinearity (belsley1980)
# of the relative uncertainty of either part: a ratio or product that is determined although they are not
STABLE = 1 / 3
NAMED = 4  # partners that a sentence names at most
STEEP = 85.0  # deg: beyond, goniometers see little
DIFFERENCE = 1e-6  # relative step of the derivative of a declared combination


@dataclass(frozen=True)
class Determination:
    """What the data say of one free value.

    determined: False where it trades off, is at its bound, or does not matter at all. inflation: its standard
    uncertainty over the one that it would have if all others were known, NaN at a bound, infinite for a value that does
    not matter. partners: the values that make up for it, the most correlated first. words: the same as a sentence, with
    what to do.
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
        """Uncertainty over value, infinite for a value of zero."""
        return abs(self.uncertainty / self.value) if self.value else np.inf


def determinations(
    solution: Solution,
    farthest: float = 90.0,
    profiles: Sequence[Profile] = (),
    remedy: Callable[[str], str] = lambda name: "",
) -> list[Determination]:
    """One for each free value, from the covariance of a fit to a scan that reaches theta_r `farthest` [deg].

    A value whose profile was computed is said with what the data allow, which holds where the covariance does not.
    remedy: what further readings would do for a value of this name, in words, as `gonio.design.remedy` finds it; empty
    where it does not know.
    """
    allowed = {p.name: f"; the data allow {p.name} {p.words}" for p in profiles}
    return [replace(d, words=d.words + allowed.get(d.name, "")) for d in _determinations(solution, farthest, remedy)]


def _determinations(solution: Solution, farthest: float, remedy: Callable[[str], str]) -> list[Determination]:
    """The determinations from the covariance alone, without profiles."""
    free = Free.of(solution)
    known = np.isfinite(free.variance) & (free.variance > 0)
    at_bound = solution.dataset["at_bound"].values[free.places]
    # a value at its bound, or without effect, makes up for no other: correlations are those of the rest
    inside = np.flatnonzero(known & ~at_bound)
    found = correlated(free, inside)
    place = {int(k): at for at, k in enumerate(inside)}
    out = []
    for k, name in enumerate(free.names):
        if at_bound[k]:
            words = "at its bound: the bound is too narrow, or the data cannot determine the value"
            out.append(Determination(name, False, np.nan, (), words))
        elif not known[k]:
            words = "not determined: no value fits better than another; hold it"
            out.append(Determination(name, False, np.inf, (), words))
        else:
            at = place[k]
            out.append(_determination(name, float(found.inflation[at]), found.partners[at], farthest, remedy))
    return out


def _determination(
    name: str, inflation: float, partners: tuple[str, ...], farthest: float, remedy: Callable[[str], str]
) -> Determination:
    """What is said of a value inside its bounds whose uncertainty is known.

    An inflation without a partner comes of several weaker correlations, and is not called a trade-off.
    """
    if not (inflation > INFLATED and partners):
        return Determination(name, True, inflation, (), "determined")
    named = partners if len(partners) <= NAMED else (*partners[: NAMED - 1], f"{len(partners) - NAMED + 1} others")
    listed = " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)
    told = f"cannot be told apart from {listed}, which makes it {inflation:.0f} times less certain than alone"
    words = f"{told}: fix one with --hold; {remedy(name) or _elsewhere(farthest)}"
    return Determination(name, False, inflation, partners, words)


def _elsewhere(farthest: float) -> str:
    """What is said of other readings where nothing is known of what they would do."""
    where = f"beyond {farthest:g} deg" if farthest < STEEP else "at other directions"
    return f"readings {where} may help"


def combinations(solution: Solution) -> list[Combination]:
    """Numbers that the data determine although their parts trade off.

    First those that the model declares, where they are relatively surer than each of their parts, one for each group
    where a part has one value a group; then ratios and products of two values that trade off, unless one of the first
    holds both.
    """
    free = Free.of(solution)
    found = [
        (declared, {known for word in _words(name) for known in (word, f"{word}{group}")})
        for name, of in solution.model.combinations.items()
        for group, declared in _of_groups(name, of, solution, free)
        if declared.relative < _surest_part(name, free, group)
    ]
    out, declared_words = [one for one, _ in found], [words for _, words in found]
    traded = [d for d in determinations(solution) if not d.determined and d.partners]
    place = free.place_of
    pairs = {tuple(sorted((d.name, p), key=place.__getitem__)) for d in traded for p in d.partners}
    for one, two in sorted(pairs, key=lambda pair: (place[pair[0]], place[pair[1]])):
        if any(words >= {one, two} for words in declared_words):
            continue
        ratio_or_product = (_pair(one, two, sign, mark, free) for sign, mark in ((-1, "/"), (1, " ")))
        out += [pair for pair in ratio_or_product if pair][:1]
    return out


def _pair(one: str, two: str, sign: int, mark: str, free: Free) -> Combination | None:
    """One times two to the power of `sign`, where that is much better known than either; else None.

    The relative variance of x y^s is v_xx/x^2 + 2 s v_xy/(x y) + s^2 v_yy/y^2, with v the covariance, to first order.
    A value of zero has no relative uncertainty.
    """
    known = free.by_name
    if not known[one] or not known[two]:
        return None
    at = [free.place_of[one], free.place_of[two]]
    relative_covariance = free.covariance(at) / np.outer([known[one], known[two]], [known[one], known[two]])
    direction = np.array([1.0, sign])
    # the terms cancel where the pair is determined, and rounding can leave less than zero
    relative = float(np.sqrt(max(direction @ relative_covariance @ direction, 0.0)))
    if not relative < STABLE * np.sqrt(min(relative_covariance[0, 0], relative_covariance[1, 1])):
        return None
    value = known[one] * known[two] ** sign
    return Combination(f"{one}{mark}{two}", value, abs(value) * relative)


class _Read(dict[str, float]):
    """Values by name that remember which were asked for: a combination is made of few of very many values.

    A name without a value of its own has that of the group.
    """

    def __init__(self, values: Mapping[str, float], group: str) -> None:
        super().__init__(values)
        self.group = group
        self.read: set[str] = set()

    def __getitem__(self, name: str) -> float:
        known = name if name in self else f"{name}{self.group}"
        self.read.add(known)
        return super().__getitem__(known)


def _of_groups(name: str, of: object, solution: Solution, free: Free) -> Iterator[tuple[str, Combination]]:
    """A declared combination, or one for each group (`[R]`) in which each of its parts has a value."""
    values = {**solution.values, **free.by_name}
    groups = dict.fromkeys(f"[{known.partition('[')[2]}" for known in values if "[" in known)
    for group in ("", *groups):
        try:
            found = _declared(name, of, _Read(values, group), free)
        except KeyError:  # a part has one value in each of other groups
            continue
        yield group, found
        if not group:
            return


def _declared(name: str, of: object, values: _Read, free: Free) -> Combination:
    """A combination that the model declares as a function of the values by name, by the law of propagation.

    Infinite uncertainty where a value takes part that the data do not determine. KeyError for a name without a value.
    """
    assert callable(of)
    value = float(of(values))
    places, slopes = [], []
    for parameter in sorted(values.read & free.by_name.keys(), key=free.place_of.__getitem__):
        step = DIFFERENCE * max(abs(values[parameter]), DIFFERENCE)
        ahead, behind = (_Read({**values, parameter: values[parameter] + s}, values.group) for s in (step, -step))
        slope = (float(of(ahead)) - float(of(behind))) / (2 * step)
        if slope:  # an infinite variance of a value that takes no part must not come in
            places.append(free.place_of[parameter])
            slopes.append(slope)
    variance = np.array(slopes) @ free.covariance(places) @ np.array(slopes) if places else 0.0
    spread = float(np.sqrt(variance)) if np.isfinite(variance) else np.inf
    return Combination(f"{name}{values.group}", value, spread)


def _surest_part(name: str, free: Free, group: str) -> float:
    """Least relative uncertainty of the values that a combination's name names, infinite where they are held."""
    parts = (known for word in _words(name) for known in (word, f"{word}{group}"))
    at = [free.place_of[known] for known in dict.fromkeys(parts) if known in free.place_of]
    relative = [np.sqrt(free.variance[k]) / abs(free.values[k]) for k in at if free.values[k]]
    return float(min(relative, default=np.inf))


def _words(name: str) -> list[str]:
    """The names of parameters in that of a combination such as `kdd/(pi gamma)`."""
    return [
        w for w in itertools.chain(*(part.split("/") for part in name.replace("(", " ").replace(")", " ").split())) if w
    ]
