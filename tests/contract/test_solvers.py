"""Promises that every solver keeps, over the family of models whose values a scan determines."""

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.comparison.ranking import FAMILY
from gonio.fitting import Anneal, Projection, Solution, Status, fit

SOLVERS = [Projection(), Anneal(max_iterations=3000, seed=3), Anneal(max_iterations=1000, seed=3, chains=4)]
every_solver = pytest.mark.parametrize("solver", SOLVERS, ids=["projection", "anneal", "anneal-4-chains"])
every_model = pytest.mark.parametrize("model", [catalogue[name] for name in FAMILY], ids=lambda m: m.name)
ANGLES = [20.0, 45.0, 65.0]
THETA_R = np.arange(-80.0, 81.0, 2.0)


def true_values(model):
    weights = {w: 0.3 + 0.1 * k for k, w in enumerate(model.weights)}
    return weights | {name: p.default for name, p in model.shape.items()}


@pytest.fixture
def problem(model):
    return Problem(model, simulate(model, true_values(model), ANGLES, THETA_R, noise=0.02, seed=5))


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
@every_model
@every_solver
def test_optimum_is_what_it_says(problem, solver):
    """Inside the bounds, E recomputes from the vector, the history falls to it, and a second run is the same."""
    optimum = solver.search(problem)
    assert np.all(optimum.vector >= problem.lower)
    assert np.all(optimum.vector <= problem.upper)
    assert optimum.cost == pytest.approx(float(problem.cost(problem.residual(optimum.vector))), rel=1e-9)
    history = optimum.history.reshape(len(optimum.history), -1)
    assert np.all(np.diff(history, axis=0) <= 0)
    assert history[-1].min() == pytest.approx(optimum.cost, rel=1e-12)
    again = solver.search(problem)
    np.testing.assert_array_equal(again.vector, optimum.vector)


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
@every_model
@pytest.mark.parametrize("weighting", ["uniform", "relative", "solid-angle", "uncertainty", "log"])
def test_nothing_beats_the_exact_solver(problem, model, weighting):
    """Two chains of annealing end no lower; `make bench` asks the same of longer ones on real scans."""
    weighted = Problem(model, problem.data, weighting=weighting)
    exact = Projection().search(weighted).cost
    assert exact <= Anneal(max_iterations=2000, chains=2).search(weighted).cost * (1 + 1e-9)


@every_model
def test_noise_free_scan_gives_the_values_back(model):
    values = true_values(model)
    scan = simulate(model, values, ANGLES, THETA_R)
    solution = fit(Problem(model, scan))
    for name, value in values.items():
        assert solution.values[name] == pytest.approx(value, rel=1e-6)


@every_model
@every_solver
def test_solution_is_complete_and_survives_a_file(problem, solver, tmp_path):
    solution = fit(problem, solver)
    assert isinstance(solution.status, Status)
    assert list(solution.values) == list(problem.names)
    covariance = solution.dataset["covariance"].values
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-9, atol=1e-300)
    assert set(solution.intervals()) == set(solution.values)
    solution.save(tmp_path / "solution.nc")
    loaded = Solution.load(tmp_path / "solution.nc")
    assert loaded.values == solution.values
    assert loaded.status is solution.status
    assert loaded.parameters() == solution.parameters()
