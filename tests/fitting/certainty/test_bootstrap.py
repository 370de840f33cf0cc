"""Resampled fits against the covariance where that is exact, and against SciPy's bootstrap where that applies."""

import numpy as np
import pytest
from scipy import stats

from gonio import Problem, catalogue, simulate
from gonio.fitting import Solution, fit
from gonio.fitting.certainty.bootstrap import bca, bootstrap, kept, percentile, standard_deviations
from gonio.measured.dataset import make_scan

THETA_R = np.arange(-75, 76, 5.0)


@pytest.fixture(scope="module")
def linear():
    """Weights alone under noise that grows with the signal."""
    model = catalogue["torrance-sparrow"]
    scan = simulate(model, {"ks": 0.3, "kd": 0.05, "sigma": 0.15}, [10.0, 30, 50], THETA_R, noise=0.1, seed=2)
    problem = Problem(model, scan, held={"sigma": 0.15}, bounds=dict.fromkeys(("ks", "kd"), (-np.inf, np.inf)))
    return problem, fit(problem)


@pytest.mark.parametrize(("kind", "rel"), [("residual", 0.0), ("pairs", 0.1)])
def test_draws_scatter_as_the_robust_covariance_says(linear, kind, rel):
    """For a linear model the wild bootstrap has the covariance HC3 exactly, pairs have it but for a few per cent."""
    problem, solution = linear
    draws = 300
    found = standard_deviations(bootstrap(problem, solution, kind, draws))
    for name in problem.names:
        stated = solution.uncertainties[name]
        # a standard deviation of so many draws is known to 1/sqrt(2 draws), 4 %; three of these
        assert found[name] == pytest.approx(stated, rel=rel + 3 / np.sqrt(2 * draws))
    scaled = fit(problem, covariance="scaled").uncertainties
    assert max(abs(scaled[n] / solution.uncertainties[n] - 1) for n in problem.names) > 0.5  # the noise is uneven


def test_the_same_seed_draws_the_same(linear):
    problem, solution = linear
    one, same, other = (bootstrap(problem, solution, draws=20, seed=seed)["value"].values for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_intervals_of_a_mean_are_scipys():
    """The weight of a constant is a mean: percentiles and BCa of skewed values against scipy.stats.bootstrap."""
    values = np.random.default_rng(5).exponential(size=40)
    scan = make_scan(np.full(40, 20.0), np.linspace(-70, 70, 40), values)
    problem = Problem(catalogue["lambert"], scan)
    draws = 300
    drawn = bootstrap(problem, fit(problem), "pairs", draws)
    jackknife = (values.sum() - values) / 39
    off = jackknife.mean() - jackknife
    np.testing.assert_allclose(drawn["acceleration"], [np.sum(off**3) / (6 * np.sum(off**2) ** 1.5)], rtol=1e-6)
    random = np.random.default_rng(0)
    for ours, method in ((percentile, "percentile"), (bca, "BCa")):
        theirs = stats.bootstrap((values,), np.mean, n_resamples=20_000, method=method, rng=random)
        expected = np.pi * np.array([theirs.confidence_interval.low, theirs.confidence_interval.high])
        # a 2.5 % quantile scatters by sqrt(0.025 / draws) over the density there, 0.058 in units of the deviation
        scatter = np.sqrt(0.025 / draws) / 0.058 * np.pi * values.std() / np.sqrt(40)
        np.testing.assert_allclose(ours(drawn)["rho"], expected, atol=3 * scatter)
    assert bca(drawn)["rho"][1] > percentile(drawn)["rho"][1]  # values that are skewed upwards reach farther there


def test_what_draws_cannot_tell_has_no_interval():
    """A group of two points is left out by some draws; a value that nothing determines stays without an interval."""
    model = catalogue["torrance-sparrow"]
    scan = simulate(model, {"ks": 0.3, "kd": 0.1, "sigma": 0.2}, [20.0, 50.0], THETA_R, noise=0.02, seed=1)
    few = scan.isel(direction=np.r_[0:31, 40, 44])
    problem = Problem(model, few, grouped={"kd": "theta_i"})
    drawn = bootstrap(problem, fit(problem), "pairs", draws=40)
    missing = np.isnan(drawn["value"].sel(parameter="kd[50]").values)
    assert 0 < missing.sum() < 40
    assert np.isnan(percentile(drawn)["kd[50]"]).all()
    assert np.isfinite(percentile(drawn)["kd[20]"]).all()
    flat = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0, 50], THETA_R, noise=0.01, seed=3)
    problem = Problem(model, flat, held={"ks": 0.0})
    drawn = bootstrap(problem, fit(problem), draws=20)
    assert np.isnan(percentile(drawn)["sigma"]).all()
    assert np.isnan(standard_deviations(drawn)["sigma"])
    assert np.isfinite(percentile(drawn)["kd"]).all()


def test_draws_stay_within_bounds_and_pile_up_there():
    """A weight whose true value is zero: the percentile interval starts at zero, BCa is refused."""
    model = catalogue["torrance-sparrow"]
    for seed in range(20):
        flat = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0, 50], THETA_R, noise=0.02, seed=seed)
        problem = Problem(model, flat, held={"sigma": 0.2})
        solution = fit(problem)
        if solution.values["ks"] == 0:
            break
    drawn = bootstrap(problem, solution, draws=60)
    assert percentile(drawn)["ks"][0] == 0 < percentile(drawn)["ks"][1]
    assert np.isnan(bca(drawn)["ks"]).all()
    assert np.isfinite(bca(drawn)["kd"]).all()


def test_draws_are_kept_with_the_solution(linear, tmp_path):
    problem, solution = linear
    drawn = bootstrap(problem, solution, draws=20, seed=3)
    kept(solution, drawn).save(tmp_path / "solution.nc")
    loaded = Solution.load(tmp_path / "solution.nc")
    np.testing.assert_array_equal(loaded.dataset["bootstrap"].values[:2], drawn["value"].values)
    assert np.isnan(loaded.dataset["bootstrap"].values[2]).all()  # sigma is held
    assert loaded.dataset["bootstrap"].attrs == {"kind": "residual", "seed": 3, "draws": 20}
    assert loaded.values == solution.values


@pytest.mark.parametrize(
    ("kind", "draws", "message"), [("blocks", 100, "residual, pairs"), ("pairs", 5, "at least 20")]
)
def test_refusals(linear, kind, draws, message):
    with pytest.raises(ValueError, match=message):
        bootstrap(*linear, kind, draws)
