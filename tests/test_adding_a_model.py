"""The example of docs/adding-a-model.md, as a package of its own: found, evaluated, fitted and drawn."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from places import ROOT

PAGE = ROOT / "docs" / "adding-a-model.md"


@pytest.fixture
def package(tmp_path):
    """A folder with the example as a module and the entry point as an installed package would have it."""
    text = PAGE.read_text(encoding="utf-8")
    example, entry, *_ = re.findall(r"```(?:python|toml)\n(.*?)```", text, flags=re.DOTALL)
    assert sum(bool(line.strip()) for line in example.splitlines()) <= 20
    (tmp_path / "example_models.py").write_text(example, encoding="utf-8")
    information = tmp_path / "example-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: example\nVersion: 1.0\n", encoding="utf-8")
    group, name = re.fullmatch(r'\[project\.entry-points\."(.*)"\]\n(.*)\n', entry).groups()
    (information / "entry_points.txt").write_text(f"[{group}]\n{name.replace(chr(34), '')}\n", encoding="utf-8")
    return tmp_path


def run(package, *arguments):
    code = f"import sys; sys.path.insert(0, {str(package)!r}); from gonio.app.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)


def test_the_example_works_like_any_other_model(package, tmp_path):
    listed = json.loads(run(package, "models", "--json", "-").stdout)
    own = {model["name"]: model for model in listed}["rimmed"]
    assert own["equation"] == r"f = k_s\,f_s + k_r\,f_r + k_d\,f_d"
    assert (own["cite"], own["source"]) == ("example2026", None)
    found = run(package, "eval", "rimmed", "--set", "kr=1", "--at", "60,70,180", "--json", "-")
    cosines = np.cos(np.radians(60)) + np.cos(np.radians(70))
    assert json.loads(found.stdout)["values"] == pytest.approx([np.exp(-4 * cosines) / 4], rel=1e-12)
    scan = tmp_path / "scan.csv"
    rows = [f"40,{t},{0.1 + 0.3 * np.exp(-(((t - 40) / 15) ** 2)):.6f}" for t in range(-70, 71, 5)]
    scan.write_text("\n".join(["theta_i_deg,theta_r_deg,brdf_sr-1", *rows]) + "\n", encoding="utf-8")
    fitted = run(package, "fit", str(scan), "--model", "rimmed", "--json", "-")
    assert {"ks", "kr", "kd", "sigma", "p"} <= set(json.loads(fitted.stdout)["parameters"])


def test_a_package_that_cannot_be_loaded_is_named_and_the_rest_works(package):
    (package / "example_models.py").write_text("import nothing_of_that_name\n", encoding="utf-8")
    listed = run(package, "models", "--json", "-")
    assert listed.returncode == 0
    assert "ggx" in {model["name"] for model in json.loads(listed.stdout)}
    assert listed.stderr.startswith("gonio: the models of 'example_models' cannot be loaded")
    assert "nothing_of_that_name" in listed.stderr
    (package / "example_models.py").write_text("", encoding="utf-8")
    assert "declares no Model" in run(package, "models").stderr
    (package / "example_models.py").write_text("from gonio.models.lambert import lambert as again\n", encoding="utf-8")
    assert run(package, "models").stderr == ""


def test_a_second_model_of_a_name_does_not_replace_the_first(package):
    source = (package / "example_models.py").read_text(encoding="utf-8").replace('name="rimmed"', 'name="ggx"')
    (package / "example_models.py").write_text(source, encoding="utf-8")
    listed = run(package, "models", "ggx")
    assert "second model 'ggx'" in listed.stderr
    assert "Smith" in listed.stdout
