"""Gauss-Legendre quadrature in place of special functions that array libraries lack: JAX and others can trace it."""

import functools
from collections.abc import Callable

import numpy as np

from gonio.arrays import Array, constants, is_traced_never, namespace


def unit_interval(count: int, like: Array) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on 0..1, in the array library, dtype and device of `like`."""
    nodes, weights = gauss_legendre(count)
    return constants((nodes + 1) / 2, like), constants(weights / 2, like)


def once_each(integral: Callable[..., Array]) -> Callable[..., Array]:
    """An integral that is computed once for equal arguments: a scan has few distinct angles.

    Only NumPy arrays can be searched for equal values; for other libraries every value is computed. The arguments
    broadcast against each other.
    """

    @functools.wraps(integral)
    def lookup(*arguments: Array) -> Array:
        if not is_traced_never(arguments[0]):
            return integral(*arguments)
        xp = namespace(arguments[0])
        if arguments[0].ndim == 1 and all(array.shape[-1:] in ((), (1,)) for array in arguments[1:]):
            distinct, where = xp.unique_inverse(arguments[0])
            return integral(distinct, *arguments[1:])[..., where]
        full = xp.broadcast_arrays(*arguments)
        columns = xp.stack([xp.reshape(array, (-1,)) for array in full])
        distinct, where = xp.unique(columns, axis=1, return_inverse=True)
        return xp.reshape(integral(*distinct)[where], full[0].shape)

    return lookup


def for_each(function: Callable[..., Array], *shape: Array) -> Array:
    """`function(*shape)` for several candidates (k, 1), computed once for those that differ in other parameters only.

    A search changes one parameter at a time. Only NumPy arrays can be searched for equal values; for other libraries
    every value is computed.
    """
    if not all(is_traced_never(array) for array in shape):
        return function(*shape)
    xp = namespace(shape[0])
    full = xp.broadcast_arrays(*shape)
    if full[0].ndim != 2 or full[0].shape[1] != 1:
        return function(*shape)
    distinct, where = xp.unique(xp.stack([array[:, 0] for array in full]), axis=1, return_inverse=True)
    return function(*(row[:, None] for row in distinct))[where]


@functools.cache
def gauss_legendre(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on -1..1, computed once for each number of nodes."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    nodes.setflags(write=False)  # every caller has the same arrays
    weights.setflags(write=False)
    return nodes, weights
