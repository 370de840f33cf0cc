"""The characteristic function of differences of height: Gaussian, of two levels, of phase screens (surface.md, B.5)."""

import math

import numpy as np
import pytest

from gonio.geometry import Geometry
from gonio.topography import (
    Light,
    characteristic,
    gaussian_structure,
    make_heights,
    predict,
    simulate_heights,
    structure,
)
from gonio.topography.correlation import lags
from gonio.topography.heights import values
from gonio.topography.light.characteristic import diffracted_by_heights
from gonio.topography.light.diffraction import diffracted

WAVELENGTH = 0.6328
MAPS = 5


def at(*directions):
    return Geometry.from_degrees(*np.array(directions, dtype=float).T)


def two_levels(depth, missing=0):
    """Plateaus 3 um wide and pits of one depth [um], as an etched surface has them."""
    z = np.where(values(simulate_heights(1.0, 3.0, points=(128, 160), pitch=0.25, seed=1)) > 0, depth, 0.0)
    z.ravel()[:missing] = np.nan
    return make_heights(z, 0.25, 0.2)


@pytest.mark.parametrize(
    ("rms", "length", "size", "pitch", "truth"), [(0.142, 2.0, 256, 0.25, 1.6165), (0.5, 5.0, 320, 0.25, 1.3381)]
)
def test_it_scatters_as_phase_screens_do(rms, length, size, pitch, truth):
    """The Fourier transform of exp(i k_z z) itself, in a ring about the frequency of theta_r 15 deg (B.5 d).

    Both come from the same maps, of which they keep different lags: they differ by less than one of them scatters.
    """
    g, shift = at((0, 15, 180)), math.sin(math.radians(15))
    k_z = 2 * math.pi / WAVELENGTH * (1 + math.cos(math.radians(15)))
    assert diffracted(g, gaussian_structure(rms, length), WAVELENGTH)[0] == pytest.approx(truth, abs=5.1e-5)
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(size, pitch), np.fft.fftfreq(size, pitch)))
    ring = np.abs(f - shift / WAVELENGTH) < 0.01
    screens, found = [], []
    for seed in range(MAPS):
        heights = simulate_heights(rms, length, points=(size, size), pitch=pitch, seed=seed)
        light = np.abs(np.fft.fft2(np.exp(1j * k_z * values(heights)))) ** 2 * (pitch / size / WAVELENGTH) ** 2
        screens.append(float(light[ring].mean()))
        found.append(float(diffracted_by_heights(g, heights, WAVELENGTH)[0][0]))
    for estimates in (screens, found):
        error = np.std(estimates, ddof=1) / math.sqrt(MAPS)
        assert abs(np.mean(estimates) - truth) < 4 * error
        assert error < 0.1 * truth


def test_of_gaussian_heights_it_is_that_of_the_structure_function():
    """It is exp(-k_z^2 D/2) at a lag of the correlation length, in the mean over maps."""
    k_z, maps = 4.0, [simulate_heights(0.2, 2.0, points=(200, 200), pitch=0.25, seed=seed) for seed in range(MAPS)]
    found = [characteristic(heights, k_z) for heights in maps]
    there = [one.chi.real[np.isclose(np.hypot(*np.meshgrid(one.x, one.y)), 2.0)].mean() for one in found]
    expected = math.exp(-(k_z**2) * 0.2**2 * (1 - math.exp(-1)))
    error = np.std(there, ddof=1) / math.sqrt(MAPS)
    assert abs(np.mean(there) - expected) < 3 * error
    assert found[0].settled == pytest.approx(math.exp(-(k_z**2) * 0.2**2), abs=0.1)
    middle = tuple(n // 2 for n in found[0].chi.shape)
    assert found[0].chi[middle] == pytest.approx(1.0)


@pytest.mark.parametrize("missing", [0, 400])
@pytest.mark.parametrize("turn", [0.25, 0.5, 0.8])
def test_of_two_levels_it_is_a_closed_form(turn, missing):
    """Heights differ by the depth or not at all: chi = 1 - P (1 - cos phase), and D = P depth^2, at every lag."""
    k_z = 4 * math.pi / WAVELENGTH
    heights = two_levels(turn * WAVELENGTH / 2, missing)
    differ = lags(heights).squared / (turn * WAVELENGTH / 2) ** 2
    found = characteristic(heights, k_z)
    np.testing.assert_allclose(found.chi.real, 1 - differ * (1 - math.cos(2 * math.pi * turn)), atol=1e-9)


def test_pits_of_half_a_wavelength_scatter_nothing():
    """A phase of one turn is none: all light stays in the mirror direction. The structure function cannot say so."""
    heights, g = two_levels(WAVELENGTH / 2), at((0, 0, 180), (0, 0.01, 180))
    light, in_phase = diffracted_by_heights(g, heights, WAVELENGTH)
    assert np.abs(light).max() < 1e-3
    assert in_phase == pytest.approx(1.0, abs=1e-6)
    assert diffracted(g, structure(heights), WAVELENGTH).min() > 1
    half, _ = diffracted_by_heights(at((0, 0, 180)), two_levels(WAVELENGTH / 4), WAVELENGTH)
    quarter, _ = diffracted_by_heights(at((0, 0, 180)), two_levels(WAVELENGTH / 8), WAVELENGTH)
    assert half / quarter == pytest.approx(2.0)  # as 1 - cos of half a turn over that of a quarter


def test_a_surface_with_a_direction_scatters_across_it():
    z = values(simulate_heights(0.1, 1.0, points=(160, 160), pitch=0.15))
    ridges = make_heights(z, 0.15, 0.75)  # five times longer along y
    g = at((20, 40, 180), (20, 40, 180))
    across, along = Geometry.from_degrees(20.0, 40.0, 180.0), Geometry.from_degrees(20.0, 40.0, 180.0, 90.0)
    one, other = (float(diffracted_by_heights(g, ridges, WAVELENGTH, True)[0]) for g in (across, along))
    assert one > 5 * abs(other)
    turned = make_heights(z.T, 0.75, 0.15)
    assert float(diffracted_by_heights(along, turned, WAVELENGTH, True)[0]) == pytest.approx(one, rel=1e-9)
    assert diffracted_by_heights(g, ridges, WAVELENGTH, True)[0] == pytest.approx([one, one])


def test_a_blazed_surface_scatters_to_the_side_that_its_facets_mirror():
    """Of one map, the ring average against the transform of the whole plane at every degree of azimuth."""
    slope = 0.1
    x = np.arange(256) * 0.2
    ridges = make_heights(np.tile(slope * (x % 8.0), (64, 1)), 0.2)
    theta_r = np.degrees(np.arcsin(slope * 2 / (1 + slope**2)))  # twice the tilt of a facet, at normal incidence
    towards, away = (Geometry.from_degrees(0.0, theta_r, phi, 0.0) for phi in (180.0, 0.0))
    assert towards.x_r < 0
    light = [float(diffracted_by_heights(g, ridges, WAVELENGTH, True)[0]) for g in (towards, away)]
    assert light[0] > 100 * abs(light[1])


def test_averaged_over_directions_it_is_the_mean_of_the_plane():
    """Of one map, the ring average against the transform of the whole plane at every degree of the azimuth."""
    heights = simulate_heights(0.142, 2.0, points=(192, 192), pitch=0.25, seed=1)
    ring = float(diffracted_by_heights(at((20, 40, 180)), heights, WAVELENGTH)[0][0])
    turned = Geometry.from_degrees(20.0, 40.0, 180.0, np.arange(0.0, 360.0))
    plane, _ = diffracted_by_heights(turned, heights, WAVELENGTH, True)
    assert ring == pytest.approx(plane.mean(), rel=1e-3)  # what rings of an eighth of a pixel round


def test_a_prediction_says_by_what_it_is():
    scan = predict(two_levels(0.1), [20], [0, 20, 40], Light(wavelength=632.8, half_angle=1.0), by="characteristic")
    assert "wave optics, isotropic characteristic function" in scan.attrs["history"]
    assert (scan["uncertainty"].values > 0).all()
    assert scan["brdf"].values[1] > 10 * scan["brdf"].values[2]


def test_a_map_whose_points_lose_the_phase_is_refused():
    noise = make_heights(0.2 * np.random.default_rng(1).standard_normal((40, 40)), 0.5)
    with pytest.raises(ValueError, match=r"too far apart for this light: neighbours keep \d+% of its phase"):
        predict(noise, [20], [30], Light(wavelength=632.8), by="characteristic")
