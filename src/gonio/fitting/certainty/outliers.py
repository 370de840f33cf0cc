"""Points that do not belong: studentised residuals, and whether it is rather the model that does not.

A studentised residual is a residual over its own standard deviation, sqrt(v_k (1 - h_k)), with the variance v_k that
the noise of the scan gives (`noise`) and the leverage h_k. A point is far off where that is beyond what a clean scan of
normal noise shows once in a hundred scans.

Where neighbours err to the same side more often than by chance, the model lacks something, and a point that is far off
may be no outlier. Nothing is removed from a fit here; such points are only reported.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.noise import EXACT, Kinds, Noise, estimated
from gonio.fitting.objective.blocks import BlockedProblem, LinearSet, in_blocks
from gonio.fitting.objective.cells.linear import of_points
from gonio.fitting.objective.problem import Problem
from gonio.fitting.quantiles import student_t
from gonio.fitting.search.bulk import SAMPLE, SEED
from gonio.measured import dataset
from gonio.measured.distinct import combined, distinct_in_groups

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.intp]

CHANCE = 0.01  # that a clean scan of normal noise shows any point beyond the threshold (Bonferroni's bound)
FEWEST = 30  # points more than values: below, the scatter is too uncertain to call a point wrong
CERTAIN = 3.0  # standard deviations by which neighbours agree in sign more often than by chance
MARKED = 0.2  # the same as a correlation: below it a misfit is small against the noise
NEAR, GRAZING = 10.0, 75.0  # deg: from the specular direction or the beam; theta_r from which a direction grazes
REGIONS = ("the specular direction", "the incident beam", "grazing", "elsewhere")


@dataclass(frozen=True)
class Scrutiny:
    """What the residuals of a fit say about its points.

    points: those in use, as a flat scan. studentised (points,): residual of each over its own scatter. threshold:
    beyond it a point does not belong, infinite where there are too few points to tell. agreement: correlation of the
    signs of neighbours. systematic: whether that is large and no chance: points beyond the threshold are then likely
    to be misfit of the model, not outliers.
    """

    points: xr.Dataset
    studentised: Values
    threshold: float
    agreement: float
    systematic: bool

    @property
    def beyond(self) -> Mask:
        """Which points are beyond the threshold."""
        return np.abs(self.studentised) > self.threshold

    @property
    def regions(self) -> dict[str, Places]:
        """The points beyond the threshold by where they lie, one of REGIONS, the farthest off first.

        By angles between directions in space: out of plane theta_r and theta_i alone do not say what is near the
        specular direction. A point near two regions counts for the first.
        """
        far = np.flatnonzero(self.beyond)
        order = far[np.argsort(-np.abs(self.studentised[far]), kind="stable")]
        points = self.points.isel(direction=order)
        g = dataset.geometry(points)
        # cosines of the angle to the specular direction (-x_i, -y_i, z_i), and to the incident beam
        mirror = g.z_i * g.z_r - g.x_i * g.x_r - g.y_i * g.y_r
        source = g.z_i * g.z_r + g.x_i * g.x_r + g.y_i * g.y_r
        near = math.cos(math.radians(NEAR))
        where = np.select([mirror > near, source > near, points["theta_r"].values >= GRAZING], [0, 1, 2], 3)
        places = {region: order[where == k] for k, region in enumerate(REGIONS)}
        return {region: at for region, at in places.items() if at.size}


def scrutinise(problem: Problem, vector: npt.ArrayLike) -> Scrutiny:
    """Residuals of the points as a robust fit near the fitted values (n,) sees them, so that no outlier hides others.

    Near means in the tangent plane: it costs one derivative, and what lies far off lies far off there too. Of very many
    points the robust fit and the noise are those of SAMPLE of them, and leverages are so small that they are left out.

    Too few points, fewer than FEWEST more than values, are not judged: nothing is beyond an infinite threshold. Nor
    are residuals that are mostly the rounding of the file (EXACT): their studentised residuals are zero.
    """
    points, vector = problem.points, np.asarray(vector, dtype=float)
    count, free = len(problem.measured), len(vector)
    if count < free + FEWEST:
        return Scrutiny(points, np.zeros(count), math.inf, math.nan, False)
    blocked = in_blocks(problem)
    few = _sample(problem) if blocked else problem
    modelled = few.brdf(vector)
    residual, slopes = few.difference(modelled), of_points(few, vector)
    noise = estimated(residual, free, slopes, Kinds.of(few, modelled))
    if np.median(np.abs(modelled - few.measured)) <= EXACT * np.median(np.abs(few.measured)):
        studentised = np.zeros(count)
    elif blocked:
        studentised = _of_all(problem, blocked, vector, noise)
    else:
        studentised = noise.studentised(residual, slopes)
    certainty = (len(residual) - free) / 3  # degrees of freedom of the noise at the ends of its range, by simulation
    threshold = float(-student_t(certainty, CHANCE / 2 / count))  # two-sided, and of so many points (Bonferroni)
    agreement, certain = _agreement(points, studentised)
    return Scrutiny(points, studentised, threshold, agreement, certain > CERTAIN and agreement > MARKED)


def _sample(problem: Problem) -> Problem:
    """The problem of SAMPLE of its points, one from each of as many stretches of the file.

    All have the same chance, other than in the sample of a search: the noise is to be that of the points as they come.
    """
    random, count = np.random.default_rng(SEED), len(problem.measured)
    return problem.part(np.unique(((np.arange(SAMPLE) + random.random(SAMPLE)) * count / SAMPLE).astype(np.intp)))


def _of_all(problem: Problem, points: BlockedProblem, vector: Values, noise: Noise) -> Values:
    """Studentised residuals of all points of a problem of very many, from the noise of a sample, a block at a time."""

    def studentised(linear: LinearSet) -> tuple[Places, Values]:
        rows, root = linear.points.rows, linear.points.root
        kinds = noise.kinds.at(root, linear.modelled, problem.measured[rows])
        remaining = linear.residual - noise.moved[linear.places] @ linear.slopes
        return rows, remaining / noise.deviation(kinds) / noise.size

    out = np.zeros(len(problem.measured))
    for sets in points.each(vector, studentised):
        for rows, values in sets:
            out[rows] = values
    return out


def _agreement(points: xr.Dataset, studentised: Values) -> tuple[float, float]:
    """Correlation of the signs of neighbours along the curves of a scan, and that in standard deviations of chance.

    Signs alone, so that no outlier counts for more than another point. A curve is one half-plane and its continuation
    beyond the normal, at one incidence angle of one set. By chance the product of two signs is +1 or -1 with equal
    probability, and the mean of n products has the standard deviation 1/sqrt(n). Both are zero where no two points are
    neighbours.
    """
    azimuth = points["phi"].values % 360
    sets = [points[name].values for name in dataset.sets(points)]
    group = combined(sets) if sets else np.zeros(len(azimuth), dtype=np.intp)
    curve = distinct_in_groups([points["theta_i"].values, azimuth % 180], group)
    rows = np.flatnonzero(np.bincount(curve)[curve] > 1)  # a grid of other coordinates has few neighbours
    signed = np.where(azimuth[rows] >= 180, 1.0, -1.0) * points["theta_r"].values[rows]
    order = rows[np.lexsort((signed, curve[rows]))]
    first, second = order[:-1], order[1:]
    signs = np.sign(studentised)
    pairs = (curve[first] == curve[second]) & (signs[first] != 0) & (signs[second] != 0)
    if not pairs.any():
        return 0.0, 0.0
    same = signs[first[pairs]] * signs[second[pairs]]
    return float(same.mean()), float(same.sum() / math.sqrt(same.size))
