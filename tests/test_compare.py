"""Metrics against their definitions, and the ranking."""

import itertools
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gonio import catalogue
from gonio.app.views import ranking
from gonio.comparison.metrics import METRICS, Judged, at_specular, judged, least, metrics, metrics_by_incidence
from gonio.comparison.ranking import TIE, _ordered, compare, drop, reference_errors
from gonio.measured.dataset import make_scan


def simple():
    theta_r = np.array([-30.0, 0, 30, 60, -30, 0, 30, 60])
    theta_i = np.array([30.0] * 4 + [60.0] * 4)
    return make_scan(theta_i, theta_r, [1.0, 2, 4, 2, 1, 1, 2, 5])


def test_definitions():
    scan = simple()
    measured = scan["brdf"].values
    modelled = measured * np.array([1.1, 0.9, 1, 1, 1, 1, 1.2, 1])
    found = metrics(scan, modelled)
    error = modelled - measured
    assert found["delta"] == pytest.approx(np.sqrt(np.mean((error / measured) ** 2)))
    assert found["E"] == pytest.approx(np.sum(error**2) / np.sum(measured**2))
    assert found["log10_rmse"] == pytest.approx(np.sqrt(np.mean(np.log10(modelled / measured) ** 2)))
    normalised = np.concatenate([modelled[:4] / 4 - measured[:4] / 4, modelled[4:] / 5 - measured[4:] / 5])
    assert found["nrmse"] == pytest.approx(np.sqrt(np.mean(normalised**2)))
    by = metrics_by_incidence(scan, modelled)
    assert list(by) == [30.0, 60.0]
    assert by[30.0]["nrmse"] == pytest.approx(np.sqrt(np.mean(normalised[:4] ** 2)))


def test_each_curve_is_normalised_by_its_own_value():
    """A model that is twice the data everywhere has the same normalised curve."""
    scan = simple()
    assert metrics(scan, 2 * scan["brdf"].values)["nrmse"] == pytest.approx(0.0, abs=1e-15)


def test_every_model_is_judged_at_the_same_points():
    """A logarithm of zero or of a negative value is no way out of a ranking, and one of 1e-300 is no verdict."""
    scan = simple()
    measured = scan["brdf"].values
    assert least(scan) == pytest.approx(0.1)  # a tenth of the least measured value
    errors = []
    for wing in (-1.0, 0.0, 1e-300, 0.1):
        modelled = np.where(measured == 1, wing, measured)
        found = metrics(scan, modelled)
        errors.append(found["log10_rmse"])
        assert judged(scan, modelled) == Judged(8, 0, least(scan), 3 if wing < 0.1 else 0)
    assert errors == pytest.approx([math.sqrt(3 / 8)] * 4)  # one decade at three of eight points
    # values measured as zero or below are left out for every model, and are counted
    scan["brdf"][:2] = [0.0, -1.0]
    modelled = np.full(8, 2.0)
    assert judged(scan, modelled).not_positive == 2
    assert metrics(scan, modelled)["log10_rmse"] == pytest.approx(np.sqrt(np.mean(np.log10(2 / measured[2:]) ** 2)))
    # a prediction that is no number has no error; it does not leave its points out
    assert math.isnan(metrics(scan, np.where(measured == 5, np.nan, modelled))["log10_rmse"])


def test_a_model_that_is_zero_at_the_specular_angle_is_judged_there():
    scan = simple()
    measured = scan["brdf"].values
    for value in (0.0, -1.0):
        modelled = np.where(np.isclose(measured, 4), value, measured)
        assert metrics(scan, modelled)["nrmse"] > 5


def test_parts_share_the_floor_of_the_scan():
    """A part of a scan, left out or of one incidence angle, is judged by the same floor as the whole."""
    scan = simple()
    scan["brdf"][4:] *= 100
    modelled = np.where(np.arange(8) < 4, scan["brdf"].values, 0.0)
    expected = np.sqrt(np.mean(np.log10(least(scan) / scan["brdf"].values[4:]) ** 2))
    assert metrics_by_incidence(scan, modelled)[60.0]["log10_rmse"] == pytest.approx(expected)


def test_a_ranking_states_what_its_metric_left_out():
    """hapke, fitted without some blocks of a steep lobe, is below zero in them: it is judged there all the same."""
    theta_r, theta_i = np.tile(np.linspace(-75, 75, 61), 3), np.repeat([10.0, 40.0, 65.0], 61)
    scan = make_scan(
        theta_i, theta_r, 0.01 + 5 * np.exp(-((theta_r - theta_i) ** 2) / 20) / np.cos(np.radians(theta_i))
    )
    models = [catalogue[n] for n in ("lambert", "hapke", "phong")]
    rows = [replace(row, metric="log10_rmse") for row in compare(scan, models, left_out="5", weighting="uniform")]
    for counts in ([row.judged for row in rows], [row.judged_left_out for row in rows]):
        assert {(one.points, one.not_positive) for one in counts} == {(183, 0)}
    floored = {row.model.name: row.judged_left_out.floored for row in rows}
    assert floored["hapke"] > 0
    assert floored["phong"] == floored["lambert"] == 0
    told = {
        one["model"]: one["lg_rmse_points_left_out"]
        for one in ranking.record(Path("scan.csv"), _answer(rows))["ranking"]
    }
    assert {name: one["floored"] for name, one in told.items()} == floored
    shown = ranking.ranking_table("scan", rows)
    assert list(next(c for c in shown.columns if c.header == "floored").cells) == [str(n) for n in floored.values()]
    assert "floored: how many values of the model lie below 0.001 sr⁻¹ and count as that in lg RMSE" in list(
        ranking.notes(rows)
    )


def _answer(rows):
    """An Answer that has these rows, and nothing else."""
    return SimpleNamespace(rows=rows, record=dict)


def test_a_ranking_of_fits_to_values_says_nothing_of_logarithms():
    """Models are ranked by the metric of the weighting: floored logarithms are no part of E."""
    rows = compare(simple(), [catalogue["lambert"], catalogue["phong"]], left_out="theta_i", weighting="uniform")
    assert {row.metric for row in rows} == {"E"}
    assert [row.validated["E"] for row in rows] == sorted(row.validated["E"] for row in rows)
    assert "floored" not in [column.header for column in ranking.ranking_table("scan", rows).columns]


def test_what_the_data_do_not_allow_is_nan():
    short = make_scan([60.0, 60.0], [-10.0, 10.0], [-1.0, -2.0])
    found = metrics(short, np.array([1.0, 2.0]))
    assert np.isnan(found["delta"])
    assert np.isnan(found["nrmse"])
    assert np.isnan(found["log10_rmse"])
    assert found["E"] > 0
    assert np.isnan(at_specular(np.array([0.0, 10.0]), np.array([1.0, 2.0]), 20.0))


def test_drop_as_in_the_tables():
    assert drop(0.1069, 0.0163) == pytest.approx(84.75, abs=0.005)
    assert drop(0.1, 0.2) == -100


def test_models_that_tie_stand_with_the_simpler_first():
    """A constant scan leaves every lobe with weight zero: all models fit it alike, and Lambert's needs one value."""
    scan = make_scan([30.0] * 9, np.linspace(-60, 60, 9), np.full(9, 0.1))
    rows = compare(scan, [catalogue[n] for n in ("cauchy-lorentz", "torrance-sparrow", "lambert")], by="delta")
    alike = compare(scan, [catalogue[n] for n in ("lambert", "torrance-sparrow", "cauchy-lorentz")], by="delta")
    for found in (rows, alike):
        metrics = [row.metrics["delta"] for row in found]
        assert max(metrics) < 1e-9 or metrics[-1] <= metrics[0] * (1 + TIE)
    one, two = (SimpleNamespace(metrics={"E": e}, free_parameters=n) for e, n in ((0.1, 5), (0.1 * (1 + 1e-9), 2)))
    three = SimpleNamespace(metrics={"E": float("nan")}, free_parameters=1)
    assert _ordered([three, one, two], lambda row: row.metrics["E"]) == [two, one, three]
    first, second = (SimpleNamespace(metrics={"E": e}, free_parameters=2) for e in (0.1 * (1 + 1e-9), 0.1))
    assert _ordered([first, second], lambda row: row.metrics["E"]) == [first, second]  # rounding decides nothing


def test_rank_orders_and_routes_options(aluminium):
    _model, _values, scan = aluminium
    models = [catalogue[n] for n in ("lambert", "torrance-sparrow", "wang-2016", "cauchy-lorentz")]
    for metric in METRICS:
        rows = compare(scan, models, by=metric, grouped={"ks": "theta_i"}, held={"gamma": 47.0, "sigma": 0.142})
        errors = [row.metrics[metric] for row in rows]
        assert all(a <= b * (1 + TIE) for a, b in itertools.pairwise(errors))
    assert {row.model.name: row.free_parameters for row in rows} == {
        "lambert": 1,
        "torrance-sparrow": 4,
        "wang-2016": 6,
        "cauchy-lorentz": 5,
    }
    references = reference_errors(rows)
    assert set(references) == {"T-S", "T-C"}
    assert compare(scan, models, shared=("kd",), bounds={"sigma": (0.1, 0.2)})
    with pytest.raises(ValueError, match="held: none of the models has a parameter 'beta'"):
        compare(scan, models, held={"beta": 1.0})
    with pytest.raises(ValueError, match="no metric 'r2'"):
        compare(scan, models, by="r2")
