"""What a design of readings is judged by: the information that they give, and what of it counts.

With a_j the derivative (values,) of a reading at direction j by the free values, over its standard uncertainty, n_j
readings there give the information (fedorov1972)

    M = M_0 + sum_j n_j a_j a_j',     C = M^-1,

with M_0 that of the readings that there are already. C is the covariance of the values in a fit that weighs readings by
their uncertainty, and as near as the model is linear over it. Two criteria are made small:

    variances     tr(L C L'), with L = diag(1/u_k) the sum of (C_kk / u_k^2) over the values k, u_k what is aimed at;
                  one row L = c' is the variance of a derived number, c its derivative by the values
    determinant   ln det C

A direction's sensitivity q_j is how much a criterion falls with n_j at first: |L C a_j|^2, or a_j' C a_j.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

# Of the information of all directions together: what makes the first few readings, which determine nothing, comparable.
RIDGE = 1e-10
GUARD = 0.02  # what an uncertainty counts that is not wanted, over one that is: 50 times the target weighs as much


@dataclass(frozen=True, eq=False)
class Question:
    """Which readings to choose, and for what.

    rows (directions, values): a_j of every direction that may be chosen. aims (k, values): L, or None for the
    determinant. prior (values, values): M_0, zero where nothing was measured.
    Raises ValueError where all directions together do not determine every value.
    """

    rows: Values
    aims: Values | None
    prior: Values

    def __post_init__(self) -> None:
        if not len(self.rows):
            raise ValueError("no direction is left to choose from: widen the ranges, or block less")
        if undetermined(self.rows, self.prior).any():
            raise ValueError(
                "the directions to choose from do not determine every value: hold one, or widen the ranges"
            )

    def information(self, counts: Values) -> Values:
        """M (values, values) for a number of readings at every direction (directions,), which need not be whole."""
        out: Values = self.prior + (self.rows * counts[:, None]).T @ self.rows
        return out

    def covariance(self, information: Values) -> Values:
        """C (values, values) of an information, finite for one that does not determine every value."""
        everything = np.diag(self.prior) + np.sum(self.rows**2, axis=0)
        length = np.sqrt(everything)
        scaled = information / np.outer(length, length) + RIDGE / len(self.rows) * np.eye(len(length))
        out: Values = np.linalg.inv(scaled) / np.outer(length, length)
        return out

    def value(self, covariance: Values) -> float:
        """The criterion of a covariance: the smaller the better."""
        if self.aims is None:
            return float(np.linalg.slogdet(covariance)[1])
        return float(np.sum((self.aims @ covariance) * self.aims))

    def sensitivities(self, covariance: Values) -> Values:
        """The q (directions,): how fast the criterion falls with readings of each direction."""
        moved = self.rows @ covariance
        if self.aims is None:
            return np.asarray(np.sum(moved * self.rows, axis=1))
        return np.asarray(np.sum((moved @ self.aims.T) ** 2, axis=1))

    def gains(self, covariance: Values) -> Values:
        """By how much the criterion falls with one more reading of each direction (directions,).

        By the formula of Sherman and Morrison, C - (C a)(C a)'/(1 + a'C a) is the covariance with that reading.
        """
        moved = self.rows @ covariance
        own = np.sum(moved * self.rows, axis=1)
        if self.aims is None:
            return np.log1p(own)
        return np.asarray(np.sum((moved @ self.aims.T) ** 2, axis=1) / (1 + own))


def undetermined(rows: Values, prior: Values) -> npt.NDArray[np.bool_]:
    """Which values (values,) all directions (directions, values) together and the prior do not determine."""
    information = prior + rows.T @ rows
    length = np.sqrt(np.diag(information))
    without = ~(length > 0)
    length[without] = 1.0
    sizes, vectors = np.linalg.eigh(information / np.outer(length, length))
    blind = sizes <= 1e-13 * sizes.max(initial=0.0)
    out: npt.NDArray[np.bool_] = without | (np.abs(vectors[:, blind]).max(axis=1, initial=0.0) > 1e-3)
    return out


def aims_of(names: list[str], wanted: list[str], targets: Values, guard: float = GUARD) -> Values:
    """L (values, values): wanted values count by their targets u_k (values,), all others by the guard of theirs.

    Without a guard the best design abandons values that are not wanted, and the model may no longer be determined.
    """
    counted = np.array([1.0 if name in wanted else guard for name in names])
    return np.diag(counted / targets)
