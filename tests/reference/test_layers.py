"""Layers: printed values, limits, closed forms and conservation (specification, E)."""

import itertools
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from gonio import Geometry, Model, catalogue
from gonio.models.gonio2026 import scattered_lobe, scattered_lobe_of_height
from gonio.models.guo2023 import gaussian_facets
from gonio.models.krywonos2011 import scattered
from gonio.models.walter2007 import ggx_facets
from gonio.optics.fresnel import dielectric, over_facets, reflectances, transmittance, unpolarised
from gonio.optics.kirchhoff import phase_variance
from gonio.optics.layers import body
from gonio.optics.layers.film import Layer, coat, coat_by_polarisation, coat_of, film, film_of, stack
from gonio.plausibility import hemispherical_reflectance

TABLE = tomllib.loads(Path(__file__).with_name("layers.toml").read_text(encoding="utf-8"))
LAST = 0.51e-8  # half a unit of the last printed digit
WAVELENGTH = 0.6328
ALUMINIUM = (np.asarray(1.37), np.asarray(7.62))
COSINES = np.cos(np.radians(np.array([0.0, 10.0, 40.0, 60.0, 80.0, 89.0])))


def equal(found, expected):
    np.testing.assert_allclose(found, expected, rtol=0, atol=LAST)


def cosine(theta):
    return np.cos(np.radians(np.asarray(theta, dtype=float)))


def brdf_of_body(rho, n):
    weight = body.body_weight(rho, n)
    return lambda g: weight * body.coated_body(g, np.asarray(n))


def test_boundary():
    (row,) = TABLE["boundary"]
    equal(body.external_reflectance(np.array(row["n"])), row["external"])
    equal(body.internal_reflectance(np.array(row["n"])), row["internal"])


@pytest.mark.parametrize("n", [1.05, 1.2, 1.5, 2.2])
def test_the_closed_form_is_the_integral(n):
    x, w = np.polynomial.legendre.leggauss(400)
    mu = (x + 1) / 2
    integral = np.sum(w * mu * dielectric(mu, np.asarray(n)))
    assert float(body.external_reflectance(np.asarray(n))) == pytest.approx(integral, rel=1e-11)


@pytest.mark.parametrize("n", [1.05, 1.5, 2.2])
def test_what_the_boundary_lets_through_is_what_it_does_not_reflect(n):
    cos = np.concatenate([COSINES, [1e-3, 1e-6]])
    found = transmittance(cos, np.asarray(n))
    np.testing.assert_allclose(found, 1 - dielectric(cos, np.asarray(n)), rtol=1e-9)
    assert found[-1] == pytest.approx(2e-6 * (1 + n**2) / np.sqrt(n**2 - 1), rel=1e-5)  # the limit at grazing


@pytest.mark.parametrize("row", TABLE["body"], ids=lambda row: f"rho {row['rho']}")
def test_coated_body(row):
    brdf = brdf_of_body(row["rho"], row["n"])
    theta_i, theta_r = np.array(row["pairs"], dtype=float).T
    equal(brdf(Geometry.from_degrees(theta_i, theta_r, 180.0)), row["brdf"])
    equal([hemispherical_reflectance(brdf, theta, nodes=400) for theta in row["theta_i"]], row["reflectance"])
    outside, inside = (f(np.asarray(row["n"])) for f in (body.external_reflectance, body.internal_reflectance))
    equal(outside + (1 - outside) * (1 - inside) * row["rho"] / (1 - row["rho"] * inside), row["total"])


def test_weight_and_reflectance_of_the_body_are_inverse_and_saundersons():
    for rho, n in itertools.product((0.0, 0.3, 0.96, 1.0), (1.05, 1.5, 2.2)):
        weight, inner = body.body_weight(rho, np.asarray(n)), body.internal_reflectance(np.asarray(n))
        assert body.body_reflectance(weight, np.asarray(n)) == pytest.approx(rho, abs=1e-14)
        before = weight / (1 - body.external_reflectance(np.asarray(n)))  # what stands before T T/pi
        assert before == pytest.approx(rho / (n**2 * (1 - rho * inner)), rel=1e-12)
        assert rho == pytest.approx(before * n**2 / (1 + before * n**2 * inner), abs=1e-14)


def test_a_white_body_gives_back_all_that_enters():
    """White furnace: the reflectance of the body is then the transmittance of the boundary, whatever the index."""
    for n, theta in itertools.product((1.05, 1.5, 2.2), (0.0, 40.0, 75.0, 88.0)):
        reflected = hemispherical_reflectance(brdf_of_body(1.0, n), theta)
        assert reflected == pytest.approx(float(1 - dielectric(cosine(theta), np.asarray(n))), rel=1e-6)


def test_a_boundary_of_no_contrast_leaves_lambert():
    """To first order in n - 1, by which 1/n^2 and the light that grazes within differ from one."""
    g = Geometry.from_degrees(np.array([0.0, 30.0, 45.0]), 45.0, 90.0)
    np.testing.assert_allclose(brdf_of_body(0.6, 1.05)(g), 0.6 / math.pi, rtol=0.8 * 0.05)
    nearer = body.body_weight(0.6, np.asarray(1.001)) * body.coated_body(g, np.asarray(1.001))
    np.testing.assert_allclose(nearer, 0.6 / math.pi, rtol=1e-3)


def test_coating_of_facets_and_body_conserves_energy():
    """Interface and body together: at most what arrives, at every index, width and angle, for a body that absorbs 1 %.

    The body sees a smooth boundary, and rough facets reflect up to 0.2 % more than that at some angles: a body that
    absorbs nothing at all comes out that much above 1.
    """
    model = catalogue["coated-body"]
    for n_b, width, theta in itertools.product((1.05, 1.5, 2.2), (0.15, 0.6), (0.0, 45.0, 75.0)):
        values = {"rho_s": 1.0, "rho_b": 1.0, "n_b": n_b, "width": width, "c": 3.0}
        white = hemispherical_reflectance(lambda g, v=values: model(g, v), theta, nodes=64)
        assert white <= 1.002
        values["rho_b"] = body.body_weight(0.99, np.asarray(n_b))
        assert hemispherical_reflectance(lambda g, v=values: model(g, v), theta, nodes=64) <= 1.0


@pytest.mark.parametrize("row", TABLE["film"], ids=lambda row: row["what"])
def test_film(row):
    constants = (np.asarray(row["index"]), np.asarray(row["extinction"]))
    cos = cosine(row["theta"])
    r_s, r_p = stack(cos, [Layer(row["n"], 0.0, row["thickness"])], *constants, WAVELENGTH)
    equal(r_s, row["s"])
    equal(r_p, row["p"])
    mean = film(cos, np.asarray(row["n"]), np.asarray(row["thickness"]), *constants, np.asarray(WAVELENGTH))
    equal(mean, (np.array(row["s"]) + row["p"]) / 2)


def test_film_of_nothing_and_of_half_a_wave_are_the_bare_metal():
    bare = unpolarised(COSINES, *ALUMINIUM)
    for n, thickness in ((1.457, 0.0), (1.0, 0.2)):
        found = film(COSINES, np.asarray(n), np.asarray(thickness), *ALUMINIUM, np.asarray(WAVELENGTH))
        np.testing.assert_allclose(found, bare, rtol=1e-12)
    half_wave = np.asarray(WAVELENGTH / (2 * 1.457))
    found = film(np.asarray(1.0), np.asarray(1.457), half_wave, *ALUMINIUM, np.asarray(WAVELENGTH))
    assert float(found) == pytest.approx(float(bare[0]), rel=1e-12)


def test_stack_without_and_with_films_of_the_substrate_is_the_substrate():
    s, p, _, _ = reflectances(COSINES, *ALUMINIUM)
    for layers in ([], [Layer(1.37, 7.62, 0.02)], [Layer(1.0, 0.0, 0.4), Layer(1.37, 7.62, 0.1)]):
        r_s, r_p = stack(COSINES, layers, *ALUMINIUM, WAVELENGTH)
        np.testing.assert_allclose(r_s, s, rtol=1e-10)
        np.testing.assert_allclose(r_p, p, rtol=1e-10)


def test_a_film_is_finite_where_it_reflects_totally_and_at_grazing():
    cos = np.concatenate([COSINES, [1e-6, 1e-17]])
    index, extinction = np.asarray(0.3), np.asarray(0.0)
    found = film(cos, np.asarray(1.5), np.linspace(0, 1, 7)[:, None], index, extinction, np.asarray(0.5))
    assert np.isfinite(found).all()
    assert (found <= 1 + 1e-12).all()
    thick = coat(cos, np.asarray(1.5), index, extinction)
    assert np.isfinite(thick).all()
    np.testing.assert_allclose(thick[cosine(20.0) > cos], 1.0, rtol=1e-9)  # total from 17.5 deg on


def test_coat():
    row = TABLE["coat"]
    constants = (np.asarray(row["index"]), np.asarray(row["extinction"]))
    equal(coat(cosine(row["theta"]), np.asarray(row["n"]), *constants), row["unpolarised"])
    found = coat_by_polarisation(cosine(40.0), np.asarray(row["n"]), *constants)
    equal(found, (row["s_40"], row["p_40"]))


def test_a_coat_is_the_mean_of_films_of_all_thicknesses():
    """Over one period of the phase the coherent film averages to the thick coat: Parseval, for each polarisation."""
    cos = cosine(40.0)
    period = WAVELENGTH / (2 * math.sqrt(1.5**2 - 1 + float(cos) ** 2))
    thickness = np.arange(64) / 64 * period
    films = stack(cos + 0 * thickness, [Layer(1.5, 0.0, thickness)], *ALUMINIUM, WAVELENGTH)
    np.testing.assert_allclose(np.mean(films, axis=1), coat_by_polarisation(cos, 1.5, *ALUMINIUM), rtol=1e-12)


@pytest.mark.parametrize("row", TABLE["kubelka_munk"], ids=lambda row: f"X {row['thickness']}")
def test_kubelka_munk(row):
    k, s, x, backing = (np.asarray(row[key]) for key in ("absorption", "scattering", "thickness", "backing"))
    reflectance, transmittance = body.kubelka_munk(k, s, x, backing)
    equal(reflectance, row["reflectance"])
    equal(transmittance, row["transmittance"])
    equal(body.infinite_reflectance(k / s), row["infinite"])
    assert body.absorption_over_scattering(body.infinite_reflectance(k / s)) == pytest.approx(k / s, rel=1e-12)


def test_kubelka_munk_at_its_ends():
    """Nothing absorbed, nothing there, infinitely much, and the step between the series and the function."""
    one = np.asarray(1.0)
    reflectance, transmittance = body.kubelka_munk(0.0 * one, one, np.array([0.0, 1.0, 3.0]))
    np.testing.assert_allclose(reflectance, [0.0, 0.5, 0.75], rtol=1e-12)  # x/(1 + x)
    np.testing.assert_allclose(reflectance + transmittance, 1.0, rtol=1e-12)
    assert float(body.kubelka_munk(0.1 * one, one, 1e4 * one, 0.7)[0]) == pytest.approx(0.64174243, abs=LAST)
    assert float(body.kubelka_munk(0.1 * one, one, 0.0 * one, 0.7)[0]) == pytest.approx(0.7, rel=1e-12)
    b = math.sqrt(1.1**2 - 1)
    at = np.array([body.THIN * (1 - 1e-9), body.THIN * (1 + 1e-9)]) / b
    below, above = body.kubelka_munk(0.1 * one, one, at, 0.3)[0]
    assert above == pytest.approx(below, rel=1e-10)


def test_one_height_map_at_several_wavelengths():
    row = TABLE["spectrum"]
    wavelength = np.array(row["wavelength"])
    g = Geometry.from_degrees(40.0 + 0 * wavelength, 30.0, 180.0)
    huge, none = np.asarray(1e6), np.asarray(0.0)
    found = scattered(g, np.asarray(row["sigma"]), np.asarray(row["length"]), huge, none, wavelength)
    # the index of 1e6 takes 4e-6 of the light
    np.testing.assert_allclose(found, row["brdf"], rtol=0, atol=LAST)
    mirror = Geometry.from_degrees(40.0, 40.0, 180.0)
    coherent = np.exp(-phase_variance(mirror, row["sigma"], wavelength))
    np.testing.assert_allclose(coherent, row["coherent"], rtol=0, atol=0.51e-6)
    np.testing.assert_allclose(4 * math.pi * row["sigma"] / wavelength, row["phase"], rtol=0, atol=0.51e-6)
    f0, m = np.asarray(0.1), np.asarray(0.25)
    by_height = scattered_lobe_of_height(mirror, f0, np.asarray(row["sigma"]), wavelength, m)
    np.testing.assert_allclose(
        by_height, scattered_lobe(mirror, f0, np.array(row["phase"]), m), rtol=2e-6
    )  # six decimals are printed


def test_a_film_or_a_coat_on_any_facets():
    """`over_facets` makes the catalogue's own models of its GGX facets, and takes facets without a Fresnel factor."""
    g = Geometry.from_degrees(np.array([0.0, 30.0, 70.0, 50.0]), np.array([10.0, 30.0, 60.0, 50.0]), 150.0)
    for name, factor in (("thin-film", film_of), ("clear-coat", coat_of)):
        other = catalogue[name]
        model = Model("other", terms={"rho_s": over_facets(ggx_facets, factor)})
        assert set(model.shape) == set(other.shape)
        shape = {"width": 0.25, "index": 1.37, "extinction": 7.62}
        np.testing.assert_allclose(model.basis(g, shape)["rho_s"], other.basis(g, shape)["rho_s"], rtol=1e-12)
    own = Model("own", terms={"ks": over_facets(gaussian_facets, film_of)})
    assert list(own.shape) == ["sigma", "n_f", "thickness", "index", "extinction", "wavelength"]
    bare = own.basis(g, {"thickness": 0.0, "index": 1.37, "extinction": 7.62})["ks"]
    facets = gaussian_facets(g, np.asarray(own.shape["sigma"].default))
    np.testing.assert_allclose(bare, unpolarised(g.cos_beta, *ALUMINIUM) * facets, rtol=1e-12)


@pytest.mark.parametrize(("name", "weight"), [("rayleigh-rice", "A"), ("priest-mueller", "ks")])
def test_a_term_without_a_fresnel_factor_to_take_out_is_refused(name, weight):
    with pytest.raises(ValueError, match="is not proportional to a Fresnel factor"):
        over_facets(catalogue[name].terms[weight], film_of)
