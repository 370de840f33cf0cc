"""The exact weights: bounded linear least squares.

For one shape the residual is A x - b, with the weights x, a column of A for each, and the weighted measured values b.
With [A b] = Q R, the length of A x - b is that of R1 x - q plus a constant, with R1 the first n rows and columns of R,
and q the same rows of its last column. So the points appear once, in the factorisation, and bounds are then a matter
of n x n systems. The condition is that of A; that of normal equations A'A would be its square.

Where the optimum leaves the bounds it is found by NNLS (Lawson and Hanson), if weights have zero as their lower bound
and no upper one, and by BVLS (Stark and Parker) otherwise: active-set methods, both SciPy's.
"""

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
ALIKE = 1e-12  # of the largest diagonal element of R: below, a column is a combination of others but for rounding


def bounded_least_squares(matrix: Values, target: Values, lower: Values, upper: Values) -> Values:
    """The x within bounds that minimises |matrix x - target|: the problem is convex, so this is the global optimum.

    `matrix` (..., points, n) and `target` (..., points) may carry leading dimensions for several problems at once.
    The matrix is reduced by QR and its columns scaled to unit length; the bounds are looked at only when the free
    optimum leaves them. Columns that are zero, and combinations that the data do not determine, get the shortest
    solution.
    """
    n = matrix.shape[-1]
    both = np.concatenate([matrix, target[..., None]], axis=-1)  # one factorisation reduces the target with the matrix
    reduced = np.asarray(np.linalg.qr(both, mode="r"))[..., :n, :]
    length = np.sqrt(np.sum(reduced[..., :n] ** 2, axis=-2))  # of the matrix's columns too
    length[length == 0] = 1.0
    r, projected = reduced[..., :n] / length[..., None, :], reduced[..., n]
    scaled = _free(r, projected)
    low, high = lower * length, upper * length
    outside = ((scaled < low) | (scaled > high)).any(axis=-1)
    for place in map(tuple, np.argwhere(outside)):
        scaled[place] = _bounded(r[place], projected[place], low[place], high[place])
    return np.clip(scaled / length, lower, upper)  # a bound times a length and over it may round to beyond itself


def _free(r: Values, projected: Values) -> Values:
    """The optimum without bounds, for triangular matrices (..., rows, n).

    One call solves all that are well conditioned; a single one that is not, or fewer points than weights, and each is
    solved for itself, with the shortest solution.
    """
    *lead, rows, n = r.shape
    size = np.abs(np.diagonal(r, axis1=-2, axis2=-1))
    sound = (size.min(axis=-1, initial=np.inf) > ALIKE * size.max(axis=-1, initial=0.0)) & (rows == n)
    if sound.all():
        return np.asarray(np.linalg.solve(r, projected[..., None])[..., 0], dtype=float)
    solutions = np.empty((*lead, n))
    for place in np.ndindex(*lead):
        solutions[place] = np.linalg.lstsq(r[place], projected[place], rcond=ALIKE)[0]
    return solutions


def _bounded(r: Values, projected: Values, low: Values, high: Values) -> Values:
    """The optimum within bounds of one problem whose free optimum leaves them."""
    from scipy.optimize import lsq_linear, nnls  # late: half a second that who only looks does not need

    if not low.any() and np.isinf(high).all():
        return nnls(r, projected)[0]
    return lsq_linear(r, projected, (low, high), method="bvls", tol=1e-15).x
