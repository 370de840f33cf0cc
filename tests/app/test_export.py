"""`gonio export` as people use it: models, fits and scans, files that are there, and what is refused."""

import json
import math
from pathlib import Path

import pytest

import gonio
from gonio.exporting import targets
from gonio.exporting.entry import chosen
from gonio.exporting.target import Target


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fit")
    gonio.write(gonio.sample("coating"), folder / "coating.csv")
    gonio.fit(gonio.sample("coating"), "ggx").save(folder / "solution.nc")
    return folder


def test_every_target_is_declared_whole():
    for name, target in targets().items():
        assert isinstance(target, Target)
        assert (target.name, bool(target.title), bool(target.writes)) == (name, True, True)
        assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in target.suffixes)


def test_a_model_with_a_proof(run, tmp_path):
    file = tmp_path / "half.py"
    code, out, _ = run("export", "lambert", "--set", "rho=0.5", "--to", "python", "--out", file, "--check")
    assert code == 0
    assert "checked: run in Python; largest relative error 0, allowed 1e-12" in out
    module: dict = {}
    exec(file.read_text(), module)
    assert module["lambert"]((0, 0, 1), (0.6, 0, 0.8)) == pytest.approx(0.5 / math.pi, rel=1e-15)
    assert module["lambert"]((0, 0, 1), (0.6, 0, -0.8)) == 0
    assert "import gonio" not in file.read_text()


def test_a_fit_is_called_as_its_file(run, results, tmp_path):
    file = tmp_path / "my coating.h"
    _, out, _ = run("export", results, "--to", "c", "--out", file, "--json", "-")
    record = json.loads(out)
    assert record["target"] == "c"
    assert record["files"] == [str(file)]
    assert "double my_coating(const double w_i[3], const double w_r[3])" in file.read_text()


def test_a_scan_is_fitted_first(run, results, tmp_path):
    words = ("export", results / "coating.csv", "--model", "ggx", "--to", "numpy", "--out", tmp_path / "c.py")
    assert "ggx fitted to 196 points, coating.csv" in " ".join(run(*words)[1].split())


def test_a_file_that_exists_stays(run, tmp_path):
    file = tmp_path / "half.h"
    file.write_text("mine")
    words = ("export", "lambert", "--set", "rho=0.5", "--to", "c", "--out", file)
    code, _, err = run(*words)
    assert code == 1
    assert "--force to overwrite it" in err
    assert file.read_text() == "mine"
    assert run(*words, "--force")[0] == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("lambert --to c --out x.h", "give at least one weight, as in --set rho=0.5"),
        ("lambret --to c --out x.h", "no model of that name; nearest: lambert"),
        ("lambert --set rho=0.5 --to cc --out x.h", "no target is called 'cc'"),
        ("lambert --set rho=0.5 --to c --out x.py", "a file for C is called x.h"),
        ("lambert --set rho=0.5 --scale 2 --to c --out x.h", "leave it out"),
        ("lambert --set rho=0.5 --out x.xyz", "name one by --to"),
        ("cauchy-lorentz --published Al --to c --out x.h", "choose one by --select theta_i=40"),
        ("cauchy-lorentz --published Al --select theta_i=40 --to c --out x.h", "give --scale VALUE"),
        ("ggx --published Al --to c --out x.h", "belong to cauchy-lorentz, not to ggx"),
    ],
)
def test_refusals_are_one_line_with_the_remedy(run, words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = run("export", *words.split())
    assert code == 1
    assert said in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_published_values_of_relative_data(run, tmp_path):
    file = tmp_path / "al.py"
    words = [
        "export",
        "cauchy-lorentz",
        "--published",
        "Al",
        "--select",
        "theta_i=40",
        "--scale",
        "1e-3",
        "--to",
        "numpy",
        "--check",
        "--out",
    ]
    assert run(*words, file)[0] == 0
    assert "0.001 1/sr for a unit of the values" in " ".join(file.read_text().split())


@pytest.mark.parametrize(("to", "suffix"), [("c", ".h"), ("python", ".py"), ("javascript", ".js"), ("numpy", ".py")])
def test_hostile_text_ends_no_comment(run, results, tmp_path, to, suffix):
    """A file may be called anything."""
    hostile = tmp_path / "x*\\\"\"\"'''\n?>--].nc"
    hostile.write_bytes((results / "solution.nc").read_bytes())
    code, out, err = run("export", hostile, "--to", to, "--out", tmp_path / f"{to}{suffix}", "--check")
    assert (code, err) == (0, "")
    assert "checked: " in out


def test_the_suffix_says_the_target_where_one_has_it():
    assert chosen("", Path("x.js")).name == "javascript"
