"""What the conventions say where angles end: at grazing, at the normal, and whichever way the surface is turned."""

import itertools
import math

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.models.schott2009 import _tilt_integral
from gonio.optics.masking import shadowing_and_obscuration, v_groove
from gonio.optics.wu import shadowing

SECOND = {"w_y": "w_x", "m_y": "m_x"}  # of two widths, which the first is given: then no axis is preferred
LEAST = 1e-6  # formulas 0: cosines are kept above this
STRETCH = {"anisotropic"}  # 0 at default; Ward's two widths have the same default and the same bounds
POLES = [[30, 30, 180], [70, 70, 180], [0, 40, 180], [40, 0, 180], *([t, t, 0] for t in range(10, 90, 10))]
EVERYWHERE = np.hstack([np.random.default_rng(5).uniform(0, [[85], [85], [360]], (3, 60)), np.transpose(POLES)])


@pytest.mark.parametrize("name", list(catalogue))
@pytest.mark.parametrize("where", [None, 0.5], ids=["default", "middle"])
def test_only_the_angle_between_the_azimuths_counts(name, where):
    """Where no axis of the surface is preferred, it looks the same when turned under the light."""
    model = catalogue[name]
    middle = {n: p.lower + (p.upper - p.lower) * where for n, p in model.shape.items() if where and n not in STRETCH}
    equal = {n: middle.get(one, model.shape[one].default) for n, one in SECOND.items() if n in model.shape}
    shape = {n: np.asarray(value) for n, value in (middle | equal).items()}
    ways = [(model.basis, EVERYWHERE)]
    if model.polarised:  # along the normal the axes of the Stokes parameters are the surface's own
        ways += [(model.mueller_basis, EVERYWHERE[:, (EVERYWHERE[0] > 0) & (EVERYWHERE[1] > 0)])]
    for values, places in ways:
        expected = values(Geometry.from_degrees(*places), shape)
        for turn, weight in itertools.product((37.0, 63.0), model.weights):
            turned = values(Geometry.from_degrees(*places, turn), shape)
            size = np.max(np.abs(expected[weight]))
            np.testing.assert_allclose(turned[weight], expected[weight], rtol=1e-7, atol=1e-10 * size)


def test_cosines_at_grazing():
    """Both directions along the surface, from the same side and from opposite sides."""
    same, opposite = Geometry.from_degrees(90.0, 90.0, 0.0), Geometry.from_degrees(90.0, 90.0, 180.0)
    for g in (same, opposite):
        assert (float(g.cos_i), float(g.cos_r)) == (LEAST, LEAST)
        assert (float(g.theta_i_deg), float(g.theta_r_deg)) == pytest.approx((90.0, 90.0))
    # the tilt's tangent is the horizontal part over the sum of the two cosines, each at its least
    assert float(same.slope_x) == pytest.approx(2 / (2 * LEAST))
    assert float(same.cos_alpha) == pytest.approx(2 * LEAST / 2)
    assert float(Geometry.from_degrees(90.0, 90.0, 0.0, 90.0).slope_y) == pytest.approx(2 / (2 * LEAST))
    # the facet that mirrors grazing light forwards is seen at grazing: half the sum of the directions is at its least
    assert float(opposite.cos_beta) == pytest.approx(LEAST / 2)


def test_nothing_hides_a_facet_from_above():
    """Light and view along the normal: every masking function is 1 there (formulas 3)."""
    g = Geometry.from_degrees(0.0, 0.0)
    assert float(v_groove(g)) == 1.0
    assert float(shadowing(g)) == 1.0
    assert float(shadowing_and_obscuration(g, np.asarray(14.0), np.asarray(40.0))) == 1.0


def test_smooth_surfaces_where_all_light_goes_by():
    """Low's smooth lobe at grazing forward has the Fresnel reflectance of its least cosine; in complex numbers."""
    index = complex(1.5, 0.8)
    q = (index**2 - 1) ** 0.5
    lost = [1 - abs((LEAST * e - q) / (LEAST * e + q)) ** 2 for e in (1, index**2)]
    shape = {"B": 100.0, "C": 1.2, "index": index.real, "extinction": index.imag}
    found = catalogue["low-smooth"].basis(Geometry.from_degrees(90.0, 90.0, 180.0), shape)["A"]
    assert 1 - float(found) == pytest.approx(sum(lost) / 2, rel=1e-4)


def test_abg_in_the_mirror_direction():
    """A/B, but for the least distance of 1e-16 that its power is taken of (formulas 7.9)."""
    mirror = Geometry.from_degrees(0.0, 0.0)
    for b, g, floor in ((1e-3, 2.0, 0.0), (1e-8, 1.0, 0.0), (1e-8, 0.5, 1e-8)):
        assert float(catalogue["abg"].basis(mirror, {"B": b, "g": g})["A"]) == pytest.approx(1 / (b + floor), rel=1e-6)


def test_wus_fresnel_factor_at_the_normal():
    """1, but for the least 1 - cos beta of 1e-30 that its power is taken of (formulas 6.7)."""
    normal = Geometry.from_degrees(0.0, 0.0)
    for a, floor in ((2.0, 0.0), (0.1, 1e-3)):
        found = catalogue["wu-five"].basis(normal, {"kr": 0.7, "b": 20.0, "a": a})["kb"]
        assert float(found) == pytest.approx(math.exp(20 * floor), rel=1e-6)


@pytest.mark.parametrize("tilt", [1.0, 8.0, 9.9, 10.1, 15.0, 19.5, 20.0, 30.0, 45.0])
def test_facets_of_every_tilt_are_counted(tilt):
    """The normaliser of the Gaussian of the tilt, by the midpoint rule up to 90 deg (formulas 6.3)."""
    width = math.radians(tilt)
    a = (np.arange(200_000) + 0.5) * (math.pi / 2 / 200_000)
    expected = np.sum(np.exp(-((a / width) ** 2) / 2) * np.sin(a)) * (math.pi / 2 / 200_000)
    assert float(_tilt_integral(np.asarray(width))) == pytest.approx(expected, rel=1e-7)


def test_shadows_of_crowns_that_meet():
    """Li's kernel at directions near enough for the shadows to overlap, in angles, over a grid (formulas 7.13)."""
    overlapping = 0
    for theta_i, theta_r, phi in itertools.product((10.0, 25.0, 40.0), (5.0, 30.0, 45.0), (0.0, 20.0, 70.0, 130.0)):
        t_i, t_r, p = (math.radians(a) for a in (theta_i, theta_r, phi))
        secants = 1 / math.cos(t_i) + 1 / math.cos(t_r)
        apart = math.tan(t_i) ** 2 + math.tan(t_r) ** 2 - 2 * math.tan(t_i) * math.tan(t_r) * math.cos(p)
        sideways = (math.tan(t_i) * math.tan(t_r) * math.sin(p)) ** 2
        t = math.acos(min(1.0, 2 * math.sqrt(apart + sideways) / secants))
        overlapping += t > 0
        phase = math.cos(t_i) * math.cos(t_r) + math.sin(t_i) * math.sin(t_r) * math.cos(p)
        lit = (1 + phase) / (2 * math.cos(t_i) * math.cos(t_r))
        kernel = (t - math.sin(t) * math.cos(t)) * secants / math.pi - secants + lit
        found = catalogue["ross-li"].basis(Geometry.from_degrees(theta_i, theta_r, phi), {})["fgeo"]
        assert float(found) == pytest.approx(kernel / math.pi, rel=1e-9, abs=1e-12)
    assert 0 < overlapping < 36


def test_angles_at_the_normal():
    g = Geometry.from_degrees(0.0, 0.0, 0.0)
    assert (float(g.theta_i_deg), float(g.theta_r_deg)) == (0.0, 0.0)
    assert (float(g.cos_alpha), float(g.cos_beta), float(g.tan_alpha_squared)) == (1.0, 1.0, 0.0)
    assert float(Geometry.from_degrees(45.0, 0.0).slope_x) == pytest.approx(math.tan(math.pi / 8))
