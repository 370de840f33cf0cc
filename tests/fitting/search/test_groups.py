"""Shape parameters with one value a group: problems that split, starts from what is common, and groups by rounding."""

from dataclasses import replace

import numpy as np
import pytest

from gonio import Problem, catalogue, join, read, simulate
from gonio.fitting import Projection, fit
from gonio.fitting.search import projection
from gonio.fitting.search.groups import assembled, common, parts, weights_couple
from gonio.measured.dataset import make_scan, points

SPARROW, LORENTZ = catalogue["torrance-sparrow"], catalogue["cauchy-lorentz"]


def spectrum(model, values, count, directions=50, noise=0.03):
    """A scan at so many wavelengths, each at two incidence angles; `values` are functions of x, from 0 to 1."""
    scans = {}
    for k, x in enumerate(np.linspace(0, 1, count)):
        here = {name: float(value(x)) for name, value in values.items()}
        theta_r = np.linspace(-75, 75, directions)
        scans[str(k)] = simulate(model, here, [20.0, 50.0], theta_r, noise=noise, seed=k, wavelength=400 + 300 * x)
    return join(scans).drop_vars("scan")


SLOPES = {"ks": lambda x: 0.4 + 0.3 * x, "kd": lambda x: 0.1, "sigma": lambda x: 0.15 + 0.1 * np.sin(2.5 * x)}


def apart(problem):
    """E of fits that know nothing of each other, one for each wavelength, added up."""
    flat = problem.points
    squares = 0.0
    for wavelength in np.unique(flat["wavelength"].values):
        here = flat.isel(direction=np.flatnonzero(flat["wavelength"].values == wavelength))
        alone = Problem(problem.model, here, weighting=problem.weighting)
        squares += fit(alone).cost * alone.scale
    return squares / problem.scale


@pytest.mark.parametrize("weighting", ["uniform", "relative", "log"])
def test_sixteen_wavelengths_are_as_near_as_sixteen_fits(weighting):
    scan = spectrum(SPARROW, SLOPES, 16 if weighting == "uniform" else 3)
    problem = Problem(SPARROW, scan, grouped={"sigma": "wavelength"}, weighting=weighting)
    solution = fit(problem)
    assert solution.cost <= apart(problem) * (1 + 1e-8)
    assert solution.cost == pytest.approx(float(problem.cost(problem.residual(solution.dataset["value"].values))))


def test_the_joint_search_finds_the_same(monkeypatch):
    """What does not split is searched at once; told not to, what does split ends where its parts do."""
    problem = Problem(SPARROW, spectrum(SPARROW, SLOPES, 5), grouped={"sigma": "wavelength"})
    split = Projection().search(problem)
    monkeypatch.setattr(projection, "parts", lambda problem: [])
    joint = Projection().search(problem)
    assert joint.cost == pytest.approx(split.cost, rel=1e-10)
    np.testing.assert_allclose(joint.vector, split.vector, rtol=1e-7)


def test_far_groups_of_a_coupled_problem_come_back():
    """A lobe shared by six surfaces whose slopes span a factor of ten, without noise."""
    slopes = dict(zip("abcdef", [0.04, 0.06, 0.1, 0.2, 0.3, 0.4], strict=True))
    values = {"ks": 0.5, "kdd": 60.0, "kid": 0.02, "gamma": 40.0}
    theta_r = np.arange(-80, 81, 4.0)
    scans = {name: simulate(LORENTZ, values | {"sigma": s}, [20.0, 50.0, 65.0], theta_r) for name, s in slopes.items()}
    problem = Problem(LORENTZ, join(scans), grouped={"sigma": "scan"}, shared=("kdd", "kid"))
    assert not parts(problem)
    solution = fit(problem)
    for name, slope in slopes.items():
        assert solution.values[f"sigma[{name}]"] == pytest.approx(slope, rel=1e-6)
    assert solution.values["gamma"] == pytest.approx(40.0, rel=1e-6)


def test_groups_that_shared_weights_couple_are_moved_one_by_one_too(shared_scans):
    """A real coating whose diffuse lobe two of four angles see: to move all groups at once is downhill for none."""
    scan = read(shared_scans / "ualoft_anoblack_ec1_al6061.csv")
    problem = Problem(LORENTZ, scan, grouped={"gamma": "theta_i"})
    assert weights_couple(problem)
    assert not weights_couple(replace(problem, grouped=dict.fromkeys(("gamma", *LORENTZ.weights), "theta_i")))
    # 64 quasi-random starts a dimension end at 0.0568224, all groups together at 0.0569565
    assert Projection().search(problem).cost < 0.056823


def test_what_splits():
    """By the coordinate that groups every free parameter, and only where nothing else couples the groups."""
    scan = spectrum(SPARROW, SLOPES, 3, directions=20)
    split = parts(Problem(SPARROW, scan, grouped={"sigma": ("theta_i", "wavelength"), "ks": "theta_i"}))
    assert [sorted(set(part.points["wavelength"].values.tolist())) for _, part in split] == [[400.0], [550.0], [700.0]]
    assert sorted(np.concatenate([rows for rows, _ in split])) == list(range(120))
    for options in (
        {},
        {"grouped": {"sigma": "theta_i"}},
        {"grouped": {"sigma": "wavelength"}, "shared": ("kd",)},
        {"smooth": {"sigma": ("wavelength", 1.0, 0.2)}},
    ):
        assert not parts(Problem(SPARROW, scan, **options))
    dark = scan.copy(deep=True)
    dark["brdf"].values[dark["wavelength"].values == 400] = 0.0
    assert not parts(Problem(SPARROW, dark, grouped={"sigma": "wavelength"}))


def test_parts_are_put_together_in_the_order_of_the_whole():
    """Weights by incidence angle and wavelength, each value where its name is."""
    scan = spectrum(SPARROW, SLOPES, 3, directions=20, noise=0.0)
    problem = Problem(SPARROW, scan, grouped={"sigma": ("theta_i", "wavelength"), "ks": ("theta_i", "wavelength")})
    optimum = assembled(problem, [(rows, part, Projection().search(part)) for rows, part in parts(problem)])
    found = dict(zip(problem.names, optimum.vector, strict=True))
    for x, wavelength in ((0.0, "400"), (0.5, "550"), (1.0, "700")):
        for angle in ("20", "50"):
            assert found[f"sigma[{angle},{wavelength}]"] == pytest.approx(SLOPES["sigma"](x), rel=1e-6)
            assert found[f"ks[{angle},{wavelength}]"] == pytest.approx(SLOPES["ks"](x), rel=1e-6)


def test_what_is_common_keeps_all_but_the_groups_of_the_shape():
    scan = spectrum(SPARROW, SLOPES, 3, directions=20)
    problem = Problem(SPARROW, scan, grouped={"sigma": "wavelength", "ks": "theta_i"}, held={"kd": 0.1})
    assert common(problem).names == (*problem.names[: problem.n_weights], "sigma")


def test_numbers_that_rounding_tells_apart_are_one_group():
    """Angles that went through radians: one value each, and found again at the directions themselves."""
    angles = np.degrees(np.radians([20.0, 50.0]))
    theta_i = np.concatenate([angles, angles * (1 + 4e-16), angles])
    scan = make_scan(theta_i, [0.0, 0.0, 10.0, 10.0, 20.0, 20.0], [1.0, 2.0, 1.0, 2.0, 1.0, 2.0])
    assert len(np.unique(theta_i)) > 2
    solution = fit(Problem(catalogue["lambert"], scan, grouped={"rho": "theta_i"}))
    assert list(solution.values) == ["rho[20]", "rho[50]"]
    np.testing.assert_allclose(solution.at(points(scan))["rho"] / np.pi, scan["brdf"].values)
