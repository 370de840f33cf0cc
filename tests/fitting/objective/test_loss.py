"""Robust losses, against SciPy's own minimum, the theory of their efficiency, and scans with gross outliers."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from gonio import Problem, catalogue, simulate
from gonio.fitting import Projection, fit
from gonio.fitting.certainty.hold_out import predictions
from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.search.reweighting import scatter
from gonio.measured.dataset import make_scan

MODEL = catalogue["torrance-sparrow"]
TRUTH = {"ks": 0.3, "kd": 0.02, "sigma": 0.15}
QUICK = Projection(grid=7, searches=1, rounds=1)
ROBUST = ("huber", "cauchy")


def scan_with_outliers(seed, part=0.05):
    """Two per cent of noise, and one value in twenty half as large again to four times as large."""
    scan = simulate(MODEL, TRUTH, [10.0, 40, 60], np.arange(-70, 71, 5.0), noise=0.02, seed=seed)
    random, n = np.random.default_rng(1000 + seed), scan.sizes["direction"]
    wrong = random.choice(n, round(part * n), replace=False)
    scan["brdf"].values[wrong] *= random.uniform(1.5, 4, len(wrong))
    return scan, wrong


@pytest.mark.parametrize("name", LOSSES)
def test_a_loss_is_what_it_says(name):
    """Weight times residual is the derivative of the cost, and the slope that of their product, over the weight."""
    loss, u, h = LOSSES[name], np.linspace(-6, 6, 97) + 0.003, 1e-6
    np.testing.assert_allclose((loss.cost(u + h) - loss.cost(u - h)) / (2 * h), loss.weight(u) * u, atol=1e-8)
    pull = [loss.weight(u + s) * (u + s) for s in (h, -h)]
    np.testing.assert_allclose((pull[0] - pull[1]) / (2 * h), loss.slope(u) * loss.weight(u), atol=1e-8)


@pytest.mark.parametrize("name", ROBUST)
def test_the_minimum_is_scipys(name):
    """SciPy minimises the same cost directly, for the scale that the weights settled at."""
    scan, _ = scan_with_outliers(3)
    problem = Problem(MODEL, scan, weighting="uncertainty", loss=name)
    solution = fit(problem)
    tuned = {"huber": 1.345, "cauchy": 2.385}[name] * solution.dataset.attrs["loss_scale"]
    found = np.array([solution.values[n] for n in problem.names])
    theirs = least_squares(problem.residual, found * 1.02, x_scale=found, loss=name, f_scale=tuned, xtol=1e-12).x
    # residuals settle to 1e-4 of their scatter, which is less than as much of a standard uncertainty of a value
    spread = np.array([solution.uncertainties[n] for n in problem.names])
    assert np.abs(found - theirs).max() < 0.01 * np.abs(spread[np.argmax(np.abs(found - theirs))])
    assert solution.dataset.attrs["loss_scale"] == pytest.approx(1.0, rel=0.25)


def test_outliers_carry_squares_away_and_no_robust_loss():
    """Over eight scans: errors in the standard uncertainties that a fit of the clean scan would state."""
    errors: dict[str, list[np.ndarray]] = {name: [] for name in LOSSES}
    for seed in range(8):
        clean, _ = scan_with_outliers(seed, part=0)
        spread = fit(Problem(MODEL, clean, weighting="uncertainty"), QUICK).uncertainties
        scan, wrong = scan_with_outliers(seed)
        for name, found in errors.items():
            solution = fit(Problem(MODEL, scan, weighting="uncertainty", loss=name), QUICK)
            found.append(np.array([(solution.values[n] - v) / spread[n] for n, v in TRUTH.items()]))
            if name == "cauchy":
                assert 0 <= solution.dataset.attrs["points_discounted"] - len(wrong) <= 4
    rms = {name: np.sqrt(np.mean(np.square(e), axis=0)) for name, e in errors.items()}
    assert rms["squared"].min() > 8
    # 1 where outliers are without effect; huber lets each pull as hard as 1.3 of the scatter, all of them upwards
    assert rms["huber"].max() < 2
    assert rms["cauchy"].max() < 1.7


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
def test_what_robustness_costs_where_nothing_is_wrong():
    """Variance 1/0.95 of that of squares for normal noise (holland1977), and stated uncertainties that hold."""
    random, n = np.random.default_rng(5), 60
    estimates, stated = {name: [] for name in ("squared", *ROBUST)}, {name: [] for name in ROBUST}
    for _ in range(40):
        values = 1 + 0.1 * random.standard_normal(n)
        scan = make_scan(np.full(n, 10.0), np.linspace(-60, 60, n), values)
        estimates["squared"].append(np.pi * np.mean(values))
        for loss in ROBUST:
            solution = fit(Problem(catalogue["lambert"], scan, loss=loss))
            estimates[loss].append(solution.values["rho"])
            stated[loss].append(solution.uncertainties["rho"])
    spread = {loss: np.std(found) for loss, found in estimates.items()}
    for loss in ROBUST:
        # 40 draws of two estimates that agree but for 5 % of their variance: their ratio scatters by 0.07
        assert (spread[loss] / spread["squared"]) ** 2 == pytest.approx(1 / 0.95, abs=0.2)
        # a standard deviation of 40 draws scatters by 0.11
        assert np.mean(stated[loss]) / spread[loss] == pytest.approx(1, abs=0.3)


def test_scatter():
    random = np.random.default_rng(2)
    residual = 3.0 * random.standard_normal(20_000)
    assert scatter(residual, 3) == pytest.approx(3, rel=0.03)
    residual[:6000] = 1e6
    assert scatter(residual, 3) < 6  # 30 % of gross errors move the median to the 71st percentile
    assert scatter(np.zeros(4), 9) == 0


def test_left_out_parts_are_predicted_under_the_loss_too():
    """The truth of every incidence angle by fits to the others, outliers among them: rms of the relative error."""
    scan, _ = scan_with_outliers(0)
    errors = {}
    for loss in ("squared", "cauchy"):
        problem = Problem(MODEL, scan, weighting="relative", loss=loss)
        found, _ = predictions(problem, fit(problem, QUICK), "theta_i")
        errors[loss] = np.sqrt(np.mean((found / MODEL(problem.geometry, TRUTH) - 1) ** 2))
    assert errors["cauchy"] < errors["squared"] / 3


def test_refusals():
    scan, _ = scan_with_outliers(0)
    with pytest.raises(ValueError, match="no loss 'l1': choose one of squared, huber, cauchy"):
        Problem(MODEL, scan, loss="l1")
    with pytest.raises(ValueError, match="one for each of the 87 points"):
        Problem(MODEL, scan, point_weights=np.ones(3))
