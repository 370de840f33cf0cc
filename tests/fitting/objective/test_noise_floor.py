"""A noise floor in the weights: less bias and less scatter than masking what lies below it, or than ignoring it."""

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.fitting import Projection, fit
from gonio.measured.dataset import make_scan
from gonio.measured.masking import mask

TRUTH = {"ks": 0.3, "kd": 0.002, "sigma": 0.15}
RELATIVE, CONSTANT = 0.02, 0.001  # the constant noise exceeds the relative one below 0.05
QUICK = Projection(grid=7, searches=1, rounds=1)
SCANS = 16


def test_weights_of_a_noise_floor():
    scan = make_scan([10.0] * 4, [0.0, 10, 20, 30], [3.0, 0.4, 0.0, -0.1])
    problem = Problem(catalogue["lambert"], scan, weighting="relative", noise_floor=0.4)
    np.testing.assert_allclose(problem.root_weights**2, 1 / (np.array([9, 0.16, 0, 0.01]) + 0.16), rtol=1e-12)
    positive = make_scan([10.0] * 2, [0.0, 10], [3.0, 0.4])
    plain = Problem(catalogue["lambert"], positive, weighting="relative")
    np.testing.assert_allclose(plain.root_weights, [1 / 3, 2.5], rtol=1e-12)


def test_a_floor_beats_masking_and_ignoring_it():
    """Over simulated scans whose tails are noise: the root mean square error of every value, and the bias."""
    model, errors = catalogue["torrance-sparrow"], {}
    noise = {"noise": RELATIVE, "offset_noise": CONSTANT}
    for seed in range(SCANS):
        scan = simulate(model, TRUTH, [10.0, 40, 60], np.arange(-70, 71, 4.0), **noise, seed=seed)
        masked = {"masked at 3": 3 * CONSTANT, "masked at 10": 10 * CONSTANT, "ignored": 1e-12}
        ways = {name: Problem(model, mask(scan, floor=f), weighting="relative") for name, f in masked.items()}
        ways["floor"] = Problem(model, scan, weighting="relative", noise_floor=CONSTANT / RELATIVE)
        for name, problem in ways.items():
            values = fit(problem, QUICK).values
            errors.setdefault(name, []).append([values[n] / v - 1 for n, v in TRUTH.items()])
    rms = {name: np.sqrt(np.mean(np.square(e), axis=0)) for name, e in errors.items()}
    # over 100 scans the factors were 4 and more for kd, 1.6 and more for ks and sigma; sixteen scatter by a fifth
    for name in masked:
        assert rms["floor"][1] < rms[name][1] / 2
        assert np.all(rms["floor"] < rms[name])
    bias = np.abs(np.mean(errors["floor"], axis=0))
    # the weights are those of the noisy values, which pulls a fit down by about the square of the relative noise
    assert np.all(bias < 4 * np.std(errors["floor"], axis=0) / np.sqrt(SCANS) + 2 * RELATIVE**2)


def test_refusals():
    scan = make_scan([10.0] * 3, [0.0, 10, 20], [3.0, 0.4, -0.1])
    with pytest.raises(ValueError, match="uniform weighting takes no noise floor: choose relative"):
        Problem(catalogue["lambert"], scan, noise_floor=0.1)
    with pytest.raises(ValueError, match="noise_floor is -1"):
        Problem(catalogue["lambert"], scan, weighting="relative", noise_floor=-1.0)
    with pytest.raises(ValueError, match=r"1 of 3 are not: give a noise floor \(--noise-floor\)"):
        Problem(catalogue["lambert"], scan, weighting="relative")
