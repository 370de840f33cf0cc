"""What shows a mistake and what does not: surfaces that look alike, digits, sizes and speed."""

import time

import numpy as np
import pytest

from gonio import check
from gonio.findings import MISTAKES, NAMES, corrections, lobes
from gonio.findings.curves import curves, reflected
from gonio.findings.magnitude import reflectance
from gonio.measured.check import Severity
from gonio.measured.dataset import make_scan, points, signed_theta_r

ANGLES = np.array([10.0, 30.0, 50.0, 70.0])
THETA_R = np.arange(-80, 81, 2.0)


def scan(brdf, theta_i=ANGLES, theta_r=THETA_R, **more):
    i, r = (v.ravel() for v in np.meshgrid(theta_i, theta_r, indexing="ij"))
    return make_scan(i, r, brdf(i, r), **more)


def lobe(i, r, width=0.15, shift=0.0):
    """Shift invariant in direction cosines, and so reciprocal, on a ground that is reciprocal and not constant."""
    away = np.sin(np.radians(r - shift)) - np.sin(np.radians(i))
    ground = 0.01 * (1 + 0.3 * np.cos(np.radians(r)) * np.cos(np.radians(i)))
    return ground + 0.1 * np.exp(-((away / width) ** 2))


def names(data):
    return [finding.name for finding in check(data) if finding.name in NAMES]


def test_a_right_scan_has_no_finding():
    assert names(scan(lobe)) == []


def test_the_names_are_those_that_programs_rely_on():
    assert set(NAMES) == {
        "sign-reversed", "cosine-left-in", "radians", "percent", "factor-pi", "reflectance-above-one",
        "azimuth-mirrored", "angle-zero-shifted", "saturated", "floor",
    }  # fmt: skip
    assert len(NAMES) == len(set(NAMES))
    assert len(MISTAKES) < len(NAMES)


def test_a_hot_spot_is_no_reversed_sign():
    """A matt surface that is brightest towards the source, and still sends flat light forward."""

    def moon(i, r):
        surge = 1 + 3 * np.exp(-np.abs(r + i) / 6)
        return 0.05 * surge + 0.4 * np.exp((r - 90) / 12) * (i / 70) ** 2

    assert names(scan(moon)) == []


def test_a_retroreflector_is_asked_about():
    found = [f for f in check(scan(lambda i, r: lobe(i, -r))) if f.name in NAMES]
    assert [f.name for f in found] == ["sign-reversed"]
    assert found[0].severity is Severity.WARNING
    assert "retroreflector" in found[0].remedy


def test_out_of_plane_it_is_the_azimuth():
    i, r, phi = (v.ravel() for v in np.meshgrid(ANGLES, np.arange(0, 81, 5.0), np.arange(0, 360, 15.0)))
    away = np.abs(np.sin(np.radians(r)) * np.exp(1j * np.radians(phi)) + np.sin(np.radians(i)))
    right = make_scan(i, r, 0.01 + 0.1 / (1 + (away / 0.2) ** 2), phi)
    assert names(right) == []
    assert names(corrections.mirror_azimuth(right)) == ["azimuth-mirrored"]
    assert names(corrections.flip(right)) == ["azimuth-mirrored"]


@pytest.mark.parametrize("angles", [ANGLES, ANGLES[1:3]])
def test_a_cosine_is_seen_with_two_incidence_angles(angles):
    data = scan(lambda i, r: lobe(i, r) * np.cos(np.radians(r)), angles)
    assert names(data) == ["cosine-left-in"]
    (finding,) = [f for f in check(data) if f.name in NAMES]
    assert finding.severity is Severity.WARNING
    relative = data.assign(brdf=data["brdf"].assign_attrs(units="a.u."))
    assert [f.severity for f in check(relative) if f.name == "cosine-left-in"] == [Severity.NOTE]


def test_a_cosine_divided_out_twice_is_none():
    assert "cosine-left-in" not in names(scan(lambda i, r: lobe(i, r) / np.cos(np.radians(r))))


def test_scatter_alone_is_no_cosine():
    """Noise of 30 % breaks reciprocity as much, and no cosine mends it; 20 seeds, none an alarm."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert "cosine-left-in" not in names(scan(lambda i, r: lobe(i, r) * np.exp(0.3 * rng.normal(size=i.size))))


@pytest.mark.parametrize("columns", [("theta_i",), ("theta_r",), ("phi",), ("theta_i", "theta_r", "phi")])
def test_one_column_in_radians_is_found_too(columns):
    i, r, phi = (v.ravel() for v in np.meshgrid([20.0, 40.0], np.arange(5, 81, 5.0), np.arange(0, 361, 30.0)))
    right = make_scan(i, r, np.full(i.shape, 0.1), phi)
    wrong = right.assign_coords(
        {n: ("direction", np.radians(right[n].values).round(5), right[n].attrs) for n in columns}
    )
    assert "radians" in names(wrong)
    mended = corrections.from_radians(wrong)
    for name in columns:
        np.testing.assert_allclose(mended[name].values, right[name].values, atol=3e-4)  # 5 decimals of a radian


def test_a_scan_about_the_normal_in_degrees_is_not_in_radians():
    data = scan(lambda i, r: np.exp(-((r - i) ** 2)), np.array([0.5, 1.0]), np.arange(-1.5, 1.51, 0.1))
    assert "radians" not in names(data)


def test_the_reflectance_of_a_lambertian_in_plane_is_its_albedo():
    for brightness, found in ((0.9, []), (1.3, ["reflectance-above-one", "factor-pi", "percent"])):
        data = scan(lambda i, r, b=brightness: np.full(i.shape, b / np.pi), theta_r=np.arange(-88, 89, 1.0))
        # The scan ends at 88 deg, short of 1 - sin(88 deg), and R is the lower of two sides.
        each = [reflectance(curve) for curve in curves(reflected(data))]
        assert each == pytest.approx([brightness] * 4, rel=0.04)
        assert set(names(data)) == set(found)


def test_relative_values_have_no_reflectance():
    assert names(scan(lambda i, r: 1e4 * lobe(i, r), unit="a.u.")) == []


def test_a_shift_is_none_where_it_grows_with_incidence():
    """An off-specular peak: 2 deg tan(theta_i) beyond the mirror direction."""

    def rough(i, r):
        return np.exp(-(((r - i - 2 * np.tan(np.radians(i))) / 4) ** 2)) / 10

    assert "angle-zero-shifted" not in names(scan(rough))


@pytest.mark.parametrize("shift", [1.5, -1.5])
def test_a_shift_is_told_with_its_sign(shift):
    data = scan(lambda i, r: np.exp(-(((r - i - shift) / 4) ** 2)) / 10 + 1e-3 * (2 + np.cos(np.radians(r))))
    (finding,) = [f for f in check(data) if f.name == "angle-zero-shifted"]
    assert f"--shift-theta-r {-shift:.2f}" in finding.remedy
    assert "angle-zero-shifted" not in names(corrections.shift_theta_r(data, -shift))


@pytest.mark.parametrize("signal", [False, True])
def test_a_saturated_peak_in_values_or_in_the_signal(signal):
    def cut(i, r):
        cosine = np.cos(np.radians(r)) if signal else 1.0
        return np.minimum(lobe(i, r) * cosine, 0.04) / cosine

    data = scan(cut)
    (finding,) = [f for f in check(data) if f.name in NAMES]
    assert finding.name == "saturated"
    assert ("cos(theta_r)" in finding.what) == signal
    value = float(finding.remedy.rsplit(" ", 1)[1])
    masked = corrections.mask_saturated(data, value)
    assert names(masked) == []
    assert masked["brdf"].values.tolist() == data["brdf"].values.tolist()
    assert points(masked).sizes["direction"] < data.sizes["direction"]


def test_round_tops_of_few_digits_are_not_saturated():
    """A lobe written with three digits has equal neighbours at its top."""
    data = scan(lambda i, r: np.round(0.3 * np.exp(-(((r - i) / 30) ** 2)), 3) + 0.001, theta_r=np.arange(-80, 81, 1.0))
    assert "saturated" not in names(data)


def test_equal_lobes_of_a_program_are_not_saturated():
    assert names(scan(lambda i, r: 0.1 * np.exp(-(((r - i) / 10) ** 2)) + 0.01 * np.exp(-((r / 90) ** 2)))) == []


@pytest.mark.parametrize("least", [0.009, 0.0])
def test_a_floor_and_its_mask(least):
    data = scan(lambda i, r: np.where(np.abs(r) > 60, least, lobe(i, r) + 1e-4 * np.sin(r)))
    found = [f for f in check(data) if f.name == "floor"]
    assert len(found) == 1
    value = float(found[0].remedy.split("--floor ")[1].split(";")[0])
    from gonio.measured.masking import mask

    assert "floor" not in names(mask(data, floor=value))


def test_a_lobe_on_a_constant_is_no_floor():
    """Computed: the tail of the lobe comes to the constant by degrees."""
    assert names(scan(lambda i, r: 0.01 + 0.1 * np.exp(-(((r - i) / 10) ** 2)))) == []


def test_corrections_change_uncertainties_and_tell_it():
    data = scan(lobe).assign(uncertainty=("direction", np.full(ANGLES.size * THETA_R.size, 0.002), {"units": "sr-1"}))
    halved = corrections.divide(data, 2.0)
    np.testing.assert_array_equal(halved["uncertainty"].values, 0.001)
    np.testing.assert_array_equal(halved["brdf"].values, data["brdf"].values / 2)
    assert halved["uncertainty"].attrs == {"units": "sr-1"}
    assert halved.attrs["history"].endswith("divided the values by 2")
    by_cosine = corrections.divide_cosine(data)
    ratio = by_cosine["uncertainty"].values / data["uncertainty"].values
    np.testing.assert_allclose(ratio, 1 / np.cos(np.radians(data["theta_r"].values)))


def test_at_the_horizon_a_quotient_is_missing_with_a_word():
    done = corrections.divide_cosine(make_scan([30.0, 30.0], [60.0, 90.0], [1.0, 1.0]))
    np.testing.assert_allclose(done["brdf"].values, [2.0, np.nan])
    assert "1 values at the horizon" in done.attrs["history"]


def test_a_shift_crosses_the_normal_and_stays_in_plane():
    moved = corrections.shift_theta_r(make_scan([30.0] * 3, [-1.0, 0.0, 1.0], [1.0, 2.0, 3.0]), -1.0)
    assert signed_theta_r(moved).tolist() == [-2, -1, 0]
    with pytest.raises(ValueError, match="out of plane"):
        corrections.shift_theta_r(make_scan([30.0], [30.0], [1.0], [90.0]), 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_any_values_are_looked_through_without_a_word_of_a_library(seed):
    """Few points, repeats, zeros, gaps, and values of 400 decades: warnings are errors in tests."""
    rng = np.random.default_rng(seed)
    for _ in range(40):
        n = int(rng.integers(1, 40))
        theta_i, theta_r = rng.choice([0, 10.0, 30, 89, 90], n), rng.choice(np.arange(-90, 91, 5.0), n)
        values = rng.choice([0, 1, -1, 1e-300, 1e99, 1e-99, np.nan, 0.3, 1e-12], n)
        phi = None if rng.random() < 0.5 else rng.choice([0, 45, 90, 180.0], n)
        data = make_scan(theta_i, theta_r if phi is None else np.abs(theta_r), values, phi)
        assert all(finding.name for finding in check(data))
        lobes(data)


def test_a_thousand_points_take_no_time():
    """Processor time, the best of five: 50 ms are asked, and the machine that this was written on takes 12."""
    data = scan(lobe, np.arange(10, 75, 5.0), np.arange(-80, 81, 2.0))
    check(data)
    spent = []
    for _ in range(5):
        begin = time.process_time()
        check(data)
        spent.append(time.process_time() - begin)
    assert min(spent) < 0.05
