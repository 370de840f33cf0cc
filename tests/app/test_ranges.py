"""Numbers out of range and names of nothing are refused in one line."""

import numpy as np
import pytest

from gonio import read, write
from gonio.measured.dataset import make_scan
from gonio.measured.masking import mask


@pytest.fixture
def here(tmp_path, monkeypatch):
    theta_r = np.tile(np.arange(-60, 61, 10.0), 2)
    write(make_scan(np.repeat([10.0, 40.0], 13), theta_r, 1 + np.cos(np.radians(theta_r))), tmp_path / "s.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


REFUSED = {
    "fit s.csv --model lambert --blocked -3": "--blocked is -3: give a number from 0 to 180",
    "fit s.csv --model lambert --blocked nan": "--blocked is nan: give a number from 0 to 180",
    "compare s.csv --models lambert --blocked -3": "--blocked is -3: give a number from 0 to 180",
    "plot s.csv --models lambert --blocked 400": "--blocked is 400: give a number from 0 to 180",
    "convert s.csv t.nc --blocked -0.1": "--blocked is -0.1: give a number from 0 to 180",
    "fit s.csv --model lambert --seed -1": "--seed is -1: give 0 or more",
    "fit s.csv --model lambert --setting searches=1.5": "the setting searches is a whole number, and is 1.5",
    "compare s.csv --models ,": "--models names no model: there is nothing to compare",
    "plot s.csv --models lambert --out x.jpg": "x.jpg: figures are written as .pdf, .png or .svg, not .jpg",
    "plot s.csv --models , --figure components": "components shows fits, and no model was fitted",
}


@pytest.mark.parametrize("command", REFUSED)
def test_refused_in_one_line(run, here, command):
    code, out, err = run(*command.split())
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith(f"gonio: {REFUSED[command]}")
    assert [path.name for path in here.iterdir()] == ["s.csv"]


def test_the_library_refuses_the_same(here):
    for wrong in ({"blocked": -1.0}, {"blocked": np.inf}, {"floor": np.nan}):
        with pytest.raises(ValueError, match="give a"):
            mask(read(here / "s.csv"), **wrong)
