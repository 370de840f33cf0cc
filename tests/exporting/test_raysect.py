"""Material classes for Raysect, run with stand-ins for Raysect's own classes."""

import math

import numpy as np
import pytest

from gonio import Geometry, catalogue, export
from gonio.exporting.entry import write
from gonio.exporting.mixture import mixture
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets.raysect import Vector, loaded
from gonio.plausibility import hemispherical_reflectance

ANGLE = 0.7


def material(done, seed=3):
    random = np.random.default_rng(seed)
    return loaded(done.files[0], random.random)[done.request.name]()


def weighed(name, value=0.3):
    return of_model(catalogue[name], dict.fromkeys(catalogue[name].weights, value))


def exported(case, tmp_path):
    return write(case, tmp_path / "coating.py", "raysect", "coating")


class Spectrum:
    def __init__(self, bins=1):
        self.samples = np.ones(bins)
        self.wavelengths = np.linspace(400, 600, bins) if bins > 1 else np.array([500.0])


class Ray:
    """A world of radiance 1."""

    def __init__(self, bins=1):
        self.bins = bins

    def new_spectrum(self):
        empty = Spectrum(self.bins)
        empty.samples[:] = 0
        return empty

    def spawn_daughter(self, origin, direction):
        return self

    def trace(self, world):
        return Spectrum(self.bins)


class Direction(Vector):
    def transform(self, matrix):
        return self


def shaded(one, viewer, light, bins=1):
    """What Raysect takes of a class, before it divides by the density."""
    light = Direction(light.x, light.y, light.z)
    found = one.evaluate_shading(None, Ray(bins), viewer, light, None, None, False, None, None, None)
    return np.asarray(found.samples)


@pytest.mark.parametrize("name", catalogue)
def test_the_class_gives_the_model(name, tmp_path):
    if name == "modified-beckmann-kirchhoff":
        pytest.skip("ten seconds of nested quadrature, printed by the same printer as the others")
    if catalogue[name].for_turned:  # a grain, which Raysect cannot place
        with pytest.raises(ValueError, match="a direction of its own"):
            exported(weighed(name), tmp_path)
        return
    assert exported(weighed(name), tmp_path).prove().holds


@pytest.mark.parametrize("name", ["ggx", "lambert", "cauchy-lorentz", "beckmann", "harvey-shack", "rpv"])
def test_drawn_directions_follow_the_density_and_reflect_what_the_model_does(name, tmp_path):
    case = weighed(name)
    one = material(exported(case, tmp_path))
    viewer = Vector(math.sin(ANGLE), 0.0, math.cos(ANGLE))
    drawn = [one.sample(viewer, False) for _ in range(4000)]
    ratios = np.array([shaded(one, viewer, s)[0] / one.pdf(viewer, s, False) for s in drawn])
    error = ratios.std(ddof=1) / math.sqrt(len(ratios))

    def exchanged(g):
        return np.asarray(case.brdf(Geometry(*g[3:], *g[:3])))

    expected = hemispherical_reflectance(exchanged, math.degrees(ANGLE))
    assert abs(ratios.mean() - expected) <= 4 * error + 1e-9
    assert error < 0.05 * expected


@pytest.mark.parametrize("name", ["ggx", "gonio-best", "ward", "beckmann"])
def test_the_density_is_that_of_the_mixture(name, tmp_path):
    case = weighed(name)
    one = material(exported(case, tmp_path))
    random = np.random.default_rng(8)
    z = random.uniform(0.05, 1, 50)
    azimuth = random.uniform(0, 2 * math.pi, 50)
    directions = np.stack([np.sqrt(1 - z * z) * np.cos(azimuth), np.sqrt(1 - z * z) * np.sin(azimuth), z])
    viewer = (math.sin(ANGLE), 0.0, math.cos(ANGLE))
    expected = mixture(case).density(Geometry(*(np.full(50, c) for c in viewer), *directions))
    found = [one.pdf(Vector(*viewer), Vector(*d), False) for d in directions.T]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_light_that_is_lost_is_no_division_by_zero(tmp_path):
    one = material(exported(weighed("ggx"), tmp_path))
    viewer, below = Vector(0.6, 0.0, 0.8), Vector(0.0, 0.0, -1.0)
    assert one.pdf(viewer, below, False) == 1.0
    assert shaded(one, viewer, below)[0] == 0.0


def test_what_is_negative_is_nothing(tmp_path):
    case = of_model(catalogue["ross-li"], {"fiso": 0.05, "fgeo": 0.3})
    one = material(exported(case, tmp_path))
    viewer, light = Vector(math.sin(1.2), 0, math.cos(1.2)), Vector(-math.sin(1.0), 0, math.cos(1.0))
    assert float(case.brdf(Geometry(light.x, 0, light.z, viewer.x, 0, viewer.z))) < 0
    assert shaded(one, viewer, light)[0] == 0.0


def test_wavelengths_are_interpolated_in_values(tmp_path):
    first, second = (dict(of_model(catalogue["lambert"], {"rho": r}).values) for r in (0.2, 0.6))
    case = Subject(catalogue["lambert"], {"600": second, "400": first}, "wavelength")
    done = exported(case, tmp_path)
    one = material(done)
    up = Vector(0.0, 0.0, 1.0)
    np.testing.assert_allclose(shaded(one, up, up, bins=3) * math.pi, [0.2, 0.4, 0.6])
    assert one.bsdf(up, up, 450.0) * math.pi == pytest.approx(0.3)
    assert done.prove().holds


def test_channels_and_turned_surfaces_are_refused(tmp_path):
    sets = {c: dict(of_model(catalogue["lambert"], {"rho": 0.5}).values) for c in "RGB"}
    with pytest.raises(ValueError, match="--select channel=VALUE"):
        exported(Subject(catalogue["lambert"], sets, "channel"), tmp_path)
    with pytest.raises(ValueError, match="direction of its own"):
        exported(of_model(catalogue["ward"], {"rho_s": 0.5, "alpha_x": 0.1, "alpha_y": 0.3}), tmp_path)


def test_a_lambertian_of_a_half(tmp_path):
    done = export(catalogue["lambert"], tmp_path / "white.py", to="raysect", values={"rho": 0.5})
    one = loaded(done.files[0])["lambert"]()
    assert one.bsdf(Vector(0.6, 0, 0.8), Vector(0, 0, 1), 500.0) == pytest.approx(0.5 / math.pi, rel=1e-15)
