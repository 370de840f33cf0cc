"""Which models of a catalogue are worth a full fit: a first look at all of them on few points.

A full fit of a model takes seconds, and its validation as long again. Most models of a catalogue miss a given scan by
far, and a fit of some hundred of its points by few searches shows that in a tenth of the time. Only the others are then
fitted and validated on the scan.

The first look is no proof: a model may be dropped that would have been found to predict best. On the 19 measured scans
beside the project it never dropped the best one (tests/real/test_answer.py).
"""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.projection import Projection

LOOKED_AT = 160  # points
LOOK = Projection()
SPREAD = 1.8  # times the least error: beyond it no model of the measured scans predicted best
FEWEST, MOST = 4, 12  # models that are fitted in full
SEED = 0


def spread_rows(count: int, wanted: int) -> npt.NDArray[np.intp]:
    """Places of at most `wanted` of `count` points, one from each of as many stretches of the file.

    So each incidence angle has its part, and the peak as many as it has of all points.
    """
    if count <= wanted:
        return np.arange(count)
    random = np.random.default_rng(SEED)
    return np.unique(((np.arange(wanted) + random.random(wanted)) * count / wanted).astype(np.intp))


def first_look(problem: Problem) -> float:
    """The root of E of a quick fit of few points, for the values that the model has: an error for each degree of
    freedom.

    Infinite where there are no more points than values, or where the fit has no finite error.
    """
    few = problem.part(spread_rows(len(problem.measured), LOOKED_AT))
    freedom = len(few.measured) - len(few.names)
    if freedom < 1:
        return math.inf
    cost = LOOK.glance(few) * len(few.measured) / freedom
    return math.sqrt(cost) if math.isfinite(cost) else math.inf


def worth_fitting(looks: Mapping[int, float]) -> list[int]:
    """Of the errors of a first look by place, the places of the models to fit in full, the least error first."""
    order = sorted(looks, key=lambda place: looks[place])
    if math.isinf(looks[order[-1]]):  # of too few points for some models, those that have enough
        order = [place for place in order if math.isfinite(looks[place])] or order
    near = [place for place in order if looks[place] <= SPREAD * looks[order[0]]]
    return near[:MOST] if len(near) > FEWEST else order[:FEWEST]
