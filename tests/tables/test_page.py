"""The examples of docs/tables.md, run one after another; and its table of names, looked up."""

import re
import shlex

import numpy as np
import pytest

import gonio
from gonio.app.cli import main
from gonio.tables.headings import parsed
from gonio.tables.request import target
from places import ROOT
from workbooks import write

PAGE = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^`([\w.-]+)`:\n\n```\n(.*?)```", PAGE, re.M | re.S))
COMMANDS = [line for block in re.findall(r"^```\n(.*?)```", PAGE, re.M | re.S) for line in block.splitlines()]
EXAMPLES = [line for line in COMMANDS if line.startswith("gonio import") and "FILE" not in line]
SHEETS = {f"AOI {i}": [["detector", "BRDF 1/sr"], [-40.0, 0.0146], [float(i), 0.3833]] for i in (10, 30)}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    write(tmp_path / "sheets.xlsx", SHEETS)
    return tmp_path


def test_every_layout_has_an_example():
    assert set(FILES) == {"aoi.csv", "matrix.csv", "blocks.txt", "wide.csv", "percent.csv", "flipped.csv"}
    assert len(EXAMPLES) == 10


@pytest.mark.parametrize("line", EXAMPLES)
def test_the_examples_run(folder, monkeypatch, capsys, line):
    monkeypatch.setattr("sys.argv", shlex.split(line))
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    assert capsys.readouterr().err == ""
    if "--out" in line:
        scan = gonio.read(folder / shlex.split(line)[-1])
        peak = scan["brdf"].isel(direction=np.flatnonzero(scan["theta_i"].values == 30)).max().item()
        if not line.startswith("gonio import sheets"):
            assert peak == pytest.approx(0.417, abs=1e-4) or "flipped" in line


def test_the_python_examples_run(folder):
    frame = {"theta_i": [30.0, 30.0], "rotation": [-40.0, 30.0], "BRDF": [0.1, 0.2]}
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    names = {"gonio": gonio, "frame": frame}
    for line in code.splitlines():
        call = line.partition(" = ")[2].partition("  #")[0]
        names["scan"] = _called(call, names)
        assert names["scan"]["brdf"].size >= 2


def _called(call, names):
    return eval(call, names)


def test_the_names_of_the_table_are_understood():
    part = PAGE[PAGE.index("| NAME |") : PAGE.index("## A matrix")]
    rows = re.findall(r"^\| (`[a-z_`, ]+`) \|[^|]*\| (.*?) \|$", part, re.M)
    assert len(rows) > 8
    for names, headings in rows:
        targets = set(re.findall(r"`(\w+)`", names))
        for name in targets:
            assert target("A", name).name == name
        for heading in re.findall(r"`([^`]+)`", headings):
            assert parsed(heading).target in targets, heading
