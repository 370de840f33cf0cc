"""Validation: what is left out is not seen, what cannot be predicted is refused, and overfitting shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.comparison.assessment import alike, assess, behind, information_criteria, validate
from gonio.comparison.ranking import compare
from gonio.fitting import fit
from gonio.fitting.certainty.hold_out import folds, predictions
from gonio.measured.dataset import make_scan, points

THETA_R = np.arange(-75, 76, 3.0)


@pytest.fixture(scope="module")
def scan():
    truth = {"ks": 0.3, "kd": 0.05, "sigma": 0.15}
    return simulate(catalogue["torrance-sparrow"], truth, [10.0, 30, 50, 70], THETA_R, noise=0.03, seed=4)


def test_every_point_is_left_out_once(scan):
    flat = points(scan)
    for by, count in (("theta_i", 4), ("5", 5), ("2", 2)):
        parts = folds(flat, by)
        assert len(parts) == count
        np.testing.assert_array_equal(sum(left.astype(int) for _, left in parts), 1)
    around = make_scan([30.0] * 4, [10.0, 20, 30, 40], [1.0, 2, 3, 4], [180.0, 180, 90, 90])
    ((name, left),) = folds(points(around), "out-of-plane")
    assert name == "out-of-plane"
    np.testing.assert_array_equal(left, [False, False, True, True])


@pytest.mark.parametrize(
    ("by", "message"),
    [
        ("out-of-plane", "at least two parts"),
        ("1", "at least two parts"),
        ("colour", "by a coordinate"),
        ("0", "at least two"),
    ],
)
def test_refused_folds(scan, by, message):
    with pytest.raises(ValueError, match=message):
        folds(points(scan), by)


def test_predictions_do_not_see_what_they_predict(scan):
    """Spoiling the values of one incidence angle leaves the predictions there as they are."""
    problem = Problem(catalogue["torrance-sparrow"], scan)
    solution = fit(problem)
    before, _ = predictions(problem, solution, "theta_i")
    at = scan["theta_i"].values == 50
    spoiled = scan.copy(deep=True)
    spoiled["brdf"].values[at] *= 9
    after, _ = predictions(Problem(catalogue["torrance-sparrow"], spoiled), solution, "theta_i")
    # both searches end within 1e-5 of the same minimum: they start alike and see alike
    np.testing.assert_allclose(after[at], before[at], rtol=1e-5)
    assert np.abs(after[~at] / before[~at] - 1).max() > 0.05


def test_the_error_left_out_is_that_of_fits_by_hand(scan):
    """Against a fit with another search, from scratch, of the scan without each incidence angle."""
    model = catalogue["torrance-sparrow"]
    problem = Problem(model, scan)
    found, parts = predictions(problem, fit(problem), "theta_i")
    for _, left in parts:
        rest = points(scan).isel(direction=np.flatnonzero(~left))
        by_hand = fit(Problem(model, rest)).values
        np.testing.assert_allclose(found[left], model(problem.geometry, by_hand)[left], rtol=1e-4)


def test_values_for_each_part_are_refused(scan):
    problem = Problem(catalogue["torrance-sparrow"], scan, grouped={"ks": "theta_i"})
    with pytest.raises(ValueError, match="do not group ks"):
        predictions(problem, fit(problem), "theta_i")
    row = validate(problem, assess(problem, fit(problem)), "4")
    assert row.validated["log10_rmse"] > 0


def test_the_true_model_wins_where_it_was_not_shown(scan):
    """A twelve-parameter fit is nearer in sample and farther out of it; the models that hold the truth are alike."""
    names = ("torrance-sparrow", "cauchy-lorentz", "lambert", "binomial")
    rows = compare(scan, [catalogue[n] for n in names], weighting="log", left_out="theta_i")
    by_name = {row.model.name: row for row in rows}
    assert rows[0].model.name in ("torrance-sparrow", "cauchy-lorentz")
    assert by_name["torrance-sparrow"].validated["log10_rmse"] < by_name["binomial"].validated["log10_rmse"] / 2
    mean, error = behind(by_name["cauchy-lorentz"], by_name["torrance-sparrow"])
    assert abs(mean) < 3 * error + 1e-4
    mean, error = behind(by_name["lambert"], by_name["torrance-sparrow"])
    assert mean > 2 * error > 0
    assert by_name["torrance-sparrow"].bic < by_name["cauchy-lorentz"].bic < by_name["lambert"].bic


def test_alike_is_said_by_students_t_and_not_of_few_parts():
    """At four degrees of freedom two standard errors are no 95 %: Student's t asks for 2.78."""

    def row(errors):
        return SimpleNamespace(by_fold={f"part {k}": error for k, error in enumerate(errors)})

    best = row([0.0] * 5)
    apart = np.array([0.0, 1.0, 2.0, 3.0, 4.0])  # standard error 1/sqrt(2), before the mean is moved
    for times, expected in ((2.5, True), (2.9, False)):
        assert alike(row(apart - 2 + times / 2**0.5), best) is expected
    assert alike(row(apart[:4]), row([0.0] * 4)) is None


def test_information_criteria():
    """Against the textbook's formulas with k = 4 (three values and the variance), n = 20 (burnham2002)."""
    aicc, bic = information_criteria(2.0, 20, 3)
    assert aicc == pytest.approx(20 * np.log(0.1) + 8 + 2 * 4 * 5 / 15)
    assert bic == pytest.approx(20 * np.log(0.1) + 4 * np.log(20))
    assert np.isnan(information_criteria(2.0, 5, 3)).all()
