"""How a fit scatters when its scan is drawn again from itself: intervals without a formula for the covariance.

With fitted values f_k, residuals r_k and leverages h_k, a draw of the wild bootstrap (kind `residual`) fits

    f_k + s_k r_k / (1 - h_k),   s_k = +1 or -1 by chance,

in place of the measured values: Rademacher signs on the residuals that HC3 takes (wu1986, davidson2008). Directions
stay, and so does how the noise differs between points. A draw of pairs (freedman1981) takes as many points as there
are, with replacement.

Intervals are percentiles of the draws, or bias-corrected and accelerated ones, BCa (efron1987). Each draw is a local
search from the solution, and looks for no other minimum. Both kinds take errors of different points as independent.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.covariance import left_out, robust, tangent
from gonio.fitting.objective.cells.linear import Plane
from gonio.fitting.objective.problem import Problem
from gonio.fitting.quantiles import normal
from gonio.fitting.search.refit import refit
from gonio.fitting.search.solver import Progress, silent
from gonio.fitting.solution import Solution

Values = npt.NDArray[np.float64]
# factor and offset of every residual, and how often it counts
Resampled = tuple[Values | float, Values | float, Values]

KINDS = {
    "residual": "wild: every residual keeps its place and its size, and gets a random sign (davidson2008)",
    "pairs": "points drawn with replacement (freedman1981)",
}
FEWEST = 20  # draws below which no percentile means anything


def bootstrap(
    problem: Problem,
    solution: Solution,
    kind: str = "residual",
    draws: int = 500,
    seed: int = 0,
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit resampled scans, each by a local search from the solution.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    solution : Solution
        Its fit.
    kind : str
        `residual` keeps the directions and gives each residual of a fit without its point a random sign; so it holds
        for noise that depends on the signal (wu1986, davidson2008). `pairs` draws points, directions with them. Both
        keep the weights of the points.
    draws : int
        How many scans.
    seed : int
        Of the random numbers.
    progress : callable
        Called with the part of the work that is done, 0 to 1.

    Returns
    -------
    xarray.Dataset
        `value` (parameter, draw), NaN where a draw left out every point of a group, where a search ran out of steps,
        and for values that the scan itself does not determine; `estimate`, the solution; and `acceleration`, which the
        BCa interval takes (efron1987).

    Raises
    ------
    ValueError
        The kind is not known, there are too few draws, or the loss is robust.

    """
    refuse_unfit(problem, kind, draws)
    problem = solution.as_fitted(problem)
    vector = solution.vector(problem.names)
    plane, residual = tangent(problem, vector), problem.difference(problem.brdf(vector))
    determined = np.isfinite(np.diag(robust(plane, residual)))
    random = np.random.default_rng(seed)
    resampled = _wild(plane, residual, random) if kind == "residual" else _pairs(len(residual), random)
    values = np.empty((len(vector), draws))
    for draw, (factor, offset, counts) in zip(range(draws), resampled, strict=False):  # resampled never ends
        end = refit(problem, vector, factors=factor, offset=offset)
        values[:, draw] = np.where(determined & _seen(problem, counts) & (not end.exhausted), end.point, np.nan)
        progress((draw + 1) / draws)
    # signs are as likely either way, so that a wild draw has no skewness to accelerate
    skewness = _acceleration(plane, residual) if kind == "pairs" else np.zeros(len(vector))
    return xr.Dataset(
        {
            "value": (("parameter", "draw"), values),
            "estimate": ("parameter", vector),
            "acceleration": ("parameter", skewness),
        },
        coords={"parameter": list(problem.names)},
        attrs={"kind": kind, "seed": seed, "draws": draws},
    )


def refuse_unfit(problem: Problem, kind: str, draws: int) -> None:
    """ValueError for a kind that is none of KINDS, for too few draws, or for a robust loss."""
    if problem.loss != "squared":
        raise ValueError(f"the bootstrap fits squared errors, and this is a {problem.loss} loss: leave out one of them")
    if kind not in KINDS:
        raise ValueError(f"no bootstrap {kind!r}: choose one of {', '.join(KINDS)}")
    if draws < FEWEST:
        raise ValueError(f"{draws} bootstrap draws say little about an interval: take at least {FEWEST}, better 500")


def percentile(drawn: xr.Dataset, level: float = 0.95) -> dict[str, tuple[float, float]]:
    """Interval of every value between percentiles of its draws; NaN where any draw leaves the value undetermined."""
    tails = np.full((drawn.sizes["parameter"], 2), [0.5 - level / 2, 0.5 + level / 2])
    return _quantiles(drawn, tails)


def bca(drawn: xr.Dataset, level: float = 0.95) -> dict[str, tuple[float, float]]:
    """The same, corrected for bias and for a spread that changes with the value (efron1987).

    With z0 the normal quantile of the part of draws below the estimate, and a the acceleration, the percentile of a
    normal quantile z becomes Phi(z0 + (z0 + z)/(1 - a (z0 + z))).
    NaN also where draws pile up on the estimate, because that is at a bound: how many lie below it then says nothing
    about bias.
    """
    from scipy.special import ndtr

    values, estimate = drawn["value"].values, drawn["estimate"].values[:, None]
    piled = np.any(values == estimate, axis=1)
    bias = normal(np.where(piled, np.nan, np.mean(values < estimate, axis=1)))[:, None]
    shifted = bias + normal(np.array([0.5 - level / 2, 0.5 + level / 2]))
    with np.errstate(invalid="ignore"):  # all draws on one side leave no interval
        tails = ndtr(bias + shifted / (1 - drawn["acceleration"].values[:, None] * shifted))
    return _quantiles(drawn, tails)


def standard_deviations(drawn: xr.Dataset) -> dict[str, float]:
    """Standard deviation of every value over its draws."""
    spread = drawn["value"].std("draw", ddof=1, skipna=False)
    return dict(zip(drawn["parameter"].values.tolist(), spread.values.tolist(), strict=True))


def kept(solution: Solution, drawn: xr.Dataset) -> Solution:
    """The solution with its draws as a variable `bootstrap` (parameter, draw), to be saved with it."""
    draws = drawn["value"].reindex(parameter=solution.dataset["parameter"].values).drop_vars("parameter")
    return replace(solution, dataset=solution.dataset.assign(bootstrap=(draws.dims, draws.values, dict(drawn.attrs))))


def _wild(plane: Plane, residual: Values, random: np.random.Generator) -> Iterator[Resampled]:
    """Rademacher signs on the residuals that HC3 takes, about the fitted values.

    The offset takes the residual itself away: at the solution the drawn error is then the whole residual.
    """
    error, _ = left_out(plane, residual)
    once = np.ones_like(residual)
    while True:
        yield 1.0, error * random.choice([-1.0, 1.0], size=len(residual)) - residual, once


def _pairs(points: int, random: np.random.Generator) -> Iterator[Resampled]:
    """Points drawn with replacement: one that comes n times has its squared error n times."""
    while True:
        counts = np.bincount(random.integers(points, size=points), minlength=points)
        yield np.sqrt(counts), 0.0, counts.astype(float)


def _seen(problem: Problem, counts: Values) -> npt.NDArray[np.bool_]:
    """Which values have a point of their group among those drawn."""
    return np.concatenate([np.bincount(e.group, weights=counts, minlength=e.size) > 0 for e in problem.free])


def _acceleration(plane: Plane, residual: Values) -> Values:
    """The acceleration (n,) of efron1987: the skewness over six of the influence of every point on every value.

    The influence is the change of the values with each residual, to first order, in place of a jackknife of fits.
    """
    skewness = np.zeros(len(plane.blind))
    for places, moved in plane.moves(len(residual)):
        influence = -moved * residual  # by a measured value, which the residual subtracts
        squares = np.sum(influence**2, axis=1)
        skewness[places] = np.sum(influence**3, axis=1) / np.where(squares > 0, 6 * squares**1.5, 1.0)
    return skewness


def _quantiles(drawn: xr.Dataset, tails: Values) -> dict[str, tuple[float, float]]:
    """Quantiles beyond which another draw lies as often as the tails say, however few the draws.

    Weibull's plotting position, k/(n + 1) for the k-th of n draws, does that; NumPy's default leaves more beyond.
    """
    rows = zip(drawn["parameter"].values.tolist(), drawn["value"].values, tails, strict=True)
    out = {}
    for name, values, ends in rows:
        known = bool(np.isfinite(values).all() and np.isfinite(ends).all())
        low, high = np.quantile(values, ends, method="weibull").tolist() if known else (np.nan, np.nan)
        out[name] = (low, high)
    return out
