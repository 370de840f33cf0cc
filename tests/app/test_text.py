"""Names from files, folders and channels on their way to a terminal, a figure and a table."""

import subprocess
import sys
import xml.dom.minidom

import numpy as np
import pytest

from gonio import read, write
from gonio.app import cli
from gonio.measured.dataset import make_scan

EVIL = "p [/s]\x1b[31m<b>&"


@pytest.fixture
def scan_file(tmp_path):
    """A scan whose channels, header and name hold markup, escape sequences and a formula."""
    angles = np.tile([-40.0, -10.0, 10.0, 40.0], 2)
    channels = np.repeat(["[s]", "=cmd"], 4)
    scan = make_scan(
        np.repeat([20.0, 40.0], 4), angles, np.linspace(0.1, 0.4, 8), coordinates={"channel": channels},
        provenance="material: \x1b]0;pwned\x07 [bold]",
    )  # fmt: skip
    folder = tmp_path / "x["
    folder.mkdir()
    write(scan, folder / "a[b]c.csv")
    return folder / "a[b]c.csv"


def test_brackets_in_names_are_shown(run, scan_file):
    code, out, err = run("info", scan_file)
    assert (code, err) == (0, "")
    assert "a[b]c.csv" in out.replace("\n", "")
    assert "[s]" in out
    assert "[bold]" in out
    assert "\x1b" not in out


@pytest.mark.parametrize(
    "command",
    ["info", "check", "fit --model lambert", "compare --models lambert", "convert out.csv", "convert out.zarr"],
)
def test_no_command_lets_control_characters_or_markup_through(run, scan_file, monkeypatch, command):
    monkeypatch.chdir(scan_file.parent)
    scan = read(scan_file)
    scan["channel"] = ("direction", np.where(scan["channel"] == "[s]", EVIL, "\x07=1"))
    write(scan, "evil.csv")
    name, *rest = command.split()
    code, out, err = run(name, "evil.csv", *rest)
    assert code == 0, err
    assert (out + err).replace("\n", "").isprintable()


def test_a_channel_that_is_not_there_is_told_without_its_escapes(run, scan_file):
    code, _, err = run("fit", scan_file, "--model", "lambert", "--select", "channel=\x1b[31m")
    assert code == 1
    assert err.count("\n") == 1
    assert "\x1b" not in err


def test_a_figure_with_control_characters_in_names_is_well_formed(run, scan_file, monkeypatch):
    monkeypatch.chdir(scan_file.parent)
    scan = read(scan_file)
    scan["channel"] = ("direction", np.where(scan["channel"] == "[s]", EVIL, "R"))
    write(scan, "evil.csv")
    assert run("plot", "evil.csv", "--models", "lambert", "--out", "evil.svg")[0] == 0
    xml.dom.minidom.parse("evil.svg")


def test_what_ends_too_early_is_one_line(run, scan_file, monkeypatch):
    """Typer takes an EOFError for the end of standard input, and says Aborted, whatever the reason."""

    def cut(*_):
        raise EOFError("marshal data too short")

    monkeypatch.setattr("gonio.app.views.physics.check", cut)
    code, out, err = run("check", scan_file)
    assert (code, out) == (1, "")
    assert err == "gonio: something ended before it was complete: marshal data too short\n"


def test_a_spreadsheet_finds_no_formula_in_what_is_written(scan_file):
    text = scan_file.read_text(encoding="utf-8")
    assert ",'=cmd" in text
    assert ",=cmd" not in text
    assert set(read(scan_file)["channel"].values) == {"[s]", "=cmd"}


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_without_utf8_loses_no_result(scan_file, encoding, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", encoding)
    program = "from gonio.app.cli import main; main()"
    for command in (["info", scan_file], ["fit", scan_file, "--model", "lambert"], ["materials"]):
        done = subprocess.run([sys.executable, "-c", program, *map(str, command)], capture_output=True, check=False)
        assert (done.returncode, done.stderr) == (0, b"")
        assert done.stdout


def test_a_program_without_docstrings_prints_a_model():
    program = "from gonio.app.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-OO", "-c", program, "models", "ggx"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "rho_s" in done.stdout


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (MemoryError("127 GiB"), "gonio: there is not enough memory: 127 GiB"),
        (IndexError("list index"), "gonio: IndexError: list index (test_text.py, line"),
        (ZeroDivisionError("division"), "this is a mistake in gonio: GONIO_TRACEBACK=1 shows where"),
    ],
)
def test_any_error_is_one_line(run, monkeypatch, error, said):
    def fails():
        raise error

    monkeypatch.setattr(cli, "app", fails)
    code, _, err = run("info")
    assert code == 1
    assert err.count("\n") == 1
    assert said in err
    monkeypatch.setenv("GONIO_TRACEBACK", "1")
    with pytest.raises(type(error)):
        run("info")
