"""Profile likelihood against fits by another search with the value held, and against the interval of linear models."""

from dataclasses import replace

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.fitting import fit
from gonio.fitting.certainty.identifiability import determinations
from gonio.fitting.certainty.profile import between, profile, rises
from gonio.measured.dataset import make_scan

THETA_R = np.arange(-75, 76, 3.0)


@pytest.fixture(scope="module")
def broad():
    """A lobe so broad that its half width is skewed: the paper's trade-off."""
    model = catalogue["cauchy-lorentz"]
    truth = {"ks": 0.2, "kdd": 12.0, "kid": 0.01, "sigma": 0.15, "gamma": 60.0}
    scan = simulate(model, truth, [30.0, 50.0], THETA_R, noise=0.01, seed=1)
    problem = Problem(model, scan, weighting="relative")
    return problem, fit(problem, covariance="scaled")


@pytest.mark.parametrize("covariance", ["robust", "scaled", "absolute"])
def test_the_interval_of_a_linear_model_is_the_covariances(covariance):
    kernels = catalogue["ross-li"]
    weights = dict(zip(kernels.weights, (0.3, 0.1, 0.05), strict=True))
    scan = simulate(kernels, weights, [10.0, 30, 50], THETA_R, noise=0.05, seed=2)
    problem = Problem(kernels, scan, bounds=dict.fromkeys(kernels.weights, (-np.inf, np.inf)))
    solution = fit(problem, covariance=covariance)
    for name, ends in solution.intervals(0.9).items():
        found = profile(problem, solution, name, level=0.9)
        np.testing.assert_allclose((found.lower, found.upper), ends, rtol=1e-5)
        assert not found.open_below
        assert not found.open_above
        # the signed root of the rise is a straight line through the value
        straight = (found.at - found.value) / solution.uncertainties[name]
        np.testing.assert_allclose(found.rise, straight, atol=1e-4)


@pytest.mark.parametrize("name", ["gamma", "kid", "sigma"])
def test_the_ends_are_where_the_cost_says(broad, name):
    """With the value held at either end another search loses t^2 times the variance of a residual: the F test."""
    problem, solution = broad
    found = profile(problem, solution, name)
    variance = solution.cost * problem.scale / (len(problem.measured) - 5)
    for end in (found.lower, found.upper):
        held = fit(Problem(problem.model, problem.data, held={name: end}, weighting="relative"))
        lost = (held.cost - solution.cost) * problem.scale / variance
        assert lost == pytest.approx(found.factor**2, rel=1e-4)
        assert rises(problem, solution, {name: end})[name] == pytest.approx(found.factor, rel=1e-4)
    assert np.all(np.diff(found.at) > 0)
    assert np.all(np.diff(found.rise) > 0)
    assert found.at[0] <= found.lower < found.value < found.upper <= found.at[-1]


def test_a_broad_lobe_is_skewed(broad):
    """The half width may be far larger and less far smaller, which the symmetric interval cannot say."""
    problem, solution = broad
    found = profile(problem, solution, "gamma")
    assert found.upper - found.value > 1.05 * (found.value - found.lower)
    low, high = solution.intervals()["gamma"]
    assert high - found.value == pytest.approx(found.value - low)


def test_intervals_that_end_at_a_bound():
    """Data without a lobe allow a lobe up to some weight, any shape of it, and say so in words."""
    model = catalogue["torrance-sparrow"]
    flat = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0, 50], THETA_R, noise=0.01, seed=3)
    problem = Problem(model, flat)
    solution = fit(problem)
    found = {name: profile(problem, solution, name) for name in problem.names}
    assert found["ks"].open_below
    assert found["ks"].lower == 0
    assert not found["ks"].open_above
    assert found["ks"].words.startswith("up to ")
    assert (found["sigma"].open_below, found["sigma"].open_above) == (True, True)
    assert (found["sigma"].lower, found["sigma"].upper) == (0.01, 1.0)
    words = {v.name: v.words for v in determinations(solution, 75.0, tuple(found.values()))}
    assert words["sigma"].endswith("; the data allow sigma at any value")
    assert words["ks"].endswith(found["ks"].words)
    narrow = Problem(model, flat, bounds={"kd": (0.0, solution.values["kd"] * 0.99)})
    above = profile(narrow, fit(narrow), "kd")
    assert above.open_above
    assert above.upper == narrow.upper[1]
    assert above.words == f"from {above.lower:.3g} sr⁻¹ upwards"


def test_a_value_that_nothing_tells_is_profiled_too():
    """Without a lobe its width has no uncertainty at all: the profile is flat and the interval is all there is."""
    model = catalogue["torrance-sparrow"]
    flat = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0, 50], THETA_R, noise=0.01, seed=3)
    for covariance in ("robust", "absolute"):
        problem = Problem(model, flat, held={"ks": 0.0})
        solution = fit(problem, covariance=covariance)
        assert np.isinf(solution.uncertainties["sigma"])
        found = profile(problem, solution, "sigma")
        assert found.words == "at any value"
        np.testing.assert_array_equal(found.rise, 0.0)


def test_a_better_fit_is_not_kept_quiet(broad):
    """A solution in a minimum that is not the deepest is refused when its profile finds that out."""
    problem, solution = broad
    worse = solution.dataset.copy(deep=True)
    worse["value"].loc[{"parameter": ["ks", "sigma"]}] = [0.0, 1.0]  # where a lobe has no weight its shape has no slope
    worse["value"].loc[{"parameter": ["kdd", "kid", "gamma"]}] = [20.0, 0.0, 80.0]
    with pytest.raises(ValueError, match="fit again with more searches"):
        profile(problem, replace(solution, dataset=worse), "sigma")


def test_refusals(broad):
    with pytest.raises(ValueError, match="no free value of this fit: choose one of ks, kdd"):
        profile(*broad, "rho")
    with pytest.raises(ValueError, match="between 0 and 1"):
        profile(*broad, "kid", level=95)
    flat = Problem(catalogue["lambert"], make_scan([10.0, 10, 10], [0.0, 20, 40], [0.25] * 3))
    with pytest.raises(ValueError, match="no scatter is left about the fit"):
        profile(flat, fit(flat, covariance="scaled"), "rho")


@pytest.mark.parametrize(
    ("ends", "text"),
    [
        ((0.12345, 0.12567), "0.12345 .. 0.12567"),
        ((4.0, 90.0), "4.0 .. 90.0"),
        ((1e9, 2e9), "1.0000e+09 .. 2.0000e+09"),
    ],
)
def test_as_many_digits_as_the_width_gives_sense_to(ends, text):
    assert between(*ends) == text
