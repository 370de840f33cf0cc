"""How sure numbers are that are made of fitted values: the BRDF at any directions, and whatever follows from it.

By the law of propagation of uncertainty: with G the derivative (m, n) of m numbers by the n free values, and C the
covariance of these, the numbers have the covariance G C G'. This takes the numbers as linear in the values over their
uncertainty; `bootstrap` and `profile` do not.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.differences import SMALLEST, derivative
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.causes import total
from gonio.measured.instrument import Acceptance

Values = npt.NDArray[np.float64]
# The change of a number where a value changes by its own size, over the number: below, the value takes no part in it,
# and the slope is an error of differences. Without that, one undetermined value could make every number infinite.
FELT = 1e-9


@dataclass(frozen=True)
class Propagated:
    """Numbers (m,), their standard uncertainty from random errors, and from systematic ones (NaN where not stated).

    Both are infinite where a value takes part that the data do not determine.
    """

    value: Values
    uncertainty: Values
    systematic: Values


def propagate(
    solution: Solution, function: Callable[[Values], Values], used: Iterable[int] | None = None
) -> Propagated:
    """A function of all values (n,) of a solution, in its order, with the uncertainty of its results (m,).

    used: places of the values that it depends on, where these are not all: only they are varied.

    Random errors are the root of the diagonal of G C G'. The shift s of the values by one cause moves the results by
    G s, with its signs, so that parts can cancel; of several causes the squares of these are added. Held values are
    taken as exact; a value at a bound counts as though the bound were not there.
    """
    stored = solution.dataset
    free = np.flatnonzero(~stored["held"].values)
    if used is not None:
        free = np.intersect1d(free, np.fromiter(used, dtype=np.intp))
    values = stored["value"].values

    def of_free(free_values: Values) -> Values:
        all_values = values.copy()
        all_values[free] = free_values
        return function(all_values)

    lower, upper = _domain(solution)
    slopes = derivative(of_free, values[free], lower[free], upper[free], scale=SMALLEST)
    results = function(values)
    sizes = np.maximum(np.abs(values[free]), SMALLEST)
    slopes = np.where(np.abs(slopes) * sizes > FELT * np.abs(results[:, None]), slopes, 0.0)
    covariance, shift = stored["covariance"].values[np.ix_(free, free)], stored["shift_by_cause"].values[:, free]
    # infinite values are set apart, since infinity times a slope of zero is no number; a shift of NaN makes all NaN
    known, steady = np.isfinite(np.diag(covariance)), ~np.isinf(shift).any(axis=0)
    variance = np.einsum("ma,ab,mb->m", slopes[:, known], covariance[np.ix_(known, known)], slopes[:, known])
    random = np.where(slopes[:, ~known].any(axis=1), np.inf, np.sqrt(np.maximum(variance, 0.0)))
    systematic = np.where(slopes[:, ~steady].any(axis=1), np.inf, total(shift[:, steady] @ slopes[:, steady].T))
    return Propagated(results, random, systematic)


def band(solution: Solution, points: xr.Dataset) -> xr.Dataset:
    """The fitted BRDF at given directions with its uncertainty.

    The uncertainty is that of the curve, not of a further measurement there, which has noise of its own.

    Parameters
    ----------
    solution : Solution
        The fit.
    points : xarray.Dataset
        The directions, a flat scan.

    Returns
    -------
    xarray.Dataset
        A scan: `brdf` in the unit of the fit, as the instrument of the fit reads it, with the standard `uncertainty`
        and `uncertainty_systematic`.

    Raises
    ------
    ValueError
        A direction belongs to no group of the fit.

    """
    places, acceptance = solution.places(points), Acceptance.of(solution.instrument, points, solution.model)
    at_points = propagate(
        solution,
        lambda values: acceptance.brdf(solution.model, {n: values[at] for n, at in places.items()}),
        np.unique(np.concatenate([np.ravel(place) for place in places.values()])),
    )
    columns = {
        "brdf": at_points.value,
        "uncertainty": at_points.uncertainty,
        "uncertainty_systematic": at_points.systematic,
    }
    unit = {"units": solution.unit}
    return points[list(dataset.ANGLES)].assign({name: ("direction", v, unit) for name, v in columns.items()})


def _domain(solution: Solution) -> tuple[Values, Values]:
    """Bounds (n,) within which the function is differentiated: those that the model declares for shape parameters.

    Outside them a term need not be defined. They are widened to hold the values, since a problem may have bounds of its
    own. Weights have none: the BRDF is linear in them, below zero too.
    """
    names, values, model = solution.dataset["name"].values.tolist(), solution.dataset["value"].values, solution.model
    lower = np.array([model.shape[n].lower if n in model.shape else -np.inf for n in names])
    upper = np.array([model.shape[n].upper if n in model.shape else np.inf for n in names])
    return np.minimum(lower, values), np.maximum(upper, values)
