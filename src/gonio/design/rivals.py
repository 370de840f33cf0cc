"""Readings that tell rival models apart: T-optimal designs (atkinson1975).

With f_1 the BRDF of the model that is held for true and f_2 that of a rival at the values v that fit f_1 best over the
readings of the design, a reading at direction j tells them apart by

    psi_j = ((f_1j - f_2j(v)) / sd_j)^2.

The sum over n readings is the noncentrality of the test of fit of the rival. The rule of Wynn and Fedorov adds the
direction of the largest psi, fits the rival again, and so on. The mean of psi over the best design is bounded by its
largest value: where both agree, no design is better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.refit import refit

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

TELLING = 16.0  # noncentrality at which a test of one degree of freedom at 5 % misses the difference 2 times in 100


@dataclass(frozen=True, eq=False)
class Rival:
    """A model that may be the true one, ready to be fitted to what another model predicts at directions.

    problem: of the rival, to the truth f_1 at every direction, with weights 1/sd^2. start (values,): its fit there.
    """

    problem: Problem
    start: Values

    @classmethod
    def of(cls, problem: Problem, truth: Values, deviation: Values) -> "Rival":
        """A rival at the directions of a problem; truth and standard deviation of readings: (directions,).

        The options of the problem, such as held and grouped values, are those of the fit; its values are not.
        """
        data = problem.points.assign(brdf=("direction", truth, problem.points["brdf"].attrs))
        changed = replace(
            problem, data=data, weighting="uniform", noise_floor=0.0, loss="squared", point_weights=deviation**-2.0
        )
        return cls(changed, fit(changed).vector(changed.names))

    def squares(self, counts: Values, start: Values) -> tuple[Values, Values]:
        """The psi (directions,) of the rival's best fit to so many readings of each direction, and its values there."""
        values = refit(self.problem, start, factors=np.sqrt(counts)).point
        return np.asarray(self.problem.residual(values)[: len(counts)] ** 2), values


@dataclass(frozen=True, eq=False)
class Telling:
    """places: of the directions added, in order. counts (directions,): of all readings, those before included.

    noncentrality: of the rival that is hardest to tell apart, and `values` its values. largest: max psi of the end,
    above which no design's mean is.
    """

    places: Places
    counts: Values
    noncentrality: float
    values: Values
    largest: float

    @property
    def readings(self) -> float:
        """How many readings shared out like these are needed for a noncentrality of TELLING."""
        mean = self.noncentrality / self.counts.sum()
        return TELLING / mean if mean > 0 else np.inf


def told_apart(
    rivals: Sequence[Rival], points: int, before: Values, repeats: bool = False, allowed: Places | None = None
) -> Telling:
    """So many readings added, one after another, that tell the truth from the rival that is hardest to tell apart.

    before (directions,): how many readings there are of each direction already; not all zero. repeats: whether a
    direction may be added more than once. allowed: places of the directions that may be added; all unless given.
    """
    counts, places = before.astype(float), list[int]()
    values = [rival.start for rival in rivals]
    free = np.zeros(len(counts), dtype=bool)
    free[slice(None) if allowed is None else allowed] = True
    for _ in range(points + 1):
        found = [rival.squares(counts, start) for rival, start in zip(rivals, values, strict=True)]
        values = [vector for _, vector in found]
        hardest = int(np.argmin([counts @ psi for psi, _ in found]))
        psi = found[hardest][0]
        if len(places) == points:
            break
        best = int(np.argmax(np.where(free, psi, -np.inf)))
        counts[best] += 1
        free[best] = repeats
        places.append(best)
    return Telling(np.array(places, dtype=np.intp), counts, float(counts @ psi), values[hardest], float(psi.max()))
