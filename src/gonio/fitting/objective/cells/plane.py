"""The tangent plane of a residual with very many values, eliminated cell by cell (golub1980).

With B the columns of a cell's own values and C those of the joint ones, each cell has B = U S V' by itself. What is
left of the joint columns, T = C - U U'C, is orthogonal to B. The T of all cells below each other, with the rows of the
penalty, are a problem K of the joint values alone, K = U_K S_K V_K'. With G = V_K / S_K and own moves D = V / S, a
change e of the residual changes

    the joint values   by   g = G G' (sum over cells of T'e),
    a cell's own       by   D U'e - M g,   M = D U'C,

which is what `objective.tangent` does with one decomposition of the whole matrix. Columns are scaled to unit length.

With a damping a, as a trust region asks for, the least squares has the rows sqrt(a) I too: D = V S / (S^2 + a), and
T = C - U (1 - sqrt(a / (S^2 + a))) U'C.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.slopes import Slopes
from gonio.fitting.objective.cells.structure import Bucket
from gonio.fitting.objective.tangent import DETERMINED, INVOLVED

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

TOGETHER = 2**22  # numbers of a matrix (points, joint values) that are held at once
SEVERAL = 64  # values whose moves by all points are computed at once


class _Part(NamedTuple):
    """The elimination in the k cells of a bucket.

    basis (k, r, q): U. moves (k, m, q): D. rest (k, r, t): T. follows (k, m, t): M. keeps (k, q): by how much less
    than wholly U is taken out of the residual where there is damping.
    """

    bucket: Bucket
    basis: Values
    moves: Values
    rest: Values
    follows: Values
    keeps: Values


# A bucket, its joint columns C (k, r, t), and the decomposition U, S, V' of its own ones.
_Decomposed = tuple[Bucket, Values, Values, Values, Values]


class Influence(NamedTuple):
    """How each point of a bucket moves its cell's own values (k, m, r), and, times `CellPlane.gain`, the joint ones.

    follows (k, m, t): by how much the own values go back where the joint ones move.
    """

    bucket: Bucket
    own: Values
    joint: Values
    follows: Values


class CellPlane:
    """The tangent plane of a derivative in cells, with the methods of `objective.tangent.Tangent`.

    free (n,): which values may move, all unless given. damping: see above. `blind` (n,): values that the data do not
    determine; those that may not move are not among them.
    """

    def __init__(self, slopes: Slopes, free: Mask | None = None, damping: float = 0.0) -> None:
        self.slopes = slopes
        free = np.ones(slopes.cells.size, dtype=bool) if free is None else free
        lengths = np.sqrt(slopes.squared_lengths)
        self._units = np.where(free & (lengths > 0), 1.0, 0.0) / np.where(lengths > 0, lengths, 1.0)
        parts = [self._decomposed(bucket) for bucket in slopes.cells.buckets]
        largest = max(float(s.max(initial=0.0)) for *_, s, _ in parts)
        self._parts = [self._eliminated(*part, largest, damping) for part in parts]
        self._joint = slopes.cells.joint
        self._factor, unseen = self._solved(largest, damping)
        self.blind: Mask = free & ((lengths == 0) | self._involved(parts, largest, unseen))

    @property
    def gain(self) -> Values:
        """G G' (g, g): how the joint values follow the sums of T'e."""
        return self._factor @ self._factor.T

    def moved(self, residual: Values, refined: bool = True) -> Values:
        """The change (n,) of the values that a change of the residual (points + m,) makes: its least-squares solution.

        refined: whether to solve once more for what the first solution leaves (bjorck1987's corrected semi-normal
        equations), which brings the digits that G G' costs.
        """
        change = self._moved(residual)
        return change + self._moved(residual - self.slopes @ change) if refined else change

    def offset(self, residual: Values) -> float:
        """The part of the residual's length that lies in the plane, zero at an exact minimum (bates1981)."""
        length = float(np.linalg.norm(residual))
        along, sums = 0.0, self._sums(residual)
        for part in self._parts:
            along += float(np.sum(_products(part.basis, part.bucket.gathered(self._points(residual))) ** 2))
        along += float(np.sum((self._factor.T @ sums) ** 2))
        return along**0.5 / length if length > 0 else 0.0

    def effective_values(self, points: int) -> float:
        """The sum of the leverages: the number of values, or less with a penalty."""
        return float(np.sum(self.leverage(points)))

    def leverage(self, points: int) -> Values:
        """Leverage (points,) of each point, 0 to 1: how much its own value pulls the fitted one."""
        out = np.zeros(points)
        for part in self._parts:
            squared = np.sum(part.basis**2, axis=-1)
            for some in self._slices(part.bucket):
                joint = np.matmul(part.rest[some], self._factor[part.bucket.joint[some]])
                squared[some] += np.sum(joint**2, axis=-1)
            part.bucket.scatter(squared, out)
        return out

    def unit_variances(self) -> Values:
        """The diagonal (n,) of (J'J)^-1: the variances of the values where each residual has the variance one."""
        gain, out = self.gain, np.zeros(len(self._units))
        out[self._joint] = np.diag(gain)
        for part in self._parts:
            joint = part.bucket.joint
            among = gain[joint[:, :, None], joint[:, None, :]]
            through = np.einsum("kmt,ktu,kmu->km", part.follows, among, part.follows)
            out[part.bucket.own] = np.sum(part.moves**2, axis=-1) + through
        return out * self._units**2

    def covariance(self, error: Values, slope: Values | None = None) -> Values:
        """Covariance (n, n) of the values, for the standard deviation (points,) of every residual.

        slope (points,): by how much less than for squared errors a loss pulls back a residual that grows.
        """
        from scipy.sparse import csr_matrix

        gain, influences = self.influences(slope)
        n, g = len(self._units), len(self._joint)
        out, middle = np.zeros((n, n)), np.zeros((g, g))
        follows, shared = csr_matrix((n, g)), csr_matrix((n, g))
        for bucket, own, joint, back in influences:
            squared = bucket.gathered(error) ** 2
            weighted = own * squared[:, None, :]
            out[bucket.own[:, :, None], bucket.own[:, None, :]] = weighted @ own.transpose(0, 2, 1)
            _add(middle, bucket.joint, joint.transpose(0, 2, 1) @ (joint * squared[:, :, None]))
            follows += _sparse(bucket, back, (n, g))
            shared += _sparse(bucket, weighted @ joint, (n, g))
        if g:
            of_joint = gain @ middle @ gain
            half = follows @ (of_joint / 2)
            half -= shared @ gain
            out += np.hstack([half, follows.toarray()]) @ np.hstack([follows.toarray(), half]).T
            out[:, self._joint] = across = shared @ gain - follows @ of_joint
            out[self._joint] = across.T
            out[np.ix_(self._joint, self._joint)] = of_joint
        out *= self._units
        out *= self._units[:, None]
        return out

    def moves(self, points: int, slope: Values | None = None) -> Iterator[tuple[Places, Values]]:
        """The places of some values at a time, and how far a unit error of each point moves them (some, points).

        Together they are a matrix (values, points), which is nowhere held at once.
        """
        gain, influences = self.influences(slope)
        g = len(self._joint)
        of_joint = np.zeros((g, points))
        for bucket, _, joint, _ in influences:
            places = np.broadcast_to(bucket.joint[:, None, :], joint.shape)[bucket.real]
            np.add.at(of_joint, (places, bucket.rows[bucket.real][:, None]), joint[bucket.real])
        of_joint = gain @ of_joint
        for at in range(0, g, SEVERAL):
            some = self._joint[at : at + SEVERAL]
            yield some, of_joint[at : at + SEVERAL] * self._units[some, None]
        for bucket, own, _, back in influences:
            for cell in range(len(bucket.own)):
                out = -back[cell] @ of_joint[bucket.joint[cell]] if g else np.zeros((own.shape[1], points))
                real = bucket.real[cell]
                out[:, bucket.rows[cell][real]] += own[cell][:, real]
                yield bucket.own[cell], out * self._units[bucket.own[cell], None]

    def influences(self, slope: Values | None = None) -> tuple[Values, list[Influence]]:
        """The gain (g, g) of the joint values, and how points move the values in each bucket, in scaled units.

        With a slope, of the normal equations J'S J with S its diagonal matrix: N = U'S U of each cell and X = U'S T are
        eliminated once more.
        """
        if slope is None:
            direct = [part.moves @ part.basis.transpose(0, 2, 1) for part in self._parts]
            pairs = zip(self._parts, direct, strict=True)
            return self.gain, [Influence(part.bucket, own, part.rest, part.follows) for part, own in pairs]
        corner = (self.slopes.penalty * self._units)[:, self._joint]
        bread, out = corner.T @ corner, []
        for part in self._parts:
            weights = part.bucket.gathered(slope)[:, :, None]
            basis, rest = part.basis.transpose(0, 2, 1), part.rest.transpose(0, 2, 1)
            inverse = np.linalg.pinv(basis @ (weights * part.basis), hermitian=True)
            across = inverse @ (basis @ (weights * part.rest))
            _add(bread, part.bucket.joint, rest @ (weights * (part.rest - part.basis @ across)))
            own, joint = part.moves @ inverse @ basis, part.rest - part.basis @ across
            out.append(Influence(part.bucket, own, joint, part.follows + part.moves @ across))
        inner = np.linalg.pinv(self._factor.T @ bread @ self._factor, hermitian=True)
        return self._factor @ inner @ self._factor.T, out

    def _decomposed(self, bucket: Bucket) -> _Decomposed:
        k, r = bucket.rows.shape
        blocks = np.zeros((k, r, bucket.own.shape[1] + bucket.joint.shape[1]))
        at = (np.arange(k)[:, None], np.arange(r))
        for slopes, places, column in zip(self.slopes.at_points, self.slopes.cells.places, bucket.column, strict=True):
            blocks[(*at, column)] = bucket.gathered(slopes * self._units[places])
        own, joint = np.split(blocks, [bucket.own.shape[1]], axis=-1)
        u, s, vt = np.linalg.svd(own, full_matrices=False)
        return bucket, joint, u, s, vt

    def _eliminated(
        self, bucket: Bucket, joint: Values, u: Values, s: Values, vt: Values, largest: float, damping: float
    ) -> _Part:
        determined = np.ones(s.shape, dtype=bool) if damping else s > DETERMINED * largest
        moves = np.where(determined, s / np.where(determined, s**2 + damping, 1.0), 0.0)
        keeps = np.where(determined, 1 - np.sqrt(damping / np.where(determined, s**2 + damping, 1.0)), 0.0)
        basis, along = u * determined[:, None, :], vt.transpose(0, 2, 1) * moves[:, None, :]
        shared = basis.transpose(0, 2, 1) @ joint
        return _Part(bucket, basis, along, joint - basis @ (keeps[:, :, None] * shared), along @ shared, keeps)

    def _solved(self, largest: float, damping: float) -> tuple[Values, Values]:
        """G (g, rank) of the joint values, and the directions (g, ..) of theirs that the data do not determine."""
        g = len(self._joint)
        if not g:
            return np.zeros((0, 0)), np.zeros((0, 0))
        stacked = [(self.slopes.penalty * self._units)[:, self._joint], damping**0.5 * np.eye(g) if damping else None]
        rows = np.concatenate([some for some in stacked if some is not None])
        for part in self._parts:
            triangles = np.asarray(np.linalg.qr(part.rest, mode="r"))
            for some in self._slices(part.bucket):
                k, r, _ = triangles[some].shape
                wide = np.zeros((k, r, g))
                at = (np.arange(k)[:, None, None], np.arange(r)[:, None], part.bucket.joint[some][:, None, :])
                wide[at] = triangles[some]
                rows = np.concatenate([rows, wide.reshape(-1, g)])
                rows = np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) > 4 * g else rows
        _, s, vt = np.linalg.svd(rows, full_matrices=len(rows) < g)
        s = np.concatenate([s, np.zeros(g - len(s))])
        determined = s > DETERMINED * max(largest, float(s.max()))
        return vt[determined].T / s[determined], vt[~determined].T

    def _involved(self, parts: list[_Decomposed], largest: float, unseen: Values) -> Mask:
        """Values (n,) that take part in a direction that is not determined."""
        out = np.zeros(len(self._units))
        out[self._joint] = np.abs(unseen).max(axis=1, initial=0.0)
        for (bucket, _, _, s, vt), part in zip(parts, self._parts, strict=True):
            undetermined = np.abs(vt) * (s <= DETERMINED * largest)[:, :, None]
            through = np.abs(part.follows @ unseen[bucket.joint]).max(axis=-1, initial=0.0) if unseen.size else 0.0
            out[bucket.own] = np.maximum(undetermined.max(axis=1, initial=0.0), through)
        involved: Mask = out > INVOLVED
        return involved

    def _points(self, residual: Values) -> Values:
        return residual[: self.slopes.cells.points]

    def _sums(self, residual: Values) -> Values:
        """The sum over cells and penalty of T' times a residual (points + m,), one for each joint value (g,)."""
        corner = (self.slopes.penalty * self._units)[:, self._joint]
        out: Values = corner.T @ residual[self.slopes.cells.points :]
        for part in self._parts:
            of_points = part.bucket.gathered(self._points(residual))
            left = of_points - _applied(part.basis, part.keeps * _products(part.basis, of_points))
            np.add.at(out, part.bucket.joint, _products(part.rest, left))
        return out

    def _moved(self, residual: Values) -> Values:
        out = np.zeros(len(self._units))
        out[self._joint] = joint = self._factor @ (self._factor.T @ self._sums(residual))
        for part in self._parts:
            along = _products(part.basis, part.bucket.gathered(self._points(residual)))
            back = _applied(part.follows, joint[part.bucket.joint])
            out[part.bucket.own] = _applied(part.moves, along) - back
        return out * self._units

    def _slices(self, bucket: Bucket) -> Iterator[slice]:
        """So many cells at a time as a matrix of their points by all joint values may have."""
        size = max(TOGETHER // max(bucket.rows.shape[1] * len(self._joint), 1), 1)
        return (slice(at, at + size) for at in range(0, len(bucket.rows), size))


def _products(matrices: Values, vectors: Values) -> Values:
    """The transpose of each matrix (k, r, q) times its vector (k, r)."""
    return np.asarray(np.einsum("krq,kr->kq", matrices, vectors))


def _applied(matrices: Values, vectors: Values) -> Values:
    """Each matrix (k, r, q) times its vector (k, q)."""
    return np.asarray(np.einsum("krq,kq->kr", matrices, vectors))


def _add(total: Values, places: Places, squares: Values) -> None:
    """Add the matrix (t, t) of every cell to the places (k, t) of a total (g, g)."""
    np.add.at(total, (places[:, :, None], places[:, None, :]), squares)


def _sparse(bucket: Bucket, blocks: Values, form: tuple[int, int]) -> "csr_matrix":
    """Blocks (k, m, t) at the own and the joint values of their cells, as a sparse matrix (n, g)."""
    from scipy.sparse import csr_matrix

    rows = np.broadcast_to(bucket.own[:, :, None], blocks.shape)
    columns = np.broadcast_to(bucket.joint[:, None, :], blocks.shape)
    return csr_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=form)
