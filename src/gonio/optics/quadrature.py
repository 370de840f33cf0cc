"""Fixed quadrature for the integrals that special functions would otherwise need: it traces in any array library."""

import functools
from collections.abc import Callable

import numpy as np

from gonio.arrays import Array, constants, is_traced_never, namespace


def unit_interval(count: int, like: Array) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on 0..1, in the array library, dtype and device of `like`."""
    nodes, weights = _gauss_legendre(count)
    return constants((nodes + 1) / 2, like), constants(weights / 2, like)


def once_each(of: Callable[..., Array]) -> Callable[..., Array]:
    """An integral that is computed once for arguments that are equal: the angles of a scan are few.

    Only NumPy can tell how many; other libraries compute every one. The arguments broadcast against each other.
    """

    @functools.wraps(of)
    def lookup(*given: Array) -> Array:
        if not is_traced_never(given[0]):
            return of(*given)
        xp = namespace(given[0])
        if given[0].ndim == 1 and all(array.shape[-1:] in ((), (1,)) for array in given[1:]):
            distinct, where = xp.unique_inverse(given[0])
            return of(distinct, *given[1:])[..., where]
        full = xp.broadcast_arrays(*given)
        columns = xp.stack([xp.reshape(array, (-1,)) for array in full])
        distinct, where = xp.unique(columns, axis=1, return_inverse=True)
        return xp.reshape(of(*distinct)[where], full[0].shape)

    return lookup


def for_each(of: Callable[..., Array], *shape: Array) -> Array:
    """`of(*shape)` for several candidates (k, 1), computed once for those that differ in other parameters alone.

    A search moves one parameter at a time. Only NumPy can tell which are equal; other libraries compute every one.
    """
    if not all(is_traced_never(array) for array in shape):
        return of(*shape)
    xp = namespace(shape[0])
    full = xp.broadcast_arrays(*shape)
    if full[0].ndim != 2 or full[0].shape[1] != 1:
        return of(*shape)
    distinct, where = xp.unique(xp.stack([array[:, 0] for array in full]), axis=1, return_inverse=True)
    return of(*(row[:, None] for row in distinct))[where]


@functools.cache
def _gauss_legendre(count: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(count)
