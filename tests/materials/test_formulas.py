"""The nine dispersion formulas, against published indices; coefficients as refractiveindex.info holds them (CC0)."""

import numpy as np
import pytest

from gonio.materials.formulas import Formula

N_BK7 = (0, 1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653)


@pytest.mark.parametrize(
    ("number", "coefficients", "at", "index", "digits"),
    [
        # fused silica (Malitson 1965) and calcium fluoride (Malitson 1963) at the helium d line
        (1, (0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161), 0.5875618, 1.45846, 5),
        (1, (0, 0.5675888, 0.050263605, 0.4710914, 0.1003909, 3.8484723, 34.649040), 0.5875618, 1.4338, 4),
        (2, N_BK7, 0.5875618, 1.51680, 5),  # the maker's nd
        # Mg-doped lithium tantalate (Moutzouris 2011)
        (3, (4.46828481, -0.01791123, 2, 0.10437434, -2, -2.84541849e-3, -4, 7.87317793e-4, -6), 0.45, 2.2373, 4),
        # zinc telluride (Li 1984), at the middle of its range
        (4, (9.92, 0.42530, 0, 0.37766, 2, 8414.13, 0, 56.5, 2), 15.275, 2.6605, 4),
        # barium borate, ordinary ray (Zhang 2000): powers after two terms, of which one is empty
        (4, (2.7359, 0.01878, 0, 0.01822, 1, 0, 0, 0, 1, -0.01471, 2, 0.0006081, 4, -6.74e-5, 6), 1.064, 1.6545, 3),
        (5, (1.00071517, 4.996e-6, -2), 0.95, 1.00072071, 8),  # sulphur hexafluoride (Vukovic 1996)
        (6, (0, 0.01470091, 423.98), 1.2694, 1.000034724, 9),  # helium (Mansfield 1969)
        (7, (3.41983, 0.159906, -0.123109, 1.26878e-6, -1.95104e-9), 13.71865, 3.4208, 4),  # silicon (Edwards 1980)
        (8, (0.452505, 0.09939, 0.070537, -0.000150), 0.5825, 2.2600, 4),  # silver bromide (Schröter 1931)
        (9, (2.51527, 0.0240, 0.0300, 0.020, 1.52, 0.8771), 0.68, 1.6000, 4),  # urea (Rosker 1985)
    ],
)
def test_published_indices(number, coefficients, at, index, digits):
    found = Formula(number, tuple(map(float, coefficients)))(np.array(at))
    assert found == pytest.approx(index, abs=0.51 * 10.0**-digits)


def test_old_and_new_catalogue_of_one_glass_agree():
    """Schott's polynomial of BK7, as catalogues printed it before the Sellmeier formula."""
    terms = [-1.0108077e-2, 2, 1.0592509e-2, -2, 2.0816965e-4, -4, -7.6472538e-6, -6, 4.9240991e-7, -8]
    w = np.linspace(0.4, 1.0, 31)
    np.testing.assert_allclose(Formula(3, (2.2718929, *terms))(w), Formula(2, N_BK7)(w), atol=3e-5)


def test_second_formula_is_the_first_with_squares():
    w = np.geomspace(0.4, 2, 9)
    np.testing.assert_allclose(Formula(1, (0.1, 1.2, 0.1))(w), Formula(2, (0.1, 1.2, 0.01))(w), rtol=1e-14)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6, 7])
def test_one_coefficient_is_a_constant(number):
    squared = {1: 1.5, 2: 1.5, 3: 2.5, 4: 2.5}.get(number)
    constant = {5: 1.5, 6: 0.5, 7: 1.5}.get(number)
    found = Formula(number, (squared if constant is None else constant,))(np.array([0.5, 1.0]))
    expected = 1.5 if constant is not None else np.sqrt(2.5)
    np.testing.assert_allclose(found, [expected, expected], rtol=1e-15)


@pytest.mark.parametrize(
    ("number", "count"),
    [(0, 1), (10, 1), (1, 0), (1, 2), (3, 4), (4, 3), (4, 7), (4, 10), (7, 7), (8, 3), (9, 5), (2, 99)],
)
def test_refused_counts(number, count):
    with pytest.raises(ValueError, match=r"no formula|coefficients where it takes"):
        Formula(number, (1.0,) * count)


def test_no_real_value_is_nan_and_no_warning():
    assert np.isnan(Formula(3, (-1.0,))(np.array(0.5)))
    assert not np.isfinite(Formula(2, (0.0, 1.0, 0.25))(np.array(0.5)))
