"""Which models of a catalogue are worth a full fit: a first look at all of them on few points.

A full fit of a model takes seconds, and its validation as long again. Most models of a catalogue miss a given scan by
far, and a fit of some hundred of its points by few searches shows that in a tenth of the time. Only the others are then
fitted and validated on the scan.

The first look is no proof: a model may be dropped that would have been found to predict best. `compare` fits all.
"""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.projection import Projection
from gonio.measured import dataset
from gonio.measured.distinct import combined

LOOKED_AT = 160  # points
LOOK = Projection()
# Of the fits that are compared; those at the front are then searched to the end.
RACE = Projection(searches=2, max_steps=500)
SPREAD = 1.8  # times the least error: for the model that predicts best it was up to 1.7 on 21 measured sets
FIRST = 8  # models that are looked at before the others: those of most values, which come near to most scans
TWICE = 2.0  # times the error that is hopeless: so far above, other starts do not help
HOPE = 1.05  # times the least left-out error so far: beyond it a first look leaves no hope of a lower one
FEWEST, MOST = 4, 12  # models that are fitted in full
SEED = 0
OF_A_SET = 200  # points of each set that is taken of many


def spread_rows(count: int, wanted: int) -> npt.NDArray[np.intp]:
    """Places of at most `wanted` of `count` points, one from each of as many stretches of the file.

    So each incidence angle has its part, and the peak as many as it has of all points.
    """
    if count <= wanted:
        return np.arange(count)
    random = np.random.default_rng(SEED)
    return np.unique(((np.arange(wanted) + random.random(wanted)) * count / wanted).astype(np.intp))


def sample_rows(points: xr.Dataset, wanted: int) -> npt.NDArray[np.intp]:
    """Places of at most `wanted` points of a flat scan that stand for all while models are compared.

    Of many sets, such as wavelengths, some are taken, evenly, and of these the points: each set has weights of its own,
    which few points of every set would not determine.
    """
    count = points.sizes["direction"]
    if count <= wanted:
        return np.arange(count)
    names = dataset.sets(points)
    group = combined([points[name].values for name in names]) if names else np.zeros(count, dtype=np.intp)
    sets = int(group.max()) + 1
    chosen = np.unique(np.linspace(0, sets - 1, min(sets, max(wanted // OF_A_SET, 1))).round().astype(np.intp))
    rows = np.flatnonzero(np.isin(group, chosen))
    return rows[spread_rows(len(rows), wanted)]


def first_look(problem: Problem, least: float = math.inf) -> float:
    """The root of E of a quick fit of few points, over the degrees of freedom that the model's values leave.

    Infinite where there are no more points than values, or where the fit has no finite error. least: the error of the
    best model so far, which says when a model needs no closer look.
    """
    few = problem.part(spread_rows(len(problem.measured), LOOKED_AT))
    freedom = len(few.measured) - len(few.names)
    if freedom < 1:
        return math.inf
    cost = LOOK.glance(few, (TWICE * SPREAD * least) ** 2) * len(few.measured) / freedom
    return math.sqrt(cost) if math.isfinite(cost) else math.inf


def worth_fitting(looks: Mapping[int, float]) -> list[int]:
    """Of the errors of a first look by place, the places of the models to fit in full, the least error first."""
    order = sorted(looks, key=lambda place: looks[place])
    if math.isinf(looks[order[-1]]):  # of too few points for some models, those that have enough
        order = [place for place in order if math.isfinite(looks[place])] or order
    near = [place for place in order if looks[place] <= SPREAD * looks[order[0]]]
    return near[:MOST] if len(near) > FEWEST else order[:FEWEST]
