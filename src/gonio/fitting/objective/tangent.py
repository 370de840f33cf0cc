"""The tangent plane of a residual at a vector of values: searches step along it, uncertainties are computed from it.

With J the derivative (points, values) of the residual r, the plane is spanned by the columns of J. Its singular value
decomposition J D = U S V' (D scales the columns to unit length) gives an orthonormal basis U, and D V / S, the change
of the values that moves the residual by each of its vectors. Then (J'J)^-1 = (D V / S)(D V / S)', without ever forming
J'J, whose condition is the square of that of J.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

DETERMINED = 1e-10  # of the largest singular value: smaller ones are errors of differences, and determine nothing
INVOLVED = 1e-6  # part of a value in a direction that is not determined, above which the value is not either
ALONE = 1 - 1e-9  # leverage of a point that some value fits exactly: such a point says nothing about its own error


class Tangent:
    """The tangent plane of a residual: an orthonormal basis, and how the values move along it.

    `directions` (values, rank) are the changes of the values that move the residual by the unit vectors `basis`
    (points, rank). `blind` (values,) marks the values that the data do not determine. Columns are scaled to unit length
    first, so that units do not matter.
    """

    def __init__(self, jacobian: Values) -> None:
        length = np.sqrt(np.sum(jacobian**2, axis=0))
        without_effect = ~(length > 0)  # the residual does not depend on these values here
        length[without_effect] = 1.0
        u, s, vt = np.linalg.svd(jacobian / length, full_matrices=False)
        determined = s > DETERMINED * s.max(initial=0.0)
        self.basis: Values = u[:, determined]
        self.directions: Values = vt[determined].T / s[determined] / length[:, None]
        self.blind: Mask = without_effect | (np.abs(vt[~determined]).max(axis=0, initial=0.0) > INVOLVED)

    def offset(self, residual: Values) -> float:
        """The part of the residual's length that lies in the plane, zero at an exact minimum (bates1981)."""
        length = float(np.linalg.norm(residual))
        return float(np.linalg.norm(self.basis.T @ residual)) / length if length > 0 else 0.0

    def moved(self, residual: Values) -> Values:
        """The change (values,) that a change of the residual (points,) makes: its least-squares solution."""
        out: Values = self.directions @ (self.basis[: len(residual)].T @ residual)
        return out

    def unit_variances(self) -> Values:
        """The diagonal (values,) of (J'J)^-1: the variances of the values where each residual has the variance one."""
        out: Values = np.sum(self.directions**2, axis=1)
        return out

    def covariance(self, error: Values, slope: Values | None = None) -> Values:
        """Covariance (values, values) for the standard deviation (points,) of every residual.

        slope (points,): by how much less than for squared errors a loss pulls back a residual that grows.
        """
        spread = self._inverse(len(error), slope) * error
        out: Values = spread @ spread.T
        return out

    def moves(self, points: int, slope: Values | None = None) -> Iterator[tuple[Places, Values]]:
        """The places of values, and how far a unit error of each point moves them (values, points)."""
        yield np.arange(len(self.directions)), self._inverse(points, slope)

    def _inverse(self, points: int, slope: Values | None) -> Values:
        """How the values follow the points (values, points): D U', or D (U'S U + P'P)^-1 U' with a slope S."""
        basis, penalty = self.basis[:points], self.basis[points:]
        if slope is None:
            return np.asarray(self.directions @ basis.T)
        bread = basis.T @ (slope[:, None] * basis) + penalty.T @ penalty
        return np.asarray(self.directions @ np.linalg.pinv(bread) @ basis.T)

    def effective_values(self, points: int) -> float:
        """The sum of the leverages of the first `points` rows: the number of values, or less with a penalty."""
        return float(np.sum(self.basis[:points] ** 2))

    def leverage(self, points: int) -> Values:
        """Leverage (points,) of each of the first `points` rows: how much its own value pulls the fitted one, 0 to 1.

        It is the diagonal of U U'. Rows beyond are those of a penalty, which are no points.
        """
        out: Values = np.sum(self.basis[:points] ** 2, axis=1)
        return out
