"""Sobol's sequence is SciPy's, bit for bit."""

import numpy as np
import pytest
from scipy.stats import qmc

from gonio.fitting.search.sobol import MOST, sobol


@pytest.mark.parametrize("dimensions", range(1, MOST + 2))  # beyond MOST it is SciPy's own
def test_points_are_those_of_scipy(dimensions):
    expected = qmc.Sobol(dimensions, scramble=False).random(2**9)
    np.testing.assert_array_equal(sobol(dimensions, 9), expected)
