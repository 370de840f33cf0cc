"""The exact weights: bounded linear least squares."""

import numpy as np
import numpy.typing as npt
from scipy.linalg import qr, solve_triangular
from scipy.optimize import lsq_linear, nnls

Values = npt.NDArray[np.float64]


def bounded_least_squares(matrix: Values, target: Values, lower: Values, upper: Values) -> Values:
    """The x within bounds that minimises |matrix x - target|: the problem is convex, so this is the global optimum.

    The matrix is reduced by QR and its columns scaled to unit length; the bounds are looked at only when the free
    optimum leaves them. Columns that are zero, and directions that the data do not tell apart, get the shortest
    solution.
    """
    n = matrix.shape[1]
    both = np.empty((len(matrix), n + 1), order="F")  # one factorisation reduces the target with the matrix
    both[:, :n], both[:, n] = matrix, target
    reduced = qr(both, mode="raw", overwrite_a=True, check_finite=False)[1][:n]
    length = np.sqrt(np.einsum("ij,ij->j", reduced[:, :n], reduced[:, :n]))  # of the matrix's columns too
    length[length == 0] = 1.0
    r, projected = reduced[:, :n] / length, reduced[:, n]
    diagonal = np.abs(np.diag(r))
    if len(reduced) == n and n and diagonal.min() > 1e-12 * diagonal.max():
        scaled = solve_triangular(r, projected, check_finite=False)
    else:
        scaled = np.linalg.lstsq(r, projected, rcond=1e-12)[0]
    low, high = lower * length, upper * length
    if np.all(scaled >= low) and np.all(scaled <= high):
        return scaled / length
    if not low.any() and np.isinf(high).all():
        return nnls(r, projected)[0] / length
    return np.clip(lsq_linear(r, projected, (low, high), method="bvls", tol=1e-15).x / length, lower, upper)
