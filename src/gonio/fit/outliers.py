"""Points that do not belong: studentised residuals, and whether it is rather the model that does not.

A scan has its noise partly constant and partly in proportion to the value. How much of each is read from the residual,
so that neither a peak nor a tail looks wrong only because its noise is another's.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.optimize import nnls
from scipy.special import stdtrit

from gonio.fit.covariance import jacobian
from gonio.fit.descent import Tangent
from gonio.fit.loss import LOSSES
from gonio.fit.problem import Problem
from gonio.fit.reweighting import scatter
from gonio.measured import dataset

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

CHANCE = 0.01  # that a clean scan of normal noise shows any point beyond the threshold (Bonferroni's bound)
FEWEST = 30  # points more than values: below, a scatter is too uncertain to call a point wrong
EXACT = 1e-5  # of a value: the least noise that a file of six digits can tell
FREEDOM = 4.0  # degrees of freedom of the t distribution that stands for noise with outliers
ROBUST_ROUNDS = 20  # fits in the tangent plane
NOISE_ROUNDS = 20  # reweightings; each takes a third of the way at least
TRIMMED = 2.5  # standard deviations: where the far tails begin
TRIMMED_VARIANCE = 0.9113  # of what the trimming leaves of a standard normal number
CERTAIN = 3.0  # standard deviations by which neighbours agree in sign more often than by chance
MARKED = 0.2  # the same as a correlation: below it a misfit is small against the noise
NEAR, GRAZING = 10.0, 75.0  # deg: from the specular direction or the beam; theta_r from which a direction grazes
REGIONS = ("the specular direction", "the incident beam", "grazing", "elsewhere")


@dataclass(frozen=True)
class Scrutiny:
    """What the residuals of a fit say about its points.

    studentised: residual of every point in use over its own scatter. threshold: beyond it a point does not belong,
    infinite where there are too few points to tell. agreement: correlation of the signs of neighbours. systematic:
    whether that is large and no chance, so that what is beyond is misfit before it is outlier.
    """

    points: xr.Dataset
    studentised: Values
    threshold: float
    agreement: float
    systematic: bool

    @property
    def beyond(self) -> Mask:
        return np.abs(self.studentised) > self.threshold

    @property
    def regions(self) -> dict[str, npt.NDArray[np.intp]]:
        """The points beyond the threshold by where they lie, the farthest off first."""
        g = dataset.geometry(self.points)
        mirror = g.z_i * g.z_r - g.x_i * g.x_r - g.y_i * g.y_r
        source = g.z_i * g.z_r + g.x_i * g.x_r + g.y_i * g.y_r
        near = math.cos(math.radians(NEAR))
        where = np.select([mirror > near, source > near, self.points["theta_r"].values >= GRAZING], [0, 1, 2], 3)
        order = np.argsort(-np.abs(self.studentised), kind="stable")
        rows = order[self.beyond[order]]
        found = {region: rows[where[rows] == k] for k, region in enumerate(REGIONS)}
        return {region: at for region, at in found.items() if at.size}


def scrutinise(problem: Problem, vector: npt.ArrayLike) -> Scrutiny:
    """Residuals of the points as a robust fit near the values found sees them, so that no outlier hides others.

    Near means in the tangent plane: it costs one derivative, and what lies far off lies far off there too.
    """
    points, vector = problem.points, np.asarray(vector, dtype=float)
    left, free = problem.difference(problem.brdf(vector)), len(vector)
    if len(left) < free + FEWEST:
        return Scrutiny(points, np.zeros_like(left), math.inf, math.nan, False)
    studentised = _studentised(left, jacobian(problem, vector), _kinds(problem, vector))
    if np.median(np.abs(problem.brdf(vector) - problem.measured)) <= EXACT * np.median(np.abs(problem.measured)):
        studentised = np.zeros_like(left)
    certainty = (len(left) - free) / 3  # degrees of freedom of the noise at the ends of its range, by simulation
    threshold = float(-stdtrit(certainty, CHANCE / 2 / len(left)))
    agreement, certain = _agreement(points, studentised)
    return Scrutiny(points, studentised, threshold, agreement, certain > CERTAIN and agreement > MARKED)


def _studentised(found: Values, slopes: Values, kinds: Values) -> Values:
    """Residuals over their scatter after a robust fit in the tangent plane, its weights those of Cauchy's loss."""
    left, free, trust = found, slopes.shape[1], np.ones_like(found)
    for _ in range(ROBUST_ROUNDS):
        deviation = np.sqrt(_variance(left, kinds))
        root = np.sqrt(trust) / deviation
        plane = Tangent(root[:, None] * slopes)
        left = found - slopes @ (plane.directions @ (plane.basis.T @ (root * found)))
        size = _spread(left / deviation, free)
        trust = LOSSES["cauchy"].weight(left / deviation / size)
    leverage = np.sum(plane.basis**2, axis=1)
    alone = leverage > 1 - 1e-9  # a point that one value fits exactly tells nothing
    out: Values = np.where(alone, 0.0, left / deviation / size / np.sqrt(np.where(alone, 1.0, 1 - leverage)))
    return out


def _kinds(problem: Problem, vector: Values) -> Values:
    """Variance of every residual (points, 2) by noise that is constant and by noise in proportion, of one size."""
    modelled = np.maximum(problem.brdf(vector), 0.0)
    per_brdf = problem.root_weights
    if problem.logarithmic:
        per_brdf = per_brdf / np.maximum(modelled, EXACT * problem.measured)
    return per_brdf[:, None] ** 2 * (modelled[:, None] / (float(modelled.max()) or 1.0)) ** [0, 2]


def _variance(residual: Values, kinds: Values) -> Values:
    """Variance of every residual up to a factor, from how much of each kind of noise makes them likeliest.

    The likelihood is that of Student's t, by reweighting (lange1989): outliers do not move it far.
    """
    counted = kinds[:, 0] > 0  # a point without weight has no residual either
    squared, shares = residual[counted] ** 2, kinds[counted]
    both = shares.sum(axis=1)
    least = both * (EXACT**2 * np.max(squared / both) + np.finfo(float).tiny)
    variance = np.maximum(both * np.median(squared / both), least)
    for _ in range(NOISE_ROUNDS):
        likely = (FREEDOM + 1) / (FREEDOM + squared / variance) * squared / variance
        variance = np.maximum(shares @ nnls(shares / variance[:, None], likely)[0], least)
    out = np.ones_like(residual)
    out[counted] = variance
    return out


def _spread(left: Values, free: int) -> float:
    """Standard deviation of a normal residual from all but its far tails: less uncertain than its median size."""
    size = scatter(left, free)
    for _ in range(NOISE_ROUNDS):
        kept = left[np.abs(left) < TRIMMED * size]
        size = float(np.sqrt(np.sum(kept**2) / max(len(kept) - free, 1) / TRIMMED_VARIANCE))
    return size or 1.0


def _agreement(points: xr.Dataset, studentised: Values) -> tuple[float, float]:
    """Correlation of the signs of neighbours along the curves of a scan, and that in standard deviations of chance."""
    azimuth = points["phi"].values % 360
    side = np.where(azimuth >= 180, 1.0, -1.0)
    columns = [points["theta_i"].values, azimuth % 180, *(points[s].values for s in dataset.sets(points))]
    curve = np.unique(
        np.column_stack([np.unique(c, return_inverse=True)[1] for c in columns]), axis=0, return_inverse=True
    )[1].ravel()
    order = np.lexsort((side * points["theta_r"].values, curve))
    first, second = order[:-1], order[1:]
    told = studentised != 0
    pairs = (curve[first] == curve[second]) & told[first] & told[second]
    if not pairs.any():
        return 0.0, 0.0
    same = np.sign(studentised[first[pairs]]) * np.sign(studentised[second[pairs]])
    return float(same.mean()), float(same.sum() / math.sqrt(same.size))
