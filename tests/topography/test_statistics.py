"""Parameters of maps whose values are known in closed form (surface.md, B.3 and B.9)."""

import math

import numpy as np
import pytest

from gonio.topography import (
    AbcSpectrum,
    correlation_lengths,
    level,
    make_heights,
    mask_outliers,
    noise_slope,
    outliers,
    roughness,
    simulate_heights,
    slopes,
    smooth,
    spectrum,
    statistics,
    structure,
)
from gonio.topography.correlation import lags
from gonio.topography.filters import high_pass, low_pass
from gonio.topography.heights import values
from gonio.topography.light.facets import facet_widths
from gonio.topography.slopes import OPERATORS

WAVELENGTH = 0.6328
MAPS = 12


def wave(period, pitch=0.5, columns=400, rows=20, amplitude=1.0):
    x = np.arange(columns) * pitch
    return make_heights(amplitude * np.sin(2 * math.pi * x / period)[None, :] + np.zeros((rows, 1)), pitch)


def plane(columns=60, rows=40):
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    return make_heights(0.1 * x + 0.05 * y, 1.0)


@pytest.fixture(scope="module")
def gaussian():
    """Maps of Gaussian heights and autocovariance: s 0.142 um, l 2 um."""
    return [simulate_heights(0.142, 2.0, points=(256, 256), pitch=0.25, seed=seed) for seed in range(MAPS)]


def test_a_sinusoid():
    found = statistics(wave(20.0))
    assert found.Sq == pytest.approx(0.707107, abs=5e-7)
    assert found.Sku == pytest.approx(1.5, abs=1e-9)
    assert found.Sa == pytest.approx(0.635310, abs=5e-7)  # sampled; 2/pi is 0.636620
    assert found.Sz == pytest.approx(2.0)
    assert found.Ssk == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("operator", "columns", "slope"),
    [("forward", 400, 0.221641), ("central", 400, 0.220689), ("seven-point", 406, 0.222144)],
)
def test_the_slope_of_a_sinusoid_by_each_operator(operator, columns, slope):
    """Ten periods, of which the rim of an operator cuts a part; the seven-point one has them whole."""
    assert statistics(wave(20.0, columns=columns), operator).Sdq == pytest.approx(slope, abs=6e-7)


@pytest.mark.parametrize(("operator", "rim"), [("forward", 1), ("central", 2), ("seven-point", 6)])
def test_over_whole_periods_a_slope_is_the_derivative_times_the_transfer(operator, rim):
    true = 2 * math.pi / 20 / math.sqrt(2)
    found = statistics(wave(20.0, columns=400 + rim), operator).Sdq
    assert found == pytest.approx(true * OPERATORS[operator].transfer(40), rel=1e-9)


@pytest.mark.parametrize(
    ("period", "forward", "central", "seven"),
    [
        (4, 0.900316, 0.636620, 0.933709),
        (8, 0.974495, 0.900316, 0.998513),
        (16, 0.993587, 0.974495, 0.999975),
        (40, 0.998972, 0.995893, 1.000000),
    ],
)
def test_what_an_operator_makes_of_a_wave(period, forward, central, seven):
    found = [OPERATORS[name].transfer(period) for name in ("forward", "central", "seven-point")]
    assert found == pytest.approx([forward, central, seven], abs=5e-7)


def test_a_plane_has_a_slope_until_it_is_levelled():
    raw = statistics(plane())
    assert raw.Sdq == pytest.approx(0.111803, abs=5e-7)
    assert 100 * raw.Sdr == pytest.approx(0.623059, abs=5e-7)
    assert statistics(level(plane())).Sq == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2, 5])
def test_a_form_of_a_degree_takes_off_that_form_and_no_more(degree):
    x, y = np.meshgrid(np.linspace(-1, 1, 50), np.linspace(-1, 1, 40))
    own = 3 + 2 * x - y + x**2 - 0.5 * x * y + y**3 * x**2
    wanted = {0: 3 + 0 * x, 1: 3 + 2 * x - y, 2: 3 + 2 * x - y + x**2 - 0.5 * x * y, 5: own}[degree]
    texture = 0.01 * np.random.default_rng(1).standard_normal(x.shape)
    texture.ravel()[::17] = np.nan
    left = level(make_heights(wanted + texture, 1.0), degree)
    assert np.nanstd(left["z"].values) == pytest.approx(np.nanstd(texture), rel=0.02)
    assert np.isnan(left["z"].values).sum() == np.isnan(texture).sum()
    with pytest.raises(ValueError, match="give 0"):
        level(left, 11)


@pytest.mark.parametrize(("ratio", "low"), [(0.5, 0.0625), (1.0, 0.5), (2.0, 0.840896), (5.0, 0.972655)])
def test_the_gaussian_filter_passes_its_share(ratio, low):
    cutoff = 10.0
    assert low_pass(ratio * cutoff, cutoff) == pytest.approx(low, abs=5e-7)
    assert high_pass(ratio * cutoff, cutoff) == pytest.approx(1 - low, abs=5e-7)
    one = wave(ratio * cutoff, columns=800, rows=60)
    middle = (slice(None), slice(100, 700))
    for filtered, share in ((smooth(one, cutoff), low), (roughness(one, cutoff), 1 - low)):
        passed = np.std(values(filtered)[middle]) / np.std(values(one)[middle])
        assert passed == pytest.approx(share, abs=5e-7)


def test_a_filter_is_not_continued_at_edges_and_holes():
    """A tilted plane stays within its heights, and missing points stay missing and change their neighbours little."""
    z = values(plane()).copy()
    z[10:13, 10:13] = np.nan
    filtered = values(smooth(make_heights(z, 1.0), 4.0))
    assert np.isnan(filtered).sum() == 9
    assert np.nanmin(filtered) >= np.nanmin(z)
    assert np.nanmax(filtered) <= np.nanmax(z)
    with pytest.raises(ValueError, match=r"give 2 um \(two pixels\) to 40 um"):
        smooth(plane(), 1.5)


def test_outliers_are_found_and_masked_not_changed():
    z = 0.01 * np.random.default_rng(0).standard_normal((60, 60))
    z[20, 30] = 5.0
    z[5, :5] = np.nan
    heights = make_heights(z, 1.0)
    assert np.argwhere(outliers(heights)).tolist() == [[20, 30]]
    masked = mask_outliers(heights)
    assert masked["mask"].values[20, 30] == 2
    assert masked["z"].values[20, 30] == 5.0
    assert statistics(masked).Sz < 0.2


def test_noise_alone_has_a_slope_that_two_maps_tell():
    """White noise of rms s gives a forward Sdq of 2 s/pitch, whatever the surface is."""
    surface = values(simulate_heights(0.142, 5.0, points=(200, 200), pitch=0.5))
    noisy = [make_heights(surface + 0.01 * np.random.default_rng(k).standard_normal((200, 200)), 0.5) for k in (1, 2)]
    assert noise_slope(*noisy, operator="forward") == pytest.approx(2 * 0.01 / 0.5, rel=0.02)
    with pytest.raises(ValueError, match="differ in size or pitch"):
        noise_slope(noisy[0], plane())


def test_a_gaussian_surface_has_its_own_numbers(gaussian):
    """Within three standard errors of the mean over the maps."""
    truth = {"Sq": 0.142, "Sa/Sq": math.sqrt(2 / math.pi), "Sdq": 0.142, "median": 0.142 * math.sqrt(math.log(2))}
    found = {name: [] for name in truth}
    for heights in gaussian:
        one = statistics(heights)
        found["Sq"].append(one.Sq)
        found["Sa/Sq"].append(one.Sa / one.Sq)
        found["Sdq"].append(one.Sdq)
        found["median"].append(facet_widths(slopes(heights)).ggx_width)
    for name, true in truth.items():
        standard_error = np.std(found[name], ddof=1) / math.sqrt(MAPS)
        assert abs(np.mean(found[name]) - true) < 3 * standard_error, name


def test_the_widths_of_facet_models(gaussian):
    found = facet_widths(slopes(gaussian[0]))
    assert found.sigma == pytest.approx(found.m / math.sqrt(2))
    assert found.m_by_median == pytest.approx(found.m, rel=0.02)
    assert found.student_c > 20  # Gaussian slopes have no tail


def test_slopes_of_ggx_are_told_by_their_median():
    """P(|grad| < t) = t^2/(w^2 + t^2): Student's t of exponent 2."""
    u = np.random.default_rng(2).random(40_000).reshape(200, 200)
    length = 0.2 * np.sqrt(u / (1 - u))
    found = facet_widths(slopes(plane())._replace(x=length, y=0 * length))
    assert found.ggx_width == pytest.approx(0.2, rel=0.02)
    assert found.student_c == pytest.approx(2.0, rel=0.03)
    assert found.student_width == pytest.approx(0.2, rel=0.03)


def test_structure_function_and_correlation_lengths(gaussian):
    """D(l) = 2 s^2 (1 - 1/e); Sal is where exp(-(r/l)^2) is 0.2; the surface has no direction."""
    at_length = [structure(heights).of(np.array([2.0]))[0] for heights in gaussian]
    error = np.std(at_length, ddof=1) / math.sqrt(MAPS)
    assert abs(np.mean(at_length) - 2 * 0.142**2 * (1 - math.exp(-1))) < 3 * error
    found = [correlation_lengths(heights) for heights in gaussian]
    assert np.mean([one.to_1_e for one in found]) == pytest.approx(2.0, rel=0.06)
    assert np.mean([one.Sal for one in found]) == pytest.approx(2.0 * math.sqrt(math.log(5)), rel=0.1)
    assert min(one.Str for one in found) > 0.75


def test_a_surface_with_a_direction_has_a_small_str():
    z = values(simulate_heights(0.1, 2.0, points=(256, 256), pitch=0.25))
    stretched = make_heights(z, 0.25, 1.0)
    found = correlation_lengths(stretched)
    assert found.Str == pytest.approx(0.25, rel=0.25)
    assert found.Sal == pytest.approx(2.0 * math.sqrt(math.log(5)), rel=0.15)


def test_missing_points_change_little(gaussian):
    """5 % of the points at random, by less than the scatter over maps."""
    scatter = {
        "Sq": np.std([statistics(h).Sq for h in gaussian], ddof=1),
        "D": np.std([structure(h).of(np.array([2.0]))[0] for h in gaussian], ddof=1),
        "S2": np.std([spectrum(h).rms(0.1, 1.0) for h in gaussian], ddof=1),
    }
    whole = gaussian[0]
    z = values(whole).copy()
    z[np.random.default_rng(7).random(z.shape) < 0.05] = np.nan
    holes = make_heights(z, 0.25)
    assert abs(statistics(holes).Sq - statistics(whole).Sq) < scatter["Sq"]
    change = structure(holes).of(np.array([2.0]))[0] - structure(whole).of(np.array([2.0]))[0]
    assert abs(change) < scatter["D"]
    assert abs(spectrum(holes).rms(0.1, 1.0) - spectrum(whole).rms(0.1, 1.0)) < scatter["S2"]


def test_lags_are_means_over_pairs():
    """Against the sum over pairs itself, with holes and pixels that are not square."""
    z = np.random.default_rng(3).standard_normal((8, 10))
    z[2, 3] = z[5, 5] = np.nan
    found = lags(make_heights(z, 0.5, 0.7))
    for row, dy in enumerate(range(-4, 5)):
        for column, dx in enumerate(range(-5, 6)):
            a = z[max(dy, 0) : 8 + min(dy, 0), max(dx, 0) : 10 + min(dx, 0)]
            b = z[max(-dy, 0) : 8 + min(-dy, 0), max(-dx, 0) : 10 + min(-dx, 0)]
            assert found.squared[row, column] == pytest.approx(np.nanmean((a - b) ** 2), abs=1e-12)
    assert found.x[0] == -2.5
    assert found.y[-1] == pytest.approx(2.8)


def test_the_spectrum_sums_to_the_squared_height_and_has_its_shape(gaussian):
    """S2 = pi s^2 l^2 exp(-(pi l f)^2), whose integral is s^2."""
    found = [spectrum(heights) for heights in gaussian]
    assert np.mean([one.rms() for one in found]) == pytest.approx(0.142, rel=0.05)
    f = found[0].f
    expected = math.pi * (0.142 * 2) ** 2 * np.exp(-((math.pi * 2 * f) ** 2))
    inside = (f > 0.05) & (f < 0.4)
    mean = np.mean([one.radial for one in found], axis=0)
    assert mean[inside] / expected[inside] == pytest.approx(1.0, abs=0.3)
    assert (mean / expected)[inside].mean() == pytest.approx(1.0, abs=0.05)


def test_the_closed_forms_of_an_abc_spectrum():
    abc = AbcSpectrum(A=1e-3, B=10.0, C=3.2)
    end = 1 / WAVELENGTH
    assert abc.rms(0, math.inf) == pytest.approx(0.00723601, abs=5e-9)
    for least, most, height, slope in (
        (0.0, end, 0.00710329, 0.01521996),
        (0.01, end, 0.00708132, 0.01521994),
        (0.01, 2 * end, 0.00715670, 0.02097734),
    ):
        assert abc.rms(least, most) == pytest.approx(height, abs=5e-9)
        assert abc.slope(least, most) == pytest.approx(slope, abs=5e-9)


def test_a_profile_of_an_abc_spectrum_is_the_integral_over_the_other_frequency():
    abc = AbcSpectrum(A=1e-3, B=10.0, C=3.2)
    t = np.linspace(0, math.atan(1e5), 400_001)
    fy, weight = np.tan(t), 1 / np.cos(t) ** 2
    for fx in (0.0, 0.05, 1.0):
        area = 2 * np.trapezoid(abc.two(np.hypot(fx, fy)) * weight, t)
        assert abc.profile(fx) == pytest.approx(area, rel=1e-5)
    f = np.linspace(0, 1 / WAVELENGTH, 200_001)
    assert abc.rms(0, f[-1]) == pytest.approx(math.sqrt(np.trapezoid(2 * math.pi * f * abc.two(f), f)), rel=1e-7)
