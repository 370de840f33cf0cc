"""`gonio verify --check` as a person types it."""

import json
from shlex import split

import numpy as np
import pytest

from gonio import catalogue, simulate, write
from gonio.acquisition import read_plan
from simulated_benches import bench, measure

FLUX = """kind,theta_i_deg,theta_r_deg,filter,signal_V,sd_V
dark,,,,0.000001,1e-9
incident,,,A,0.050101,1e-8
incident,,,B,0.050101,1e-8
incident,,,A+B,0.100216051,1e-8
incident,,,A,0.500001,1e-8
incident,,,B,0.500001,1e-8
incident,,,A+B,1.000151515,1e-8
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = {"rho_s": 0.3, "rho_d": 0.2, "width": 0.2, "index": 1.5, "extinction": 0.0}
    scan = simulate(catalogue["ggx"], values, [20.0, 40.0, 60.0], np.arange(-80, 81, 10.0), noise=0.002, seed=1)
    write(scan.drop_vars("uncertainty"), tmp_path / "scan.csv")
    write(scan, tmp_path / "stated.csv")
    (tmp_path / "flux.csv").write_text(FLUX)
    return tmp_path


def test_what_a_scan_allows(run, here):
    code, out, err = run(*split("verify stated.csv --check all --json checks.json"))
    assert (code, err) == (0, "")
    record = json.loads((here / "checks.json").read_text())
    checks = {one["check"]: one for one in record["checks"]}
    assert set(checks) == {"reciprocity", "energy"}
    assert "peaks of a mirror at" in record["left_out"]["zero"]
    assert checks["reciprocity"]["passes"] is True
    assert checks["reciprocity"]["limit"] == pytest.approx(2 * checks["reciprocity"]["uncertainty"])
    assert checks["energy"]["limit"] > 1
    text = " ".join(out.split())
    assert "reciprocity: rms of ln f(i, r)/f(r, i)" in text
    assert "zero was left out: there are peaks of a mirror at" in text
    assert "fails" not in text


def test_without_an_uncertainty_there_is_no_verdict_until_one_is_given(run, here):
    code, out, _ = run(*split("verify scan.csv --check reciprocity"))
    assert code == 0
    assert "no verdict" in out
    assert "give --uncertainty" in " ".join(out.split())
    code, out, _ = run(*split("verify scan.csv --check reciprocity --uncertainty 2 --json -"))
    assert json.loads(out)["checks"][0]["limit"] == pytest.approx(0.02)
    assert json.loads(out)["checks"][0]["passes"] is True


@pytest.mark.parametrize("names", ["--check reciprocity,energy", "--check reciprocity --check energy"])
def test_several_checks_are_named_with_commas_or_one_by_one(run, here, names):
    code, out, _ = run(*split(f"verify stated.csv {names} --json -"))
    assert code == 0
    assert [one["check"] for one in json.loads(out)["checks"]] == ["reciprocity", "energy"]


def test_a_nonlinear_detector_fails_with_the_remedy(run, here):
    code, out, err = run(*split("verify flux.csv --check linearity"))
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "fails" in text
    assert "linearity fails: correct it: gonio reduce --nonlinearity 0.0005," in text
    code, out, _ = run(*split("verify flux.csv --check linearity --uncertainty 1"))
    assert "passes" in out


def test_a_journal_is_checked(run, here):
    line = "plan --theta-i 30:50:10 --theta-r -70:70:20 --blocked 5 --check 0,45 --dark-every 10 --out plan.toml"
    assert run(*split(line))[0] == 0
    measure(here / "run.jsonl", bench(), read_plan(here / "plan.toml"))
    code, out, err = run(*split("verify run.jsonl --check all --uncertainty 1 --json -"))
    assert (code, err) == (0, "")
    record = json.loads(out)
    assert [one["check"] for one in record["checks"]] == ["repeat", "dark"]
    assert all(one["passes"] for one in record["checks"])
    assert set(record["left_out"]) == {"linearity", "zero"}


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("scan.csv --check linearity", "scan.csv: linearity is a check of raw readings, and this is a scan"),
        ("flux.csv --check energy", "flux.csv: energy is a check of a scan, and this is raw readings"),
        ("flux.csv --check repeat", "flux.csv: no check direction was read twice: plan it, gonio plan --check 0,45"),
        ("flux.csv --check linearty", "'linearty'"),
        ("scan.csv stated.csv --check all", "2 files are given: check one at a time"),
        ("scan.csv --check all --out a.png", "--out to a mirror or a standard: leave them out"),
        ("scan.csv --check all --reflectance 0.9", "say what is known"),
        ("scan.csv --reflectance 0.9 --zero 0.1", "--zero belongs to --check zero"),
    ],
)
def test_what_is_refused_is_one_line(run, here, line, said):
    code, out, err = run("verify", *split(line))
    assert (code, out) == (1, "")
    assert said in err
    assert err.count("\n") == 1
