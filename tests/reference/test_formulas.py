"""Values printed in the specification and in guo2023, kept as data."""

import dataclasses
import functools
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.special import sici

from gonio import Geometry, catalogue, published
from gonio.comparison.ranking import drop
from gonio.models.publications import load
from gonio.optics.fresnel import unpolarised, with_fresnel
from gonio.optics.lorentz import hemispherical_integral
from gonio.optics.masking import v_groove
from gonio.optics.wu import shadowing as wu_shadowing
from gonio.plausibility import hemispherical_reflectance

# Every TOML file of this folder may hold [[term]] rows (model, weight, shape) and [[whole]] rows (model, values_set),
# with their values over the common directions, and [[furnace]] rows with directional-hemispherical reflectances.
FILES = [tomllib.loads(p.read_text(encoding="utf-8")) for p in sorted(Path(__file__).parent.glob("*.toml"))]
TERMS = [row for file in FILES for row in file.get("term", [])]
FURNACES = [row for file in FILES for row in file.get("furnace", [])]
WHOLES = [row for file in FILES for row in file.get("whole", [])]
TABLE = tomllib.loads(Path(__file__).with_name("formulas.toml").read_text(encoding="utf-8"))
PLACES = np.array(TABLE["directions"], dtype=float).T
GEOMETRY = Geometry.from_degrees(*PLACES)


def agrees(found, expected):
    # The table prints six digits, and half a unit of the sixth can exceed 5e-6: those cells hold to their own rounding.
    expected = np.asarray(expected, dtype=float)
    np.testing.assert_allclose(found, expected, rtol=TABLE["tolerance"], atol=0)


@pytest.mark.parametrize("row", TABLE["geometry"], ids=lambda row: row["quantity"])
def test_geometry(row):
    agrees(getattr(GEOMETRY, row["quantity"]), row["values"])


@pytest.mark.parametrize("row", TERMS, ids=lambda row: row["what"])
def test_terms(row):
    model = catalogue[row["model"]]
    if "fresnel" in row:
        terms = dict(model.terms) | {row["weight"]: with_fresnel(model.terms[row["weight"]], **row["fresnel"])}
        model = dataclasses.replace(model, terms=terms)
    agrees(model.basis(GEOMETRY, row["shape"])[row["weight"]], row["values"])


@pytest.mark.parametrize("row", WHOLES, ids=lambda row: row["what"])
def test_whole_models(row):
    agrees(catalogue[row["model"]](GEOMETRY, row["values_set"]), row["values"])


def test_fresnel_and_masking():
    for row in TABLE["fresnel"]:
        agrees(unpolarised(GEOMETRY.cos_beta, row["n"], row["k"]), row["values"])
    for row in TABLE["masking"]:
        agrees({"v_groove": v_groove, "wu_shadowing": wu_shadowing}[row["function"]](GEOMETRY), row["values"])
    for row in TABLE["reflectance"]:
        found = unpolarised(np.cos(np.radians(row["at"])), row["n"], row["k"])
        np.testing.assert_allclose(found, row["values"], rtol=0, atol=0.5 * 10 ** -row["digits"])


def test_hemispherical_integral_as_printed():
    found = hemispherical_integral(np.array(TABLE["integral"]["gamma"], dtype=float))
    np.testing.assert_allclose(found, TABLE["integral"]["values"], rtol=0, atol=0.5e-8)


@pytest.mark.parametrize("gamma", [1.0, 2.5, 5.0, 20.0, 47.0, 74.0, 120.0, 360.0])
def test_hemispherical_integral_against_closed_form(gamma):
    """The closed form of the specification, to the digits that its cancellation leaves (none at 720 deg)."""
    g = math.radians(gamma)

    def phi(t):
        si, ci = sici(2 * (t - 1j * g))
        return math.cosh(2 * g) * si + 1j * math.sinh(2 * g) * ci

    closed = math.pi * g * (phi(math.pi / 2) - phi(0.0)).imag
    lost = np.finfo(float).eps * math.cosh(2 * g) ** 2 * 100
    np.testing.assert_allclose(hemispherical_integral(gamma), closed, rtol=1e-12 + lost)


def test_hemispherical_integral_by_brute_force():
    """Over the whole range of gamma, against a dense trapezium that knows nothing of the substitution."""
    t = np.linspace(0, math.pi / 2, 2_000_001)
    for gamma in (1.0, 10.0, 100.0, 720.0):
        g = math.radians(gamma)
        dense = math.pi * np.trapezoid(np.sin(2 * t) / (1 + (t / g) ** 2), t)
        np.testing.assert_allclose(hemispherical_integral(gamma), dense, rtol=1e-8)


@pytest.mark.parametrize("row", FURNACES, ids=lambda row: row["what"])
def test_hemispherical_reflectances(row):
    model = catalogue[row["model"]]
    for theta_i, expected in zip(row["at"], row["values"], strict=True):
        found = hemispherical_reflectance(functools.partial(_evaluate, model, row["values_set"]), theta_i, nodes=400)
        assert found == pytest.approx(expected, abs=0.5 * 10 ** -row["digits"] + 1e-4)


@pytest.mark.parametrize("name", ["Al", "Cu", "SR107", "S781"])
def test_sum_of_the_published_constants(name):
    """Equations 12 and 13 over the hemisphere: the constants are in arbitrary units."""
    surface = published[name]
    model = catalogue[surface.model]
    for theta_i, expected in zip(TABLE["sums"]["at"], TABLE["sums"][name], strict=True):
        values = surface.at(theta_i)
        found = hemispherical_reflectance(functools.partial(_evaluate, model, values), theta_i)
        assert found == pytest.approx(expected, abs=0.6)


def _evaluate(model, values, geometry):
    return model(geometry, values)


def test_published_constants_between_and_outside_the_tabulated_angles():
    surface = published["Al"]
    assert surface.at(25.0)["ks"] == pytest.approx((362 + 397) / 2)
    with pytest.raises(ValueError, match="20 to 70 deg"):
        surface.at(75.0)
    with pytest.raises(KeyError, match="did you mean Al"):
        published["al"]


@pytest.mark.parametrize("reference", ["torrance-sparrow", "t-c"])
def test_tables_2_and_3_recompute(reference):
    """All 24 percentages and the four averages follow from the printed errors, to the printed digit."""
    paper = load("guo2023")
    errors, stated = paper["errors"], paper["drops"][reference]
    drops, differences = [], []
    for sample in ("Al", "Cu", "SR107", "S781"):
        pairs = zip(errors[reference][sample], errors["cauchy-lorentz"][sample], stated[sample], strict=True)
        for old, new, percentage in pairs:
            assert drop(old, new) == pytest.approx(percentage, abs=0.0051)
            drops.append(drop(old, new))
            differences.append(old - new)
    assert np.mean(drops) == pytest.approx(stated["average"], abs=0.0051)
    assert np.mean(differences) == pytest.approx(stated["average_error"], abs=0.000051)


def test_fresnel_at_its_edges():
    """An index of 1 reflects nothing; beyond the critical angle everything; values and slopes stay finite."""
    import jax
    import jax.numpy as jnp

    cos = np.cos(np.radians([0.0, 30.0, 60.0, 89.9]))
    np.testing.assert_allclose(unpolarised(cos, 1.0, 0.0), 0.0, atol=1e-20)
    inside = unpolarised(np.cos(np.radians([20.0, 41.0, 42.0, 80.0])), 1 / 1.5, 0.0)
    assert inside[0] < 0.05
    np.testing.assert_allclose(inside[2:], 1.0, rtol=1e-12)
    with jax.enable_x64(True):
        for n, k in ((1.0, 0.0), (1 / 1.5, 0.0), (1.5, 0.0), (0.25, 3.4)):
            slopes = jax.jacfwd(unpolarised, argnums=(1, 2))(jnp.asarray(cos), n, k)
            assert all(np.isfinite(np.asarray(slope)).all() for slope in slopes)


def test_fresnel_of_dielectrics_against_cooks_form():
    """Real indices: the form with g = sqrt(n^2 + c^2 - 1), and 1 where g is imaginary (formulas 1)."""
    random = np.random.default_rng(8)
    n, cos = random.uniform(0.3, 3, 500), random.uniform(1e-3, 1, 500)
    squared = n**2 + cos**2 - 1
    g = np.sqrt(np.where(squared > 0, squared, np.nan))
    cook = 0.5 * ((g - cos) / (g + cos)) ** 2 * (1 + ((cos * (g + cos) - 1) / (cos * (g - cos) + 1)) ** 2)
    np.testing.assert_allclose(unpolarised(cos, n, 0 * n), np.where(squared > 0, cook, 1.0), rtol=1e-9, atol=1e-15)


def test_fresnel_against_complex_arithmetic():
    """The real form against Fresnel's own, in complex numbers, over random indices and angles."""
    random = np.random.default_rng(7)
    n, k, beta = random.uniform(0.1, 5, 500), random.uniform(0, 8, 500), random.uniform(0, np.pi / 2, 500)
    m2, cos = (n + 1j * k) ** 2, np.cos(beta)
    q = np.sqrt(m2 - np.sin(beta) ** 2)
    r_s, r_p = (cos - q) / (cos + q), (m2 * cos - q) / (m2 * cos + q)
    np.testing.assert_allclose(unpolarised(cos, n, k), (abs(r_s) ** 2 + abs(r_p) ** 2) / 2, rtol=1e-11)
