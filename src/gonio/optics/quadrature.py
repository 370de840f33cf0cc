"""Fixed quadrature for the integrals that special functions would otherwise need: it traces in any array library."""

import functools

import numpy as np

from gonio.arrays import Array, namespace


def unit_interval(count: int, like: Array) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on 0..1, in the array library and dtype of `like`."""
    xp = namespace(like)
    nodes, weights = _gauss_legendre(count)
    return xp.asarray((nodes + 1) / 2, dtype=like.dtype), xp.asarray(weights / 2, dtype=like.dtype)


@functools.cache
def _gauss_legendre(count: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(count)
