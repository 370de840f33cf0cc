"""`gonio complete`, and `gonio compare --correct`: what they write, and what they refuse."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from gonio import catalogue, read, simulate, write
from gonio.app.views.fit.answer import steepest_lines
from gonio.formats.native.tidy_csv import read_directions

VALUES = {"rho_s": 0.2, "rho_d": 0.1, "width": 0.3}
WANTED = "theta_i_deg,theta_r_deg,phi_deg\n20,40,180\n40,20,180\n70,80,90\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(
        simulate(catalogue["ggx"], VALUES, [20.0, 40.0, 60.0], np.arange(-70, 71, 10.0), noise=0.02, seed=3), "scan.csv"
    )
    (tmp_path / "wanted.csv").write_text(WANTED)
    return tmp_path


def test_complete_writes_value_uncertainty_and_origin(run, here):
    code, out, err = run("complete", "scan.csv", "--model", "lambert", "--onto", "wanted.csv", "--out", "out.csv")
    assert code == 0, err
    assert "3 directions, 2 measured" in " ".join(out.split())
    rows = [line.split(",") for line in (here / "out.csv").read_text().splitlines() if not line.startswith("#")]
    head = [
        "theta_i_deg",
        "theta_r_deg",
        "phi_deg",
        "brdf_sr-1",
        "uncertainty_sr-1",
        "lower_sr-1",
        "upper_sr-1",
        "origin",
    ]
    assert rows[0] == head
    assert [row[-1] for row in rows[1:]][:2] == ["measured", "measured"]
    pairs = np.array([row[3:7] for row in rows[1:3]], dtype=float)
    np.testing.assert_allclose(pairs[0], pairs[1], rtol=1e-9)  # exchanged
    assert "corrected by 45 values and the prior" in read("out.csv").attrs["history"]


def test_the_prior_can_be_left_out_and_materials_of_it(run, here):
    common = (
        "complete",
        "scan.csv",
        "--model",
        "lambert",
        "--onto",
        "wanted.csv",
        "--force",
        "--json",
        "-",
        "--out",
        "o.csv",
    )
    values = []
    for more in ((), ("--no-prior",), ("--without", "paper_red,paper_blue")):
        code, out, err = run(*common, *more)
        assert code == 0, err
        assert json.loads(out)["directions"]["measured"] == 2
        values.append(tuple(read(here / "o.csv")["brdf"].values))
    assert len(set(values)) == 3


def test_the_directions_may_be_a_scan_of_any_format(run, here):
    write(read("scan.csv"), here / "other.nc")
    code, out, err = run("complete", "scan.csv", "--model", "lambert", "--onto", "other.nc", "--out", "out.nc")
    assert code == 0, err
    assert "45 measured" in " ".join(out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("complete", "scan.csv", "--model", "lambert", "--without", "gold", "--out", "o.csv"),
            "gold: the prior has no such",
        ),
        (
            ("complete", "scan.csv", "--model", "lambert", "--no-prior", "--without", "paper_red", "--out", "o.csv"),
            "leave out one of --without, --no-prior",
        ),
        (("compare", "scan.csv", "--models", "lambert", "--no-prior"), "add --correct, or leave them out"),
        (("compare", "scan.csv", "--models", "lambert", "--correct", "--validate", "none"), "name theta_i"),
        (
            ("complete", "scan.csv", "--model", "lambert", "--onto", "bad.csv", "--out", "o.csv"),
            "theta_i is 'x', not a number",
        ),
    ],
)
def test_refusals(run, here, words, said):
    (here / "bad.csv").write_text("theta_i_deg,theta_r_deg\nx,10\n")
    code, _, err = run(*words)
    assert code == 1
    assert said in " ".join(err.split())
    assert not (here / "o.csv").exists()


def test_directions_are_signed_without_azimuths(here):
    (here / "signed.csv").write_text("theta_i_deg,theta_r_deg\n10,-20\n10,20\n")
    assert read_directions(here / "signed.csv")["phi"].values.tolist() == [0.0, 180.0]
    assert read_directions(here / "scan.csv") is None


def test_compare_judges_the_corrected_prediction(run, here):
    common = (
        "compare",
        "scan.csv",
        "--models",
        "lambert",
        "--weighting",
        "log",
        "--validate",
        "theta_i",
        "--json",
        "-",
    )
    plain, corrected, alone = (
        json.loads(run(*common, *more)[1])[0]["ranking"][0]
        for more in ((), ("--correct",), ("--correct", "--no-prior"))
    )
    assert plain["validated"] == corrected["validated_plain"] == alone["validated_plain"]
    assert "validated_plain" not in plain
    assert corrected["validated"]["log10_rmse"] < plain["validated"]["log10_rmse"]  # of no lobe to one that was learned
    assert alone["validated"] != corrected["validated"]
    assert corrected["intervals"]["level"] == 0.95
    assert corrected["intervals"]["interior"] == 30
    assert corrected["intervals"]["steepest"] == 15


def test_compare_says_both_errors_in_words(run, here):
    code, out, _ = run("compare", "scan.csv", "--models", "lambert", "--weighting", "log", "--correct")
    assert code == 0
    assert "without the correction" in " ".join(out.split())
    assert "at the steepest angle" in " ".join(out.split())


@pytest.mark.parametrize(("steepest", "lines"), [(0.3, 1), (0.14, 0)])
def test_an_error_at_the_steepest_angle_that_is_much_larger_is_told(steepest, lines):
    """Angles are compared as numbers: 9 deg is not the steepest."""
    by_fold = {"theta_i 9": 0.1, "theta_i 60": steepest, "theta_i 30": 0.1}
    best = SimpleNamespace(by_fold=by_fold, metric="log10_rmse", model=SimpleNamespace(name="ggx"))
    told = list(steepest_lines(SimpleNamespace(best=best, left_out="theta_i")))
    assert len(told) == lines
    assert all("0.3 at the steepest, 60 deg, and 0.1 at the others" in line for line in told)
    assert not list(steepest_lines(SimpleNamespace(best=best, left_out="5")))
