"""Special functions in elementary ones, for languages that have none: good to a few units of the last digit.

They take Symbols or arrays, so that they are printed in every language by the one printer, and tested against SciPy.
"""

import math
from collections.abc import Callable, Sequence

from gonio.arrays import Array, namespace

# W. J. Cody, Rational Chebyshev approximations for the error function, Math. Comp. 23 (1969) 631: ratios of
# polynomials, the highest power first, in x^2 up to 0.46875, in x up to 4, and in 1/x^2 beyond.
_NEAR = (
    (1.85777706184603153e-1, 3.16112374387056560, 1.13864154151050156e2, 3.77485237685302021e2, 3.20937758913846947e3),
    (1.0, 2.36012909523441209e1, 2.44024637934444173e2, 1.28261652607737228e3, 2.84423683343917062e3),
)
_MIDDLE = (
    (
        *(2.15311535474403846e-8, 5.64188496988670089e-1, 8.88314979438837594, 6.61191906371416295e1),
        *(2.98635138197400131e2, 8.81952221241769090e2, 1.71204761263407058e3, 2.05107837782607147e3),
        1.23033935479799725e3,
    ),
    (
        *(1.0, 1.57449261107098347e1, 1.17693950891312499e2, 5.37181101862009858e2, 1.62138957456669019e3),
        *(3.29079923573345963e3, 4.36261909014324716e3, 3.43936767414372164e3, 1.23033935480374942e3),
    ),
)
_FAR = (
    (
        *(1.63153871373020978e-2, 3.05326634961232344e-1, 3.60344899949804439e-1, 1.25781726111229246e-1),
        *(1.60837851487422766e-2, 6.58749161529837803e-4),
    ),
    (
        *(1.0, 2.56852019228982242, 1.87295284992346725, 5.27905102951428412e-1, 6.05183413124413191e-2),
        2.33520497626869185e-3,
    ),
)
# M. Giles, Approximating the erfinv function, GPU Computing Gems 2 (2012) 109: two polynomials of a logarithm.
_INVERSE_NEAR = (
    *(2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087),
    *(-0.00125372503, -0.00417768164, 0.246640727, 1.50140941),
)
_INVERSE_FAR = (
    *(-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773),
    *(-0.0076224613, 0.00943887047, 1.00167406, 2.83297682),
)
_STIRLING = (1 / 156, -691 / 360360, 1 / 1188, -1 / 1680, 1 / 1260, -1 / 360, 1 / 12)  # in 1/z^2, times 1/z
_SHIFT = 8  # from which Stirling's series reaches double precision


def erf(x: Array) -> Array:
    """The error function."""
    xp = namespace(x)
    size = xp.abs(x)
    near = x * _ratio(xp.where(size > _ENDS_NEAR, 0.0, x * x), _NEAR)
    tail = 1 - _tail(size)
    return xp.where(size <= _ENDS_NEAR, near, xp.where(x < 0, -tail, tail))


def erfc(x: Array) -> Array:
    """One less the error function, which keeps its digits where that is nearly one."""
    xp = namespace(x)
    size = xp.abs(x)
    near = 1 - x * _ratio(xp.where(size > _ENDS_NEAR, 0.0, x * x), _NEAR)
    tail = _tail(size)
    return xp.where(size <= _ENDS_NEAR, near, xp.where(x < 0, 2 - tail, tail))


def erfinv(x: Array) -> Array:
    """The inverse of the error function: a polynomial, and two steps of Newton's method."""
    xp = namespace(x)
    logarithm = -xp.log((1 - x) * (1 + x))
    near = logarithm < 5
    guess = x * xp.where(
        near,
        _polynomial(logarithm - 2.5, _INVERSE_NEAR),
        _polynomial(xp.sqrt(xp.where(near, 5.0, logarithm)) - 3, _INVERSE_FAR),
    )
    for _ in range(2):
        guess = guess - (erf(guess) - x) * xp.exp(guess * guess) * (math.sqrt(math.pi) / 2)
    return guess


def gammaln(x: Array) -> Array:
    """The logarithm of the gamma function of a positive number, by Stirling's series of x + 8."""
    xp = namespace(x)
    product = x
    for k in range(1, _SHIFT):
        product = product * (x + k)
    z = x + _SHIFT
    series = _polynomial(1 / (z * z), _STIRLING) / z
    return (z - 0.5) * xp.log(z) - z + math.log(2 * math.pi) / 2 + series - xp.log(product)


def log1p(x: Array) -> Array:
    """The logarithm of 1 + x, which keeps the digits of a small x (W. Kahan)."""
    xp = namespace(x)
    sum_ = 1 + x
    same = sum_ == 1
    return xp.where(same, x, xp.log(sum_) * (x / xp.where(same, 1.0, sum_ - 1)))


def expm1(x: Array) -> Array:
    """The exponential less 1, which keeps the digits of a small x."""
    xp = namespace(x)
    small = xp.abs(x) < 0.5
    half = xp.where(small, x, 0.5) / 2
    return xp.where(small, 2 * _small_sinh(half) * xp.exp(half), xp.exp(x) - 1)


def sinh(x: Array) -> Array:
    """The hyperbolic sine."""
    xp = namespace(x)
    small = xp.abs(x) < 0.5
    return xp.where(small, _small_sinh(xp.where(small, x, 0.5)), (xp.exp(x) - xp.exp(-x)) / 2)


def cosh(x: Array) -> Array:
    """The hyperbolic cosine."""
    xp = namespace(x)
    return (xp.exp(x) + xp.exp(-x)) / 2


def tanh(x: Array) -> Array:
    """The hyperbolic tangent."""
    twice = expm1(2 * x)
    return twice / (twice + 2)


def asinh(x: Array) -> Array:
    """The inverse of the hyperbolic sine."""
    xp = namespace(x)
    size = xp.abs(x)
    positive = log1p(size + size * size / (1 + xp.sqrt(size * size + 1)))
    return xp.where(x < 0, -positive, positive)


def acosh(x: Array) -> Array:
    """The inverse of the hyperbolic cosine."""
    xp = namespace(x)
    return log1p(x - 1 + xp.sqrt((x - 1) * (x + 1)))


def atanh(x: Array) -> Array:
    """The inverse of the hyperbolic tangent."""
    return log1p(2 * x / (1 - x)) / 2


SUPPORT: dict[str, Callable[[Array], Array]] = {
    f.__name__: f for f in (erf, erfc, erfinv, gammaln, log1p, expm1, sinh, cosh, tanh, asinh, acosh, atanh)
}

_ENDS_NEAR, _ENDS_MIDDLE = 0.46875, 4.0


def _tail(size: Array) -> Array:
    """The complementary error function of a positive number of at least 0.46875."""
    xp = namespace(size)
    middle = size <= _ENDS_MIDDLE
    inverse = 1 / xp.where(middle, _ENDS_MIDDLE, size) ** 2
    far = (1 / math.sqrt(math.pi) - inverse * _ratio(inverse, _FAR)) / xp.where(middle, _ENDS_MIDDLE, size)
    ratio = xp.where(middle, _ratio(xp.where(middle, size, _ENDS_MIDDLE), _MIDDLE), far)
    # the square in two parts, as its rounding would be a relative error of the exponential
    rounded = xp.floor(size * 16) / 16
    return xp.exp(-rounded * rounded) * xp.exp(-(size - rounded) * (size + rounded)) * ratio


def _small_sinh(x: Array) -> Array:
    """The hyperbolic sine of a number below 0.5, by its series."""
    return x * _polynomial(x * x, [1 / math.factorial(n) for n in range(15, 0, -2)])


def _ratio(x: Array, coefficients: tuple[Sequence[float], Sequence[float]]) -> Array:
    above, below = coefficients
    return _polynomial(x, above) / _polynomial(x, below)


def _polynomial(x: Array, coefficients: Sequence[float]) -> Array:
    value = coefficients[0] + 0 * x
    for coefficient in coefficients[1:]:
        value = value * x + coefficient
    return value
