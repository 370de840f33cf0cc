"""Functions for Lumos-Sat."""

import math
import runpy

import numpy as np
import pytest

from gonio import Geometry, catalogue, export

RANDOM = np.random.default_rng(5)


def unit(n):
    v = RANDOM.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)


def written(model, tmp_path, **values):
    done = export(catalogue[model], tmp_path / "panel.py", to="lumos", values=values)
    return runpy.run_path(str(done.files[0]))[model.replace("-", "_")]


@pytest.mark.parametrize("name", ["ggx", "abg", "phong", "rpv", "oren-nayar"])
def test_any_frame_gives_the_models_value(name, tmp_path):
    weights = catalogue[name].weights
    values = dict.fromkeys(weights, 0.3)
    function = written(name, tmp_path, **values)
    n, light, view = unit(300), unit(300), unit(300)
    theta_i, theta_r = (np.degrees(np.arccos(np.sum(v * n, axis=0))) for v in (light, view))
    flat = [v - np.sum(v * n, axis=0) * n for v in (light, view)]
    sine = np.sum(np.cross(flat[0], flat[1], axis=0) * n, axis=0)
    phi = np.degrees(np.arctan2(sine, np.sum(flat[0] * flat[1], axis=0)))
    above = (theta_i < 89) & (theta_r < 89)
    below = (theta_i > 91) | (theta_r > 91)
    g = Geometry.from_degrees(*(np.where(above, angle, 0) for angle in (theta_i, theta_r, phi)))
    expected = np.where(above, catalogue[name](g, values), 0)
    found = function(tuple(light), tuple(n), tuple(view))
    np.testing.assert_allclose(found[above | below], expected[above | below], rtol=1e-7)
    assert min(above.sum(), below.sum()) > 50


def test_the_order_is_incident_normal_outgoing(tmp_path):
    """Phong's shading of 1975 is not reciprocal, so that an exchange is seen."""
    function = written("phong", tmp_path, ks=0.3, n=5)
    light, view = (math.sin(0.9), 0.0, math.cos(0.9)), (-math.sin(0.3), 0.0, math.cos(0.3))
    expected = catalogue["phong"](Geometry(*light, *view), {"ks": 0.3, "kd": 0.0, "n": 5})
    assert float(function(light, (0.0, 0.0, 1.0), view)) == pytest.approx(float(expected), rel=1e-12)
    assert float(function(view, (0.0, 0.0, 1.0), light)) != pytest.approx(float(expected), rel=1e-3)


def test_vectors_of_any_length_and_numbers_broadcast(tmp_path):
    function = written("lambert", tmp_path, rho=0.5)
    found = function((0.0, 1.0, 2.0), (0, 2.0, 0), (np.zeros(3), np.array([1.0, -1.0, 2.0]), np.ones(3)))
    np.testing.assert_allclose(found, [0.5 / math.pi, 0, 0.5 / math.pi], rtol=1e-14)


def test_a_brushed_surface_takes_a_vector_along_it(tmp_path):
    values = {"rho_s": 0.5, "alpha_x": 0.05, "alpha_y": 0.4}
    function = written("ward", tmp_path, **values)
    light, view = np.array([math.sin(0.5), 0, math.cos(0.5)]), np.array([-math.sin(0.8), 0, math.cos(0.8)])
    expected = float(catalogue["ward"](Geometry(*light, *view), {"rho_d": 0.0} | values))
    turn = np.linalg.qr(RANDOM.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    x, _, n = turn.T
    found = function(tuple(turn @ light), tuple(n), tuple(turn @ view), along=tuple(x + 0.7 * n))
    assert float(found) == pytest.approx(expected, rel=1e-9)
    across = function(tuple(turn @ light), tuple(n), tuple(turn @ view), along=tuple(turn[:, 1]))
    assert float(across) != pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("name", catalogue)
def test_every_model_is_proved(name, tmp_path):
    if name == "modified-beckmann-kirchhoff":
        pytest.skip("two seconds of nested quadrature, printed by the same printer as the others")
    done = export(catalogue[name], tmp_path / "m.py", to="lumos", values=dict.fromkeys(catalogue[name].weights, 0.3))
    assert done.prove().holds
