"""The functions that languages lack, against SciPy and NumPy."""

import numpy as np
import pytest
import scipy.special

from gonio.symbols.special import SUPPORT

ALONG = np.concatenate([-np.geomspace(1e-12, 26, 4001), [0.0], np.geomspace(1e-12, 26, 4001)])
WHERE = {
    "gammaln": np.geomspace(1e-3, 200, 5001),
    "erfinv": np.linspace(-0.999, 0.999, 5001),
    "log1p": np.geomspace(1e-15, 50, 5001),
    "acosh": 1 + np.geomspace(1e-9, 50, 5001),
    "atanh": np.linspace(-0.999, 0.999, 5001),
}
NUMPY = {"asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh}


@pytest.mark.parametrize("name", SUPPORT)
def test_function(name):
    """To 1e-13 of the value, or of 1 near a zero: the arguments' own rounding, magnified by exponentials, is 5e-14."""
    x = WHERE.get(name, ALONG)
    expected = getattr(scipy.special, name, None) or NUMPY.get(name) or getattr(np, name)
    with np.errstate(under="ignore"):
        np.testing.assert_allclose(SUPPORT[name](x), expected(x), rtol=1e-13, atol=1e-13 if name == "gammaln" else 0)
