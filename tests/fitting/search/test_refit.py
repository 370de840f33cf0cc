"""Searches from near: their slopes against accurate ones and SciPy's, and where they end."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from gonio import Problem, catalogue, simulate
from gonio.fitting import fit
from gonio.fitting.objective.differences import derivative
from gonio.fitting.objective.slopes import jacobian, quick_jacobian
from gonio.fitting.search.descent import LeastSquares, descend
from gonio.fitting.search.refit import refit

TRUTH = {"ks": 0.5, "kdd": 8.0, "kid": 0.05, "sigma": 0.2, "gamma": 40.0}


@pytest.fixture(params=["uniform", "relative", "log"])
def problem(request):
    scan = simulate(catalogue["cauchy-lorentz"], TRUTH, [20.0, 50, 65], np.arange(-75, 76, 3.0), noise=0.03, seed=2)
    return Problem(catalogue["cauchy-lorentz"], scan, grouped={"ks": "theta_i"}, weighting=request.param)


def vector(problem):
    return np.array([TRUTH[name.split("[")[0]] for name in problem.names])


def testslopes(problem):
    at = vector(problem)
    accurate = jacobian(problem, at)
    size = np.linalg.norm(accurate, axis=0)
    # a forward difference keeps half of the digits
    np.testing.assert_allclose(quick_jacobian(problem, at) / size, accurate / size, atol=1e-6)
    np.testing.assert_allclose(approx_fprime(at, problem.residual) / size, accurate / size, atol=1e-5)


def test_what_is_never_positive_has_no_slope_in_logarithms():
    """Where a model gives no positive value the residual stays at one logarithm, and nothing moves it."""
    scan = simulate(catalogue["lambert"], {"rho": 0.5}, [20.0, 80], np.arange(-85, 86, 5.0))
    problem = Problem(catalogue["ross-li"], scan, weighting="log")
    at = np.array([0.0, 1.0, 1.0])  # kernels alone are negative somewhere
    negative = problem.brdf(at) <= 0
    assert 0 < negative.sum() < len(negative)
    assert not jacobian(problem, at)[negative].any()
    assert np.isfinite(jacobian(problem, at)).all()


def test_it_comes_back_from_nearby(problem):
    best = np.array([fit(problem).values[name] for name in problem.names])
    found = refit(problem, best * 1.02)
    np.testing.assert_allclose(found.point, best, rtol=1e-4)  # a search ends where the cost no longer changes
    stopped = refit(problem, best * 1.02, max_steps=2)
    assert stopped.exhausted
    assert stopped.cost > found.cost
    coarse = refit(problem, best * 1.02, tolerance=1e-3)
    assert coarse.evaluations < found.evaluations


def test_several_points_at_once_change_nothing():
    """A residual that takes several points gives the same search and derivative as one that does not."""
    x = np.linspace(0, 3, 40)
    y = 2 * np.exp(-1.3 * x) + 0.05 * np.cos(40 * x)

    def residual(b):
        return b[..., :1] * np.exp(-b[..., 1:] * x) - y

    start, low, high = np.array([1.0, 0.5]), [0.0, 0.0], [10.0, 1.35]
    one, several = (descend(LeastSquares(residual, low, high, vectorised=flag), start) for flag in (False, True))
    np.testing.assert_array_equal(several.point, one.point)
    assert several.evaluations == one.evaluations
    at = np.array([2.0, 1.35])  # one value at its bound
    slopes = derivative(residual, at, low, high, vectorised=True)
    np.testing.assert_array_equal(slopes, derivative(residual, at, low, high))
    exact = np.stack([np.exp(-1.35 * x), -2 * x * np.exp(-1.35 * x)], axis=-1)
    np.testing.assert_allclose(slopes, exact, atol=1e-9)
