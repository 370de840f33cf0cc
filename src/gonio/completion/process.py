r"""A Gaussian process of the residuals of a fit (rasmussen2006, chapters 2 and 5), by exact linear algebra.

The residual lg m - lg f is a sum of a smooth part, a part that resembles what models miss of public materials, and
noise:

    K(x, x') = a^2 M(|(x - x')/l|) + b^2 sum_k p_k(x) p_k(x') + c^2 delta

with Matern's function M of order 5/2, the lengths l of `coordinates`, and the residuals p_k of the materials. a, b and c
are those of the largest likelihood, with a weak prior that keeps each near the size of the residual.
"""

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

LENGTHS = (0.7, 0.8, 0.5)  # of the coordinates, chosen on the 19 shared scans: `make completed`
LEAST = 0.002  # lg of a value: no measurement is better than half a per cent
MOST = 600  # residuals that a process learns from; of more, as many are chosen evenly
WIDTH = 2.0  # of the weak prior, in logarithms of a, b, c about their first values


@dataclass(frozen=True)
class Where:
    """Places of a process: coordinates (n, 3), the set of each (n,), and the materials' residuals there (n, k)."""

    coordinates: Values
    sets: Places
    materials: Values

    def part(self, rows: Places) -> "Where":
        """Some of them."""
        return Where(self.coordinates[rows], self.sets[rows], self.materials[rows])


@dataclass(frozen=True)
class Process:
    """What was learned. scales: a, b and c as standard deviations of lg; 0 for b without materials."""

    known: Where
    residual: Values
    scales: tuple[float, float, float]

    @classmethod
    def learned(cls, where: Where, residual: Values) -> "Process":
        """The process of largest likelihood for residuals (n,) at some places."""
        rows = np.linspace(0, len(residual) - 1, min(len(residual), MOST)).round().astype(np.intp)
        where, residual = where.part(rows), residual[rows]
        smooth, similar = _smooth(where, where), _similar(where, where)
        size = max(float(np.std(residual)), LEAST)
        first = np.log([0.8 * size, 0.8 * size, 0.3 * size])
        with_materials = where.materials.shape[1] > 0

        def unlikelihood(scales: Values) -> float:
            a, b, c = np.exp(2 * scales)
            matrix = a * smooth + b * similar * with_materials
            matrix.flat[:: len(residual) + 1] += c + LEAST**2
            try:
                factor = cholesky(matrix, lower=True, check_finite=False)
            except np.linalg.LinAlgError:
                return 1e300
            white = solve_triangular(factor, residual, lower=True, check_finite=False)
            far = float(np.sum(((scales - first) / WIDTH) ** 2))
            return float(0.5 * white @ white + np.log(np.diag(factor)).sum() + 0.5 * far)

        best = minimize(unlikelihood, first, method="Nelder-Mead", options={"xatol": 0.03, "fatol": 0.05, "maxfev": 80}).x
        a, b, c = np.exp(best)
        return cls(where, residual, (float(a), float(b) if with_materials else 0.0, float(np.hypot(c, LEAST))))

    @functools.cached_property
    def _factor(self) -> tuple[Values, bool]:
        a, b, c = self.scales
        matrix = a**2 * _smooth(self.known, self.known) + b**2 * _similar(self.known, self.known)
        matrix.flat[:: len(self.residual) + 1] += c**2
        factor: tuple[Values, bool] = cho_factor(matrix, lower=True, check_finite=False)
        return factor

    def at(self, where: Where) -> tuple[Values, Values]:
        """Mean and standard deviation (n,) of lg of the surface over the fit, without noise, at other places."""
        a, b, _ = self.scales
        across = a**2 * _smooth(where, self.known) + b**2 * _similar(where, self.known)
        mean = across @ cho_solve(self._factor, self.residual, check_finite=False)
        before = a**2 + b**2 * np.sum(where.materials**2, axis=1)
        known = np.sum(across * cho_solve(self._factor, across.T, check_finite=False).T, axis=1)
        return mean, np.sqrt(np.maximum(before - known, 0.0))


def _smooth(one: Where, other: Where) -> Values:
    """Matern's function of order 5/2 between places of the same set."""
    scaled = [w.coordinates / LENGTHS for w in (one, other)]
    squares = sum((scaled[0][:, None, k] - scaled[1][None, :, k]) ** 2 for k in range(len(LENGTHS)))
    far = np.sqrt(5 * squares)
    found: Values = (1 + far + far**2 / 3) * np.exp(-far) * (one.sets[:, None] == other.sets)
    return found


def _similar(one: Where, other: Where) -> Values:
    found: Values = (one.materials @ other.materials.T) * (one.sets[:, None] == other.sets)
    return found
