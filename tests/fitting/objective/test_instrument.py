"""A lobe narrower than the detector: biased without the instrument in the fit, and the surface's own with it."""

import numpy as np
import pytest

from gonio import Problem, catalogue, read, simulate
from gonio.comparison.assessment import assess
from gonio.comparison.ranking import compare
from gonio.fitting import Projection, Solution, fit
from gonio.measured.instrument import Acceptance, Instrument
from gonio.measured.masking import mask

THETA_R = np.arange(-20, 81.0)
SEEN = Instrument(detector_half_angle=2.0)
QUICK = Projection(grid=7, searches=1, rounds=1)
TRUTHS = {
    "cauchy-lorentz": ({"ks": 0.02, "kdd": 30.0, "kid": 0.02, "sigma": 0.01, "gamma": 40.0}, "sigma", {}),
    "ggx": ({"rho_s": 0.8, "rho_d": 0.1, "width": 0.02}, "width", {"index": 1.5, "extinction": 0.0}),
}
SEEDS = 5


@pytest.mark.parametrize("name", TRUTHS)
def test_the_instrument_in_the_fit_removes_the_bias(name):
    """Over five simulated scans: many standard uncertainties away without it, inside two with it."""
    truth, width, held = TRUTHS[name]
    options = {"held": held, "weighting": "uncertainty", "bounds": {width: (0.001, 1.0)}}
    blind, seeing = [], []
    for seed in range(SEEDS):
        data = simulate(catalogue[name], truth | held, [10.0, 35, 60], THETA_R, noise=0.01, seed=seed, instrument=SEEN)
        for found, seen in ((blind, Instrument()), (seeing, SEEN)):
            solution = fit(Problem(catalogue[name], data, **options, instrument=seen), QUICK)
            found.append([(solution.values[n] - v) / solution.uncertainties[n] for n, v in truth.items()])
    at = [*truth].index(width)
    assert np.min(blind, axis=0)[at] > 4
    # the mean of five deviations in standard uncertainties scatters by 0.45, their root mean square by 0.3
    assert np.abs(np.mean(seeing, axis=0)).max() < 1.8
    assert np.sqrt(np.mean(np.square(seeing), axis=0)).max() < 2


def test_design_is_the_mean_of_every_term():
    """Several candidates at once, with one width a channel: each as the instrument reads the model alone."""
    model = catalogue["ggx"]
    held = {"index": 1.5, "extinction": 0.0}
    scan = simulate(model, {"rho_s": 1.0, "rho_d": 0.1} | held, [10.0, 40], [5.0, 10, 35, 42])
    problem = Problem(model, scan, held=held, grouped={"width": "theta_i"}, instrument=Instrument(1.0, 1.0))
    shapes = np.array([[0.05, 0.2], [0.1, 0.03]])
    matrix, fixed = problem.design(shapes)
    assert not fixed.any()
    widths = shapes[:, [0] * 4 + [1] * 4]
    for k, row in enumerate(widths):
        for column, weight in enumerate(("rho_s", "rho_d")):
            alone = Acceptance(Instrument(1.0, 1.0), problem.geometry).brdf(model, {weight: 1.0, "width": row} | held)
            np.testing.assert_allclose(matrix[k, :, column], alone, rtol=1e-12)


def test_whatever_stands_beside_the_scan_is_seen_through_the_instrument(tmp_path):
    """Predictions from a solution that was saved and read, and those of parts left out."""
    model = catalogue["torrance-sparrow"]
    truth = {"ks": 0.3, "kd": 0.05, "sigma": 0.02}
    data = simulate(model, truth, [10.0, 30, 50], THETA_R, noise=0.01, seed=3, instrument=SEEN)
    problem = Problem(model, data, weighting="relative", instrument=SEEN)
    solution = fit(problem)
    solution.save(tmp_path / "solution.nc")
    loaded = Solution.load(tmp_path / "solution.nc")
    assert loaded.instrument == SEEN
    vector = np.array([solution.values[name] for name in problem.names])
    np.testing.assert_allclose(loaded.brdf(problem.points), problem.brdf(vector), rtol=1e-12)
    assert assess(problem, loaded).metrics["delta"] == pytest.approx(0.01, rel=0.2)
    # the curve itself, deconvolved, is what the model alone says
    assert np.max(model(problem.geometry, loaded.values) / loaded.brdf(problem.points)) > 1.3
    options = {"weighting": "relative", "left_out": "theta_i"}
    (seeing,) = compare(data, [model], **options, instrument=SEEN)
    (blind,) = compare(data, [model], **options)
    assert seeing.validated["delta"] < 0.015 < 0.025 < blind.validated["delta"]


def test_a_rule_too_coarse_for_the_lobe_is_told():
    """What half the step would change, over what the fit leaves over: nothing for a wide lobe, much for a needle."""
    model, narrow = catalogue["torrance-sparrow"], {"sigma": (0.0005, 1.0)}
    errors = []
    for sigma in (0.05, 0.002):
        exact = Instrument(detector_half_angle=2.0, step=0.1)
        data = simulate(
            model, {"ks": 0.3, "kd": 0.05, "sigma": sigma}, [10.0, 40], THETA_R, noise=0.01, instrument=exact
        )
        solution = fit(Problem(model, data, held={"sigma": sigma}, bounds=narrow, instrument=SEEN))
        errors.append(solution.dataset.attrs["instrument_error"])
    assert errors[0] < 1e-3
    assert errors[1] > 0.3
    assert fit(Problem(model, data)).dataset.attrs["instrument_error"] == 0


def test_real_peaks_as_wide_as_their_source(shared_scans):
    """The infrared aluminium was scanned with a source of 0.91 deg half-angle, which is most of its peak's width."""
    data = read(shared_scans / "jsss_mwir_aluminium.csv")
    theta_i, theta_r = data["theta_i"].values, data["theta_r"].values
    used = mask(data, exclude=(theta_i >= 80) | ((theta_i == 15) & (theta_r <= 3)))
    options = {"held": {"index": 1.5, "extinction": 0.0}, "grouped": {"rho_s": "theta_i"}}
    blind, seeing = (
        fit(Problem(catalogue["ggx"], used, **options, bounds={"width": (0.001, 1.0)}, instrument=seen))
        for seen in (Instrument(), Instrument(detector_half_angle=0.91, step=0.25))
    )
    # the widths were 0.01278(71) and 0.00682(84), E 0.0212 and 0.0142 when this was written
    assert seeing.values["width"] < 0.6 * blind.values["width"]
    assert seeing.cost < 0.75 * blind.cost
