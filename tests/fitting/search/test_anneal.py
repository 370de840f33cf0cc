"""Appendix A: every parameter that it names, and what each does."""

import numpy as np
import pytest

from gonio import Problem
from gonio.fitting import Anneal, fit


def problem_of(aluminium, **options):
    model, _values, scan = aluminium
    return Problem(model, scan, held={"sigma": 0.142, "gamma": 47.0}, **options)


def test_temperature_and_iterations_end_the_search(aluminium):
    problem = problem_of(aluminium)
    cooled = Anneal(initial_temperature=1.0, final_temperature=1e-3, cooling_rate=0.9).search(problem)
    assert len(cooled.history) == int(np.ceil(np.log(1e-3) / np.log(0.9))) + 1
    assert not cooled.exhausted
    stopped = Anneal(max_iterations=20, final_temperature=0.0).search(problem)
    assert len(stopped.history) == stopped.evaluations == 20
    assert stopped.exhausted


def test_tolerance_ends_the_search(aluminium):
    settled = Anneal(tolerance=1.0, patience=50).search(problem_of(aluminium))
    assert len(settled.history) == 51
    assert not settled.exhausted


def test_lower_and_upper_bounds_hold(aluminium):
    solver = Anneal(lb={"kdd": 1e4}, ub={"kdd": 2e4, "kid": 5.0}, max_iterations=2000)
    solution = fit(problem_of(aluminium), solver)
    assert 1e4 <= solution.values["kdd"] <= 2e4
    assert 0 <= solution.values["kid"] <= 5.0
    with pytest.raises(ValueError, match="no free parameter is called 'sigma'"):
        Anneal(lb={"sigma": 0.1}).search(problem_of(aluminium))
    with pytest.raises(ValueError, match="nothing lies between lb and ub of kid: 5 to 2"):
        Anneal(lb={"kid": 5.0}, ub={"kid": 2.0}).search(problem_of(aluminium))


def test_seed_and_chains(aluminium):
    problem = problem_of(aluminium)
    one, same, other = (Anneal(seed=s, max_iterations=500).search(problem) for s in (1, 1, 2))
    np.testing.assert_array_equal(one.vector, same.vector)
    assert not np.array_equal(one.vector, other.vector)
    several = Anneal(chains=5, max_iterations=500).search(problem)
    assert several.history.shape == (500, 5)
    assert several.evaluations == 2500
    assert several.cost == several.history[-1].min()


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
def test_slower_cooling_ends_lower(aluminium):
    problem = problem_of(aluminium)
    median = {
        rate: np.median([Anneal(cooling_rate=rate, seed=s).search(problem).cost for s in range(5)])
        for rate in (0.95, 0.999)
    }
    assert median[0.999] < median[0.95]


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
def test_free_shape_is_annealed_too(aluminium):
    model, _values, scan = aluminium
    problem = Problem(model, scan, grouped={"ks": "theta_i"})
    exact = fit(problem)
    annealed = fit(problem, Anneal(seed=4))
    assert exact.cost <= annealed.cost < 1.1 * exact.cost
    assert annealed.values["sigma"] == pytest.approx(0.142, rel=0.02)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cooling_rate": 1.0}, "cooling_rate"),
        ({"final_temperature": 2.0}, "initial_temperature"),
        ({"chains": 0}, "at least 1"),
    ],
)
def test_refusals(settings, message):
    with pytest.raises(ValueError, match=message):
        Anneal(**settings)
