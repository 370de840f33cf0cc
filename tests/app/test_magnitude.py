"""Values of any size are fitted alike over 200 decades and refused beyond in one line; no warning is shown."""

import json
import warnings

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, fit, fit_many, write
from gonio.fitting import Projection
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.measured.check import check
from gonio.measured.dataset import make_scan
from gonio.resampling.difference import difference

THETA_I, THETA_R = np.repeat([10.0, 40.0], 13), np.tile(np.arange(-60, 61, 10.0), 2)
VALUES = 0.2 + np.cos(np.radians(THETA_R)) + np.exp(-(((THETA_R - THETA_I) / 15) ** 2))
BEYOND = ("1e-310", "1e-300", "1e-160", "1e-101", "1e101", "1e155", "1e300")


def scan(scale=1.0):
    return make_scan(THETA_I, THETA_R, VALUES * scale, uncertainty=0.02 * VALUES * scale)


@pytest.fixture
def path(tmp_path):
    def written(scale):
        write(scan(float(scale)), tmp_path / "scan.csv", force=True)
        return tmp_path / "scan.csv"

    return written


COMMANDS = {
    **{f"fit {name}": ("fit", "{}", "--model", "ggx", "--weighting", name) for name in WEIGHTINGS},
    "absolute": ("fit", "{}", "--model", "ggx", "--covariance", "absolute"),
    "compare": ("compare", "{}", "--models", "ggx,lambert", "--validate", "5"),
    "plot": ("plot", "{}", "--models", "lambert", "--out", "{folder}/x.png"),
    "fill": ("convert", "{}", "{folder}/x.bsdf", "--to", "rgl", "--fill", "symmetry,lambert"),
}


@pytest.mark.parametrize("scale", BEYOND)
@pytest.mark.parametrize("name", COMMANDS)
def test_what_no_square_can_hold_is_refused_in_one_line(run, path, tmp_path, name, scale):
    file = path(scale)
    code, out, err = run(*(part.format(file, folder=tmp_path) for part in COMMANDS[name]))
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert f"the largest brdf value is {VALUES.max() * float(scale):g}, and squares of such values overflow" in err
    assert err.endswith("multiply the values by a power of ten, so that it lies between 1e-100 and 1e+100\n")


@pytest.mark.parametrize("scale", BEYOND)
def test_what_is_not_fitted_goes_on_whatever_the_size(run, path, tmp_path, scale):
    file = path(scale)
    code, out, err = run("info", file)
    assert (code, err) == (0, "")
    assert "error: the largest brdf value is" in out
    for command in (("check", file), ("diff", file, file), ("convert", file, tmp_path / "x.nc", "--force")):
        code, _, err = run(*command)
        assert code == 0
        assert all(" uncertainty is " in line for line in err.splitlines()), err


@pytest.mark.parametrize("scale", [2.0**-1000, 1.0, 2.0**1000])
def test_a_difference_keeps_every_bit_at_any_size(scale):
    """Powers of two change no digit, so all figures that have no unit are the same."""
    other = scan().assign(brdf=scan()["brdf"] * 1.1)
    usual = difference(other.assign(brdf=other["brdf"].assign_attrs(units="sr-1")), scan())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = difference(other.assign(brdf=(other["brdf"] * scale).assign_attrs(units="sr-1")), scan(scale))
        assert (found.rms, found.rms_steep, found.bias, found.largest) == (
            *(usual.rms, usual.rms_steep, usual.bias, usual.largest),
        )


@pytest.mark.parametrize("name", WEIGHTINGS)
def test_fits_are_alike_over_the_whole_range(name):
    """E has no unit; a search in other numbers may end another rounding away, which E sees in second order."""
    model = catalogue["lambert"]
    usual = fit(Problem(model, scan(), weighting=name))
    for scale in (1e-99, 1e99):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            found = fit(Problem(model, scan(scale), weighting=name))
        assert found.status == usual.status
        assert found.values["rho"] == pytest.approx(usual.values["rho"] * scale, rel=1e-9, abs=0)
        assert found.uncertainties["rho"] == pytest.approx(usual.uncertainties["rho"] * scale, rel=1e-8, abs=0)
        assert found.cost == pytest.approx(usual.cost, rel=1e-9)


def test_single_values_without_a_square_have_no_relative_weight():
    data = scan()
    data["brdf"].values[3] = 1e-200
    with pytest.raises(ValueError, match=r"relative weighting needs values of at least 1e-150.* and 1 of 26 are not"):
        Problem(catalogue["lambert"], data, weighting="relative")
    data["uncertainty"].values[3] = 1e-200
    with pytest.raises(ValueError, match=r"1 of 26 have none \(1 is negative, infinite or outside 1e-150 to 1e\+150\)"):
        Problem(catalogue["lambert"], data, weighting="uncertainty")
    assert "the uncertainty is outside 1e-150 to 1e+150 at 1 value" in [finding.what for finding in check(data)]


@pytest.mark.parametrize("scale", [1e-300, 1e-101, 1e101, 1e200])
def test_a_stack_marks_such_lanes_and_fits_the_others(scale):
    pytest.importorskip("jax", reason="the extra `batch` is not installed")
    stack = xr.concat([scan(), scan(scale)], dim="sample", data_vars=["brdf", "uncertainty"], coords="minimal")
    found = fit_many(Problem(catalogue["lambert"], scan()), stack, Projection(searches=1))
    words = found["status"].attrs["flag_meanings"].split()
    assert [words[code] for code in found["status"].values] == ["converged", "not_weighed"]


def test_no_warning_of_a_library_reaches_the_terminal(run, path, monkeypatch):
    def noisy(*_, **__):
        warnings.warn("overflow encountered in square", RuntimeWarning, stacklevel=1)
        warnings.warn("Glyph 1 missing", UserWarning, stacklevel=1)
        return np.float64(1e308) * np.full(2, 10.0)

    monkeypatch.setattr("gonio.app.views.file.half_widths", lambda flat: list(noisy())[:0])
    code, out, err = run("info", path("1"), "--json", "-")
    assert (code, err) == (0, "")
    assert json.loads(out)["half_widths"] == []
