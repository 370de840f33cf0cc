"""What commands print at 80 and at 120 columns, as files in `screens`.

`make screens` renews them, and git shows what changed.
The scan is small and its fits are well conditioned, so that the digits shown are the same on every machine; seconds are
masked, since they are not.
"""

import io
import os
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len

from gonio import catalogue, write
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan

SCREENS = Path(__file__).with_name("screens")
RENEW = "GONIO_RENEW_SCREENS"
COMMANDS = {
    "help": "--help",
    "fit-help": "fit --help",
    "info": "info scan.csv",
    "fit": "fit scan.csv --model torrance-sparrow",
    "compare": "compare scan.csv --models lambert,torrance-sparrow,phong",
    "compare-validated": "compare scan.csv --models lambert,torrance-sparrow --validate theta_i",
    "check": "check scan.csv",
    "convert": "convert scan.csv scan.nc",
    "diff": "diff other.csv scan.csv",
    "models": "models",
    "model": "models cauchy-lorentz",
    "formats": "formats",
    "eval": 'eval cauchy-lorentz --published Al --at "40,40,180;40,20,180"',
    "materials": "materials",
}
WIDTHS = (80, 120)
SECONDS = re.compile(r"\d[\d.e-]* s\b")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Two scans of one surface whose errors of a few percent look random and are not."""
    theta_i, theta_r = np.repeat([10.0, 30.0, 50.0], 29), np.tile(np.arange(-70, 71, 5.0), 3)
    geometry = Geometry.from_degrees(theta_i, np.abs(theta_r), np.where(theta_r >= 0, 180.0, 0.0))
    surface = catalogue["torrance-sparrow"](geometry, {"ks": 0.3, "kd": 0.1, "sigma": 0.15})
    for name, phase in (("scan", 0.0), ("other", 1.0)):
        errors = 0.03 * np.sin(np.arange(len(theta_r)) ** 2 + phase)
        write(make_scan(theta_i, theta_r, np.round(surface * (1 + errors), 5)), tmp_path / f"{name}.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def screen(run, here, monkeypatch):
    """What a command prints at a width, each line without the blanks at its end and without its seconds."""

    def of(name, width):
        monkeypatch.setenv("COLUMNS", str(width))
        code, out, err = run(*shlex.split(COMMANDS[name]))
        assert code == 0, err
        return "\n".join(line.rstrip() for line in SECONDS.sub("# s", out).splitlines()) + "\n"

    return of


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_screen_is_as_it_was_and_can_be_read(screen, name, width):
    shown, kept = screen(name, width), SCREENS / f"{name}-{width}.txt"
    assert max(map(cell_len, shown.splitlines())) <= width
    assert "…" not in shown, "a name is cut"
    assert not re.search(r"\bnan\b", shown)
    assert not re.search(r"<\w+", shown), "a type of Python is shown"
    if os.environ.get(RENEW):
        kept.write_text(shown, encoding="utf-8")
    assert shown == kept.read_text(encoding="utf-8"), f"make screens renews {kept.name}"


def test_no_screen_is_left_over():
    assert {path.name for path in SCREENS.iterdir()} == {f"{name}-{width}.txt" for name in COMMANDS for width in WIDTHS}


def test_the_rules_find_what_is_cut():
    """A table that is wider than the screen is cut with an ellipsis, which the rule above looks for."""
    from rich.console import Console

    from gonio.app.output import table

    wide = table("model", "value")
    wide.add_row("a-name-that-is-too-long-for-this", "1")
    console = Console(width=20, file=io.StringIO())
    console.print(wide)
    assert "…" in console.file.getvalue()
