"""Disney's model against the published shader, disney.brdf of the BRDF Explorer, written out here anew (burley2012)."""

import math

import numpy as np
import pytest

from gonio import Geometry, catalogue

COUNT = 1000


def mix(a, b, t):
    return a + t * (b - a)


def schlick(cos):
    return (1 - cos) ** 5


def smith_aniso(cos, x, y, ax, ay):
    return 1 / (cos + np.sqrt((x * ax) ** 2 + (y * ay) ** 2 + cos**2))


def smith(cos, alpha):
    return 1 / (cos + np.sqrt(alpha**2 + cos**2 - alpha**2 * cos**2))


def shader(incident, reflected, values):
    """BRDF() of disney.brdf for a grey base colour that is linear already; the tangent X is the x axis."""
    base, metallic, roughness, specular = (values[n] for n in ("base", "metallic", "roughness", "specular"))
    subsurface, sheen, anisotropic, gloss = (values[n] for n in ("subsurface", "sheen", "anisotropic", "gloss"))
    half = incident + reflected
    half = half / np.linalg.norm(half, axis=0)
    n_l, n_v, n_h, l_h = incident[2], reflected[2], half[2], np.sum(incident * half, axis=0)
    f_l, f_v = schlick(n_l), schlick(n_v)
    f_d90 = 0.5 + 2 * l_h**2 * roughness
    f_d = mix(1, f_d90, f_l) * mix(1, f_d90, f_v)
    f_ss90 = l_h**2 * roughness
    f_ss = mix(1, f_ss90, f_l) * mix(1, f_ss90, f_v)
    flat = 1.25 * (f_ss * (1 / (n_l + n_v) - 0.5) + 0.5)
    aspect = math.sqrt(1 - anisotropic * 0.9)
    ax, ay = max(0.001, roughness**2 / aspect), max(0.001, roughness**2 * aspect)
    d_s = 1 / (math.pi * ax * ay * ((half[0] / ax) ** 2 + (half[1] / ay) ** 2 + n_h**2) ** 2)
    f_h = schlick(l_h)
    f_s = mix(mix(0.08 * specular, base, metallic), 1, f_h)
    g_s = smith_aniso(n_l, incident[0], incident[1], ax, ay) * smith_aniso(n_v, reflected[0], reflected[1], ax, ay)
    squared = mix(0.1, 0.001, gloss) ** 2
    d_r = (squared - 1) / (math.pi * math.log(squared) * (1 + (squared - 1) * n_h**2))
    f_r, g_r = mix(0.04, 1, f_h), smith(n_l, 0.25) * smith(n_v, 0.25)
    body = mix(f_d, flat, subsurface) * base / math.pi + f_h * sheen
    return body * (1 - metallic) + g_s * f_s * d_s + 0.25 * values["clearcoat"] * g_r * f_r * d_r


def directions(random):
    cos, azimuth = random.uniform(0.02, 1, COUNT), random.uniform(0, 2 * np.pi, COUNT)
    sin = np.sqrt(1 - cos**2)
    return np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), cos])


@pytest.mark.parametrize("anisotropic", [0.0, 0.25, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_equals_the_published_shader(metallic, anisotropic):
    random = np.random.default_rng(2012)
    incident, reflected = directions(random), directions(random)
    drawn = ("base", "roughness", "specular", "subsurface", "sheen", "gloss")
    values = {"metallic": metallic, "anisotropic": anisotropic, "clearcoat": 0.7}
    values |= dict(zip(drawn, random.uniform(0.1, 1, len(drawn)), strict=True))
    found = catalogue["disney"](Geometry(*incident, *reflected), values | {"scale": 1.0})
    # 1e-9: near the mirror direction 1 + (a^2 - 1) cos^2 of the shader keeps some ten digits of a = 0.001
    np.testing.assert_allclose(found, shader(incident, reflected, values), rtol=1e-9)


@pytest.mark.parametrize("anisotropic", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("roughness", [0.6, 0.8, 1.0])
def test_a_white_metal_reflects_no_more_than_arrives(roughness, anisotropic):
    """Smith's masking along each direction keeps the energy of single reflection; narrower lobes need finer grids."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    theta, phi = np.radians(45 * (nodes + 1))[:, None], np.radians(np.arange(0.0, 360.0))
    sin, cos = np.sin(theta), np.cos(theta) + 0 * phi
    portion = weights[:, None] * math.pi / 4 * np.radians(1.0) * sin * cos
    values = {"base": 1.0, "metallic": 1.0, "roughness": roughness, "anisotropic": anisotropic}
    for theta_i in (0.0, 40.0, 75.0):
        for phi_i in (0.0, 45.0, 90.0):
            x, y = np.sin(np.radians(theta_i)) * np.array([np.cos(np.radians(phi_i)), np.sin(np.radians(phi_i))])
            g = Geometry(
                x + 0 * cos,
                y + 0 * cos,
                np.cos(np.radians(theta_i)) + 0 * cos,
                sin * np.cos(phi),
                sin * np.sin(phi),
                cos,
            )
            assert np.sum(catalogue["disney"].basis(g, values)["scale"] * portion) <= 1 + 1e-4, (theta_i, phi_i)
