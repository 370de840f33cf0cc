"""The Python and the commands of README and docs/results.md run as they are printed (F20)."""

import re
import shlex

import numpy as np
import pytest

from gonio import catalogue, simulate, write
from gonio.app.cli import main
from places import ROOT
from results.conftest import LORENTZ


def blocks(page, language):
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [block for of, block in found if of == language]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a scan.csv as the README has it."""
    monkeypatch.chdir(tmp_path)
    scan = simulate(catalogue["cauchy-lorentz"], LORENTZ, [10.0, 30.0, 50.0], np.arange(-80.0, 81, 5), noise=0.01)
    write(scan, tmp_path / "scan.csv")
    return tmp_path


def run(page):
    """Every block of Python of a page, one after the other, as a reader would type them."""
    code = "\n".join(blocks(page, "python"))
    namespace = {}
    exec(compile(code, page, "exec"), namespace)
    return namespace


def test_the_readme_runs(folder, capsys, monkeypatch):
    """Of a few models, as all take their time."""
    few = {name: catalogue[name] for name in ("lambert", "cauchy-lorentz")}
    monkeypatch.setattr("gonio.comparison.answer.everything", lambda: list(few.values()))
    found = run("README.md")
    assert "cauchy-lorentz" in capsys.readouterr().out
    assert (folder / "fit.png").stat().st_size > 1000
    assert np.isfinite(found["brdf"]).all()


def test_the_page_of_results_runs(folder, capsys, monkeypatch):
    found = run("docs/results.md")
    assert found["solution"].status == "converged"
    assert "ggx" in capsys.readouterr().out
    np.testing.assert_allclose(found["ratio"], 1.0, atol=0.1)
    assert {p.name for p in folder.iterdir()} >= {"residuals.png", "two-models.svg", "report.html", "solution.nc"}
    commands = [line for block in blocks("docs/results.md", "") for line in block.splitlines() if line]
    assert len(commands) == 7
    for command in commands:
        monkeypatch.setattr("sys.argv", shlex.split(command))
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0, command


def test_the_model_of_one_line_runs(folder, capsys):
    *_, one_line = blocks("docs/adding-a-model.md", "python")
    exec(compile(one_line, "docs/adding-a-model.md", "exec"), {})
    assert "lobe (lobe) fitted to a simulated scan: 58 points" in capsys.readouterr().out
