"""Points that do not belong: found where they were put, not where nothing was wrong, and not where the model is."""

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.fitting import Projection, fit
from gonio.fitting.certainty.outliers import CHANCE, scrutinise
from gonio.measured.dataset import make_scan

MODEL = catalogue["torrance-sparrow"]
TRUTH = {"ks": 0.3, "kd": 0.02, "sigma": 0.1}
QUICK = Projection(grid=7, searches=1, rounds=1)
KINDS = [
    ({"noise": 0.02}, {}),
    ({"noise": 0.02}, {"weighting": "relative"}),
    ({"noise": 0.02}, {"weighting": "log"}),
    ({"offset_noise": 0.002}, {}),
    ({"offset_noise": 0.002}, {"weighting": "solid-angle"}),
    ({"noise": 0.02, "offset_noise": 0.001}, {"weighting": "relative", "noise_floor": 0.05}),
]
NAMES = ["proportional", "relative", "log", "constant", "no weight at the normal", "floor"]


def looked_at(scan, model=MODEL, **options):
    problem = Problem(model, scan, **options)
    solution = fit(problem, QUICK)
    return scrutinise(problem, [solution.values[name] for name in problem.names])


@pytest.mark.parametrize(("noise", "options"), KINDS, ids=NAMES)
def test_what_was_put_there_is_found_and_no_more(noise, options):
    """Ten standard deviations at five points, the peak among them, under weightings that suit the noise or do not."""
    for seed in range(3):
        clean = simulate(MODEL, TRUTH, [10.0, 40, 60], np.arange(-69, 70, 3.0), seed=seed, **noise)
        assert not looked_at(clean, **options).beyond.any()
        scan = clean.copy(deep=True)
        wrong = np.random.default_rng(seed).choice(np.flatnonzero(scan["theta_r"].values), 5, replace=False)
        wrong[0] = int(np.argmax(scan["brdf"].values))
        scan["brdf"].values[wrong] += 10 * scan["uncertainty"].values[wrong]
        found = looked_at(scan, **options)
        assert not found.systematic
        assert set(np.flatnonzero(found.beyond)) == set(wrong)


def test_a_clean_scan_cries_wolf_as_seldom_as_stated():
    """In 60 scans of normal noise at most 0.6 with a point beyond; four would come once in 300 times."""
    random, n, alarms, misfits = np.random.default_rng(3), 60, 0, 0
    for _ in range(60):
        scan = make_scan(np.full(n, 10.0), np.linspace(-60, 60, n), 1 + 0.1 * random.standard_normal(n))
        problem = Problem(catalogue["lambert"], scan)
        found = scrutinise(problem, [np.pi * scan["brdf"].values.mean()])
        alarms, misfits = alarms + found.beyond.any(), misfits + found.systematic
    assert CHANCE == 0.01
    assert alarms <= 3
    assert misfits <= 2


def test_a_model_that_lacks_something_is_told_from_outliers():
    """A lobe fitted without a lobe: neighbours err alike, and the peak is not called wrong."""
    scan = simulate(MODEL, TRUTH, [10.0, 40, 60], np.arange(-70, 71, 3.0), noise=0.01)
    found = looked_at(scan, catalogue["oren-nayar"], weighting="relative")
    assert found.systematic
    assert found.agreement > 0.5


def test_where_they_lie():
    """The specular direction, the beam, grazing and elsewhere; out of plane the angles alone do not say which."""
    theta_i, theta_r, phi = (a.ravel() for a in np.meshgrid([20.0, 60], [0.0, 15, 30, 62, 80], [0.0, 5, 90, 175, 180]))
    random = np.random.default_rng(0)
    scan = make_scan(theta_i, theta_r, 1 + 0.01 * random.standard_normal(theta_i.size), phi)
    places = {(60, 62, 175): "the specular direction", (20, 15, 5): "the incident beam", (20, 80, 90): "grazing"}
    places |= {(60, 0, 90): "elsewhere", (20, 30, 180): "the specular direction"}
    rows = {}
    for place, region in places.items():
        (row,) = np.flatnonzero(np.all(np.column_stack([theta_i, theta_r, phi]) == place, axis=1))
        rows.setdefault(region, set()).add(row)
        scan["brdf"].values[row] = 1.5
    found = scrutinise(Problem(catalogue["lambert"], scan), [np.pi])
    assert {region: set(at.tolist()) for region, at in found.regions.items()} == rows


def test_exact_and_few_values_say_nothing():
    exact = simulate(MODEL, TRUTH, [10.0, 40], np.arange(-70, 71, 5.0))
    found = looked_at(exact)
    assert not found.beyond.any()
    assert not found.systematic
    few = looked_at(make_scan(np.full(9, 10.0), np.arange(9.0), [1.0] * 8 + [9.0]), catalogue["lambert"])
    assert np.isinf(few.threshold)
    assert not few.beyond.any()
