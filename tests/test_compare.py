"""Metrics against their definitions, and the ranking."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from gonio import catalogue
from gonio.comparison.metrics import METRICS, at_specular, metrics, metrics_by_incidence
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
