r"""A Gaussian process of the residuals of a fit (rasmussen2006, chapters 2 and 5), by exact linear algebra.

The residual lg m - lg f at a place x is the sum of four parts, and K is their covariance:

    K(x, x') = a^2 M(l) + b^2 M(2 l) sum_k p_k(x) p_k(x') + d^2 [same curve] M(l') + c^2 delta

with Matern's function M of order 5/2 of the distance in `coordinates` over the lengths l. The first part is smooth. The
second resembles what models miss of public materials, with their residuals p_k. It is local, because few
materials show false correlations between places far apart. The third belongs to one curve of one incidence angle: what
was wrong in its measurement, which another curve or the exchanged directions do not show. The last is noise. A
prediction is the first two, so it is reciprocal.

The standard deviations a, b, d and c are those of the largest likelihood, with a weak prior that keeps each
near the size of the residual, and with bounds: without them a narrow feature that no length fits makes a large.

Of many residuals several processes are learned, each from some of them, and their predictions are averaged (bagging,
breiman1996): no such sum of parts is quite true, and the mean of several predicts better than one that knows all.
"""

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

# Of the coordinates. These and the numbers below were chosen on the 19 shared scans alone: docs/completion.md.
LENGTHS = np.array([0.75, 1.0, 0.3])
OF_MATERIALS = 2 * LENGTHS
OF_CURVES = np.array([0.5, 0.6, 0.4])
FIRST = np.array([1.0, 1.5, 0.7, 2.0])  # a, b, d and c in units of the residual's size: the first values and bounds
WIDTHS = np.array([1.5, 1.5, 1.5, 2.0])  # of the weak prior of their logarithms
LOWEST = 6.0  # below the first, in logarithms
LEAST = 0.002  # lg of a value: no measurement is better than half a per cent
TOGETHER = 2_000  # directions that are predicted at once: what is known of each fits into a cache
MOST = 250  # residuals that a process learns from
SEVERAL = 3  # processes, where there are more: each learns from so many at even steps


@dataclass(frozen=True)
class Where:
    """Places: coordinates (n, 3), the set and the curve of each (n,), and the materials' residuals there (n, k)."""

    coordinates: Values
    sets: Places
    curves: Places
    materials: Values

    def part(self, rows: Places) -> "Where":
        """Some of them."""
        return Where(self.coordinates[rows], self.sets[rows], self.curves[rows], self.materials[rows])

    def pieces(self) -> list["Where"]:
        """All of them in parts that fit into memory."""
        count = len(self.sets)
        return [self.part(rows) for rows in np.array_split(np.arange(count), max(1, -(-count // TOGETHER)))]


@dataclass(frozen=True)
class Process:
    """What was learned from residuals (n,) at known places. scales: a, b, d and c; b is 0 without materials."""

    known: Where
    residual: Values
    scales: Values

    @classmethod
    def learned(cls, known: Where, residual: Values, size: float) -> "Process":
        """The process of largest likelihood. size: the standard deviation of all residuals of the scan."""
        from scipy.optimize import minimize

        parts = [*_shared(known, known), _matern(known, known, OF_CURVES) * _alike(known.curves, known.curves)]
        # Each part has the size 1 on average over the known places, so that the same bounds fit all.
        means = np.array([*(max(float(np.mean(np.diag(part))), np.finfo(float).tiny) for part in parts), 1.0])
        first = np.log(FIRST * size)
        first[1] = first[1] if known.materials.shape[1] else np.log(LEAST)  # without materials the part is zero
        scaled = [part / mean for part, mean in zip(parts, means, strict=False)]
        unlikely = functools.partial(_unlikelihood, parts=scaled, residual=residual, first=first)
        bounds = [(value - LOWEST, value) for value in first]
        best = minimize(unlikely, first, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 40}).x
        scales = np.exp(best) / np.sqrt(means)
        scales[1] *= bool(known.materials.shape[1])
        scales[3] = np.hypot(scales[3], LEAST)
        return cls(known, residual, scales)

    @property
    def noise(self) -> float:
        """Standard deviation of lg of a measured value about the surface's own."""
        return float(np.hypot(*self.scales[2:]))

    @functools.cached_property
    def _factor(self) -> tuple[Values, bool]:
        from scipy.linalg import cho_factor

        a, b, d, c = self.scales
        smooth, similar = _shared(self.known, self.known)
        curves = _matern(self.known, self.known, OF_CURVES) * _alike(self.known.curves, self.known.curves)
        matrix = a**2 * smooth + b**2 * similar + d**2 * curves
        matrix.flat[:: len(self.residual) + 1] += c**2
        factor: tuple[Values, bool] = cho_factor(matrix, lower=True, check_finite=False)
        return factor

    @functools.cached_property
    def _weights(self) -> Values:
        from scipy.linalg import cho_solve

        return np.asarray(cho_solve(self._factor, self.residual, check_finite=False))

    def at(self, where: Where) -> tuple[Values, Values, Values]:
        """Lg of the surface over the fit (n,), its standard deviation, and that of nothing learned; without noise."""
        mean, deviation, before = np.concatenate([self._at(part) for part in where.pieces()], axis=1)
        return mean, deviation, before

    def mean_at(self, where: Where) -> Values:
        """The first of these (n,) alone, which takes a fraction of the time."""
        found = np.zeros(len(where.sets))
        for of_set in np.unique(where.sets):  # another set's residuals say nothing here
            rows, own = np.flatnonzero(where.sets == of_set), np.flatnonzero(self.known.sets == of_set)
            known = self.known.part(own)
            means = [self._across(part, known) @ self._weights[own] for part in where.part(rows).pieces()]
            found[rows] = np.concatenate(means)
        return found

    def _across(self, where: Where, known: Where) -> Values:
        """The covariance of places with some that are known (n, known)."""
        a, b, _, _ = self.scales
        smooth, similar = _shared(where, known)
        found: Values = a**2 * smooth + b**2 * similar
        return found

    def _at(self, where: Where) -> Values:
        """All three (3, n) for directions that fit into memory together."""
        from scipy.linalg import cho_solve

        a, b, _, _ = self.scales
        across = self._across(where, self.known)
        mean = across @ self._weights
        before = a**2 + b**2 * np.sum(where.materials**2, axis=1)
        known = np.sum(across * cho_solve(self._factor, across.T, check_finite=False).T, axis=1)
        return np.stack([mean, np.sqrt(np.maximum(before - known, 0.0)), np.sqrt(before)])


@dataclass(frozen=True)
class Several:
    """The mean of processes that are learned from different residuals of one scan."""

    members: tuple[Process, ...]

    @classmethod
    def learned(cls, where: Where, residual: Values) -> "Several":
        """One process of all residuals, or SEVERAL of MOST each."""
        count, size = len(residual), max(float(np.std(residual)), LEAST)
        if count <= MOST:
            return cls((Process.learned(where, residual, size),))
        steps = np.arange(MOST)
        each = [np.unique(((steps + (k + 0.5) / SEVERAL) * count / MOST).astype(np.intp)) for k in range(SEVERAL)]
        return cls(tuple(Process.learned(where.part(rows), residual[rows], size) for rows in each))

    @property
    def noise(self) -> float:
        """As of a Process: the root mean square over the members."""
        return float(np.sqrt(np.mean([member.noise**2 for member in self.members])))

    def at(self, where: Where) -> tuple[Values, Values, Values]:
        """As of a Process: the mean, and the root mean squares of both standard deviations."""
        means, deviations, before = (
            np.stack(parts) for parts in zip(*(m.at(where) for m in self.members), strict=True)
        )
        return means.mean(axis=0), _rms(deviations), _rms(before)

    def mean_at(self, where: Where) -> Values:
        """As of a Process: the mean."""
        return np.mean([member.mean_at(where) for member in self.members], axis=0)


def _rms(several: Values) -> Values:
    return np.asarray(np.sqrt(np.mean(several**2, axis=0)))


def _unlikelihood(scales: Values, parts: list[Values], residual: Values, first: Values) -> tuple[float, Values]:
    """The negative logarithm of likelihood and weak prior for logarithms of a, b, d and c, and its derivative."""
    from scipy.linalg.lapack import dpotrf, dpotri

    squares = np.exp(2 * scales)
    matrix = sum(square * part for square, part in zip(squares, parts, strict=False))
    matrix = np.asarray(matrix)
    matrix.flat[:: len(residual) + 1] += squares[-1] + LEAST**2
    factor, failed = dpotrf(matrix, lower=1)
    if failed:  # by rounding alone, where noise is next to nothing: worse than any other
        return 1e10, np.zeros_like(scales)
    half = np.tril(dpotri(factor, lower=1)[0])
    inverse = half + np.tril(half, -1).T
    solved = inverse @ residual
    away = (scales - first) / WIDTHS
    value = 0.5 * residual @ solved + np.log(np.diag(factor)).sum() + 0.5 * away @ away
    slopes = [
        square * (np.sum(inverse * part) - solved @ part @ solved) for square, part in zip(squares, parts, strict=False)
    ]
    slopes.append(squares[-1] * (np.trace(inverse) - solved @ solved))
    return float(value), np.array(slopes) + away / WIDTHS


def _matern(one: Where, other: Where, lengths: Values) -> Values:
    """Matern's function of order 5/2 between places of the same set."""
    scaled = [where.coordinates / lengths for where in (one, other)]
    squares = sum((scaled[0][:, None, k] - scaled[1][None, :, k]) ** 2 for k in range(len(lengths)))
    far = np.sqrt(5 * squares)
    found: Values = (1 + far + far**2 / 3) * np.exp(-far) * _alike(one.sets, other.sets)
    return found


def _shared(one: Where, other: Where) -> tuple[Values, Values]:
    """The two parts that belong to the surface, over the squares of a and b."""
    similar: Values = (one.materials @ other.materials.T) * _matern(one, other, OF_MATERIALS)
    return _matern(one, other, LENGTHS), similar


def _alike(one: Places, other: Places) -> npt.NDArray[np.bool_]:
    return np.asarray(one[:, None] == other)
