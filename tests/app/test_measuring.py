"""`gonio plan`, `measure`, `watch` and `verify` as a person types them."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from shlex import split

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.image import imread

from gonio import catalogue, simulate, write
from gonio.acquisition import grid, read_journal, read_plan, readings
from gonio.plotting.measuring import readings_figure
from simulated_benches import SMALL, bench, measure

BENCH = '[simulated]\nmodel = "lambert"\nvalues = {rho = 0.5}\n'
LINE = split("measure plan.toml --bench bench.toml --log run.jsonl")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.toml").write_text(BENCH)
    grid([30], [0, 30, 60]).write(tmp_path / "plan.toml")
    return tmp_path


def test_a_plan_is_written_and_explained(run, here):
    line = "plan --theta-i 20,30 --theta-r -40:40:10 --blocked 5 --check 0,45 --out new.toml --json plan.json"
    code, out, err = run(*split(line))
    assert (code, err) == (0, "")
    assert "left out: theta_i = 20, theta_r = -20 (1): within 5 deg of the source" in out
    assert "20 readings (2 dark, 2 check, 16 sample)" in " ".join(out.split())
    plan = read_plan(here / "new.toml")
    record = json.loads((here / "plan.json").read_text())
    assert record["sha256"] == plan.sha256
    assert record["duration_s"] == pytest.approx(plan.duration)
    assert [row[:2] for row in record["skipped"]] == [[20, -20], [30, -30]]
    assert record["steps"] == plan.record["steps"]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--theta-i 20 --theta-r 95", "the step sample 20 95 is outside"),
        ("--theta-i 20:10:1 --theta-r 0", "--theta-i is '20:10:1'"),
        ("--theta-i 20 --theta-r x", "--theta-r is 'x'"),
        ("--theta-i 20 --theta-r 0 --check 0", "--check is '0'"),
        ("--theta-i 20 --theta-r 0 --check-every 3", "check_every needs a direction"),
        ("--theta-i 20 --theta-r -20 --blocked 5", "no direction can be measured"),
        ("--theta-i 20 --theta-r 0 --blocked 1 --arm-half-width 20", "the arm hides 2.292 deg"),
        ("--theta-i 20 --theta-r 0 --dwell 0", "--dwell is 0"),
        ("--theta-i 20 --theta-r 0 --polarisation x", "the polarisation is 'x'"),
        ("--theta-i 20 --theta-r 0 --out plan.toml", "plan.toml exists"),
    ],
)
def test_a_plan_that_cannot_be_is_one_line(run, here, line, said):
    code, out, err = run("plan", *split(line))
    assert (code, out) == (1, "")
    assert said in err
    assert err.count("\n") == 1


def test_the_mirror_direction_of_every_angle(run, here):
    run(*split("plan --theta-i 10:80:10 --theta-r mirror --incident --out mirror.toml"))
    samples = [step for step in read_plan(here / "mirror.toml").steps if step.kind == "sample"]
    assert [(s.theta_i, s.theta_r) for s in samples] == [(t, t) for t in range(10, 81, 10)]


def test_a_measurement_goes_on_where_it_stopped(run, here):
    (here / "bench.toml").write_text(BENCH + '[[simulated.faults]]\nwhat = "lost"\nat = 9\ntimes = 99\n')
    code, out, err = run(*LINE)
    assert code == 1
    assert "no answer from the detector" in err
    assert "run the same command to go on" in err
    assert err.count("\n") == 1
    (here / "bench.toml").write_text(BENCH)
    with (here / "run.jsonl").open("ab") as file:
        file.write(b"1234")
    code, out, err = run(*LINE)
    assert code == 0
    assert "4 bytes after its last whole line, which a crash tore, go to run.jsonl.torn" in err
    assert "5 of 5 steps are measured" in out
    assert "2 sessions" in out
    assert (here / "run.jsonl.torn").read_bytes() == b"1234"
    times = [record["t_utc"] for record in read_journal(here / "run.jsonl").records]
    assert times == sorted(times)  # a simulated clock goes on behind the journal
    assert run(*LINE)[0] == 0


def test_an_overload_is_told(run, here):
    (here / "bench.toml").write_text(BENCH + "[simulated.optics]\npower = 1e4\n")
    code, out, _ = run(*LINE, "--json", "-")
    assert code == 0
    assert json.loads(out)["overloaded"] == 3
    assert json.loads(out)["complete"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda: grid([40], [0]).write("plan.toml", force=True), "is the journal of another plan"),
        (lambda: write_text("bench.toml", BENCH + "[instrument]\ndistance = 3\n"), "another instrument: distance is 3"),
        (lambda: write_text("bench.toml", "x"), "bench.toml: is no TOML"),
        (lambda: write_text("plan.toml", "x"), "plan.toml: is no TOML"),
        (lambda: write_text("run.jsonl", "x\n"), "run.jsonl, line 1: holds no whole line"),
        (lambda: write_text("bench.toml", '[simulated]\nmodel = "lambart"\n'), "lambart"),
    ],
)
def test_what_does_not_belong_together_is_one_line(run, here, change, said):
    run(*LINE)
    change()
    code, _, err = run(*LINE)
    assert code == 1
    assert said in err
    assert err.count("\n") == 1


def write_text(name, text):
    Path(name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_within_moments_and_the_same_command_goes_on(here, number):
    """The bench waits in real time; what closes the shutter writes a file, since the process is gone afterwards."""
    (here / "own.py").write_text(OWN)
    (here / "bench.toml").write_text(REAL)
    start = [sys.executable, "-c", "from gonio.app.cli import main; main()", *LINE]
    process = subprocess.Popen(start, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        while not (here / "opened").exists():
            assert process.poll() is None
            time.sleep(0.02)
        time.sleep(0.2)
        asked = time.monotonic()
        os.killpg(process.pid, number)
        err = process.communicate(timeout=30)[1]
    finally:
        process.kill()
    assert time.monotonic() - asked < 4
    assert process.returncode == 128 + number
    assert "steps are measured; the same command goes on" in err
    assert err.count("\n") == 1
    assert (here / "closed").exists()
    assert not (here / "opened").exists()
    assert not read_journal(here / "run.jsonl").torn


OWN = """
import time
from pathlib import Path
from gonio.acquisition import Reading


class Arm:
    name, limits = "arm", (-180.0, 180.0)

    def position(self):
        return self.at if hasattr(self, "at") else 0.0

    def move(self, to):
        self.at = to


class Meter:
    unit, ranges = "W", (1.0,)

    def read(self, seconds):
        time.sleep(20 if Path("opened").exists() else 0)
        return Reading(0.5, 1e-3, 10, "W", 1.0)

    def set_range(self, largest):
        pass


class Light:
    is_open = False

    def open(self):
        Path("opened").touch()
        self.is_open = True

    def close(self):
        Path("opened").unlink(missing_ok=True)
        Path("closed").touch()
        self.is_open = False
"""
REAL = "".join(
    f'[{name}]\ndriver = "own.py:{of}"\n'
    for name, of in (("table", "Arm"), ("arm", "Arm"), ("detector", "Meter"), ("shutter", "Light"))
)


def test_watch_draws_every_reading(run, here):
    measure(here / "run.jsonl", bench())
    code, out, err = run("watch", "run.jsonl", "--once", "now.png")
    assert (code, err) == (0, "")
    raw = readings(here / "run.jsonl")
    assert f"{raw.sizes['reading']} readings" in out
    assert imread(here / "now.png").shape[0] > 100
    figure = readings_figure(raw)
    drawn = sum(len(line.get_xdata()) for line in figure.axes[0].lines)
    assert drawn == sum(step.kind == "sample" for step in SMALL.steps)
    assert figure.axes[0].get_ylabel() == "signal [W]"


def test_watch_needs_a_window_or_a_file(run, here):
    measure(here / "run.jsonl", bench())
    code, _, err = run("watch", "run.jsonl")
    assert code == 1
    assert "no window to draw in: give --once FILE" in err


def test_a_window_follows_the_journal_until_it_is_closed(run, here, monkeypatch):
    """The window is played by a canvas without one: at each pause a reading is added, then it is closed."""
    on = bench()
    measure(here / "whole.jsonl", on)
    lines = (here / "whole.jsonl").read_bytes().splitlines(keepends=True)
    (here / "run.jsonl").write_bytes(b"".join(lines[:2]))
    drawn = []

    def pause(seconds):
        assert seconds == 0.5
        (figure,) = map(plt.figure, plt.get_fignums())
        drawn.append(sum(len(line.get_xdata()) for ax in figure.axes[:1] for line in ax.lines))
        count = len((here / "run.jsonl").read_bytes().splitlines()) + 8
        (here / "run.jsonl").write_bytes(b"".join(lines[:count]))
        if len(drawn) == 4:
            plt.close(figure)

    plt.switch_backend("agg")  # before it says that it needs a screen, which a machine may not have
    monkeypatch.setattr(plt, "pause", pause)
    monkeypatch.setattr(mpl.backends.backend_agg.FigureCanvasAgg, "required_interactive_framework", "none")
    code, _, err = run("watch", "run.jsonl", "--every", "0.5")
    assert (code, err) == (0, "")
    assert drawn == sorted(drawn)
    assert drawn[0] == 0 < drawn[-1]


def test_a_mirror_is_verified_from_plan_to_verdict(run, here):
    (here / "bench.toml").write_text(
        '[simulated]\nmirror = "aluminium"\n[simulated.electronics]\nranges = [1e-6, 1e-5, 2e-3]\n'
    )
    for state in ("s", "p"):
        line = f"plan --theta-i 10:80:10 --theta-r mirror --incident --filter nd --wavelength 632.8 --out {state}.toml"
        assert run(*split(line), "--polarisation", state)[0] == 0
        assert run("measure", f"{state}.toml", "--bench", "bench.toml", "--log", f"{state}.jsonl")[0] == 0
    line = "verify s.jsonl p.jsonl --material aluminium --uncertainty 0.5 --out mirror.png --json mirror.json"
    code, out, err = run(*split(line))
    assert (code, err) == (0, "")
    assert "the set-up passes" in out
    record = json.loads((here / "mirror.json").read_text())
    assert [one["polarisation"] for one in record["reflectances"]] == ["s", "p"]
    assert all(one["delta"] < 6e-4 for one in record["deviations"])
    assert (here / "mirror.png").exists()


def test_an_unknown_polarisation_is_told(run, here):
    (here / "bench.toml").write_text(
        '[simulated]\nmirror = "aluminium"\n[simulated.electronics]\nranges = [1e-6, 1e-5, 2e-3]\n'
    )
    line = "plan --theta-i 10:80:10 --theta-r mirror --incident --filter nd --wavelength 632.8 --out new.toml"
    run(*split(line))
    run(*split("measure new.toml --bench bench.toml --log new.jsonl"))
    code, out, _ = run(*split("verify new.jsonl --material aluminium"))
    assert code == 0
    assert "the polarisation is unknown: theory for s or p differs from this by up to" in out


def test_a_standard_is_verified_over_growing_ranges(run, here):
    for name, rho in (("scan", 0.9), ("certificate", 0.91)):
        scan = simulate(catalogue["lambert"], {"rho": rho}, [10.0, 30.0], np.arange(-70, 71, 10.0), noise=1e-6)
        write(scan, here / f"{name}.csv")
    code, out, err = run(*split("verify scan.csv --certified certificate.csv --uncertainty 1 --json - --out d.png"))
    assert (code, err) == (0, "")
    record = json.loads(out)
    assert [one["values"] for one in record["deviations"]][-1] == "|theta_r| up to 70 deg"
    assert record["deviations"][0]["delta"] == pytest.approx(1 / 90, rel=1e-3)
    assert record["deviations"][0]["passes"] is False
    assert len(record["by_theta_i"]) == 2
    assert (here / "d.png").exists()
    code, out, _ = run(*split("verify scan.csv --reflectance 0.9 --uncertainty 1"))
    assert "the set-up passes" in out


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("verify scan.csv", "say what is known"),
        ("verify scan.csv --material gold --reflectance 1", "say what is known"),
        ("verify scan.csv --material gold", "scan.csv, line 1: holds no whole line of a journal"),
        ("verify run.jsonl --material gold", "name as wavelength none: give --wavelength"),
        ("verify run.jsonl --material gold --wavelength 632.8", "no reading at theta_r = theta_i"),
        ("verify scan.csv scan.csv --reflectance 0.9", "2 scans are given"),
        ("verify scan.csv --reflectance 0.9 --transmittance 0.1", "belong to a mirror"),
        ("watch scan.csv --once x.png", "holds no whole line"),
        ("watch run.jsonl --once x.docx", "x.docx: figures are written as"),
    ],
)
def test_what_cannot_be_verified_is_one_line(run, here, line, said):
    write(simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], [0.0, 10.0]), here / "scan.csv")
    measure(here / "run.jsonl", bench(), grid([30], [0]))
    code, _, err = run(*split(line))
    assert code == 1
    assert said in err
    assert err.count("\n") == 1
