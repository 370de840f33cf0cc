"""Uncertainties that are none (negative, zero, missing, infinite) are told with count and place, and never used."""

import json

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, fit, fit_many, read, write
from gonio.fitting import Projection
from gonio.formats import formats
from gonio.measured.check import check
from gonio.measured.dataset import make_scan
from gonio.measured.sound import UNCERTAINTIES

THETA_I, THETA_R = np.repeat([10.0, 40.0], 13), np.tile(np.arange(-60, 61, 10.0), 2)
CARRIERS = [f for f in formats().values() if f.write and {"*", "uncertainty"} & set(f.holds.variables)]
EXACT = [f for f in CARRIERS if f.name != "bird"]  # which refuses to hold them


def scan(**wrong):
    """A scan with an uncertainty of 0.02 at every value but the fifth and further ones, as `wrong` has them."""
    stated = np.full(26, 0.02)
    for at, value in wrong.items():
        stated[int(at.removeprefix("at"))] = value
    return make_scan(THETA_I, THETA_R, 0.2 + np.cos(np.radians(THETA_R)), uncertainty=stated)


def told(data):
    return [str(finding) for finding in check(data) if "uncertainty" in finding.what]


def test_each_kind_is_told_once_and_truly():
    assert told(scan()) == []
    (said,) = told(scan(at5=-0.02, at7=-1.0))
    assert said.startswith("warning: the uncertainty is negative at 2 values (theta_i 10, theta_r 10, phi 0 deg; ")
    (said,) = told(scan(at5=np.inf))
    assert said.startswith("warning: the uncertainty is infinite at 1 value (theta_i 10, theta_r 10, phi 0 deg): ")
    for none in (0.0, np.nan):
        (said,) = told(scan(at5=none))
        assert said.startswith("note: no uncertainty is stated at 1 value (theta_i 10, theta_r 10, phi 0 deg): ")
    systematic = scan().assign(uncertainty_systematic=("direction", np.where(np.arange(26) == 5, -0.1, 0.0)))
    (said,) = told(systematic)
    assert said.startswith("warning: the systematic uncertainty is negative at 1 value (theta_i 10, ")


@pytest.mark.parametrize("kind", EXACT, ids=lambda f: f.name)
def test_info_says_one_true_thing_of_every_format(run, tmp_path, kind):
    path = tmp_path / f"scan{kind.suffix}"
    for data, fact, words in (
        (scan(**{f"at{k}": -0.02 for k in range(26)}), "uncertainty not stated", "is negative at 26 values"),
        (scan(at5=-0.02), "uncertainty stated at 25 of 26 values in use", "is negative at 1 value"),
        (scan(at5=0.0), "uncertainty stated at 25 of 26 values in use", "no uncertainty is stated at 1 value"),
        (scan(), "uncertainty stated", ""),
    ):
        write(data, path, force=True)
        code, out, _ = run("info", path)
        text = " ".join(out.split())
        assert code == 0
        assert fact in text
        assert words in text
        assert text.count("no uncertainty is stated") == (1 if words.startswith("no ") else 0)
        code, _, err = run("check", path)
        assert code == 0
        assert err.count("\n") == err.count("the uncertainty is negative at") == words.startswith("is negative")
    record = json.loads(run("info", path, "--json", "-")[1])
    assert (record["uncertainty"], record["uncertainty_stated"]) == (True, 26)


@pytest.mark.parametrize("kind", CARRIERS, ids=lambda f: f.name)
@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_no_file_of_an_infinite_uncertainty_is_read(tmp_path, kind, name):
    data = scan()
    data[name] = ("direction", np.where(np.arange(26) == 5, np.inf, 0.02), {"units": "sr-1"})
    path = tmp_path / f"scan{kind.suffix}"

    def through_a_file():
        write(data, path, to=kind.name)
        return read(path)

    with pytest.raises(ValueError, match=r"infinite|is inf|missing values"):
        through_a_file()


WRONG = {"negative": -0.02, "infinite": np.inf, "zero": 0.0, "missing": np.nan}


@pytest.mark.parametrize("value", WRONG.values(), ids=WRONG)
def test_no_fit_uses_them_in_silence(value):
    data, model = scan(at5=value), catalogue["lambert"]
    wrong = " (1 is negative, infinite or outside 1e-150 to 1e+150)" if abs(value) > 0 else ""
    said = f"needs a positive uncertainty for every value, and 1 of 26 have none{wrong}: theta_i 10, theta_r 10, phi 0"
    for ask in (
        lambda: Problem(model, data, weighting="uncertainty"),
        lambda: fit(Problem(model, data), covariance="absolute"),
    ):
        with pytest.raises(ValueError, match="needs a positive uncertainty") as caught:
            ask()
        assert said in str(caught.value)


@pytest.mark.parametrize("value", WRONG.values(), ids=WRONG)
def test_a_stack_marks_their_lanes_as_not_weighed(value):
    pytest.importorskip("jax", reason="the extra `batch` is not installed")
    stack = xr.concat([scan(), scan(at5=value)], dim="sample", data_vars=["brdf", "uncertainty"], coords="minimal")
    problem = Problem(catalogue["lambert"], scan(), weighting="uncertainty")
    found = fit_many(problem, stack, Projection(searches=1))
    statuses = [found["status"].attrs["flag_meanings"].split()[code] for code in found["status"].values]
    assert statuses[0] == "converged"
    assert statuses[1] == "not_weighed"
    with_absolute = fit_many(Problem(catalogue["lambert"], scan()), stack, covariance="absolute")
    assert with_absolute["status"].values.tolist() == found["status"].values.tolist()


@pytest.mark.parametrize("value", [-0.1, np.inf, np.nan])
def test_a_systematic_uncertainty_that_is_none_takes_no_part(value):
    data = scan().assign(uncertainty_systematic=("direction", np.where(np.arange(26) == 5, value, 0.01)))
    assert not fit(Problem(catalogue["lambert"], data)).has_systematic


def test_a_curve_has_bars_where_an_uncertainty_is_stated(run, tmp_path):
    for name, data in (("some", scan(at5=-0.02, at6=np.nan)), ("none", scan(**{f"at{k}": -1.0 for k in range(26)}))):
        write(data, tmp_path / f"{name}.csv")
        code, _, err = run("plot", tmp_path / f"{name}.csv", "--models", "", "--out", tmp_path / f"{name}.svg")
        assert code == 0, err
        assert ("standard uncertainty" in (tmp_path / f"{name}.svg").read_text()) == (name == "some")
