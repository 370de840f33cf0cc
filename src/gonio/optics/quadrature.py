"""Fixed quadrature for the integrals that special functions would otherwise need: it traces in any array library."""

import functools

import numpy as np

from gonio.arrays import Array, constants


def unit_interval(count: int, like: Array) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on 0..1, in the array library, dtype and device of `like`."""
    nodes, weights = _gauss_legendre(count)
    return constants((nodes + 1) / 2, like), constants(weights / 2, like)


@functools.cache
def _gauss_legendre(count: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(count)
