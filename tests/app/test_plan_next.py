"""`gonio plan-next`: what it prints, writes and refuses."""

import csv
import json

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate, write
from gonio.fitting import fit

VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}
ASK = ("--model", "ggx", "--hold", "index=1.5,extinction=0")


@pytest.fixture(scope="module")
def scan_file(tmp_path_factory):
    scan = simulate(catalogue["ggx"], VALUES, [20.0, 50.0], np.arange(-70, 71, 10.0), noise=0.02)
    path = tmp_path_factory.mktemp("plan") / "scan.csv"
    write(scan, path)
    fit(Problem(catalogue["ggx"], scan, held={"index": 1.5, "extinction": 0.0})).save(path.with_name("solution.nc"))
    return path


def test_a_plan_is_printed_and_written_in_the_order_of_measuring(run, scan_file, tmp_path):
    out = tmp_path / "next.csv"
    code, said, err = run("plan", "next", scan_file, *ASK, "--want", "width", "--points", "6", "--out", out)
    assert (code, err) == (0, "")
    assert "6 readings for width of ggx, beside the 30 of scan.csv" in said
    assert "taken for the noise of a reading: 2 %" in said
    assert "no other 6 readings are better by more than" in said
    assert f"wrote {out}" in said
    rows = list(csv.DictReader(out.open()))
    assert list(rows[0]) == ["order", "theta_i_deg", "theta_r_deg", "phi_deg"]
    assert [int(row["order"]) for row in rows] == [1, 2, 3, 4, 5, 6]
    assert run("plan", "next", scan_file, *ASK, "--points", "6", "--out", out)[0] == 1


def test_json_has_what_is_printed(run, scan_file):
    code, said, _ = run("plan", "next", scan_file, *ASK, "--want", "width", "--points", "6", "--json", "-")
    found = json.loads(said)
    assert code == 0
    assert len(found["directions"]) == 6
    assert found["uncertainties"]["width"]["after"] < found["uncertainties"]["width"]["uniform"]
    assert found["noise"]["relative"] == pytest.approx(0.02, rel=0.05)
    assert found["uncertainties_systematic"] == {}


def test_a_fit_from_its_file_gives_the_same_plan(run, scan_file):
    asked = ("--want", "width", "--points", "6", "--json", "-")
    of_model = json.loads(run("plan", "next", scan_file, *ASK, "--weighting", "uniform", *asked)[1])
    of_file = json.loads(run("plan", "next", scan_file, "--solution", scan_file.with_name("solution.nc"), *asked)[1])
    assert of_file["directions"] == of_model["directions"]


def test_ranges_cost_and_noise_are_obeyed(run, scan_file):
    asked = (
        "--theta-i",
        "35",
        "--theta-r",
        "-40:60",
        "--every",
        "5",
        "--noise",
        "1%+0.001",
        "--cost",
        "read=2,table=9",
    )
    code, said, err = run("plan", "next", scan_file, *ASK, *asked, "--points", "7", "--blocked", "20", "--json", "-")
    assert code == 0, err
    found = json.loads(said)
    for one in found["directions"]:
        signed = one["theta_r_deg"] if one["phi_deg"] == 180 else -one["theta_r_deg"]
        assert one["theta_i_deg"] == 35
        assert -40 <= signed <= 60
        assert abs(signed + 35) >= 20
    assert found["seconds"] == 7 * 2 + 9
    assert found["noise"] == {"relative": 0.01, "constant": 0.001, "from": "as given"}


def test_rivals_are_told_apart(run, scan_file):
    code, said, err = run("plan", "next", scan_file, *ASK, "--rival", "beckmann", "--points", "5", "--every", "10")
    assert (code, err) == (0, "")
    assert "5 readings that tell ggx from beckmann" in said
    assert "noncentrality" in said


def test_what_systematic_errors_leave_is_said_where_a_scan_states_them(run, tmp_path):
    scan = simulate(catalogue["ggx"], VALUES, [20.0, 50.0], np.arange(-70, 71, 5.0), noise=0.02)
    for part, said in (
        (0.1, "the random part is below half of it already"),
        (1e-4, "stays, however many readings"),
    ):
        stated = scan.assign(uncertainty_systematic=("direction", part * scan["brdf"].values, {"units": "sr-1"}))
        write(stated, tmp_path / f"{part}.csv")
        code, out, err = run("plan", "next", tmp_path / f"{part}.csv", *ASK, "--want", "rho_s", "--points", "4")
        assert (code, err) == (0, "")
        assert "rho_s: a systematic part of" in out
        assert " ".join(out.split()).endswith(said if part < 0.01 else f"{said}, and further readings pay little")
    write(scan, tmp_path / "none.csv")
    assert "systematic" not in run("plan", "next", tmp_path / "none.csv", *ASK, "--points", "4")[1]


def test_a_fit_that_went_wrong_is_said(run, tmp_path):
    """As many points as values: the plan holds as far as that fit, and needs to be told the noise."""
    scan = simulate(catalogue["ggx"], VALUES, [30.0], [0.0, 20.0, 40.0], noise=0.01).drop_vars("uncertainty")
    write(scan, tmp_path / "few.csv")
    asked = ("plan", "next", tmp_path / "few.csv", *ASK, "--points", "4", "--every", "2")
    code, _, err = run(*asked)
    assert code == 1
    assert "shows no noise: say it with --noise" in err
    code, out, err = run(*asked, "--noise", "1%")
    assert code == 0, err
    assert "the plan trusts a fit: as many values as points or more" in " ".join(out.split())


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        ((), "say of which model the values are: --model NAME, or --solution FILE"),
        (("--model", "ggx,phong"), "names several models, and readings are planned for one"),
        ((*ASK, "--want", "gamma"), "the fit has no value 'gamma' to want; it has rho_s"),
        ((*ASK, "--noise", "much"), "write a percentage of the BRDF, a constant, or both"),
        ((*ASK, "--theta-r", "5"), "write -80:80"),
        ((*ASK, "--rival", "phong", "--want", "width"), "leave out --want and --cost"),
        ((*ASK, "--cost", "walk=3"), "give seconds for read, arm, table"),
        ((*ASK, "--out", "next.json"), "name the file so"),
        ((*ASK, "--points", "0"), "--points is 0"),
        ((*ASK, "--points", "9000"), "ask for fewer, take a finer step, or allow repeats"),
        ((*ASK, "--theta-i", "95"), "is not a list of angles from 0 to below 90 deg"),
        (("--solution", "solution.nc", "--hold", "index=2"), "leave out --model and the options of fits"),
    ],
)
def test_what_cannot_be_planned_is_refused_in_one_line(run, scan_file, monkeypatch, words, remedy):
    monkeypatch.chdir(scan_file.parent)
    code, said, err = run("plan", "next", scan_file, *words)
    assert (code, said) == (1, "")
    assert remedy in err
    assert len(err.strip().splitlines()) == 1


def test_readings_become_a_plan_that_measure_takes(run, scan_file, tmp_path):
    from gonio.acquisition.plan import read_plan

    out = tmp_path / "next.toml"
    code, _, err = run("plan", "next", scan_file, *ASK, "--want", "width", "--points", "6", "--out", out)
    assert code == 0, err
    plan = read_plan(out)
    assert sum(step.kind == "sample" for step in plan.steps) == 6
    assert any(step.kind == "dark" for step in plan.steps)
