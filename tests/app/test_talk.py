"""How much is told: -v each step, -q results and errors only, and never a warning of a library."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gonio
from gonio import catalogue, simulate, write
from gonio.app import talk

ONE_ANGLE = "one incidence angle only"  # what a warning of such a scan says


@pytest.fixture
def scan(tmp_path):
    path = tmp_path / "scan.csv"
    write(simulate(catalogue["lambert"], {"rho": 0.5}, [30.0], np.arange(-60, 61, 20.0), noise=0.01), path)
    return path


@pytest.fixture(autouse=True)
def usual():
    yield
    talk.choose(verbose=False, quiet=False)


COMPARE = ("--models", "lambert,phong")


@pytest.mark.parametrize("flag", ["-q", "--quiet"])
def test_quiet_is_results_and_errors_only(run, scan, flag, tmp_path):
    assert ONE_ANGLE in run("compare", scan, *COMPARE)[2]
    for line in ((flag, "compare", scan, *COMPARE), ("compare", scan, *COMPARE, flag)):
        code, out, err = run(*line)
        assert (code, err) == (0, "")
        assert "phong" in out
    code, out, err = run(flag, "info", tmp_path / "missing.csv")
    assert (code, out) == (1, "")
    assert "there is no such file" in err


@pytest.mark.parametrize("flag", ["-v", "--verbose"])
def test_verbose_tells_each_step(run, scan, flag, tmp_path):
    for k, line in enumerate(((flag, "convert", scan), ("convert", scan, flag))):
        out_file = tmp_path / f"out{k}.nc"
        _, out, err = run(*line, out_file)
        assert f"gonio: read {scan} as tidy CSV: 7 values\n" in err
        assert f"gonio: wrote {out_file}\n" in err
        assert ".gonio-" not in err
        assert "read" not in out.split("as the file reads now")[0]
    _, _, err = run("compare", scan, *COMPARE, flag)
    for words in ("fitted lambert to 7 points with uncertainty weighting by Projection(", "compared phong, ", "2 of 2"):
        assert words in err
    assert run("compare", scan, *COMPARE)[2].count("\n") == 1  # the next command has its own way


def test_both_contradict_each_other(run, scan):
    for line in (("-q", "-v", "info", scan), ("info", scan, "-v", "-q")):
        code, out, err = run(*line)
        assert (code, out) == (1, "")
        assert err == "gonio: --verbose and --quiet contradict each other: give one of them\n"


def test_what_is_logged_is_escaped(capsys):
    talk.choose(verbose=True, quiet=False)
    import logging

    logging.getLogger("gonio.formats").info("read %s", "a\x1b[2Jb.csv")
    assert capsys.readouterr().err == "gonio: read a\\x1b[2Jb.csv\n"


PROGRAM = """
import sys

import numpy as np

from gonio.app import cli
from gonio.app.cli import main
from gonio.processes import results


def squared(number):
    return float(np.square(np.float64(number)))


def work():
    for index, one in results(squared, [1e200, 1e300], workers):
        print(index, one)


if __name__ == "__main__":
    workers = int(sys.argv[1])
    cli.app = work
    main()
"""


@pytest.mark.parametrize("workers", [1, 2])
def test_no_warning_of_a_library_reaches_the_terminal(tmp_path, workers):
    """Neither from this process nor from those that share the work: "overflow encountered in square" says nothing."""
    (tmp_path / "program.py").write_text(PROGRAM)
    environment = os.environ | {"PYTHONPATH": str(Path(gonio.__file__).parents[1])}
    environment.pop("PYTHONWARNINGS", None)
    line = [sys.executable, "program.py", str(workers)]
    done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert sorted(done.stdout.split("\n")) == ["", "0 inf", "1 inf"]
    assert done.stderr == ""
