"""The tangent plane of a residual at a vector of values: searches step along it, uncertainties are computed from it.

With J the derivative (points, values) of the residual r, the plane is spanned by the columns of J. Its singular value
decomposition J D = U S V' (D scales the columns to unit length) gives an orthonormal basis U, and D V / S, the change
of the values that moves the residual by each of its vectors. Then (J'J)^-1 = (D V / S)(D V / S)', without ever forming
J'J, whose condition is the square of that of J.
"""

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
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

    def leverage(self, points: int) -> Values:
        """Leverage (points,) of each of the first `points` rows: how much its own value pulls the fitted one, 0 to 1.

        It is the diagonal of U U'. Rows beyond are those of a penalty, which are no points.
        """
        out: Values = np.sum(self.basis[:points] ** 2, axis=1)
        return out
