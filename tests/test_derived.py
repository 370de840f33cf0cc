"""Derived numbers against closed forms, another quadrature and drawn values."""

import numpy as np
import pytest

from gonio import Geometry, Problem, catalogue, published, simulate
from gonio.derived import derived
from gonio.fitting import fit
from gonio.measured.dataset import join
from gonio.plausibility import bihemispherical_reflectance, hemispherical_reflectance

THETA_R = np.arange(-80, 81, 5.0)


@pytest.fixture(scope="module")
def lobe():
    model = catalogue["torrance-sparrow"]
    scan = simulate(model, {"ks": 0.3, "kd": 0.05, "sigma": 0.2}, [10.0, 40.0], THETA_R, noise=0.02, seed=1)
    scan["uncertainty_systematic"] = 0.03 * np.abs(scan["brdf"])
    return model, scan, fit(Problem(model, scan, weighting="relative"))


def by_name(numbers):
    return {(n.name, n.where.get("theta_i")): n for n in numbers}


def test_a_lambertian_reflects_its_weight():
    """Reflectance and albedo of a perfect diffuser are its one parameter, uncertainty and all."""
    model = catalogue["lambert"]
    scan = simulate(model, {"rho": 0.6}, [20.0, 60.0], THETA_R, noise=0.02, seed=3)
    solution = fit(Problem(model, scan))
    found = by_name(derived(solution, scan))
    for key in (("reflectance", 20.0), ("reflectance", 60.0), ("albedo", None)):
        assert found[key].value == pytest.approx(solution.values["rho"], rel=1e-12)
        assert found[key].uncertainty == pytest.approx(solution.uncertainties["rho"], rel=1e-9)
        assert np.isnan(found[key].systematic)
    assert found[("peak", 20.0)].value == pytest.approx(solution.values["rho"] / np.pi)
    assert "does not fall to half" in found[("half width", 20.0)].why


def test_uniform_light_on_a_known_surface():
    """White-sky albedo against the double integral by Monte Carlo over both directions, within five of its errors."""
    model, values = catalogue["torrance-sparrow"], {"ks": 0.3, "kd": 0.05, "sigma": 0.25}
    u, v, w = np.random.default_rng(1).random((3, 400_000))
    g = Geometry.from_degrees(*(np.degrees(np.arccos(np.sqrt(x))) for x in (u, v)), 360 * w)
    drawn = np.pi * model(g, values)  # both directions by their cosine
    error = drawn.std() / np.sqrt(drawn.size)
    assert bihemispherical_reflectance(lambda g: model(g, values)) == pytest.approx(drawn.mean(), abs=5 * error)


def test_uncertainties_are_the_scatter_of_drawn_values(lobe):
    """All numbers of values that are drawn from the covariance, by a plain grid, against the law of propagation."""
    model, scan, solution = lobe
    found = by_name(derived(solution, scan))
    grid = np.linspace(-80, 80, 3_201)
    draws = np.random.default_rng(0).multivariate_normal(
        solution.vector(model.parameters), solution.dataset["covariance"].values, size=150
    )
    seen = []
    for draw in draws:
        values = dict(zip(model.parameters, draw, strict=True))
        curve = model(Geometry.in_plane(np.full_like(grid, 10.0), grid), values)
        wide = grid[curve > curve.max() / 2]
        reflectance = hemispherical_reflectance(lambda g, v=values: model(g, v), 10.0, nodes=40)
        seen.append([reflectance, curve.max(), (wide[-1] - wide[0]) / 2])
    for name, values in zip(("reflectance", "peak", "half width"), np.transpose(seen), strict=True):
        number = found[(name, 10.0)]
        # the mean of 150 is known to 8 % of a deviation, the deviation to 6 %; three of each, and the grid's step
        assert number.value == pytest.approx(values.mean(), abs=0.25 * values.std() + 0.05 * (name == "half width"))
        assert number.uncertainty == pytest.approx(values.std(), rel=0.18)


def test_a_scale_error_is_in_heights_and_not_in_widths(lobe):
    _, scan, solution = lobe
    found = by_name(derived(solution, scan))
    for name in ("reflectance", "peak"):
        assert found[(name, 40.0)].systematic == pytest.approx(0.03 * found[(name, 40.0)].value, rel=1e-6)
    assert found[("albedo", None)].systematic == pytest.approx(0.03 * found[("albedo", None)].value, rel=1e-6)
    assert found[("half width", 10.0)].systematic == pytest.approx(0, abs=1e-9)


def test_relative_data_have_no_reflectance():
    surface = published["Al"]
    model, angles = catalogue[surface.model], [30.0, 40.0]
    scan = simulate(model, surface.values, angles, THETA_R, noise=0.01, unit="a.u.")
    found = by_name(derived(fit(Problem(model, scan, grouped={"ks": "theta_i"})), scan))
    for key in (("reflectance", 30.0), ("reflectance", 40.0), ("albedo", None)):
        assert "the data are relative" in found[key].why
        assert np.isnan(found[key].value)
    assert found[("peak", 30.0)].unit == "a.u."
    assert found[("peak", 30.0)].uncertainty > 0


def test_numbers_that_cannot_be_told_say_why(lobe):
    model, scan, solution = lobe
    grouped = fit(Problem(model, scan, grouped={"ks": "theta_i"}))
    found = by_name(derived(grouped, scan))
    assert found[("albedo", None)].why == "ks has one value for each theta_i, and none between them"
    with pytest.raises(ValueError, match="there is none for 25"):
        derived(grouped, scan, [25.0])
    mirror = simulate(model, {"ks": 0.3, "kd": 0.05, "sigma": 0.002}, [40.0], THETA_R)
    narrow = fit(Problem(model, mirror, held={"sigma": 0.002}, bounds={"sigma": (0.001, 1.0)}))
    assert "too narrow for the quadrature" in by_name(derived(narrow, mirror))[("reflectance", 40.0)].why
    assert "no curve in plane" in by_name(derived(solution, scan, [25.0]))[("peak", 25.0)].why


def test_every_set_has_its_own():
    """Two scans fitted together, one twice as bright: twice the reflectance, in the order of the scans."""
    model = catalogue["lambert"]
    scan = simulate(model, {"rho": 0.3}, [10.0, 40.0], THETA_R, noise=0.02, seed=1)
    both = join({"once": scan, "twice": scan.assign(brdf=scan["brdf"] * 2)})
    seen = []
    numbers = derived(fit(Problem(model, both)), both, [10.0], seen.append)
    once, twice = (n for n in numbers if n.name == "reflectance")
    assert (once.where["scan"], twice.where["scan"]) == ("once", "twice")
    assert twice.value == pytest.approx(2 * once.value, rel=1e-9)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
