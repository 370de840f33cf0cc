"""The light of a surface: every vector of surface.md B.4 to B.6, gonio's own scatter models, and phase screens."""

import math

import numpy as np
import pytest

import gonio
from gonio.geometry import Geometry
from gonio.topography import (
    Light,
    diffracted,
    effective_slope,
    exponential_structure,
    gaussian_structure,
    level,
    make_heights,
    phase_variance,
    predict,
    predict_like,
    scattered_share,
    seen_by_light,
    simulate_heights,
    slopes,
    structure,
)
from gonio.topography.correlation import lags
from gonio.topography.heights import values
from gonio.topography.light.diffraction import diffracted_along, obliquity
from gonio.topography.light.facets import facets_brdf
from gonio.topography.spectrum import AbcSpectrum

WAVELENGTH = 0.6328
SCREENS = 6
DIRECTIONS = [(0, 5, 180), (40, 38, 180), (40, 10, 180), (30, 20, 90)]


def at(directions):
    return Geometry.from_degrees(*np.array(directions, dtype=float).T)


@pytest.mark.parametrize(
    ("rms", "theta_i", "g", "scattered"),
    [(0.002, 0, 0.001577, 0.001576), (0.07, 40, 1.133942, 0.678238), (0.142, 40, 4.666287, 0.990593)],
)
def test_phase_variance_and_scattered_share(rms, theta_i, g, scattered):
    found = phase_variance(rms, theta_i, WAVELENGTH)
    assert found == pytest.approx(g, abs=6e-7)
    assert scattered_share(found) == pytest.approx(scattered, abs=6e-7)


@pytest.mark.parametrize(
    ("rms", "length", "brdf"),
    [
        (0.05, 2.0, (8.00170, 11.28053, 6.155331e-4, 1.792436e-5)),
        (0.5, 5.0, (1.92197, 3.32599, 0.425759, 0.145239)),
        (0.142, 2.0, (4.054420, 8.169372, 0.1544672, 0.02978804)),
    ],
)
def test_gaussian_heights_scatter_as_printed_and_as_gonios_own_model(rms, length, brdf):
    found = diffracted(at(DIRECTIONS), gaussian_structure(rms, length), WAVELENGTH)
    assert found == pytest.approx(brdf, rel=2e-6)  # the printed digits
    model = gonio.catalogue["generalised-harvey-shack"]
    fixed = {"scale": 1.0, "sigma": rms, "length": length, "index": 1e6, "wavelength": WAVELENGTH, "extinction": 0.0}
    grid = np.array([(i, r, p) for i in (0, 30, 60) for r in (0, 20, 45, 70) for p in (0, 90, 180)], dtype=float)
    own = np.asarray(model(at(grid), fixed))
    found = diffracted(at(grid), gaussian_structure(rms, length), WAVELENGTH)
    large = own > 1e-9 * own.max()  # below, both are rounding of the sum
    assert found[large] == pytest.approx(own[large], rel=1e-5)


def test_with_the_kirchhoff_obliquity_it_is_gonios_beckmann_kirchhoff():
    fixed = {"scale": 1.0, "sigma": 0.2, "length": 2.0, "index": 1e6, "extinction": 0.0, "wavelength": WAVELENGTH}
    own = np.asarray(gonio.catalogue["beckmann-kirchhoff"](at(DIRECTIONS), fixed))
    g = at(DIRECTIONS)
    found = obliquity(g, "kirchhoff") * diffracted(g, gaussian_structure(0.2, 2.0), WAVELENGTH)
    assert found == pytest.approx(own, rel=1e-5)


@pytest.mark.parametrize(
    ("rms", "brdf", "first_order"),
    [
        (0.02, (0.969223, 5.872015, 6.190331e-3), (1.030549, 6.329074, 6.207806e-3)),
        (0.142, (2.448060, 10.90823, 0.2236827), (51.95, 319.05, 0.312935)),
    ],
)
def test_the_smooth_limit_is_first_order_in_the_spectrum(rms, brdf, first_order):
    """Exponential autocovariance, whose spectrum is ABC with C = 3, B = 2 pi l, A = 2 pi s^2 l^2."""
    g, length = at(DIRECTIONS[:3]), 3.0
    found = diffracted(g, exponential_structure(rms, length), WAVELENGTH)
    assert found == pytest.approx(brdf, rel=1e-6)
    abc = AbcSpectrum(A=2 * math.pi * (rms * length) ** 2, B=2 * math.pi * length, C=3.0)
    shift = np.hypot(g.x_i + g.x_r, g.y_i + g.y_r)
    k_z = 2 * math.pi / WAVELENGTH * (g.cos_i + g.cos_r)
    assert k_z**2 * abc.two(shift / WAVELENGTH) / WAVELENGTH**2 == pytest.approx(first_order, rel=2e-5)
    tiny = diffracted(g, exponential_structure(rms / 1000, length), WAVELENGTH)
    assert tiny == pytest.approx(k_z**2 * abc.two(shift / WAVELENGTH) / WAVELENGTH**2 * 1e-6, rel=1e-3)


def test_the_rough_limit_is_facets_with_the_kirchhoff_obliquity_alone():
    """It is eq 3 with G = 1; Harvey-Shack lacks cos theta_i cos theta_r cos^2 alpha/cos^2 beta."""
    rms, length = 30.0, 300.0
    g = at([(30, 30, 180), (30, 20, 180), (50, 45, 180), (30, 25, 160)])
    kernel = diffracted(g, gaussian_structure(rms, length), WAVELENGTH)
    slope = math.sqrt(2) * rms / length
    facets = np.exp(-g.tan_alpha_squared / (2 * slope**2)) / (
        2 * math.pi * slope**2 * g.cos_alpha**4 * 4 * g.cos_i * g.cos_r
    )
    assert kernel * obliquity(g, "kirchhoff") == pytest.approx(facets, rel=1e-3)
    assert kernel == pytest.approx(facets * g.cos_i * g.cos_r * g.cos_alpha**2 / g.cos_beta**2, rel=1e-3)


@pytest.mark.parametrize(
    ("surface", "rows"),
    [
        (
            gaussian_structure(0.142, math.sqrt(2)),
            {0: (0.518456, 0.137360), 40: (0.694528, 0.133853), 60: (1.182566, 0.120441)},
        ),
        (
            exponential_structure(0.142, 3.0),
            {0: (0.403195, 0.176627), 40: (0.723553, 0.128484), 60: (2.097695, 0.067898)},
        ),
    ],
)
def test_the_slope_that_light_sees(surface, rows):
    for theta_i, (distance, slope) in rows.items():
        found = effective_slope(surface, theta_i, WAVELENGTH)
        assert found == pytest.approx((distance, slope), abs=6e-7)
    assert all(map(math.isnan, effective_slope(gaussian_structure(0.02, 2.0), 0, WAVELENGTH)))


def test_the_band_that_light_sees():
    heights = level(simulate_heights(0.142, 2.0, points=(256, 256), pitch=0.25))
    found = seen_by_light(heights, WAVELENGTH, [0, 40])
    assert (found.least, found.most) == pytest.approx((1 / 64, 1 / WAVELENGTH))
    assert found.Sq_rel == pytest.approx(0.142, rel=0.15)  # of one map, whose rim the window does not see
    assert found.at[1].g == pytest.approx(phase_variance(found.Sq_rel, 40, WAVELENGTH))
    assert found.at[1].scattered == pytest.approx(-math.expm1(-found.at[1].g))
    assert found.warnings == ()
    narrow = seen_by_light(heights, WAVELENGTH, [0], least=0.4)
    assert narrow.Sq_rel < 0.3 * found.Sq_rel
    coarse = make_heights(values(heights)[::2, ::2], 0.5)
    (warning,) = seen_by_light(coarse, WAVELENGTH, [0]).warnings
    assert "resolves frequencies up to 1/um, and light of 632.8 nm sees up to 1.58/um" in warning
    assert "less than 10 periods" in seen_by_light(heights, WAVELENGTH, [0], least=0.05).warnings[0]
    with pytest.raises(ValueError, match="nothing between"):
        seen_by_light(heights, 100.0, [0])


def test_phase_screens_scatter_as_their_structure_function_says():
    """The Fourier transform of exp(i k_z z) itself, in a ring about the frequency of theta_r 15 deg (B.5 d)."""
    shift, k_z = math.sin(math.radians(15)), 2 * math.pi / WAVELENGTH * (1 + math.cos(math.radians(15)))
    g = at([(0, 15, 180)])
    truth = float(diffracted(g, gaussian_structure(0.142, 2.0), WAVELENGTH)[0])
    assert truth == pytest.approx(1.6165, abs=6e-5)
    screens, predicted = [], []
    for seed in range(SCREENS):
        heights = simulate_heights(0.142, 2.0, points=(384, 384), pitch=0.2, seed=seed)
        light = np.abs(np.fft.fft2(np.exp(1j * k_z * values(heights)))) ** 2 * 0.2**2 / (384**2 * WAVELENGTH**2)
        f = np.hypot(*np.meshgrid(np.fft.fftfreq(384, 0.2), np.fft.fftfreq(384, 0.2)))
        screens.append(float(light[np.abs(f - shift / WAVELENGTH) < 0.01].mean()))
        predicted.append(float(diffracted(g, structure(heights), WAVELENGTH)[0]))
    error = np.std(screens, ddof=1) / math.sqrt(SCREENS)
    assert abs(np.mean(screens) - truth) < 4 * error
    assert np.mean(predicted) == pytest.approx(truth, rel=0.03)  # what estimating D costs
    assert abs(np.mean(predicted) - np.mean(screens)) < 4 * error + 0.03 * truth


def test_a_surface_without_a_direction_scatters_alike_by_both_transforms():
    heights = level(simulate_heights(0.142, 2.0, points=(256, 256), pitch=0.2, seed=1))
    g, found, surface = at([(20, 5, 180), (20, 30, 180), (40, 20, 180)]), lags(heights), structure(heights)
    both = diffracted_along(g, found, surface.variance, WAVELENGTH), diffracted(g, surface, WAVELENGTH)
    assert both[0] == pytest.approx(both[1], rel=0.25)  # one map, whose two directions scatter


def test_a_surface_with_a_direction_scatters_across_it():
    z = values(simulate_heights(0.1, 1.0, points=(200, 200), pitch=0.15))
    ridges = level(make_heights(z, 0.15, 0.75))  # five times longer along y
    light = Light(wavelength=632.8)
    across = predict(ridges, [20.0], [40.0], light)
    assert "two-dimensional structure function" in across.attrs["history"]
    turned = across.assign_coords(phi_i=("direction", [90.0]))
    along = predict_like(ridges, turned, light)
    assert across["brdf"].values[0] > 5 * abs(along["brdf"].values[0])


@pytest.fixture(scope="module")
def heights():
    return level(simulate_heights(0.142, math.sqrt(2), points=(160, 160), pitch=0.2, seed=1))


def test_a_prediction_is_a_scan_with_uncertainty_that_says_what_it_is(heights, tmp_path):
    light = Light(wavelength=632.8, index=1.37, extinction=7.62)
    scan = predict(heights, [20, 40], np.arange(-60, 61, 10.0), light)
    assert scan["brdf"].attrs["units"] == "sr-1"
    assert scan.attrs["simulated"] == "simulated from the heights of a height map"
    assert "wave optics, isotropic structure function, harvey-shack obliquity" in scan.attrs["history"]
    assert (scan["uncertainty"].values > 0).all()
    truth = gonio.simulate(
        gonio.catalogue["generalised-harvey-shack"],
        {"scale": 1, "sigma": 0.142, "length": math.sqrt(2), "index": 1.37, "extinction": 7.62, "wavelength": 0.6328},
        [20, 40],
        np.arange(-60, 61, 10.0),
    )
    large = truth["brdf"].values > 0.05
    distance = (scan["brdf"].values - truth["brdf"].values)[large] / scan["uncertainty"].values[large]
    assert np.abs(distance).max() < 4
    gonio.write(scan, tmp_path / "scan.nc")
    again = gonio.read(tmp_path / "scan.nc")
    assert again.attrs["simulated"].startswith("simulated from the")
    same = predict_like(heights, scan, light)
    assert same["brdf"].values == pytest.approx(scan["brdf"].values, rel=1e-9)


def test_reflectance_and_the_light_that_stays_in_the_mirror(heights):
    bare = predict(heights, [20], [15, 20, 22], Light(wavelength=632.8))
    metal = predict(heights, [20], [15, 20, 22], Light(wavelength=632.8, index=1.37, extinction=7.62))
    assert metal["brdf"].values / bare["brdf"].values == pytest.approx(0.91, abs=0.02)
    cone = predict(heights, [20], [15, 20, 22], Light(wavelength=632.8, half_angle=0.5))
    more = cone["brdf"].values - bare["brdf"].values
    solid = 2 * math.pi * (1 - math.cos(math.radians(0.5)))
    g = phase_variance(structure(heights).rms, 20, WAVELENGTH)
    assert more == pytest.approx([0, math.exp(-g) / (solid * math.cos(math.radians(20))), 0], rel=1e-6, abs=1e-9)


def test_the_obliquity_follows_the_roughness_and_is_said():
    rough = level(simulate_heights(0.3, 3.0, points=(128, 128), pitch=0.3))
    said = predict(rough, [0, 75], [10], Light(wavelength=632.8)).attrs["history"]
    assert "harvey-shack obliquity at theta_i 75, kirchhoff obliquity at theta_i 0" in said
    assert "Smith's masking beyond 60 deg" in said
    with pytest.raises(ValueError, match="choose auto, harvey-shack, kirchhoff"):
        predict(rough, [0], [10], Light(wavelength=632.8), factor="none")
    with pytest.raises(ValueError, match="by waves, by characteristic or by slopes, not by 'guess'"):
        predict(rough, [0], [10], Light(wavelength=632.8), by="guess")
    with pytest.raises(ValueError, match="from 0 to below 90 deg"):
        predict(rough, [90], [10], Light(wavelength=632.8))


def test_rough_surfaces_scatter_alike_by_waves_and_by_slopes():
    rough = level(simulate_heights(1.5, 10.0, points=(256, 256), pitch=0.5, seed=3))
    light, angles = Light(wavelength=632.8), [0, 10, 20, 30, 40]
    waves = predict(rough, [20], angles, light)["brdf"].values
    mirrors = predict(rough, [20], angles, light, by="slopes")
    assert "slopes as facets, seven-point operator" in mirrors.attrs["history"]
    assert waves / mirrors["brdf"].values == pytest.approx(1.0, abs=0.12)


def test_the_slopes_of_gaussian_heights_are_gaussian_facets_with_smiths_masking():
    found = slopes(simulate_heights(0.5, 5.0, points=(512, 512), pitch=0.5, seed=4))
    g = at([(20, 20, 180), (20, 30, 180), (70, 60, 180), (60, 75, 180)])
    own = gonio.catalogue["beckmann"](g, {"rho_s": 1.0, "rho_d": 0.0, "m": found.rms, "index": 1e6, "extinction": 0.0})
    assert facets_brdf(g, found) == pytest.approx(np.asarray(own), rel=0.05)


def test_the_spread_is_that_of_the_quarters(heights):
    small = level(simulate_heights(0.142, 1.0, points=(24, 24), pitch=0.2))
    scan = predict(small, [20], [10], Light(wavelength=632.8))
    assert "uncertainty" not in scan
    assert "uncertainty: none: the map is too small to divide" in scan.attrs["history"]
    parts = [heights.isel(y=slice(a, a + 80), x=slice(b, b + 80)) for a in (0, 80) for b in (0, 80)]
    each = [predict(level(part), [20], [10], Light(wavelength=632.8))["brdf"].values[0] for part in parts]
    whole = predict(heights, [20], [10], Light(wavelength=632.8))
    assert whole["uncertainty"].values[0] == pytest.approx(np.std(each, ddof=1))
