"""`gonio info` of what `gonio measure` writes and `gonio reduce` reads: what it holds, how far, and what comes next."""

import json
import shlex
from shlex import split

import pytest

from gonio.acquisition import Conditions, Journal, Layout, planned, read_journal, read_plan
from places import SHARED
from simulated_benches import SMALL, bench, measure

TABLE = """# fill: under
# sample: panel 7
kind,theta_i_deg,theta_r_deg,signal_V,sd_V,samples,time_s
dark,,,0.002,0.00003,10,0
standard,0,45,0.0702,0.00006,10,10
sample,30,-60,0.0115,0.00003,10,20
sample,30,40,0.0202,0.00004,10,30
"""
BENCH = '[simulated]\nmodel = "lambert"\nvalues = {rho = 0.5}\n'
MEASURE = split("measure plan.toml --bench bench.toml --log run.jsonl")
BLACK_LAB = SHARED / "raw" / "blacklab" / "nite_invar_a_l631h.inp.txt"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    SMALL.write(tmp_path / "plan.toml")
    return tmp_path


@pytest.fixture
def told(run, here):
    """The record and the text, on one line, of `gonio info` of a file."""

    def of(name):
        code, text, err = run("info", name)
        assert (code, err) == (0, "")
        code, record, _ = run("info", name, "--json", "-")
        assert code == 0
        return json.loads(record), " ".join(text.split())

    return of


def test_a_measurement_that_was_stopped_says_how_to_go_on(run, here, told):
    (here / "bench.toml").write_text(BENCH + '[[simulated.faults]]\nwhat = "lost"\nat = 9\ntimes = 99\n')
    assert run(*MEASURE)[0] == 1
    content = read_journal(here / "run.jsonl")
    with (here / "run.jsonl").open("ab") as file:
        file.write(b"12345")
    size = (here / "run.jsonl").stat().st_size
    record, text = told("run.jsonl")
    assert (here / "run.jsonl").stat().st_size == size  # it is only looked at
    plan = read_plan(here / "plan.toml")
    assert (record["kind"], record["plan"], record["plan_sha256"]) == ("journal", "plan.toml", plan.sha256)
    assert record["steps"] == len(plan.steps)
    assert 0 < record["done"] == len(content.done) < record["steps"]
    assert sum(record["left"].values()) == record["steps"] - record["done"]
    assert sum(record["by_kind"].values()) <= record["readings"]
    assert record["torn"] == 5
    assert "no answer from the detector" in record["stopped"]
    assert record["next"] == "gonio measure plan.toml --bench BENCH.toml --log run.jsonl"
    for words in (
        f"{record['done']} of {record['steps']} steps are measured",
        f"plan.toml, SHA-256 {plan.sha256}",
        "5 bytes after the last whole line",
        "failed and tried again: no answer from the detector (3 times)",
        "it was stopped: detector: no answer",
        "no number",  # of the last attempt
        "next: gonio measure plan.toml --bench BENCH.toml --log run.jsonl",
        "BENCH.toml is the file of the bench",
    ):
        assert words in text, words
    (here / "bench.toml").write_text(BENCH)
    assert run(*split(record["next"].replace("BENCH", "bench"))[1:])[0] == 0
    after, text = told("run.jsonl")
    assert (after["complete"], after["left"], after["torn"], after["torn_before"]) == (True, {}, 0, 5)
    assert after["sessions"] == 2
    assert after["stopped"] == ""
    assert "run.jsonl.torn holds what crashes tore before, 5 bytes" in text


def test_a_complete_measurement_says_how_it_is_reduced(run, here, told):
    """The command it names is one that runs, once what stands in capitals is filled in."""
    measure(here / "run.jsonl", bench())
    record, text = told("run.jsonl")
    assert record["plan"] == ""
    steps = [step.kind for step in SMALL.steps]
    assert f"complete, {len(steps)} of {len(steps)} steps" in text
    assert {kind: record["by_kind"][kind] for kind in ("check", "sample")} == {
        kind: steps.count(kind) for kind in ("check", "sample")
    }
    assert (record["last"]["unit"], record["unit"]) == ("W", "W")
    assert record["theta_i"] == [0.0, 20.0, 40.0]
    assert "wavelengths 632.8 nm" in text
    filled = record["next"].replace("VALUE+-U:factor@THETA_I,THETA_R", "0.99:factor@0,45").replace("V+-U", "1e-9")
    assert run(*split(filled)[1:])[0] == 0


def test_readings_of_the_beam_are_reduced_by_what_the_bench_states(run, here, told):
    plan = planned([(30, 30, None)], Layout(incident=True), Conditions(filter="nd", dwell=0.1))
    measure(here / "run.jsonl", bench(), plan)
    record, _ = told("run.jsonl")
    assert record["filters"] == ["nd"]
    assert record["next"].endswith("--absolute stated --out scan.csv")
    assert run(*split(record["next"])[1:])[0] == 0


def test_a_journal_without_a_reading(here, told):
    with Journal(here / "run.jsonl", read_plan(here / "plan.toml"), {}):
        pass
    record, text = told("run.jsonl")
    assert (record["readings"], record["done"], record["last"]) == (0, 0, None)
    assert "0 of" in text
    assert "last reading none yet" in text
    assert record["next"].startswith("gonio measure plan.toml")


def test_a_table_of_readings(run, here, told):
    (here / "my run.csv").write_text(TABLE)
    record, text = told("my run.csv")
    assert (record["kind"], record["unit"]) == ("readings", "V")
    assert record["by_kind"] == {"dark": 1, "standard": 1, "sample": 2}
    assert record["theta_r"] == [-60.0, 45.0]
    assert record["provenance"] == ["sample: panel 7"]
    assert record["next"] == (
        f"gonio reduce {shlex.quote('my run.csv')} --standard VALUE+-U:factor@THETA_I,THETA_R --out scan.csv"
    )
    assert "# sample: panel 7" in text
    filled = record["next"].replace("VALUE+-U", "0.99+-0.002").replace("THETA_I,THETA_R", "0,45")
    assert run(*split(filled)[1:])[0] == 0


@pytest.mark.skipif(not BLACK_LAB.is_file(), reason=f"no measured file at {BLACK_LAB}")
def test_black_lab_readings(told):
    record, text = told(BLACK_LAB)
    assert record["by_kind"] == {"sample": 114, "dark": 2}
    assert record["wavelengths"] == [630.79]
    assert "dark subtracted by the instrument" in text
    assert record["next"].endswith(
        "--fill FILL --standard VALUE+-U:factor@THETA_I,THETA_R --standard-signal V+-U --out scan.csv"
    )
    assert "V+-U is the signal of the standard, which the file does not hold" in text


def test_a_scan_with_signals_beside_its_values_is_a_scan(run, here):
    (here / "scan.csv").write_text("theta_i_deg,theta_r_deg,brdf_a.u.,signal\n30,-20,2.8,2.7\n30,0,2.5,2.5\n")
    code, out, _ = run("info", "scan.csv", "--json", "-")
    assert code == 0
    assert json.loads(out)["kind"] == "scan"


@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        (lambda text: text.replace("sample,30,40,0.0202", "sample,30,40,x"), (), "line 7: signal is 'x', not a number"),
        (lambda text: text.replace("sample,30,40", "sumple,30,40"), (), "line 7: no kind of reading 'sumple'"),
        (lambda text: text, ("--floor", "0.1"), "holds raw readings, and --select, masks and corrections belong to a"),
    ],
)
def test_what_is_wrong_is_one_line(run, here, change, options, words):
    (here / "table.csv").write_text(change(TABLE))
    code, out, err = run("info", "table.csv", *options)
    assert (code, out) == (1, "")
    assert words in err
    assert err.count("\n") == 1


def test_a_damaged_journal_is_one_line(run, here):
    measure(here / "run.jsonl", bench())
    whole = (here / "run.jsonl").read_bytes()
    (here / "run.jsonl").write_bytes(whole[: whole.index(b"\n") - 3])
    code, out, err = run("info", "run.jsonl")
    assert (code, out) == (1, "")
    assert "run.jsonl, line 1: holds no whole line of a journal" in err


def test_a_hostile_name_of_a_plan_is_shown_and_does_nothing(here, told):
    plan = read_plan(here / "plan.toml")
    object.__setattr__(plan, "name", "a;rm -rf x\x1b[31m.toml")
    with Journal(here / "run.jsonl", plan, {}):
        pass
    record, text = told("run.jsonl")
    assert split(record["next"])[2] == "a;rm -rf x\\x1b[31m.toml"
    assert "\x1b" not in text
