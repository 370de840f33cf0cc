"""How sure numbers are that are made of fitted values: the BRDF at any directions, and whatever follows from it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.differences import SMALLEST, derivative
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.instrument import Acceptance

Values = npt.NDArray[np.float64]
FELT = 1e-9  # relative change of a number above which a value takes part in it


@dataclass(frozen=True)
class Propagated:
    """Numbers (m,), their standard uncertainty from random errors, and from systematic ones (NaN where not stated).

    Infinite where a value takes part that the data do not determine.
    """

    value: Values
    uncertainty: Values
    systematic: Values


def propagate(solution: Solution, function: Callable[[Values], Values]) -> Propagated:
    """A function of all values (n,) of a solution, in its order, with the uncertainty of its results (m,).

    By the law of propagation: with G the derivative (m, n) of the function and C the covariance, the results have the
    covariance G C G'. A systematic shift s of the values moves them by G s. Held values are taken as exact; a value at
    a bound counts as though the bound were not there.
    """
    stored = solution.dataset
    free = np.flatnonzero(~stored["held"].values)
    values = stored["value"].values

    def of_free(part: Values) -> Values:
        whole = values.copy()
        whole[free] = part
        return function(whole)

    lower, upper = _domain(solution)
    slopes = derivative(of_free, values[free], lower[free], upper[free], scale=SMALLEST)
    results = function(values)
    sizes = np.maximum(np.abs(values[free]), SMALLEST)
    slopes = np.where(np.abs(slopes) * sizes > FELT * np.abs(results[:, None]), slopes, 0.0)
    covariance, shift = stored["covariance"].values[np.ix_(free, free)], stored["systematic_shift"].values[free]
    known, steady = np.isfinite(np.diag(covariance)), ~np.isinf(shift)
    variance = np.einsum("ma,ab,mb->m", slopes[:, known], covariance[np.ix_(known, known)], slopes[:, known])
    random = np.where(slopes[:, ~known].any(axis=1), np.inf, np.sqrt(np.maximum(variance, 0.0)))
    moved = np.where(slopes[:, ~steady].any(axis=1), np.inf, np.abs(slopes[:, steady] @ shift[steady]))
    return Propagated(results, random, moved)


def band(solution: Solution, points: xr.Dataset) -> xr.Dataset:
    """The fitted BRDF at the directions of a flat scan, as a scan with `uncertainty` and `uncertainty_systematic`.

    As the instrument of the fit reads it, which is what `Solution.predict` gives.
    Raises ValueError where a direction belongs to no group of the fit.
    """
    places, acceptance = solution.places(points), Acceptance(solution.instrument, dataset.geometry(points))
    at_points = propagate(
        solution, lambda values: acceptance.brdf(solution.model, {n: values[at] for n, at in places.items()})
    )
    columns = {
        "brdf": at_points.value,
        "uncertainty": at_points.uncertainty,
        "uncertainty_systematic": at_points.systematic,
    }
    unit = {"units": solution.unit}
    return points[list(dataset.ANGLES)].assign({name: ("direction", v, unit) for name, v in columns.items()})


def _domain(solution: Solution) -> tuple[Values, Values]:
    """Declared bounds of shape parameters, widened to hold the values; weights may be anything, which is linear."""
    names, values, model = solution.dataset["name"].values.tolist(), solution.dataset["value"].values, solution.model
    lower = np.array([model.shape[n].lower if n in model.shape else -np.inf for n in names])
    upper = np.array([model.shape[n].upper if n in model.shape else np.inf for n in names])
    return np.minimum(lower, values), np.maximum(upper, values)
