"""The commands and the Python of docs/figures.md run as they are printed, and write what they say."""

import re
import shlex

import numpy as np
import pytest
from PIL import Image

from gonio import catalogue, simulate, write
from gonio.app.cli import main
from gonio.app.commands.draw import Drawing
from gonio.app.commands.plot import Figure
from places import ROOT

PAGE = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.25}
    write(
        simulate(catalogue["ggx"], values, [10.0, 30.0, 50.0], np.arange(-70.0, 71, 5), noise=0.02),
        tmp_path / "scan.csv",
    )
    return tmp_path


def blocks(language):
    found = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
    return [block for of, block in found if of == language]


def test_the_commands_run(folder, monkeypatch):
    commands = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("gonio ")]
    assert len(commands) == 3
    for command in commands:
        monkeypatch.setattr("sys.argv", shlex.split(command))
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0, command
    assert {path.name for path in folder.iterdir()} == {"scan.csv", "fig1.pdf", "fig2.pdf", "lobe.png"}
    with Image.open(folder / "lobe.png") as picture:
        assert picture.size == (int(85 / 25.4 * 300), int(60 / 25.4 * 300))


def test_the_python_and_the_style_run(folder):
    (code,) = blocks("python")
    namespace = {}
    exec(compile(code, "figures.md", "exec"), namespace)
    assert {path.name for path in folder.iterdir()} == {"scan.csv", "fig3.pdf", "fig4.png"}
    style = next(block for block in blocks("text") if block.startswith("axes."))
    (folder / "mine.mplstyle").write_text(style)
    figure = namespace["solution"].plot(style="mine.mplstyle")
    assert figure.axes[0].lines[1].get_color() == "#000000"


def test_every_kind_has_a_line():
    told = re.findall(r"^\| `([a-z]+)` \|", PAGE, flags=re.MULTILINE)
    assert set(told) == {kind.value for kind in Figure}
    for kind in Drawing:
        assert f"`{kind.value}`" in PAGE.rpartition("`gonio draw MODEL")[2]
