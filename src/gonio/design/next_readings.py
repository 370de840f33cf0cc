"""Where to measure next: the readings that make wanted values of a fit surest, with the proof of how good they are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.design.candidates import coarse
from gonio.design.continuous import continuous, distinct_bound, efficiency
from gonio.design.exact import chosen, greedy
from gonio.design.known import Known
from gonio.design.noise import Noise
from gonio.design.question import Question, aims_of, undetermined
from gonio.design.travel import Cost, in_order, not_worth_it
from gonio.fitting.solution import Solution

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

CHECKED = 0.2  # of all readings, old and new, that stand on a grid: what no model chose, and can contradict it


@dataclass(frozen=True, eq=False)
class Plan:
    """Readings to take next, and what they are expected to bring.

    directions: in the order of measuring, a flat scan without values. wanted: the values that they are chosen for. now,
    after, uniform: standard uncertainties by value, of the readings so far, with these, and with as many on a uniform
    grid instead; infinite where not determined. efficiency: the least that these are of the best design there can be.
    noise: that was taken. seconds: what they take. left_out: incidence angles that are not worth their time.
    """

    directions: xr.Dataset
    wanted: tuple[str, ...]
    now: Mapping[str, float]
    after: Mapping[str, float]
    uniform: Mapping[str, float]
    efficiency: float
    noise: Noise
    cost: Cost | None
    left_out: tuple[float, ...] = ()
    at_bound: tuple[str, ...] = ()
    systematic: Mapping[str, float] = field(default_factory=dict)

    @property
    def guarded(self) -> tuple[str, float] | None:
        """The value not wanted that fares worst against the uniform grid, and its ratio; None where all are wanted."""
        ratios = {n: self.after[n] / self.uniform[n] for n in self.after if n not in self.wanted}
        if not ratios:
            return None
        worst = max(ratios, key=ratios.__getitem__)
        return worst, ratios[worst]

    @property
    def seconds(self) -> float | None:
        """What they take, None without a cost."""
        return None if self.cost is None else self.cost.seconds(self.directions)


def next_readings(
    solution: Solution,
    directions: xr.Dataset,
    points: int,
    want: Sequence[str] = (),
    *,
    noise: Noise | None = None,
    cost: Cost | None = None,
    repeats: bool = False,
) -> Plan:
    """The readings among directions that make wanted values of a fit surest, beside those that were fitted.

    solution: a fit that holds its scan. directions: as `candidates.reachable` gives them. want: names of values; all of
    them where none is named. noise: of the readings; as the scan states it, or as the residuals show, unless given.
    cost: of their time; leaves out incidence angles that are not worth it. repeats: whether one direction may be
    chosen more than once.
    A fifth of all readings, those of the scan included, stand on a grid that no model chose. The uncertainties are
    those of a fit that weighs readings by this noise.
    Raises ValueError, with the remedy, for a fit that no readings can be designed for (`Known.of`), for names that it
    has not, and where the directions do not determine every value.
    """
    known = Known.of(solution)
    wanted = known.wanted(want or known.names)
    noise = noise or known.noise()
    measured = known.rows(solution.scan, noise)
    question = _question(known, wanted, known.rows(directions, noise), measured.T @ measured, points)
    grid = _check(len(measured), points, len(question.rows))

    def kept(some: Places) -> Places | None:
        return coarse(directions.isel(direction=some), grid) if grid else None

    def tried(some: Places) -> tuple[Places, float]:
        places = some[greedy(_part(question, some), points, kept(some), repeats)]
        return places, question.value(_with(question, places))

    left_out = not_worth_it(directions, tried, cost) if cost else []
    some = np.flatnonzero(~np.isin(directions["theta_i"].values, left_out))
    places = some[chosen(_part(question, some), points, kept(some), repeats)]
    bound = continuous(question, points).bound if repeats else distinct_bound(question, places, points)
    selected = directions.isel(direction=places)
    return Plan(
        selected.isel(direction=in_order(selected)),
        tuple(wanted),
        _spreads(known, question, question.prior),
        _spreads(known, question, question.information(_counts(question, places))),
        _spreads(known, question, question.information(_evenly(directions, points))),
        efficiency(question, bound, _with(question, places)),
        noise,
        cost,
        tuple(left_out),
        known.at_bound,
        _systematic(solution, wanted),
    )


def _question(known: Known, wanted: list[str], rows: Values, prior: Values, points: int) -> Question:
    """What the readings are judged by: targets are what readings spread evenly over all directions would give.

    Raises ValueError where the directions do not determine every value.
    """
    _refuse_undetermined(known.names, rows, prior)
    evenly = prior + points / len(rows) * rows.T @ rows
    length = np.sqrt(np.diag(evenly))
    targets = np.sqrt(np.diag(np.linalg.inv(evenly / np.outer(length, length)))) / length
    return Question(rows, aims_of(list(known.names), wanted, targets), prior)


def _refuse_undetermined(names: Sequence[str], rows: Values, prior: Values) -> None:
    if (blind := undetermined(rows, prior)).any():
        listed = ", ".join(name for name, is_blind in zip(names, blind, strict=True) if is_blind)
        raise ValueError(f"no reading within the ranges determines {listed}: hold one with --hold, or widen the ranges")


def _check(measured: int, points: int, directions: int) -> int:
    """How many of the new readings stand on a grid, so that with those of the scan a fifth of all do."""
    return max(min(int(np.ceil(CHECKED * (measured + points))) - measured, points, directions), 0)


def _part(question: Question, some: Places) -> Question:
    return Question(question.rows[some], question.aims, question.prior)


def _evenly(directions: xr.Dataset, points: int) -> Values:
    """How many of so many readings on a uniform grid each direction has (directions,)."""
    count = directions.sizes["direction"]
    if points >= count:
        return np.full(count, points / count)
    return np.bincount(coarse(directions, points), minlength=count).astype(float)


def _counts(question: Question, places: Places) -> Values:
    return np.bincount(places, minlength=len(question.rows)).astype(float)


def _with(question: Question, places: Places) -> Values:
    return question.covariance(question.information(_counts(question, places)))


def _spreads(known: Known, question: Question, information: Values) -> dict[str, float]:
    """Standard uncertainties by value of an information (values, values), infinite where it does not determine one."""
    blind = undetermined(np.zeros((0, len(information))), information)
    spread = np.sqrt(np.diag(question.covariance(information)))
    return dict(zip(known.names, np.where(blind, np.inf, spread).tolist(), strict=True))


def _systematic(solution: Solution, wanted: Sequence[str]) -> dict[str, float]:
    """What systematic errors of the scan leave of each wanted value, however many readings; empty if it states none."""
    if not solution.has_systematic:
        return {}
    stored = solution.dataset
    sizes = dict(
        zip(stored["parameter"].values.tolist(), stored["uncertainty_systematic"].values.tolist(), strict=True)
    )
    return {name: sizes[name] for name in wanted}
