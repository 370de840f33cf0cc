"""What the data tell: the paper's own model trades off its three diffuse numbers and fixes one combination of them."""

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, published, simulate
from gonio.fitting import Solution, fit
from gonio.fitting.certainty.identifiability import combinations, determinations

THETA_I = [20.0, 30, 40, 50, 60, 70]


@pytest.mark.parametrize("name", ["Al", "Cu", "SR107", "S781"])
def test_the_papers_model_as_published(name):
    """Gamma, kdd and kid trade off on every sample; kdd/(pi gamma) comes out, near the published value."""
    surface = published[name]
    model = catalogue[surface.model]
    scan = simulate(model, surface.values, THETA_I, np.arange(-80, 81, 1.0), noise=0.03, seed=1, unit="a.u.", blocked=5)
    solution = fit(Problem(model, scan, grouped={"ks": "theta_i"}, weighting="relative"))
    found = {v.name: v for v in determinations(solution, farthest=80.0)}
    trading = {n for n, v in found.items() if not v.determined}
    assert trading == {"kdd", "kid", "gamma"}
    for one in trading:
        assert set(found[one].partners) == trading - {one}
        assert "fix one with --hold; readings beyond 80 deg may help" in found[one].words
    (told,) = [c for c in combinations(solution) if c.name == "kdd/(pi gamma)"]
    expected = surface.values["kdd"] / (np.pi * surface.values["gamma"])
    assert abs(told.value - expected) < 4 * told.uncertainty
    parts = [solution.uncertainties[n] / solution.values[n] for n in ("kdd", "gamma")]
    assert told.relative < min(parts)


def test_the_uncertainty_of_a_combination_is_its_scatter():
    """Over repeated scans kdd/(pi gamma) scatters as its uncertainty says, within the error of 60 repeats."""
    surface = published["SR107"]
    model = catalogue[surface.model]
    seen, said = [], []
    for seed in range(60):
        scan = simulate(
            model, surface.values, [30.0, 50.0], np.arange(-80, 81, 2.0), noise=0.03, seed=seed, unit="a.u."
        )
        solution = fit(Problem(model, scan, grouped={"ks": "theta_i"}, weighting="relative"))
        (told,) = [c for c in combinations(solution) if c.name == "kdd/(pi gamma)"] or [None]
        if told:
            seen.append(told.value)
            said.append(told.uncertainty)
    assert len(seen) > 40
    # the standard deviation of 60 values is known to 9 %; three of these, and what curvature adds
    assert np.std(seen) == pytest.approx(np.median(said), rel=0.35)


def test_all_is_determined_where_nothing_trades_off():
    model = catalogue["torrance-sparrow"]
    scan = simulate(model, {"ks": 0.4, "kd": 0.05, "sigma": 0.2}, THETA_I, np.arange(-75, 76, 3.0), noise=0.02, seed=2)
    solution = fit(Problem(model, scan))
    assert [v.words for v in determinations(solution)] == ["determined"] * 3
    assert combinations(solution) == []


def test_held_bounded_and_untold_values():
    """A held value has no verdict; one at its bound and one that nothing tells say so."""
    model = catalogue["cauchy-lorentz"]
    flat = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0, 50], np.arange(-75, 76, 5.0), noise=0.01, seed=3)
    solution = fit(Problem(model, flat, held={"sigma": 0.2}))
    found = {v.name: v for v in determinations(solution)}
    assert "sigma" not in found
    assert not all(v.determined for v in found.values())
    assert all(v.words for v in found.values())
    zero = [n for n in ("ks", "kdd") if solution.values[n] == 0]
    assert all("at its bound" in found[n].words for n in zero)


@pytest.mark.parametrize(("correlation", "name"), [(0.995, "ks/kd"), (-0.995, "ks kd")])
def test_ratios_and_products_are_found_by_themselves(correlation, name):
    """Two values of 10 % that move together fix their ratio, two that move apart their product: to 1 % here."""
    model = catalogue["torrance-sparrow"]
    names, values, relative = ["ks", "kd", "sigma"], np.array([2.0, 5.0, 0.2]), np.array([0.1, 0.1, 0.001])
    together = np.array([[1, correlation, 0], [correlation, 1, 0], [0, 0, 1]])
    covariance = together * np.outer(values * relative, values * relative)
    solution = Solution(
        xr.Dataset(
            {
                "value": ("parameter", values),
                "uncertainty": ("parameter", values * relative),
                "at_bound": ("parameter", np.zeros(3, dtype=bool)),
                "held": ("parameter", np.zeros(3, dtype=bool)),
                "covariance": (("parameter", "parameter_b"), covariance),
            },
            coords={"parameter": names},
            attrs={"smooth": ""},
        ),
        model,
    )
    found = {v.name: v for v in determinations(solution)}
    assert [v.determined for v in found.values()] == [False, False, True]
    assert found["ks"].inflation == pytest.approx(1 / np.sqrt(1 - correlation**2))
    (told,) = combinations(solution)
    assert told.name == name
    assert told.value == pytest.approx(2 / 5 if "/" in name else 10)
    assert told.relative == pytest.approx(0.1 * np.sqrt(2 - 2 * abs(correlation)))
