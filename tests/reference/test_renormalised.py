"""The renormalisation of Beckmann and Kirchhoff's scatter where surfaces are rough and light grazes, by brute force."""

import math

import numpy as np
import pytest
from scipy.special import gammaln, i0e

from gonio.models.harvey2007 import renormalisation

LEAST = 1e-6  # formulas 0: cosines are kept above this


@pytest.mark.parametrize("theta_i", [0.0, 60.0, 85.0, 89.9, 90.0])
@pytest.mark.parametrize(
    ("height", "length"),  # in wavelengths
    [
        (0.003, 0.2),
        (0.02, 60.0),
        (0.1, 0.05),
        (0.3, 3.0),
        (0.7, 0.4),
        (1.2, 8.0),
        (1.8, 0.6),
        (1.907, 122.0),
        (2.5, 200.0),
    ],
)
def test_all_orders_on_a_dense_grid(height, length, theta_i):
    """Light lost from the mirror direction over the integral of the kernel (formulas 7.7), every order counted."""
    theta, a, k = math.radians(theta_i), math.pi * length, 2 * math.pi * height
    cos = max(math.cos(theta), LEAST)
    # in direction cosines u = sin(theta_r), from one far edge of the lobe to the other; u = 1 - t^2 nears the horizon
    reach = 7 * math.sqrt((k * (1 + cos)) ** 2 + 60 * (1 + k)) / a
    low, high = max(0.0, math.sin(theta) - reach), min(1.0, math.sin(theta) + reach)
    x, w = np.polynomial.legendre.leggauss(1000)
    start, end = math.sqrt(1 - high), math.sqrt(1 - low)
    t = start + (end - start) * (x + 1) / 2
    u, weights = 1 - t**2, w * (end - start) / 2 * 2 * t
    variance = (k * (cos + t * np.sqrt(2 - t**2))) ** 2
    density = np.zeros_like(u)
    for m in range(1, int(4 * k**2 + 60 * k + 150)):
        order = m * np.log(variance) - variance - gammaln(m + 1) - math.log(m) - (a * (u - math.sin(theta))) ** 2 / m
        density += np.exp(order) * i0e(2 * a**2 * math.sin(theta) * u / m)
    scattered = np.sum(weights * 2 * a**2 * density * u)
    lost = -math.expm1(-((2 * k * cos) ** 2))
    found = renormalisation(*(np.asarray(v) for v in (theta, height * 0.5, length * 0.5, 0.5)))
    assert float(found) == pytest.approx(lost / scattered, rel=2e-6)
