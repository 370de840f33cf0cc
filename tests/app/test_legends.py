"""Whatever a table of `gonio compare` abbreviates is said below it, and what has no value is a dash."""

import re

import numpy as np
import pytest

from gonio import catalogue, simulate, write
from gonio.app.views.ranking import _percent
from gonio.comparison.ranking import REFERENCES

# The two lines of README.md.
TWO = (
    "# material: black anodised aluminium\n"
    "theta_i_deg,theta_r_deg,wavelength_nm,brdf_sr-1\n10,-80,650,0.00779\n10,-75,650,0.00689\n"
)


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """A catalogue of four models: the legend does not depend on how many are tried."""
    names = ("torrance-sparrow", "wang-2016", "cauchy-lorentz", "ggx")
    monkeypatch.setattr("gonio.comparison.answer.everything", lambda: [catalogue[name] for name in names])


@pytest.fixture
def scan(tmp_path):
    given = {"ks": 0.3, "kd": 0.1, "sigma": 0.2}
    path = tmp_path / "scan.csv"
    write(simulate(catalogue["torrance-sparrow"], given, [20.0, 50], np.arange(-70, 71, 10.0), noise=0.02), path)
    return path


def headings(out):
    """The columns of the first table, without the name of the model and the mark."""
    line = next(line for line in out.splitlines() if line.strip().startswith("model"))
    return re.findall(r"vs \S+|lg RMSE|left out|[\w-]+", line)[1:]


@pytest.mark.parametrize(
    "options", [(), ("--by-incidence",), ("--validate", "theta_i"), ("--models", "lambert"), ("--rank", "delta")]
)
def test_every_heading_has_its_line(run, scan, options):
    code, out, err = run("compare", scan, *options)
    assert code == 0, err
    below = out.splitlines()
    for heading in headings(out):
        assert any(heading in line.partition(": ")[0].split(", ") for line in below), heading
    for names in REFERENCES.values():
        told = [line for line in below if line.startswith("vs ")]
        assert not told or any(all(name in line for name in names) for line in told)


def test_a_legend_stands_once_below_several_scans(run, scan, tmp_path):
    other = tmp_path / "other.csv"
    other.write_bytes(scan.read_bytes())
    _, out, _ = run("compare", scan, other, "--models", "lambert,torrance-sparrow")
    assert out.count("free: ") == 1
    assert out.rindex("\n model ") < out.index("free: ")


def test_two_points_print_no_nan(run, tmp_path):
    path = tmp_path / "two.csv"
    path.write_text(TWO)
    code, out, _ = run("compare", path)
    assert code == 0
    assert "nan" not in out
    for options in (("--by-incidence",), ("--models", "torrance-sparrow,phong,ggx")):
        code, out, _ = run("compare", path, "--models", "family", *options)
        assert code == 0
        assert "nan" not in out
        assert "vs T-S" in out
        assert "–: the data do not allow this figure" in out


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_drop_that_is_no_number_is_a_dash(value):
    assert _percent(value) == "–"
