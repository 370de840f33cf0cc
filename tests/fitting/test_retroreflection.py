"""A lobe about the back direction: what it is, and a retroreflector that no other model follows."""

import numpy as np
import pytest

from gonio import Geometry, catalogue, check, simulate
from gonio.comparison.answer import everything
from gonio.comparison.ranking import compare
from gonio.fitting import Projection
from gonio.optics.backward import back_lobe, backward
from gonio.optics.facets import gtr_normals
from gonio.sampling import sample

RETRO = [model for model in catalogue.values() if "rho_r" in model.terms]
NOISE = 0.05
SHEETING = {"rho_s": 0.5, "rho_d": 0.15, "rho_r": 0.4, "width": 0.3, "w_b": 0.03, "c_b": 1.7}
GLASS = {"index": 1.5, "extinction": 0.0}
THETA_I, THETA_R = np.arange(5.0, 66.0, 15.0), np.arange(-75.0, 76.0, 5.0)
QUICK = Projection(grid=3, searches=1, line=5, rounds=1)


def sheeting():
    """Facets and a diffuse part with a narrow lobe back to the source."""
    return simulate(catalogue["ggx-retro"], SHEETING | GLASS, THETA_I, THETA_R, noise=NOISE, seed=2)


def test_the_lobe_stands_about_the_source_and_is_that_of_facets_mirrored():
    """Largest at the source for every incidence; and what a facet lobe gives for light from the other side."""
    theta_r = np.arange(-80.0, 80.1, 0.5)
    for theta_i in (0.0, 20.0, 50.0):
        f = back_lobe(Geometry.in_plane(theta_i, theta_r), np.asarray(0.02), np.asarray(2.0))
        assert theta_r[np.argmax(f)] == -theta_i
    there, back = Geometry.from_degrees(40.0, 30.0, 20.0, 70.0), Geometry.from_degrees(40.0, 30.0, 200.0, 250.0)
    shape = np.asarray(0.1), np.asarray(1.5)
    # a forward lobe of the same law, for a source on the other side of the normal
    forward = gtr_normals(back, *shape) / (2 * (back.cos_i + back.cos_r))
    assert back_lobe(there, *shape) == pytest.approx(float(forward), rel=1e-12)
    np.testing.assert_allclose(backward(there), back, rtol=0, atol=1e-15)


@pytest.mark.parametrize("model", RETRO, ids=lambda model: model.name)
def test_it_is_added_to_a_model_that_stays_as_it_is(model):
    plain = catalogue[model.name.removesuffix("-retro")]
    assert {weight: term for weight, term in model.terms.items() if weight != "rho_r"} == plain.terms


def test_no_search_tries_it_by_itself():
    """As a scan with its angles reversed would look like a retroreflector, which `check` tells with their names."""
    assert {model.name for model in RETRO} == {"ggx-retro", "gonio-best-retro"}
    assert not {model.name for model in everything()} & {model.name for model in RETRO}
    told = next(one for one in check(sheeting()) if one.name == "sign-reversed")
    assert all(model.name in told.remedy for model in RETRO)


def test_light_is_drawn_towards_the_source():
    """Half of a narrow lobe's directions are within a few of its widths."""
    found = sample(catalogue["ggx-retro"], {"rho_r": 1.0, "w_b": 0.02, "c_b": 2.0}, 40.0, 2_000, seed=1).geometry
    cosine = found.x_i * found.x_r + found.y_i * found.y_r + found.z_i * found.z_r
    assert np.median(np.degrees(np.arccos(cosine))) < 5.0


def test_a_retroreflector_is_predicted_to_its_noise():
    """At incidence angles left out: within a tenth of the noise, where gonio-best is off by a factor of two."""
    noise = NOISE / np.log(10)
    options = {"weighting": "log", "left_out": "theta_i", "solver": QUICK, "workers": 1}
    (with_lobe,) = compare(sheeting(), [catalogue["ggx-retro"]], held=GLASS, **options)
    assert with_lobe.validated["log10_rmse"] == pytest.approx(noise, rel=0.1)
    (without,) = compare(sheeting(), [catalogue["gonio-best"]], **options)
    assert without.validated["log10_rmse"] > 0.3
