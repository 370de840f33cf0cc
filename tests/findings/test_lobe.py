"""The width of the measured lobe."""

import math

import numpy as np
import pytest

from gonio.findings import lobes
from gonio.findings.lobe import Width
from gonio.measured.dataset import make_scan

ANGLES = (10.0, 30.0, 50.0, 70.0)


def lobe_scan(shape, theta_r, theta_i=ANGLES):
    i, r = (v.ravel() for v in np.meshgrid(theta_i, theta_r, indexing="ij"))
    return make_scan(i, r, shape(r - i))


def gaussian(half_width):
    return lambda away: np.exp(-math.log(2) * (away / half_width) ** 2)


@pytest.mark.parametrize("step", [1.0, 5.0, 7.0])
def test_a_gaussian_lobe_has_its_own_width(step):
    """A parabola through ln f is a Gaussian: exact for any step, on the grid and beside it."""
    for lobe in lobes(lobe_scan(gaussian(14.1), np.arange(-80, 80.1, step))):
        assert lobe.half_width == pytest.approx(14.1, rel=1e-9)
        assert lobe.peak == pytest.approx(1, rel=1e-9)
        assert lobe.theta_r == pytest.approx(lobe.theta_i, abs=1e-9)
        assert lobe.status is (Width.TO_NORMAL if lobe.theta_i == 70 else Width.BOTH)
        assert lobe.lower == pytest.approx(14.1)
        assert math.isnan(lobe.upper) == (lobe.theta_i == 70)


def test_a_lorentz_lobe_comes_near():
    """Not a Gaussian: steps of a fifth of the half width leave some thousandths."""
    for lobe in lobes(lobe_scan(lambda away: 1 / (1 + (away / 10) ** 2), np.arange(-80, 81, 2.0), (30.0, 50.0))):
        assert lobe.half_width == pytest.approx(10.0, rel=5e-3)


def test_two_sides_may_differ():
    def shape(away):
        return np.where(away > 0, gaussian(4.0)(away), gaussian(12.0)(away))

    (lobe,) = lobes(lobe_scan(shape, np.arange(-80, 81, 1.0), (40.0,)))
    assert (lobe.lower, lobe.upper) == pytest.approx((12.0, 4.0), abs=0.5)  # the top is read across the bend, to a step
    assert lobe.half_width == pytest.approx(8.0, rel=0.01)


def test_curves_without_a_width():
    t = np.arange(-80, 81, 5.0)
    rising = make_scan(np.full(len(t), 60.0), t, np.exp(t / 30))
    flat = make_scan(np.full(len(t), 60.0), t, 1 + 0.1 * np.cos(np.radians(t)))
    dark = make_scan(np.full(len(t), 60.0), t, -np.ones(len(t)))
    assert [lobes(s)[0].status for s in (rising, flat, dark)] == [Width.AT_END, Width.NEVER, Width.NO_LOBE]
    assert lobes(rising)[0].theta_r == 80
