"""Scatter of rough surfaces: the identities and limits of the Kirchhoff family (the printed values are in the TOML)."""

import math

import numpy as np
import pytest
from scipy.special import erfc, gammaln, i0e

from gonio import Geometry, catalogue
from gonio.models.harvey2007 import _bessel, renormalisation
from gonio.models.he1991 import _apparent_height
from gonio.optics.facets import beckmann_slopes
from gonio.optics.kirchhoff import diffracted, kirchhoff_obliquity, phase_variance, shift_squared
from gonio.plausibility import hemispherical_reflectance

AL = {"index": 1.37, "extinction": 7.62}
WAVELENGTH = 0.6328


def anywhere(n=500):
    random = np.random.default_rng(1)
    return Geometry.from_degrees(random.uniform(0, 88, n), random.uniform(0, 88, n), random.uniform(0, 360, n))


def test_distance_to_the_mirror_direction():
    """2 cos b sin a is the distance of the direction cosines."""
    g = anywhere()
    sin_alpha_squared = g.tan_alpha_squared * g.cos_alpha**2
    np.testing.assert_allclose(shift_squared(g), 4 * g.cos_beta**2 * sin_alpha_squared, rtol=1e-12)


@pytest.mark.parametrize("sigma", [0.002, 0.1, 0.31, 0.33, 0.6, 2.0])
def test_kernel_against_the_series(sigma):
    """The full series, summed over every term that counts; g = 40 is crossed between the heights.

    Samples beyond it are good to 2e-11, where Stirling's formula meets the series.
    """
    g = anywhere(40)
    length = 4 * sigma + 0.5
    variance = phase_variance(g, sigma, WAVELENGTH)[:, None]
    m = np.arange(1, 6000)
    tail = (math.pi * length / WAVELENGTH) ** 2 * shift_squared(g)[:, None]
    terms = np.exp(m * np.log(variance) - variance - gammaln(m + 1) - np.log(m) - tail / m)
    expected = math.pi * (length / WAVELENGTH) ** 2 * terms.sum(axis=1)
    found = diffracted(g, sigma, length, WAVELENGTH)
    np.testing.assert_allclose(found, expected, rtol=3e-11, atol=1e-13 * expected.max())


@pytest.mark.parametrize("sigma", [0.002, 0.1, 0.31, 2.0])
@pytest.mark.parametrize("length", [0.5, 30.0])
def test_kernel_of_libraries_that_sum_every_term(sigma, length):
    """NumPy leaves out what does not count, down to values that are no part of any light."""
    xp = pytest.importorskip("array_api_strict")
    angles = np.random.default_rng(1).uniform([[0], [0], [0]], [[88], [88], [360]], (3, 300))
    found = diffracted(Geometry.from_degrees(*angles), *(np.asarray(v) for v in (sigma, length, WAVELENGTH)))
    every = diffracted(
        Geometry.from_degrees(*(xp.asarray(a) for a in angles)), *(xp.asarray(v) for v in (sigma, length, WAVELENGTH))
    )
    every = np.asarray(every)
    counts = every > 1e-200 * every.max()
    # exponents of some hundreds round to 1e-13
    np.testing.assert_allclose(found[counts], every[counts], rtol=1e-12)


def test_candidates_that_share_parameters():
    """Kernel and renormalisation of several candidates, two of them alike, are those of each alone."""
    g = Geometry.from_degrees(np.repeat([10.0, 50.0], 20), np.tile(np.linspace(0, 80, 20), 2), 160.0)
    model = catalogue["modified-beckmann-kirchhoff"]
    shape = {"sigma": [0.05, 0.4, 0.05], "length": [2.0, 5.0, 2.0], "index": [1.4, 1.5, 1.6], "extinction": [7.0] * 3}
    together = model.basis(g, {name: np.array(values)[:, None] for name, values in shape.items()})["scale"]
    alone = [model.basis(g, {name: values[k] for name, values in shape.items()})["scale"] for k in range(3)]
    np.testing.assert_allclose(together, alone, rtol=1e-13)


def test_kernel_has_no_step_where_sampling_begins():
    g = Geometry.from_degrees(30.0, np.linspace(0, 60, 13), 180.0)
    edge = math.sqrt(40.0) * WAVELENGTH / (2 * math.pi) / (g.cos_i + g.cos_r)
    below, above = (diffracted(g, edge * (1 + side), 3.0, WAVELENGTH) for side in (-1e-12, 1e-12))
    np.testing.assert_allclose(above, below, rtol=1e-10)


def test_rough_limit_is_beckmanns_facets():
    """Original Beckmann-Kirchhoff of a very rough surface: facets of slope 2 sigma/length, nothing masked."""
    g = anywhere()
    sigma, length = 10.0, 40.0
    facets = beckmann_slopes(g, 2 * sigma / length) / (4 * g.cos_i * g.cos_r)
    found = kirchhoff_obliquity(g) * diffracted(g, sigma, length, WAVELENGTH)
    near = (g.tan_alpha_squared < 0.5) & (g.cos_i + g.cos_r > 1)
    assert near.sum() > 100
    np.testing.assert_allclose(found[near] / facets[near], 1.0, rtol=1.5e-3)
    mirror = Geometry.from_degrees(30.0, 30.0, 180.0)
    ratio = kirchhoff_obliquity(mirror) * diffracted(mirror, sigma, length, WAVELENGTH)
    ratio *= 4 * mirror.cos_i * mirror.cos_r / beckmann_slopes(mirror, 2 * sigma / length)
    assert ratio == pytest.approx(1.0, abs=1.5e-4)


def test_smooth_limits():
    """Generalised Harvey-Shack at small heights is the spectrum of heights times (4 pi^2/lambda^4)(cos_i + cos_r)^2."""
    g = anywhere()
    sigma, length = 1e-5, 0.3  # short: the second order of the series outlives the first far from the mirror
    spectrum = math.pi * sigma**2 * length**2 * np.exp(-((math.pi * length / WAVELENGTH) ** 2) * shift_squared(g))
    expected = 4 * math.pi**2 / WAVELENGTH**4 * (g.cos_i + g.cos_r) ** 2 * spectrum
    np.testing.assert_allclose(diffracted(g, sigma, length, WAVELENGTH), expected, rtol=1e-3)


def test_rayleigh_rice_polarisation_against_complex_amplitudes():
    """The azimuth-free real form of the model against the four printed amplitudes."""
    random = np.random.default_rng(2)
    t_i, t_r, phi = random.uniform(0.1, 88, 300), random.uniform(0.1, 88, 300), random.uniform(0, 360, 300)
    model = catalogue["rayleigh-rice"]
    for n, k in [(1.37, 7.62), (1.5, 0.0), (0.6, 0.0), (0.25, 3.4)]:
        values = {"A": 1.0, "C": 2.0, "B": 1e-9, "index": n, "extinction": k}
        found = model(Geometry.from_degrees(t_i, t_r, phi), values)
        e = complex(n, k) ** 2
        i, r, p = np.radians(t_i), np.radians(t_r), np.radians(phi) - math.pi
        ci, cr, qi, qr = np.cos(i), np.cos(r), np.sqrt(e - np.sin(i) ** 2), np.sqrt(e - np.sin(r) ** 2)
        ss = (e - 1) * np.cos(p) / ((ci + qi) * (cr + qr))
        pp = (e - 1) * (e * np.sin(i) * np.sin(r) - qi * qr * np.cos(p)) / ((e * ci + qi) * (e * cr + qr))
        ps = (e - 1) * qi * np.sin(p) / ((e * ci + qi) * (cr + qr))
        sp = (e - 1) * qr * np.sin(p) / ((ci + qi) * (e * cr + qr))
        q = sum(abs(amplitude) ** 2 for amplitude in (ss, pp, ps, sp)) / 2
        np.testing.assert_allclose(found, 16 * math.pi**2 * ci * cr * q, rtol=1e-9)


def test_apparent_height_solves_its_equation():
    """The fixed number of Newton steps is enough from smooth to steep, and up to grazing."""
    angles = np.array([0.0, 1.0, 30.0, 60.0, 80.0, 89.0, 89.9, 89.9999])
    g = Geometry.from_degrees(angles, 89.9, 180.0)
    for sigma, length in [(0.001, 100.0), (0.1, 1.5), (1.0, 1.0), (10.0, 0.1)]:
        z = np.sqrt((sigma / _apparent_height(g, sigma, length)) ** 2 - 1)
        tan = [np.sqrt(1 - c**2) / c for c in (g.cos_i, g.cos_r)]
        with np.errstate(divide="ignore"):
            seen = sum(t * erfc(length / (2 * sigma * t)) for t in tan)
        np.testing.assert_allclose(z * np.exp(z**2 / 2), seen / math.sqrt(8 * math.pi), rtol=1e-9, atol=1e-9)


def test_energy_of_he_torrance_on_aluminium():
    """Directional-diffuse light and the exp(-g) of the mirror direction together are the reflectance of the metal."""
    model = catalogue["he-torrance"]
    values = {"scale": 1.0, "sigma": 0.1, "length": 1.5, **AL}
    diffuse = hemispherical_reflectance(lambda g: model(g, values), 0.0)
    mirror = 0.913946 * math.exp(-((4 * math.pi * 0.1 / WAVELENGTH) ** 2))
    assert diffuse == pytest.approx(0.896, abs=6e-4)
    assert mirror == pytest.approx(0.018, abs=6e-4)


def test_modified_beckmann_kirchhoff_is_the_kernel_renormalised():
    """Without its renormalisation it is the row of the specification, and only that breaks its reciprocity."""
    g = anywhere()
    shape = {"sigma": 0.05, "length": 2.0, "wavelength": WAVELENGTH, "index": 1.0, "extinction": 1e9}
    found = catalogue["modified-beckmann-kirchhoff"](g, {"scale": 1.0, **shape})
    gain = renormalisation(np.radians(g.theta_i_deg), *(np.asarray(v) for v in (0.05, 2.0, WAVELENGTH)))
    np.testing.assert_allclose(
        found / gain, catalogue["generalised-harvey-shack"](g, {"scale": 1.0, **shape}), rtol=1e-12
    )
    assert np.ptp(gain) > 0.01


@pytest.mark.parametrize(
    ("sigma", "length", "theta_i"),
    [(0.002, 0.2, 30.0), (0.05, 2.0, 0.0), (0.05, 2.0, 70.0), (0.2, 0.1, 80.0), (0.3, 1.0, 40.0), (0.6, 3.0, 75.0)],
)
def test_renormalised_scatter_is_what_the_mirror_direction_loses(sigma, length, theta_i):
    """Scattered light and exp(-g) in the mirror direction add up, by quadrature over both angles."""
    values = {"scale": 1.0, "sigma": sigma, "length": length, "index": 1.0, "extinction": 1e9}
    model = catalogue["modified-beckmann-kirchhoff"]
    scattered = hemispherical_reflectance(lambda g: model(g, values), theta_i, nodes=300)
    mirror = math.exp(-((4 * math.pi * sigma / WAVELENGTH * math.cos(math.radians(theta_i))) ** 2))
    assert scattered + mirror == pytest.approx(1, abs=2e-6)


def test_renormalisation_against_all_orders_on_a_dense_grid():
    """From narrow to broad lobes and up to grazing; rougher surfaces are held to their energy above."""
    random = np.random.default_rng(4)
    for _ in range(12):
        wavelength, theta = 10 ** random.uniform(-1, 1.3), math.radians(random.uniform(0, 89.5))
        sigma, length = wavelength * 10 ** random.uniform(-3, -0.2), 10 ** random.uniform(-1, 2)
        a, k = math.pi * length / wavelength, 2 * math.pi * sigma / wavelength
        farthest = 8 * math.sqrt((2 * k) ** 2 + 12 * k + 8) / a
        least, greatest = (math.asin(np.clip(math.sin(theta) + s * farthest, 0, 1)) for s in (-1, 1))
        x, w = np.polynomial.legendre.leggauss(600)
        theta_r = least + (greatest - least) * (x + 1) / 2
        sin_r, cos_r = np.sin(theta_r), np.cos(theta_r)
        shift = sin_r - math.sin(theta)
        variance = (k * (math.cos(theta) + cos_r)) ** 2
        m = np.arange(1, 300)[:, None]
        orders = np.exp(m * np.log(variance) - variance - gammaln(m + 1) - np.log(m) - (a * shift) ** 2 / m)
        density = 2 * a**2 * (orders * i0e(2 * a**2 * math.sin(theta) * sin_r / m)).sum(axis=0) * sin_r * cos_r
        scattered = np.sum(w * density) * (greatest - least) / 2
        lost = -math.expm1(-((2 * k * math.cos(theta)) ** 2))
        found = renormalisation(*(np.asarray(v) for v in (theta, sigma, length, wavelength)))
        assert found == pytest.approx(lost / scattered, rel=2e-6)


def test_scaled_bessel_function():
    x = np.concatenate([[0.0], np.geomspace(1e-6, 1e8, 2000)])
    np.testing.assert_allclose(_bessel(x), i0e(x), rtol=1e-6)
