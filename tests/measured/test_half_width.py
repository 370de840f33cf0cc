"""gamma read straight from the curve."""

import numpy as np
import pytest

from gonio import catalogue, published, simulate
from gonio.measured.dataset import make_scan
from gonio.measured.half_width import Reading, half_widths, widest_angle

THETA_R = np.arange(-80, 81.0)


def test_a_lobe_alone_reads_exactly():
    scan = simulate(catalogue["cauchy-lorentz"], {"kdd": 1000.0, "gamma": 40.0}, [30.0], THETA_R)
    (reading,) = half_widths(scan, floor=0.0)
    assert reading.status is Reading.READ
    # a straight line over +-5 deg of the crossing bends away from the Lorentz curve by a tenth of a degree
    assert reading.gamma == pytest.approx(40.0, abs=0.2)
    assert reading.peak == pytest.approx(1000 / (np.pi * 40), rel=1e-3)


@pytest.mark.parametrize("size", [1e-290, 1e-30, 1e30, 1e307])
def test_the_size_of_the_values_does_not_matter(size):
    scan = simulate(catalogue["cauchy-lorentz"], {"kdd": 100.0, "kid": 0.1, "gamma": 40.0}, [30.0], THETA_R)
    (expected,) = half_widths(scan)
    (reading,) = half_widths(scan.assign(brdf=(scan["brdf"] * size).assign_attrs(units="sr-1")))
    assert reading.status is Reading.READ
    assert reading.gamma == pytest.approx(expected.gamma, rel=1e-9)


@pytest.mark.parametrize("name", ["Al", "Cu", "SR107", "S781"])
def test_published_gamma_at_the_largest_incidence(name):
    """With the floor removed, the half width at 70 deg is the paper's gamma to 2.5 deg.

    Not closer: the specular lobe of SR107, the widest, reaches the normal even at 70 deg and lifts the peak.
    """
    surface = published[name]
    scan = simulate(catalogue[surface.model], surface.values, sorted(surface.values["ks"]), THETA_R, unit="a.u.")
    for floor in (None, surface.values["kid"]):
        best = widest_angle(half_widths(scan, floor))
        assert best.theta_i == 70.0
        assert best.gamma == pytest.approx(surface.values["gamma"], abs=2.5)


def test_coatings_never_fall_to_half_with_their_floor():
    """As formulas 9 (ii) finds: without removing kid the half level lies beyond the scan."""
    surface = published["S781"]
    scan = simulate(catalogue[surface.model], surface.values, sorted(surface.values["ks"]), THETA_R, unit="a.u.")
    assert {r.status for r in half_widths(scan, floor=0.0)} == {Reading.NEVER_HALF}
    assert widest_angle(half_widths(scan, floor=0.0)) is None


def test_uncertainty_is_the_scatter_of_repeats():
    """The stated uncertainty against the spread over repeated noise, within a factor of two."""
    values = {"kdd": 1000.0, "kid": 1.0, "gamma": 40.0}
    readings = [
        half_widths(simulate(catalogue["cauchy-lorentz"], values, [30.0], THETA_R, noise=0.02, seed=s), floor=1.0)[0]
        for s in range(60)
    ]
    spread = np.std([r.gamma for r in readings])
    stated = np.median([r.uncertainty for r in readings])
    assert spread / 2 < stated < spread * 2


def test_other_statuses():
    forward_only = make_scan(np.full(50, 30.0), np.linspace(1, 80, 50), np.ones(50))
    assert half_widths(forward_only)[0].status is Reading.NO_FAR_SIDE
    dip = make_scan(np.full(80, 30.0), np.linspace(-80, 0, 80), 1 + np.linspace(80, 0, 80) ** 2)
    assert half_widths(dip)[0].status is Reading.NO_LOBE
