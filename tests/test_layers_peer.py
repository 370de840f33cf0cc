"""Layers against independent programs: Mitsuba 3 and SCATMECH for coated bodies, tmm for films and coats.

`crosscheck/layers_peer.py` runs them and rewrites what is kept in reference/peers. Mitsuba's reflectance of uniform
light is a polynomial fit, and SCATMECH's a sum in steps of 0.2 deg: neither is demanded to agree to rounding.
"""

import functools
import json
import re
from pathlib import Path

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.optics.layers.body import body_weight
from gonio.optics.layers.film import Layer, coat_by_polarisation, stack

PEERS = Path(__file__).parent / "reference" / "peers"
WAVELENGTH = 0.6328
AGREED = {"mitsuba": 2e-3, "scatmech": 1e-3}
FILMS = 1e-12  # both are double precision


@functools.cache
def peer(name):
    return json.loads((PEERS / f"layers_{name}.json").read_text(encoding="utf-8"))


BODIES = [(name, surface) for name in AGREED for surface in peer(name)["surfaces"]]


@pytest.mark.parametrize(("name", "surface"), BODIES)
def test_coated_body(name, surface):
    """Two hundred pairs of directions up to 85 deg, three indices, bodies from dark to white."""
    n, rho = map(float, re.fullmatch(r"n (\S+) rho (\S+)", surface).groups())
    theta_i, theta_r = np.array(peer(name)["columns"]["angles"])
    values = {"rho_b": float(body_weight(rho, np.asarray(n))), "n_b": n}
    found = catalogue["coated-body"](Geometry.from_degrees(theta_i, theta_r, 90.0), values)
    expected = np.array(peer(name)["columns"][surface])
    assert expected.shape == (200,)
    np.testing.assert_allclose(found, expected, rtol=AGREED[name])


def test_all_are_compared():
    assert len(BODIES) == 18
    assert len(peer("tmm")["surfaces"]) == 21


@pytest.mark.parametrize("surface", peer("tmm")["surfaces"])
def test_films_and_coats(surface):
    """Reflectance of s and p from the normal to 88 deg: one film, several, absorbing ones, and a thick coat."""
    given, columns = peer("tmm")["surfaces"][surface], peer("tmm")["columns"]
    cos = np.cos(np.radians(columns["theta"]))
    below = np.asarray(given["index"]), np.asarray(given["extinction"])
    if "coat" in given:
        found = coat_by_polarisation(cos, given["coat"], *below)
    else:
        found = stack(cos, [Layer(*film) for film in given["films"]], *below, WAVELENGTH)
    for polarisation, reflectance in zip("sp", found, strict=True):
        np.testing.assert_allclose(reflectance, columns[f"{surface} {polarisation}"], rtol=0, atol=FILMS)
