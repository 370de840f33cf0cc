"""How sure numbers are that are made of fitted values: the BRDF at any directions, and whatever follows from it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.search.descent import derivative
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.instrument import Acceptance
from gonio.model import Model

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


def propagate(model: Model, solution: Solution, function: Callable[[Values], Values]) -> Propagated:
    """A function of all values of a solution, in its order, with what the law of propagation says of its results.

    Held values are taken as exact; a value at a bound counts as though the bound were not there.
    """
    stored = solution.dataset
    free = np.flatnonzero(~stored["held"].values)
    values = stored["value"].values

    def of_free(part: Values) -> Values:
        whole = values.copy()
        whole[free] = part
        return function(whole)

    lower, upper = _domain(model, solution)
    slopes = derivative(of_free, values[free], lower[free], upper[free], scale=1e-3)
    found = function(values)
    sizes = np.maximum(np.abs(values[free]), 1e-3)
    slopes = np.where(np.abs(slopes) * sizes > FELT * np.abs(found[:, None]), slopes, 0.0)
    covariance, shift = stored["covariance"].values[np.ix_(free, free)], stored["systematic_shift"].values[free]
    known, steady = np.isfinite(np.diag(covariance)), ~np.isinf(shift)
    variance = np.einsum("ma,ab,mb->m", slopes[:, known], covariance[np.ix_(known, known)], slopes[:, known])
    random = np.where(slopes[:, ~known].any(axis=1), np.inf, np.sqrt(np.maximum(variance, 0.0)))
    moved = np.where(slopes[:, ~steady].any(axis=1), np.inf, np.abs(slopes[:, steady] @ shift[steady]))
    return Propagated(found, random, moved)


def band(model: Model, solution: Solution, points: xr.Dataset) -> xr.Dataset:
    """The fitted BRDF at the directions of a flat scan, as a scan with `uncertainty` and `uncertainty_systematic`.

    As the instrument of the fit reads it, as `compare.predict` does.

    Raises ValueError where a direction belongs to no group of the fit.
    """
    places, acceptance = solution.places(points), Acceptance(solution.instrument, dataset.geometry(points))
    found = propagate(
        model, solution, lambda values: acceptance.brdf(model, {n: values[at] for n, at in places.items()})
    )
    columns = {"brdf": found.value, "uncertainty": found.uncertainty, "uncertainty_systematic": found.systematic}
    unit = {"units": str(solution.dataset.attrs["unit"])}
    return points[list(dataset.ANGLES)].assign({name: ("direction", v, unit) for name, v in columns.items()})


def _domain(model: Model, solution: Solution) -> tuple[Values, Values]:
    """Declared bounds of shape parameters, widened to hold the values; weights may be anything, which is linear."""
    names, values = solution.dataset["name"].values.tolist(), solution.dataset["value"].values
    lower = np.array([model.shape[n].lower if n in model.shape else -np.inf for n in names])
    upper = np.array([model.shape[n].upper if n in model.shape else np.inf for n in names])
    return np.minimum(lower, values), np.maximum(upper, values)
