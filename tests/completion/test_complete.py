"""A fit corrected by what its scan says beyond it: reciprocal, near to the data, the model alone far from them."""

import time

import numpy as np
import pytest

from bumped import ANGLES, HELD, NOISE, directions, exchanged, measured, some, surface
from gonio import Problem, catalogue, complete, fit, join
from gonio.comparison import assess, validate
from gonio.completion import Correction
from gonio.completion.correction import LEVEL, RELATIVE
from gonio.measured import dataset


@pytest.fixture(scope="module")
def scan():
    return measured()


@pytest.fixture(scope="module")
def solution(scan):
    return fit(Problem(catalogue["ggx"], scan, weighting="log", held=HELD))


@pytest.mark.parametrize("prior", [True, False])
def test_light_and_detector_may_be_exchanged(scan, solution, prior):
    places = some(60)
    one, other = (complete(scan, solution, where, prior) for where in (places, exchanged(places)))
    for name in ("brdf", "uncertainty", "lower", "upper"):
        np.testing.assert_allclose(one[name].values, other[name].values, rtol=1e-9)
    assert one["origin"].values.tolist() == other["origin"].values.tolist()


def test_where_it_was_measured_too(scan, solution):
    one, other = complete(scan, solution, scan), complete(scan, solution, exchanged(scan))
    np.testing.assert_allclose(one["brdf"].values, other["brdf"].values, rtol=1e-9)
    assert {*one["origin"].values, *other["origin"].values} == {"measured"}


@pytest.mark.parametrize("prior", [True, False])
def test_it_finds_what_the_model_misses(scan, solution, prior):
    """Between the angles, where the model errs by more than its noise; three times less is far beyond chance."""
    places = directions(*np.meshgrid([30.0, 50.0], np.arange(0, 70, 5.0)), 180.0)
    off = [
        np.log10(values / surface(places))
        for values in (solution.brdf(places), complete(scan, solution, places, prior)["brdf"].values)
    ]
    plain, corrected = (np.sqrt(np.mean(one**2)) for one in off)
    assert plain > 0.01
    assert corrected < plain / 3


def test_it_follows_the_data_without_their_noise(scan, solution):
    points = dataset.points(scan)
    found = complete(scan, solution, points)
    off = found["brdf"].values / points["brdf"].values - 1
    true = found["brdf"].values / surface(points) - 1
    assert np.std(off) < 1.2 * NOISE
    assert np.std(true) < 0.7 * NOISE


def test_intervals_hold_new_measurements(scan, solution):
    """Of 200 new values between the angles some 95 % should be held; fewer than 90 has a chance below 1 in 500."""
    new = measured([30.0, 35.0, 45.0, 50.0], seed=7)
    found = complete(scan, solution, new)
    inside = (new["brdf"].values >= found["lower"].values) & (new["brdf"].values <= found["upper"].values)
    assert inside.mean() >= 0.9
    assert found["uncertainty"].values.min() > 0.5 * NOISE * found["brdf"].values.min()
    assert np.median(found["uncertainty"] / found["brdf"]) < 4 * NOISE


def test_the_interval_is_even_in_logarithms(scan, solution):
    found = complete(scan, solution, some(20))
    value, lower, upper = (found[name].values for name in ("brdf", "lower", "upper"))
    np.testing.assert_allclose(lower * upper, value**2, rtol=1e-9)
    lg = found["uncertainty"].values / value / RELATIVE
    np.testing.assert_allclose(np.log10(upper / value), LEVEL * lg, rtol=1e-9)


def test_far_from_the_data_it_is_the_model(solution):
    """A scan near the normal says nothing of grazing directions, where the uncertainty is larger than anywhere near."""
    near = measured([5.0, 10.0]).pipe(dataset.points)
    near = near.isel(direction=np.flatnonzero(near["theta_r"].values < 20))
    far = directions([85.0, 88.0], [85.0, 80.0], [180.0, 20.0])
    found, close = (complete(near, solution, where, prior=False) for where in (far, directions(8.0, 5.0, 180.0)))
    np.testing.assert_allclose(found["brdf"].values, solution.brdf(far), rtol=0.02)
    assert set(found["origin"].values) == {"model"}
    relative = [np.max((one["uncertainty"] / one["brdf"]).values) for one in (found, close)]
    assert relative[0] > 2 * relative[1]


def test_several_sets_are_corrected_each_by_its_own(scan):
    red = scan.assign(brdf=scan["brdf"] * 1.0)
    blue = scan.assign(brdf=scan["brdf"] * 0.5)
    both = join({"red": red, "blue": blue})
    solution = fit(Problem(catalogue["ggx"], both, weighting="log", held=HELD))
    places = some(10, most=60.0)
    found = complete(both, solution, places)
    assert found.sizes["direction"] == 20
    red, blue = (found["brdf"].values[found["scan"].values == name] for name in ("red", "blue"))
    np.testing.assert_allclose(blue, 0.5 * red, rtol=0.02)
    with pytest.raises(ValueError, match="the scan has no green: it has red, blue"):
        complete(both, solution, places.assign_coords(scan=("direction", ["green"] * 10)))


def test_without_directions_it_is_the_half_space(scan, solution):
    found = complete(scan, solution)
    assert np.unique(found["theta_i"].values).tolist() == ANGLES
    assert found["theta_r"].values.max() == 80
    assert "corrected by 93 values and the prior" in found.attrs["history"]


def test_many_directions_are_predicted_in_pieces(scan, solution, monkeypatch):
    whole = complete(scan, solution)
    monkeypatch.setattr("gonio.completion.process.TOGETHER", 100)
    pieces = complete(scan, solution)
    assert whole.sizes["direction"] > 1000
    for name in ("brdf", "uncertainty"):
        np.testing.assert_allclose(pieces[name], whole[name], rtol=1e-9)  # sums of another order


def test_refusals(scan, solution):
    with pytest.raises(ValueError, match=r"the fit is in sr-1 and the scan in a\.u\."):
        complete(scan.assign(brdf=scan["brdf"].assign_attrs(units="a.u.")), solution)
    with pytest.raises(ValueError, match="at least 10 values above zero, and the scan has 5"):
        complete(scan.isel(direction=slice(5)), solution)
    with pytest.raises(ValueError, match="gold: the prior has no such material; it has acrylic_felt_green, "):
        complete(scan, solution, without=["gold"])
    with pytest.raises(ValueError, match="a prior that is not used"):
        complete(scan, solution, prior=False, without=["paper_red"])
    with pytest.raises(ValueError, match="the directions have no phi"):
        complete(scan, solution, scan.drop_vars("phi"))
    with pytest.raises(ValueError, match="1 directions lie below the horizon"):
        complete(scan, solution, directions([10.0, 95.0], 20.0, 0.0))


def test_values_that_are_not_positive_are_left_out_and_counted(scan, solution):
    spoilt = scan["brdf"].values.copy()
    spoilt[:3] = [0.0, -1e-3, 0.0]
    found = complete(scan.assign(brdf=scan["brdf"].copy(data=spoilt)), solution, some(5))
    assert "; 3 that are not positive took no part" in found.attrs["history"]
    assert np.isfinite(found["brdf"].values).all()


def test_a_thousand_points_take_less_than_two_seconds(solution):
    """Half a second of the processor is usual."""
    many = measured(np.linspace(5, 70, 33))
    started = time.process_time()
    complete(many, solution, many.isel(direction=slice(1000)))
    assert many.sizes["direction"] > 1000
    assert time.process_time() - started < 2


def test_folds_are_corrected_by_what_their_fits_were_shown(scan):
    """What is left out is corrected by the rest: its own values change nothing of its prediction."""
    row = one_row(scan)
    assert row.validated["log10_rmse"] < 0.8 * row.validated_plain["log10_rmse"]
    held = row.intervals
    assert (held.interior, held.steepest) == (62, 31)
    assert one_row(scan, Correction(prior=False)).validated != row.validated
    alone = one_row(scan, None)
    assert alone.validated == row.validated_plain
    assert alone.intervals is None


def one_row(scan, correction=Correction()):  # noqa: B008 - it cannot be changed
    problem = Problem(catalogue["ggx"], scan, weighting="log", held=HELD)
    return validate(problem, assess(problem, fit(problem)), "theta_i", correction=correction)
