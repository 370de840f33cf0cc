"""Uncertainty of predictions against repeated measurements, exact cases and drawn values."""

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.fitting import fit
from gonio.fitting.certainty.band import band, propagate
from gonio.measured import dataset
from gonio.measured.dataset import make_scan, points
from gonio.measured.instrument import Instrument

THETA_R = np.arange(-75, 76, 5.0)
TRUTH = {"ks": 0.3, "kd": 0.05, "sigma": 0.2}
MODEL = catalogue["torrance-sparrow"]
ELSEWHERE = make_scan([20.0, 20, 40, 65], [25.0, 25, 10, 80], np.zeros(4), [180.0, 90, 0, 180])


def scan(seed=0, systematic=None, **noise):
    found = simulate(MODEL, TRUTH, [10.0, 30, 50], THETA_R, seed=seed, **(noise or {"noise": 0.02}))
    if systematic is not None:
        found["uncertainty_systematic"] = systematic * np.abs(found["brdf"])
    return found


def test_predictions_scatter_as_the_band_says():
    """Fits to repeated scans predict directions that no scan held; their scatter is the mean band."""
    repeats, values, stated = 100, [], []
    for seed in range(repeats):
        found = band(fit(Problem(MODEL, scan(seed, offset_noise=0.01), held={"sigma": 0.2})), ELSEWHERE)
        values.append(found["brdf"].values)
        stated.append(found["uncertainty"].values)
    # a standard deviation of 100 is known to 7 %; three of these
    np.testing.assert_allclose(np.std(values, axis=0), np.mean(stated, axis=0), rtol=0.21)


def test_the_band_is_the_scatter_of_drawn_values():
    """Values drawn from the covariance, correlated as it says, through the model: the delta method is linear."""
    solution = fit(Problem(MODEL, scan()))
    drawn = np.random.default_rng(0).multivariate_normal(
        solution.vector(MODEL.parameters), solution.dataset["covariance"].values, size=4000
    )
    names = dict(zip(MODEL.parameters, drawn.T[:, :, None], strict=True))
    geometry = Problem(MODEL, ELSEWHERE.assign(brdf=ELSEWHERE["brdf"] + 1)).geometry
    found = band(solution, ELSEWHERE)
    np.testing.assert_allclose(np.std(MODEL(geometry, names), axis=0), found["uncertainty"], rtol=0.05)
    np.testing.assert_allclose(found["brdf"], MODEL(geometry, solution.values), rtol=1e-12)


@pytest.mark.parametrize("weighting", ["uniform", "relative", "log"])
def test_a_scale_error_scales_predictions(weighting):
    """2 % of every value at once is 2 % of every prediction, whatever the weighting."""
    found = band(fit(Problem(MODEL, scan(systematic=0.02), weighting=weighting)), ELSEWHERE)
    np.testing.assert_allclose(found["uncertainty_systematic"] / found["brdf"], 0.02, rtol=1e-6)
    assert found["uncertainty_systematic"].attrs["units"] == "sr-1"
    assert np.isnan(band(fit(Problem(MODEL, scan())), ELSEWHERE)["uncertainty_systematic"]).all()


def test_what_is_not_determined_spreads_only_to_what_needs_it():
    """The kd of an angle with one point has no uncertainty, nor a prediction there; elsewhere the band is finite."""
    flat = points(scan())
    lone = flat.isel(
        direction=np.flatnonzero((flat["theta_i"].values < 50) | (np.arange(flat.sizes["direction"]) == 70))
    )
    solution = fit(Problem(MODEL, lone, grouped={"kd": "theta_i"}))
    assert np.isinf(solution.uncertainties["kd[50]"])
    there = make_scan([30.0, 50.0], [10.0, 10.0], np.zeros(2))
    found = band(solution, there)["uncertainty"].values
    assert np.isfinite(found[0])
    assert np.isinf(found[1])
    with pytest.raises(ValueError, match="there is none for 20"):
        band(solution, ELSEWHERE)


def test_any_function_of_the_values():
    """A product by hand, a held value as exact."""
    solution = fit(Problem(MODEL, scan(), held={"sigma": 0.2}))
    ks, kd, _ = solution.vector(MODEL.parameters)
    covariance = solution.dataset["covariance"].values[:2, :2]
    found = propagate(solution, lambda v: np.array([v[0] * v[1] * v[2], v[2]]))
    slope = 0.2 * np.array([kd, ks])
    np.testing.assert_allclose(found.uncertainty, [np.sqrt(slope @ covariance @ slope), 0.0], rtol=1e-9)


def test_the_band_is_read_by_the_instrument_of_the_fit():
    """The curve under the band is the one that is drawn and compared, not the deconvolved one."""
    seen = Instrument(detector_half_angle=5.0)
    solution = fit(Problem(MODEL, scan(), weighting="relative", instrument=seen))
    found = band(solution, points(ELSEWHERE))
    np.testing.assert_allclose(found["brdf"].values, solution.brdf(points(ELSEWHERE)), rtol=1e-12)
    bare = MODEL(dataset.geometry(points(ELSEWHERE)), solution.values)
    assert np.abs(found["brdf"].values / bare - 1).max() > 1e-3
