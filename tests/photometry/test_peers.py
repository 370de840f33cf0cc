"""Fluxes against those of Lumos-Sat, which crosscheck/lumos_peer.py computed and tests/reference/peers keeps."""

import functools
import json

import numpy as np
import pytest

from gonio import catalogue
from gonio.photometry import EARTH_RADIUS, Earth, Facet, bands, from_horizon, light_curve
from places import ROOT

SUN = 1360.0  # W/m^2, as Lumos-Sat has it


@functools.cache
def peer():
    return json.loads((ROOT / "tests" / "reference" / "peers" / "lumos.json").read_text(encoding="utf-8"))


def facet(kind, values, area, normal):
    model, given = {
        "LAMBERTIAN": lambda albedo: ("lambert", {"rho": albedo}),
        "PHONG": lambda Kd, Ks, n: ("modified-phong", {"rho_d": Kd, "rho_s": Ks, "n": n}),
        "ABG": lambda A, B, g: ("abg", {"A": A, "B": B, "g": g}),
    }[kind](**values)
    return Facet(area, normal, catalogue[model], given)


@pytest.mark.parametrize("name", ["panel", "glossy", "scattering"])
def test_fluxes_of_satellites(name):
    columns = {n: np.array(c) for n, c in peer()["columns"].items()}
    angles = (columns[n] for n in ("sun_altitude", "sun_azimuth", "altitude", "azimuth", "height"))
    sight = from_horizon(*angles)
    facets = [facet(*one) for one in peer()["surfaces"][name]]
    found = light_curve(
        facets, sight.sun, sight.observer, sun_half_angle=0, earth=Earth(sight.position, values={"rho": 0.0})
    )
    expected = columns[name]
    assert (expected > 0).sum() > 20
    assert found["ratio"].values * SUN == pytest.approx(expected, rel=1e-6, abs=1e-6 * expected.max())


def overhead(angle):
    """The sun past the terminator by an angle [rad], and where the satellite is."""
    return [0.0, np.cos(angle), -np.sin(angle)], [0.0, 0.0, -550e3], [0.0, 0.0, EARTH_RADIUS + 550e3]


def test_the_vector_of_the_specification():
    sun, observer, _ = overhead(0.1)
    panel = Facet(1.0, [0.0, 0.6, -0.8], catalogue["lambert"], {"rho": 0.3})
    found = light_curve([panel], sun, observer, sun_half_angle=0)["ratio"].values[0] * SUN
    assert found == pytest.approx(peer()["columns"]["overhead"][0], rel=1e-12)
    assert f"{found:.10e}" == "2.3247682827e-10"


def test_earthshine():
    """Their mesh of a million parts is a sum of rectangles that ends at the limb by whole parts."""
    panel = Facet(1.0, [0.0, 0.6, -0.8], catalogue["lambert"], {"rho": 0.3})
    for angle, expected in zip((0.0, 0.1, 0.2), peer()["columns"]["earthshine"], strict=True):
        sun, observer, position = overhead(angle)
        both, alone = (
            light_curve([panel], sun, observer, sun_half_angle=0, earth=Earth(position, values={"rho": rho}))["ratio"]
            for rho in (0.3, 0.0)
        )
        assert (both - alone).values[0] * SUN == pytest.approx(expected, rel=0.02)


def test_their_sun_is_brighter():
    """They take the whole solar constant for the flux at 532 nm: times 532 nm over c and 3631 Jy it is -27.056 AB."""
    theirs = -2.5 * np.log10(SUN * 532e-9 / (299_792_458 * 3631e-26))
    assert theirs == pytest.approx(-27.056, abs=5.1e-4)
    assert bands()["V"].ab - theirs == pytest.approx(0.286, abs=6e-4)  # as docs/howto/magnitudes.md says
