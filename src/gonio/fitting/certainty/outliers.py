"""Points that do not belong: studentised residuals, and whether it is rather the model that does not.

A scan has its noise partly constant and partly in proportion to the value. How much of each is read from the residual,
so that neither a peak nor a tail looks wrong only because its noise is another's.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.optimize import nnls
from scipy.special import stdtrit

from gonio.fitting.certainty.covariance import ALONE, jacobian
from gonio.fitting.objective.blocks import Bulk, Linear
from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.bulk import SAMPLE, SEED
from gonio.fitting.search.descent import Tangent
from gonio.fitting.search.reweighting import scatter
from gonio.measured import dataset
from gonio.measured.distinct import combined, distinct_in_groups

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
        far = np.flatnonzero(self.beyond)
        order = far[np.argsort(-np.abs(self.studentised[far]), kind="stable")]
        some = self.points.isel(direction=order)
        g = dataset.geometry(some)
        mirror = g.z_i * g.z_r - g.x_i * g.x_r - g.y_i * g.y_r
        source = g.z_i * g.z_r + g.x_i * g.x_r + g.y_i * g.y_r
        near = math.cos(math.radians(NEAR))
        where = np.select([mirror > near, source > near, some["theta_r"].values >= GRAZING], [0, 1, 2], 3)
        found = {region: order[where == k] for k, region in enumerate(REGIONS)}
        return {region: at for region, at in found.items() if at.size}


def scrutinise(problem: Problem, vector: npt.ArrayLike) -> Scrutiny:
    """Residuals of the points as a robust fit near the values found sees them, so that no outlier hides others.

    Near means in the tangent plane: it costs one derivative, and what lies far off lies far off there too. Of very many
    points the robust fit and the noise are those of SAMPLE of them, and no point has a leverage worth its name.
    """
    points, vector = problem.points, np.asarray(vector, dtype=float)
    count, free = len(problem.measured), len(vector)
    if count < free + FEWEST:
        return Scrutiny(points, np.zeros(count), math.inf, math.nan, False)
    few = problem
    if problem.bulk:
        random = np.random.default_rng(SEED)
        few = problem.part(np.unique(((np.arange(SAMPLE) + random.random(SAMPLE)) * count / SAMPLE).astype(np.intp)))
    modelled = few.brdf(vector)
    left, slopes = few.difference(modelled), jacobian(few, vector)
    noise = _noise(left, slopes, _kinds(few, modelled))
    if np.median(np.abs(modelled - few.measured)) <= EXACT * np.median(np.abs(few.measured)):
        studentised = np.zeros(count)
    elif problem.bulk:
        studentised = _of_all(problem, problem.bulk, vector, noise)
    else:
        studentised = _studentised(left, slopes, noise)
    certainty = (len(left) - free) / 3  # degrees of freedom of the noise at the ends of its range, by simulation
    threshold = float(-stdtrit(certainty, CHANCE / 2 / count))
    agreement, certain = _agreement(points, studentised)
    return Scrutiny(points, studentised, threshold, agreement, certain > CERTAIN and agreement > MARKED)


class Noise(NamedTuple):
    """The scatter of residuals about a robust fit in the tangent plane.

    moved: the values of that fit less those found. amounts: how much of each of the `_kinds` of noise there is; least:
    what a variance is at least, over the sum of its kinds. size: of residuals over the root of that variance.
    leverage: of every point.
    """

    moved: Values
    amounts: Values
    least: float
    size: float
    kinds: "Kinds"
    leverage: Values

    def deviation(self, kinds: Values) -> Values:
        return np.sqrt(_variance(kinds, self.amounts, self.least))


def _noise(found: Values, slopes: Values, kinds: "Kinds") -> Noise:
    """A robust fit in the tangent plane, its weights those of Cauchy's loss."""
    left, free, trust = found, slopes.shape[1], np.ones_like(found)
    for _ in range(ROBUST_ROUNDS):
        amounts, least = _amounts(left, kinds.variances)
        deviation = np.sqrt(_variance(kinds.variances, amounts, least))
        root = np.sqrt(trust) / deviation
        plane = Tangent(root[:, None] * slopes)
        moved = plane.directions @ (plane.basis.T @ (root * found))
        left = found - slopes @ moved
        size = _spread(left / deviation, free)
        trust = LOSSES["cauchy"].weight(left / deviation / size)
    return Noise(moved, amounts, least, size, kinds, np.sum(plane.basis**2, axis=1))


def _studentised(found: Values, slopes: Values, noise: Noise) -> Values:
    """Residuals over their scatter, zero for a point that one value fits exactly, which tells nothing."""
    left, alone = found - slopes @ noise.moved, noise.leverage > ALONE
    scatter = noise.deviation(noise.kinds.variances) * np.sqrt(np.where(alone, 1.0, 1 - noise.leverage))
    out: Values = np.where(alone, 0.0, left / scatter / noise.size)
    return out


def _of_all(problem: Problem, points: Bulk, vector: Values, noise: Noise) -> Values:
    """The same of all points of a problem of very many, from the noise of some."""

    def studentised(linear: Linear) -> tuple[npt.NDArray[np.intp], Values]:
        rows, root = linear.sheet.rows, linear.sheet.root
        kinds = noise.kinds.at(root, linear.modelled, problem.measured[rows])
        left = linear.residual - noise.moved[linear.places] @ linear.slopes
        return rows, left / noise.deviation(kinds) / noise.size

    out = np.zeros(len(problem.measured))
    for found in points.each(vector, studentised):
        for rows, values in found:
            out[rows] = values
    return out


class Kinds(NamedTuple):
    """Variance of every residual (points, 2) by noise that is constant and by noise in proportion, of one size."""

    variances: Values
    top: float
    logarithmic: bool

    def at(self, root_weights: Values, modelled: Values, measured: Values) -> Values:
        """The same at other points."""
        modelled = np.maximum(modelled, 0.0)
        per_brdf = root_weights
        if self.logarithmic:
            per_brdf = per_brdf / np.maximum(modelled, EXACT * measured)
        out: Values = per_brdf[:, None] ** 2 * (modelled[:, None] / self.top) ** [0, 2]
        return out


def _kinds(problem: Problem, modelled: Values) -> Kinds:
    kinds = Kinds(np.empty(0), float(np.maximum(modelled, 0.0).max()) or 1.0, problem.logarithmic)
    return kinds._replace(variances=kinds.at(problem.root_weights, modelled, problem.measured))


def _amounts(residual: Values, kinds: Values) -> tuple[Values, float]:
    """How much of each kind of noise makes the residuals likeliest, and the least variance over the sum of its kinds.

    The likelihood is that of Student's t, by reweighting (lange1989): outliers do not move it far.
    """
    counted = kinds[:, 0] > 0  # a point without weight has no residual either
    squared, shares = residual[counted] ** 2, kinds[counted]
    both = shares.sum(axis=1)
    least = float(EXACT**2 * np.max(squared / both) + np.finfo(float).tiny)
    variance = np.maximum(both * np.median(squared / both), both * least)
    for _ in range(NOISE_ROUNDS):
        likely = (FREEDOM + 1) / (FREEDOM + squared / variance) * squared / variance
        amounts = nnls(shares / variance[:, None], likely)[0]
        variance = np.maximum(shares @ amounts, both * least)
    return amounts, least


def _variance(kinds: Values, amounts: Values, least: float) -> Values:
    """Variance of every residual up to a factor, one for a point without weight."""
    out, counted = np.ones(len(kinds)), kinds[:, 0] > 0
    shares = kinds[counted]
    out[counted] = np.maximum(shares @ amounts, shares.sum(axis=1) * least)
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
    sets = [points[name].values for name in dataset.sets(points)]
    group = combined(sets) if sets else np.zeros(len(azimuth), dtype=np.intp)
    curve = distinct_in_groups([points["theta_i"].values, azimuth % 180], group)
    some = np.flatnonzero(np.bincount(curve)[curve] > 1)  # a grid of other coordinates has few neighbours
    signed = np.where(azimuth[some] >= 180, 1.0, -1.0) * points["theta_r"].values[some]
    order = some[np.lexsort((signed, curve[some]))]
    first, second = order[:-1], order[1:]
    told = studentised != 0
    pairs = (curve[first] == curve[second]) & told[first] & told[second]
    if not pairs.any():
        return 0.0, 0.0
    same = np.sign(studentised[first[pairs]]) * np.sign(studentised[second[pairs]])
    return float(same.mean()), float(same.sum() / math.sqrt(same.size))
