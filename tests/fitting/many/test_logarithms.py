"""Log weighting of many scans: each lane as `gonio.fit` fits it alone, and the weighting that a stack asks for."""

import functools

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, simulate
from gonio.fitting import Anneal, fit
from gonio.fitting.choosing import choice_for
from gonio.fitting.many import fit_many as batch
from gonio.fitting.status import STATUSES, Status

# One process, which compiles each form of a problem once.
pytestmark = [pytest.mark.xdist_group("many fits"), pytest.mark.usefixtures("quick_compilation")]
fit_many = functools.partial(batch.fit_many, block=8)
SMALL, PLAIN = catalogue["torrance-sparrow"], catalogue["lambert"]  # of a shape value, and of a weight alone
COST = 1e-6  # relative: what was promised; searches of many end where a step wins less than 1e-10 of E


def stack_of(name="torrance-sparrow", lanes=4, noise=0.05, seed=3):
    """Simulated scans with noise of so much of the value, all positive."""
    rng, model = np.random.default_rng(seed), catalogue[name]
    scans = []
    for _ in range(lanes):
        values = dict.fromkeys(model.weights, 0.0) | {n: p.default for n, p in model.shape.items()}
        values |= {w: rng.uniform(0.3, 1.5) for w in model.weights}
        values |= {"sigma": rng.uniform(0.1, 0.4)} if "sigma" in model.shape else {}
        scan = simulate(model, values, [20.0, 50.0], np.linspace(-75, 75, 16))
        scan["brdf"].values *= np.exp(noise * rng.standard_normal(scan["brdf"].shape))
        scans.append(scan)
    return xr.concat(scans, "sample")


def one(stack, lane=0, model=SMALL, weighting="log", **options):
    return Problem(model, stack.isel(sample=lane), weighting=weighting, **options)


def assert_as_alone(found, stack, lanes, **options):
    for lane in lanes:
        single = fit(one(stack, lane, **options))
        assert float(found["cost"][lane]) == pytest.approx(single.cost, rel=COST)
        assert STATUSES[int(found["status"][lane])] is single.status
        spread = single.dataset["uncertainty"].values
        told = np.isfinite(spread)
        away = np.abs(found["value"].values[lane] - single.dataset["value"].values)[told]
        # E agrees to 1e-10 in the lanes here: values may differ by the root of that, times the points, of a deviation
        assert (away <= 1e-3 * spread[told]).all()
        np.testing.assert_allclose(found["uncertainty"].values[lane][told], spread[told], rtol=1e-2)


OPTIONS = {
    "free": ("torrance-sparrow", {}),
    "grouped, held and bounded": (
        "torrance-sparrow",
        {"grouped": {"ks": "theta_i"}, "held": {"kd": 0.1}, "bounds": {"ks": (0.0, 0.8), "sigma": (0.15, 0.3)}},
    ),
    "weights alone, g2": ("lambert", {"g2": lambda z: np.cos(np.radians(z))}),
    "negative terms": ("ross-li", {}),
}


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
@pytest.mark.parametrize(("model", "options"), OPTIONS.values(), ids=OPTIONS)
def test_each_lane_is_fitted_in_logarithms_as_one_scan_is(model, options):
    stack, options = stack_of("torrance-sparrow"), options | {"model": catalogue[model]}
    found = fit_many(one(stack, **options), stack)
    assert found.attrs["weighting"] == "log"
    assert_as_alone(found, stack, range(4), **options)


def test_gaps_zeros_negative_values_and_a_dead_scan(recwarn):
    stack = stack_of("lambert", 7)
    values = stack["brdf"].values
    values[1, 3:20:4] = np.nan
    values[2, 5] = 0.0
    values[3, 6] = -1e-3
    values[4] = 0.0
    values[5] = np.nan
    found = fit_many(one(stack, model=PLAIN), stack)
    said = [STATUSES[int(status)] for status in found["status"].values]
    assert said[2:6] == [Status.NOT_WEIGHED, Status.NOT_WEIGHED, Status.ALL_ZERO, Status.NO_POINTS]
    assert np.isnan(found["value"].values[2:6]).all()
    assert_as_alone(found, stack, (0, 1, 6), model=PLAIN)
    with pytest.raises(ValueError, match="log weighting needs positive values, and 1 of 32 are not"):
        one(stack, 2, model=PLAIN)
    assert not len(recwarn)  # no logarithm of zero is taken


def test_stated_uncertainties_are_propagated_through_the_logarithm():
    stack = stack_of(lanes=2)
    stack["uncertainty"] = 0.03 * stack["brdf"]
    stack["uncertainty"].attrs = stack["brdf"].attrs
    found = fit_many(one(stack), stack, covariance="absolute")
    single = fit(one(stack, 1), covariance="absolute")
    np.testing.assert_allclose(found["uncertainty"][1], single.dataset["uncertainty"], rtol=1e-3)


def test_annealing_takes_logarithms_too():
    stack = stack_of("lambert", 2)
    many = fit_many(one(stack, model=PLAIN), stack, Anneal(cooling_rate=0.99, chains=2, seed=4), covariance="")
    for lane in range(2):
        exact = fit(one(stack, lane, model=PLAIN))
        assert exact.cost * (1 - 1e-9) <= float(many["cost"][lane]) < 1.5 * exact.cost  # a walk, and no descent


def test_auto_is_log_where_all_values_of_all_scans_are_positive():
    stack = stack_of("lambert")
    found = fit_many(one(stack, model=PLAIN, weighting="auto"), stack, covariance="")
    assert found.attrs["weighting"] == "log"
    assert found.attrs["weighting_reason"] == "all values of the scans are positive"


def test_auto_is_one_weighting_for_all_where_one_scan_needs_another():
    """The problem's own scan asks for log; a value of another is negative."""
    stack = stack_of("lambert")
    stack["brdf"].values[2, 5] = -1e-3
    found = fit_many(one(stack, model=PLAIN, weighting="auto"), stack, covariance="")
    assert found.attrs["weighting"] == "relative"
    assert found.attrs["noise_floor"] > 0
    assert found.attrs["weighting_reason"].startswith("1 of 4 scans hold values that are not positive")
    assert found["converged"].values.all()
    named = fit_many(one(stack, 0, model=PLAIN), stack, covariance="")
    assert named.attrs["weighting"] == "log"


def test_dead_scans_ask_for_no_weighting_and_a_given_floor_stays():
    stack = stack_of("lambert")
    stack["brdf"].values[1] = 0.0
    stack["brdf"].values[2] = np.nan
    assert choice_for(stack, ("sample",)).weighting == "log"
    assert choice_for(stack, ("sample",), 0.02)[:2] == ("relative", 0.02)
    assert choice_for(stack.isel(sample=[1, 2]), ("sample",)).weighting == "uniform"
    found = fit_many(one(stack, model=PLAIN, weighting="auto", noise_floor=0.02), stack, covariance="")
    assert found.attrs["noise_floor"] == 0.02


def test_uncertainties_decide_where_every_scan_states_them():
    stack = stack_of("lambert")
    stack["uncertainty"] = 0.05 * stack["brdf"]
    assert choice_for(stack, ("sample",)).weighting == "uncertainty"
    stack["uncertainty"].values[1] = np.nan
    assert choice_for(stack, ("sample",)).weighting == "log"


def test_of_a_long_stack_some_scans_are_asked_and_that_is_said(monkeypatch):
    from gonio.fitting import choosing

    monkeypatch.setattr(choosing, "ASKED", 4)
    monkeypatch.setattr(choosing, "RUNS", 2)
    stack = stack_of(lanes=9)
    assert choice_for(stack, ("sample",)).reason.endswith(", as 4 of the 9 scans say")
    stack["brdf"].values[8, 0] = -1.0  # the last one is asked
    assert choice_for(stack, ("sample",)).weighting == "relative"
