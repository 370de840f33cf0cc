"""Numbers that were worked out elsewhere: solid angles, fields of view, tilts, budgets; and Monte Carlo of a budget."""

import math

import numpy as np
import pytest

from gonio.reduction import (
    Absolute,
    Filling,
    Known,
    Reduction,
    Relative,
    budget,
    correlation,
    covariance,
    make_readings,
    reduce,
)
from gonio.reduction.steps.detector import gain_ratio, linearised
from gonio.reduction.steps.filling import half_angle, kappa, noise_equivalent, solid_angle
from gonio.reduction.steps.zeros import tilted, zero_of_mirror

UNDER, OVER = Filling("under"), Filling("over")
SIX = 1e-6
SIGNALS, THETA_R = [1.2e-8, 4.5678e-9, 8.8e-10], [0.0, 40.0, 75.0]
HOW = Absolute(Known(4.75, 5e-3), Known(500.0, 0.5), Known(1e-3, 1e-5))


def absolute_readings(signals=SIGNALS, dark=1.9e-10, incident=1.2345e-6):
    """The three readings of the vector, each range with its dark."""
    spread = [2e-12 + 1e-3 * v for v in SIGNALS]
    return make_readings(
        {
            "kind": ["dark", "dark", "incident", "sample", "sample", "sample"],
            "theta_i": [np.nan, np.nan, np.nan, 20, 20, 20],
            "theta_r": [np.nan, np.nan, np.nan, *THETA_R],
            "range": ["low", "high", "high", "low", "low", "low"],
            "signal": [dark, 2e-10, incident, *signals],
            "sd": [1e-11, 0, 1e-9, *spread],
        },
        "A",
    )


@pytest.mark.parametrize(
    ("beam", "view", "angles", "expected"),
    [
        (2, 3, (0, 0), 0.988891),
        (2, 3, (40, 40), 0.988891),
        (2, 3, (60, 0), 0.835082),
        (2, 3, (75, 0), 0.532040),
        (4, 3, (40, 40), 0.675348),
        (4, 3, (60, 0), 0.408974),
        (4, 3, (75, 0), 0.223270),
        (1, 5, (75, 0), 0.989967),
    ],
)
def test_part_of_a_beam_in_a_field_of_view(beam, view, angles, expected):
    assert float(kappa(*angles, beam, view)) == pytest.approx(expected, abs=6e-7)


def test_part_of_a_beam_has_the_two_fillings_as_limits():
    theta_i, theta_r = np.array([0.0, 30.0, 70.0]), np.array([60.0, 50.0, 10.0])
    assert kappa(theta_i, theta_r, 1.0, 1e3) == pytest.approx(1.0, abs=1e-12)
    wide = 1e4
    limit = 2 / wide**2 * np.cos(np.radians(theta_i)) / np.cos(np.radians(theta_r))
    assert kappa(theta_i, theta_r, wide, 1.0) == pytest.approx(limit, rel=1e-6)
    # a reading of a very wide beam is proportional to cos theta_i, one of a narrow beam to cos theta_r
    over, under = Filling("beam", wide, 1.0), Filling("beam", 1.0, 1e3)
    assert over.weight(theta_i, theta_r) * wide**2 / 2 == pytest.approx(OVER.weight(theta_i, theta_r), rel=1e-6)
    assert under.weight(theta_i, theta_r) == pytest.approx(UNDER.weight(theta_i, theta_r), rel=1e-12)


def test_solid_angles_and_noise():
    assert solid_angle(12.5, 300) == pytest.approx(5.447062409e-3, rel=1e-9)
    assert solid_angle(25, 100) == pytest.approx(0.1876002044, rel=1e-9)
    assert solid_angle(4.75, 500) == pytest.approx(2.835095471e-4, rel=1e-9)
    assert solid_angle(1e-6, 1.0) == pytest.approx(math.pi * 1e-12, rel=1e-11)  # no digits lost where it is small
    assert half_angle(12.5, 300) == pytest.approx(2.385944, abs=5e-7)
    assert half_angle(4.75, 500) == pytest.approx(0.544294, abs=5e-7)
    assert noise_equivalent(1e-10, 1e-3, 2.835095471e-4, [0, 80]) == pytest.approx([3.5272e-4, 2.0312e-3], rel=3e-5)


@pytest.mark.parametrize(
    ("angles", "tilt", "expected"),
    [
        ((40, 40, 180), (0.5, 0), (40.5, 39.5, 180)),
        ((40, 40, 180), (0, 1), (40.010399, 40.010399, 177.616957)),
        ((30, 20, 0), (0.5, 1), (30.514811, 20.523327, 0.975465)),
        ((60, 75, 180), (-0.3, 0.4), (59.700816, 75.300366, 179.661325)),
    ],
)
def test_a_tilted_sample(angles, tilt, expected):
    found = tilted(*([a] for a in angles), *tilt)
    assert [float(a[0]) for a in found] == pytest.approx(expected, abs=6e-7)


def test_mirror_peaks_and_the_detector():
    assert zero_of_mirror([20, 40, 60], [20.9, 41.0, 61.1]) == pytest.approx((1.0, 0.1 / math.sqrt(3)))
    twice = linearised(np.array([2.0, 1.0]), 5e-4, 1.0)
    # flux addition: a detector that reads V(1 + a log10 V) reads 1.00015051 times the sum of the halves
    assert 2.0 * (1 + 5e-4 * math.log10(2)) / 2.0 == pytest.approx(1.00015051, abs=5e-9)
    assert twice == pytest.approx([2.0 / 1.00015051, 1.0], rel=1e-8)
    ratio = gain_ratio(Known(10.0, 0.03), Known(2.0, 0.008))
    assert ratio == pytest.approx((5.0, 5 * 0.005))


def test_an_absolute_measurement_and_its_budget():
    scan = reduce(absolute_readings(), HOW, Reduction(fill=UNDER, uncertainties={"zero": 0.05}))
    assert scan["brdf"].values == pytest.approx([3.374904e-2, 1.633103e-2, 7.618412e-3], rel=SIX)
    found = budget(scan)
    expected = {
        "random": [0.001185, 0.001500, 0.004174],
        "dark": [-0.000847, -0.002284, -0.014493],
        "filter": [0.01] * 3,
        "incident": [-0.000810] * 3,
        "aperture": [-0.002105] * 3,
        "distance": [0.002] * 3,
        "zero": [0, 0.000732, 0.003257],
    }
    assert {row.cause for row in found.rows} == set(expected)
    for row in found.rows:
        assert row.by_direction == pytest.approx(expected[row.cause], abs=6e-7), row.cause
    assert found.combined == pytest.approx([0.010546, 0.010821, 0.018632], abs=6e-7)
    assert found.expanded == pytest.approx(2 * found.combined)
    related = correlation(scan)
    assert [related[0, 1], related[0, 2], related[1, 2]] == pytest.approx([0.972909, 0.617646, 0.717092], abs=6e-7)
    total = scan["uncertainty_systematic"].values
    assert total == pytest.approx(np.sqrt((scan["systematic"].values ** 2).sum(axis=0)))
    assert np.sqrt(np.diag(covariance(scan))) == pytest.approx(found.combined * scan["brdf"].values)


def test_the_budget_is_what_a_monte_carlo_of_the_measurement_gives():
    """4000 draws: standard deviations to 1.1 % (1/sqrt(2 n)), 4 of these allowed; correlations to 0.016."""
    rng, count = np.random.default_rng(5), 4000
    scan = reduce(absolute_readings(), HOW, Reduction(fill=UNDER))
    draw = rng.standard_normal
    v = np.array(SIGNALS) + (2e-12 + 1e-3 * np.array(SIGNALS)) * draw((count, 3))
    net = v - (1.9e-10 + 1e-11 * draw((count, 1)))
    incident = (1.2345e-6 + 1e-9 * draw((count, 1)) - 2e-10) / (1e-3 + 1e-5 * draw((count, 1)))
    radius, distance = 4.75 + 5e-3 * draw((count, 1)), 500 + 0.5 * draw((count, 1))
    omega = 2 * np.pi * (1 - distance / np.hypot(distance, radius))
    f = net / incident / omega / np.cos(np.radians(THETA_R))
    u = np.sqrt(np.diag(covariance(scan)))
    assert f.std(axis=0) == pytest.approx(u, rel=4 * 0.011)
    assert np.corrcoef(f.T) == pytest.approx(correlation(scan), abs=4 * 0.016)


@pytest.mark.parametrize(
    ("fill", "theta_i", "theta_r", "expected"), [(UNDER, 20, 60, 1.587187e-2), (OVER, 30, 20, 1.295933e-2)]
)
def test_a_measurement_relative_to_a_standard(fill, theta_i, theta_r, expected):
    raw = make_readings(
        {
            "kind": ["sample", "standard", "dark", "dark"],
            "theta_i": [theta_i, 0, np.nan, np.nan],
            "theta_r": [theta_r, 45, np.nan, np.nan],
            "range": ["a", "b", "a", "b"],
            "signal": [3.21e-9, 8.765e-8, 1.9e-10, 2.1e-10],
        },
        "A",
    )
    found = reduce(raw, Relative.parsed("1.02086:factor@0,45"), Reduction(fill=fill))["brdf"].values
    assert found == pytest.approx([expected], rel=SIX)
