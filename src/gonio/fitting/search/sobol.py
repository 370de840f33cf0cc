"""The first points of Sobol's sequence (sobol1967) in few dimensions.

They are those of `scipy.stats.qmc.Sobol`, whose import takes half a second: more than the fits that start from them.
"""

import numpy as np
import numpy.typing as npt

BITS = 30
# Primitive polynomials over two elements, as bits, and the first direction numbers of each (joe2008).
POLYNOMIALS = (3, 7, 11, 13, 19, 25, 37, 41, 47, 55, 59, 61, 67, 91, 97)
FIRST = (
    *((1,), (1, 3), (1, 3, 1), (1, 1, 1), (1, 1, 3, 3), (1, 3, 5, 13), (1, 1, 5, 5, 17), (1, 1, 5, 5, 5)),
    *((1, 1, 7, 11, 19), (1, 1, 5, 1, 1), (1, 1, 1, 3, 11), (1, 3, 5, 5, 31), (1, 3, 3, 9, 7, 49)),
    *((1, 1, 1, 15, 21, 21), (1, 3, 1, 13, 27, 49)),
)
MOST = 1 + len(FIRST)  # dimensions


def sobol(dimensions: int, power: int) -> npt.NDArray[np.float64]:
    """The first 2**power points (n, dimensions) in [0, 1), in the order of Gray's code; the first is 0."""
    if dimensions > MOST:
        from scipy.stats import qmc

        found: npt.NDArray[np.float64] = qmc.Sobol(dimensions, scramble=False).random(2**power)
        return found
    directions = np.array([_directions(k) for k in range(dimensions)])[:, :power]
    place = np.arange(2**power)
    code = place ^ (place >> 1)
    bits = (code[:, None] >> np.arange(power)) & 1  # (n, power)
    chosen = np.where(bits[:, None, :] == 1, directions, 0)
    return np.bitwise_xor.reduce(chosen, axis=-1) / 2.0**BITS


def _directions(dimension: int) -> list[int]:
    """The direction numbers of a dimension; the first dimension is van der Corput's sequence."""
    if dimension == 0:
        return [1 << (BITS - 1 - k) for k in range(BITS)]
    polynomial, numbers = POLYNOMIALS[dimension - 1], list(FIRST[dimension - 1])
    degree = len(numbers)
    for k in range(degree, BITS):
        new = numbers[k - degree] ^ (numbers[k - degree] << degree)
        for i in range(1, degree):
            if polynomial >> (degree - i) & 1:
                new ^= numbers[k - i] << i
        numbers.append(new)
    return [number << (BITS - 1 - k) for k, number in enumerate(numbers)]
