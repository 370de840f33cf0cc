"""The command line as people and programs use it."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gonio import catalogue, join, published, simulate, write
from gonio.fitting import Solution
from gonio.measured.instrument import Instrument

SCRIPT = Path(sys.executable).with_name("gonio")


@pytest.fixture
def scan_file(tmp_path):
    surface = published["Al"]
    scan = simulate(
        catalogue[surface.model], surface.values, [30.0, 40, 50], np.arange(-80, 81, 4.0), noise=0.01, unit="a.u."
    )
    path = tmp_path / "al.csv"
    write(scan, path)
    return path


def as_json(run, *arguments):
    code, out, err = run(*arguments, "--json", "-")
    assert code == 0, err
    return json.loads(out)


def test_models_json(run):
    listed = as_json(run, "models")
    assert [m["name"] for m in listed] == sorted(catalogue)
    lorentz = next(m for m in listed if m["name"] == "cauchy-lorentz")
    assert set(lorentz) == {
        *("name", "title", "cite", "source", "confidence", "equation", "equations", "weights", "shape", "violates")
    }
    assert lorentz["source"]["doi"] == "10.3390/photonics10070773"
    assert lorentz["source"]["title"].startswith("A Modified BRDF Model")
    assert lorentz["equations"]["kdd"] == [r"f_{dd} = \frac{1}{\pi}\,\frac{\gamma}{\theta_r^2 + \gamma^2}"]
    assert lorentz["weights"] == ["ks", "kdd", "kid"]
    assert lorentz["shape"][1] == {
        "name": "gamma",
        "default": 45.0,
        "lower": 1.0,
        "upper": 720.0,
        "unit": "deg",
        "help": "half width at half maximum of the directional-diffuse lobe",
    }
    assert "reciprocity" in lorentz["violates"]
    assert as_json(run, "models", "cauchy-lorentz") == [lorentz]


def test_eval_json(run):
    found = as_json(
        run, "eval", "torrance-sparrow", "--at", "30,30,180;40,20,180", "--set", "ks=397", "--set", "sigma=0.142"
    )
    np.testing.assert_allclose(found["values"], [397 * 2.63101, 397 * 1.34808], rtol=5e-6)
    assert found["unit"] == "1/sr"
    paper = as_json(run, "eval", "cauchy-lorentz", "--at", "40,40,180", "--published", "Al")
    assert paper["unit"] == "a.u."
    assert paper["values"][0] == pytest.approx(1659, abs=0.5)
    in_plane = as_json(run, "eval", "cauchy-lorentz", "--at", "40,-20;40,20,0", "--published", "Al")
    assert in_plane["values"][0] == pytest.approx(in_plane["values"][1])


def test_eval_of_polarised_light(run):
    """Element 00 is the BRDF; unpolarised light leaves with the first column; DoLP and AoLP follow from it."""
    at = ("eval", "priest-mueller", "--set", "ks=1", "--at", "50,35,120")
    plain = as_json(run, *at)
    assert plain["values"] == [plain["mueller"][0][0][0]]
    assert "stokes" not in plain
    light = as_json(run, *at, "--stokes", "1,0,0,0")
    assert light["stokes"][0] == [row[0] for row in plain["mueller"][0]]
    q, u = light["stokes"][0][1:3]
    assert light["dolp"][0] == pytest.approx(np.hypot(q, u) / light["values"][0])
    assert light["aolp_deg"][0] == pytest.approx(np.degrees(np.arctan2(u, q)) / 2)
    _, out, _ = run(*at, "--stokes", "1,0,0,0")
    assert "DoLP" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    _, out, _ = run("eval", "ggx", "--set", "rho_s=1", "--at", "50,35,120")
    assert "theta_i [deg]" in out


def test_check_by_samples(run):
    """Where a lobe is too narrow for the quadrature, drawn directions tell its reflectance."""
    narrow = ("check", "torrance-sparrow", "--set", "ks=1", "--set", "sigma=0.001")
    by_nodes = as_json(run, *narrow)[-1]["figures"]["DHR(30)"]
    assert abs(by_nodes - 1) > 0.05
    sampled = as_json(run, *narrow, "--samples", "2000")[-1]
    assert sampled["holds"] is True
    assert sampled["figures"]["DHR(30)"] == pytest.approx(1, abs=1e-4)  # five standard errors
    assert "standard error" in sampled["why"]
    beyond = as_json(run, "check", "lambert", "--set", "rho=1.1", "--samples", "500")[-1]
    assert beyond["holds"] is False


def test_materials(run, tmp_path):
    """Constants by name or file, listed and held where a model has an index."""
    listed = as_json(run, "materials")
    gold = next(m for m in listed if m["name"] == "gold")
    assert gold["cite"] == "johnson1972"
    at = gold["wavelength_um"].index(0.6328)
    code, out, _ = run("materials")
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "reflectance" in run("materials", "gold")[1]
    named = as_json(
        run, "eval", "ggx", "--set", "rho_s=1", "--at", "30,40", "--material", "gold", "--wavelength", "632.8"
    )
    by_hand = ("--set", f"index={gold['n'][at]}", "--set", f"extinction={gold['k'][at]}")
    assert named["values"] == as_json(run, "eval", "ggx", "--set", "rho_s=1", "--at", "30,40", *by_hand)["values"]
    glass = tmp_path / "glass.csv"
    glass.write_text("wavelength_nm,n\n500,1.52\n700,1.51\n")
    found = as_json(run, "eval", "ggx", "--set", "rho_s=1", "--at", "0,0", "--material", glass, "--wavelength", "600")
    halfway = as_json(run, "eval", "ggx", "--set", "rho_s=1", "--at", "0,0", "--set", "index=1.515")
    assert found["values"] == pytest.approx(halfway["values"], rel=1e-12)


def test_fit_at_a_materials_constants(run, tmp_path):
    """Each wavelength of a scan has its own constants; a scan that names none needs --wavelength."""
    path = tmp_path / "gold.csv"
    rows = [f"{w},30,{t},{0.1 + np.exp(-(((t - 30) / 20) ** 2)):.5f}" for w in (532, 1064) for t in range(-60, 61, 10)]
    path.write_text("\n".join(["wavelength_nm,theta_i_deg,theta_r_deg,brdf_sr-1", *rows]) + "\n")
    found = as_json(run, "fit", path, "--model", "ggx", "--material", "gold")["parameters"]["extinction"]
    assert found["held"]
    assert found["by"] == "wavelength"
    assert {w: v["value"] for w, v in found["values"].items()} == {"532": 2.231, "1064": 6.965}
    one = as_json(run, "fit", path, "--model", "ggx", "--material", "gold", "--select", "wavelength=1064")
    assert one["parameters"]["index"]["value"] == 0.2585
    ranked = as_json(run, "compare", path, "--models", "lambert,ggx", "--material", "gold")
    assert {row["model"] for row in ranked[0]["ranking"]} == {"lambert", "ggx"}
    plain = tmp_path / "plain.csv"
    plain.write_text("\n".join(["theta_i_deg,theta_r_deg,brdf_sr-1", *(r.split(",", 1)[1] for r in rows[:13])]) + "\n")
    code, _, err = run("fit", plain, "--model", "ggx", "--material", "gold")
    assert code == 1
    assert "needs --wavelength" in err
    code, _, err = run("fit", path, "--model", "ggx", "--material", "gold", "--hold", "index=1")
    assert code == 1
    assert "leave it out of --hold" in err


@pytest.mark.parametrize("figure", ["curves", "hemisphere", "dolp"])
def test_draw(run, tmp_path, figure):
    target = tmp_path / "drawn"
    code, out, _ = run("draw", "wellems", "--set", "ks=1", "--figure", figure, "--theta-i", "20,50", "--out", target)
    assert code == 0
    assert {p.suffix for p in tmp_path.iterdir()} == {".png", ".svg"}
    assert "wrote" in out
    assert run("draw", "wellems", "--set", "ks=1", "--figure", figure, "--out", target)[0] == 1


def test_one_model_in_full(run):
    """Equation, parameters and physics as computed, in eighty columns."""
    for name in ("cauchy-lorentz", "disney", "ross-li", "priest-mueller", "sgd"):
        code, out, _ = run("models", name)
        assert code == 0
        assert all(len(line) <= 80 for line in out.splitlines()), name
        assert catalogue[name].confidence in out
        assert catalogue[name].source.title in " ".join(out.split())
        assert f"docs/models/{name}.md" in out
        assert all(parameter in out for parameter in catalogue[name].parameters)
        assert "reflectance" in out
    assert "gamma / (math.pi * (g.theta_r_squared + gamma**2))" in run("models", "cauchy-lorentz")[1]
    assert "worst ln ratio" in run("models", "cauchy-lorentz")[1]


def test_fit_json(run, scan_file):
    found = as_json(run, "fit", scan_file, "--model", "cauchy-lorentz", "--group", "ks=theta_i")
    assert {"model", "solver", "status", "seconds", "parameters", "metrics"} <= set(found)
    assert set(found["metrics"]) == {"delta", "E", "nrmse", "log10_rmse"}
    ks = found["parameters"]["ks"]
    assert ks["by"] == "theta_i"
    assert set(ks["values"]) == {"30", "40", "50"}
    assert ks["values"]["30"]["value"] == pytest.approx(397, rel=0.03)
    assert ks["values"]["30"]["uncertainty"] > 0
    assert found["parameters"]["gamma"]["unit"] == "deg"
    assert found["status"] == "converged"


def test_fit_options(run, scan_file):
    common = ("fit", scan_file, "--model", "cauchy-lorentz", "--group", "ks=theta_i")
    held = as_json(run, *common, "--hold", "sigma=0.142", "--hold", "gamma=half-width", "--weighting", "relative")
    assert held["parameters"]["gamma"]["value"] == pytest.approx(47, abs=3)
    assert held["parameters"]["gamma"]["held"] is True
    assert held["parameters"]["gamma"]["uncertainty"] is None
    settings = ("--solver", "anneal", "--seed", "7", "--setting", "max_iterations=400", "--setting", "chains=2")
    annealed = as_json(run, *common, *settings)
    assert annealed["solver"] == "anneal"
    assert annealed["metrics"]["E"] >= held["metrics"]["E"] / 10
    assert as_json(run, *common, *settings)["parameters"] == annealed["parameters"]
    bounded = as_json(run, *common, "--bound", "gamma=10:20", "--blocked", "6", "--floor", "100")
    assert 10 <= bounded["parameters"]["gamma"]["value"] <= 20
    assert bounded["points"] < held["points"]


def test_fit_writes_its_results(run, scan_file, tmp_path):
    out = tmp_path / "results"
    command = ("fit", scan_file, "--model", "cauchy-lorentz", "--group", "ks=theta_i", "--out", out)
    code, text, _ = run(*command, "--solver", "anneal", "--setting", "max_iterations=300")
    assert code == 0
    assert "results" in text
    names = {path.name for path in out.iterdir()}
    kinds = ("curves", "residuals", "components", "convergence")
    assert names == {"solution.nc", "fit.json", "report.html"} | {f"{k}.{s}" for k in kinds for s in ("png", "svg")}
    code, _, err = run(*command)
    assert code == 1
    assert "--force" in err
    assert run(*command, "--force")[0] == 0


@pytest.fixture
def calibrated_file(tmp_path):
    """A scan in 1/sr whose uncertainty has a random and a systematic part."""
    values = {"ks": 0.3, "kd": 0.05, "sigma": 0.2}
    scan = simulate(catalogue["torrance-sparrow"], values, [10.0, 40], np.arange(-75, 76, 5.0), noise=0.02, seed=1)
    scan["uncertainty_systematic"] = ("direction", 0.03 * scan["brdf"].values, {"units": "sr-1"})
    path = tmp_path / "calibrated.csv"
    write(scan, path)
    return path


def test_fit_says_how_sure_it_is(run, calibrated_file, tmp_path):
    """Every question about uncertainty at once, in JSON, in tables and in the written files."""
    out = tmp_path / "results"
    questions = ("--bootstrap", "30", "--resample", "pairs", "--seed", "4", "--profile", "sigma,kd", "--derived")
    common = ("fit", calibrated_file, "--model", "torrance-sparrow", "--covariance", "absolute")
    found = as_json(run, *common, *questions)
    assert found["covariance"] == "absolute"
    kd = found["parameters"]["kd"]
    assert kd["uncertainty_systematic"] == pytest.approx(0.03 * kd["value"], rel=1e-4)
    low, high = found["intervals"]["kd"]
    both = math.hypot(kd["uncertainty"], kd["uncertainty_systematic"])
    assert (high - low) / 2 == pytest.approx(1.96 * both, rel=1e-4)
    assert found["intervals"]["level"] == 0.95
    drawn = found["bootstrap"]
    assert (drawn["kind"], drawn["draws"], drawn["seed"]) == ("pairs", 30, 4)
    assert set(drawn["parameters"]["sigma"]) == {"standard_deviation", "percentile", "bca"}
    assert set(found["profiles"]) == {"sigma", "kd"}
    one = found["profiles"]["sigma"]
    assert one["lower"] < found["parameters"]["sigma"]["value"] < one["upper"]
    assert len(one["at"]) == len(one["rise"])
    assert "; the data allow sigma from" in found["verdicts"]["sigma"]["words"]
    albedo = next(n for n in found["derived"] if n["name"] == "albedo")
    assert albedo["systematic"] == pytest.approx(0.03 * albedo["value"], rel=1e-4)
    code, text, _ = run(*common, *questions, "--out", out)
    assert code == 0
    for part in ("absolute covariance", "random ± systematic", "bootstrap of pairs", "profile likelihood", "albedo"):
        assert part in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    assert {"profiles.png", "profiles.svg"} <= {path.name for path in out.iterdir()}
    assert json.loads((out / "fit.json").read_text())["bootstrap"] == drawn
    assert Solution.load(out / "solution.nc").dataset.sizes["draw"] == 30


def test_grouped_values_are_profiled_together(run, scan_file):
    """A grouped parameter stands for all of its groups; without questions the answers are not in the record."""
    common = ("fit", scan_file, "--model", "cauchy-lorentz", "--group", "ks=theta_i", "--hold", "gamma=47")
    assert list(as_json(run, *common, "--profile", "ks,kid")["profiles"]) == ["ks[30]", "ks[40]", "ks[50]", "kid"]
    plain = as_json(run, *common)
    assert not {"bootstrap", "profiles", "derived"} & set(plain)
    assert plain["covariance"] == "robust"
    relative = run(*common, "--derived")[1]
    assert "no reflectance at theta_i 30, 40, 50 deg, albedo: the data are relative" in " ".join(relative.split())


def test_compare_json(run, scan_file):
    names = "torrance-sparrow,wang-2016,cauchy-lorentz"
    (found,) = as_json(run, "compare", scan_file, "--models", names, "--group", "ks=theta_i")
    assert found["scan"] == str(scan_file)
    assert {row["model"] for row in found["ranking"]} == set(names.split(","))
    assert found["ranking"][-1]["model"] == "torrance-sparrow"
    assert found["ranking"][-1]["free_parameters"] == 5
    assert set(found["ranking"][0]["metrics"]) == {"delta", "E", "nrmse", "log10_rmse"}


def test_compare_by_what_is_left_out(run, scan_file):
    """Ranking rows say what was predicted where nothing was shown."""
    names = ("compare", scan_file, "--models", "lambert,torrance-sparrow,cauchy-lorentz", "--validate", "theta_i")
    ranking = as_json(run, *names)[0]["ranking"]
    errors = [row["validated"]["log10_rmse"] for row in ranking]
    assert errors == sorted(errors)
    assert all(set(row["validated"]) == {"delta", "log10_rmse", "E"} for row in ranking)
    assert all(row["aicc"] < row["bic"] + 100 and set(row["by_fold"]) for row in ranking)
    _, out, _ = run(*names)
    assert "left out" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    code, _, err = run(*names, "--group", "ks=theta_i")
    assert code == 1
    assert "do not group ks" in err


def test_info_json(run, scan_file):
    found = as_json(run, "info", scan_file)
    assert found["format"] == "tidy CSV"
    assert found["quantity"] == "relative BRDF"
    assert found["points"] == 123
    assert found["symmetry"] == "in plane"
    assert found["theta_i"] == [30, 40, 50]
    assert len(found["half_widths"]) == 3


def test_check(run, scan_file):
    found = as_json(run, "check", "cauchy-lorentz")
    assert {(v["checked"], v["law"]): v["holds"] for v in found}["cauchy-lorentz, kdd = 1", "reciprocity"] is False
    code, out, _ = run("check", scan_file)
    assert code == 0
    assert "relative" in out
    code, _, err = run("check", "cauchy-lorenz")
    assert code == 1
    assert "nearest: cauchy-lorentz" in err


@pytest.mark.parametrize("figure", ["curves", "residuals", "components", "hemisphere", "errors"])
def test_plot(run, scan_file, tmp_path, figure):
    target = tmp_path / "figure.png"
    code, _out, err = run("plot", scan_file, "--figure", figure, "--models", "lambert,cauchy-lorentz", "--out", target)
    assert code == 0, err
    assert target.stat().st_size > 10_000
    assert not target.with_suffix(".svg").exists()


def test_json_to_a_file(run, tmp_path):
    target = tmp_path / "models.json"
    code, out, _ = run("models", "--json", target)
    assert code == 0
    assert "cauchy-lorentz" in out
    assert [m["name"] for m in json.loads(target.read_text())] == sorted(catalogue)


def test_tables_fit_eighty_columns(run, scan_file):
    commands = [
        ("models",),
        ("models", "cauchy-lorentz"),
        ("eval", "cauchy-lorentz", "--at", "40,40,180", "--published", "Al"),
        ("fit", scan_file, "--model", "cauchy-lorentz", "--group", "ks=theta_i", "--hold", "sigma=0.142"),
        ("compare", scan_file, "--by-incidence"),
        ("info", scan_file),
    ]
    for command in commands:
        code, out, _ = run(*command)
        assert code == 0
        assert "…" not in out, command
        assert max(len(line.rstrip()) for line in out.splitlines()) <= 80, command


GOOD = "theta_i_deg,theta_r_deg,brdf_sr-1\n30,-10,0.5\n30,20,0.7\n"
BAD_FILES = {
    "wrong header": (b"a,b,c\n1,2,3\n", "line 1"),
    "text": ((GOOD + "30,30,bright\n").encode(), "line 4"),
    "beyond 90": ((GOOD + "30,95,1\n").encode(), "line 4"),
    "all zero": (GOOD.replace("0.5", "0").replace("0.7", "0").encode(), "line 2"),
    "empty": (b"", "is empty"),
    "not UTF-8": (GOOD.encode() + b"\xff\xfe", "line 4"),
    "one infinite": ((GOOD + "30,30,inf\n").encode(), "line 4"),
}


@pytest.mark.parametrize("case", [*BAD_FILES, "directory", "missing", "garbage"])
@pytest.mark.parametrize("command", ["info", "fit", "compare", "plot"])
def test_bad_input_is_one_line_and_exit_code_1(run, tmp_path, monkeypatch, case, command):
    folder = tmp_path / "data"
    folder.mkdir()
    path = folder / "scan.csv"
    if case == "directory":
        path.mkdir()
    elif case == "garbage":
        with path.open("wb") as file:
            file.truncate(2 * 1024**3)
    elif case != "missing":
        path.write_bytes(BAD_FILES[case][0])
    elsewhere = tmp_path / "cwd"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    extra = {"fit": ("--model", "lambert", "--out", "results"), "plot": ("--out", "figure")}.get(command, ())
    code, out, err = run(command, path, *extra)
    assert code == 1
    assert out == ""
    assert err.startswith(f"gonio: {path}")
    assert err.count("\n") == 1
    assert BAD_FILES.get(case, (b"", ""))[1] in err
    assert list(elsewhere.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("models", "cauchy-lorenz"), "nearest: cauchy-lorentz"),
        (("eval", "lambert", "--at", "30"), "theta_i,theta_r,phi"),
        (("eval", "lambert", "--at", "30,x,0"), "not a number"),
        (("eval", "lambert", "--at", "95,0,0"), "outside 0 to 90 deg"),
        (("eval", "lambert", "--at", ";"), "names no direction"),
        (("eval", "lambert", "--at", "30,30,180"), "at least one weight: rho"),
        (("eval", "lambert", "--at", "30,30,180", "--set", "rho"), "name=value"),
        (("eval", "lambert", "--at", "30,30,180", "--set", "rho=nan"), "finite"),
        (("eval", "lambert", "--at", "30,30,180", "--published", "Al"), "belong to cauchy-lorentz"),
        (("eval", "ggx", "--at", "30,30,180", "--set", "rho_s=1", "--stokes", "1,0,0,0"), "no Mueller terms"),
        (("eval", "wellems", "--at", "30,30,180", "--set", "ks=1", "--stokes", "1,1,1,0"), "no light has"),
        (("eval", "ggx", "--at", "3,3,0", "--set", "rho_s=1", "--material", "gold"), "needs --wavelength in nm"),
        (("materials", "golf"), "nearest: gold"),
        (("draw", "ggx", "--set", "rho_s=1", "--figure", "dolp"), "no Mueller terms"),
        (("draw", "ggx", "--set", "rho_s=1", "--theta-i", "95"), "from 0 to below 90"),
        (("draw", "ggx", "--set", "rho_s=1", "--figure", "hemisphere", "--theta-i", "1,2,3,4,5"), "room for 4"),
        (("fit", "SCAN", "--model", "lambert", "--solver", "guess"), "projection, anneal"),
        (("fit", "SCAN", "--model", "lambert", "--setting", "speed=1"), "no setting 'speed'"),
        (("fit", "SCAN", "--model", "lambert", "--select", "channel=R"), "no coordinate 'channel'"),
        (("fit", "SCAN", "--model", "lambert", "--bound", "rho=1"), "lower:upper"),
        (("fit", "SCAN", "--model", "lambert", "--weighting", "loud"), "uniform, relative"),
        (("compare", "SCAN", "--workers", "-1"), "--workers is -1: give 0 or more"),
        (("fit", "SCAN", "--model", "lambert", "--covariance", "bayes"), "robust, scaled, absolute"),
        (("fit", "SCAN", "--model", "lambert", "--bootstrap", "3"), "at least 20"),
        (("fit", "SCAN", "--model", "lambert", "--bootstrap", "50", "--resample", "x"), "residual, pairs"),
        (("fit", "SCAN", "--model", "lambert", "--profile", "gamma"), "there are rho"),
        (("plot", "SCAN", "--models", "lambert", "--band", "--normalised"), "leave out --band"),
        (("fit", "SCAN", "--model", "lambert", "--loss", "huber", "--covariance", "scaled"), "choose robust"),
        (("fit", "SCAN", "--model", "lambert", "--loss", "huber", "--bootstrap", "50"), "this is a huber loss"),
        (("fit", "SCAN", "--model", "lambert", "--loss", "huber", "--profile", "rho"), "this is a huber loss"),
        (("compare", "SCAN", "--rank", "r2"), "delta, E, nrmse, log10_rmse"),
        (("plot", "SCAN", "--figure", "convergence"), "--solver anneal"),
    ],
)
def test_bad_arguments_are_one_line(run, scan_file, arguments, message):
    code, _out, err = run(*(scan_file if a == "SCAN" else a for a in arguments))
    assert code == 1
    assert message in err
    assert err.count("\n") == 1
    assert "Traceback" not in err


def test_a_half_width_that_cannot_be_read(run, tmp_path):
    path = tmp_path / "forward.csv"
    path.write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n" + "".join(f"30,{t},1\n40,{t},1\n" for t in range(0, 60, 5)))
    code, _, err = run("fit", path, "--model", "cauchy-lorentz", "--hold", "gamma=half-width")
    assert code == 1
    assert "no half width can be read" in err


def test_warnings_go_to_standard_error(run, tmp_path):
    path = tmp_path / "one.csv"
    path.write_text(GOOD)
    code, out, err = run("compare", path, "--models", "lambert", "--json", "-")
    assert code == 0
    json.loads(out)
    assert "one incidence angle only" in err


def test_the_installed_script(tmp_path):
    """What a user gets: the console script of the wheel, from another folder."""
    environment = os.environ | {"COLUMNS": "80"}
    done = subprocess.run([SCRIPT, "--help"], capture_output=True, text=True, cwd=tmp_path, env=environment, check=True)
    for command in ("models", "eval", "draw", "fit", "compare", "plot", "info", "check", "demo"):
        assert command in done.stdout
    failed = subprocess.run([SCRIPT, "info", "missing.csv"], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert failed.returncode == 1
    assert failed.stderr == "gonio: missing.csv: there is no such file\n"


def test_starting_imports_next_to_nothing():
    """`import gonio` and `gonio --help` load no numerical library: that is what keeps them fast."""
    heavy = "{'numpy', 'scipy', 'xarray', 'pandas', 'matplotlib', 'jax'} & set(sys.modules)"
    for module in ("gonio", "gonio.app.cli"):
        code = f"import sys, {module}; print({heavy} or 'none')"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "none\n", module


@pytest.fixture
def spectrum_file(tmp_path):
    """Torrance-Sparrow at eight wavelengths, its slope a parabola of them."""
    x = np.linspace(0, 1, 8)
    values = {"ks": 0.5, "kd": 0.1}
    theta_r = np.arange(-70, 71, 10.0)
    parts = {
        f"{at:g}": simulate(
            catalogue["torrance-sparrow"],
            values | {"sigma": 0.2 + 0.2 * at * (1 - at)},
            [20.0, 50.0],
            theta_r,
            noise=0.05,
            seed=int(100 * at),
            wavelength=400 + 350 * at,
        )
        for at in x
    }
    path = tmp_path / "spectrum.csv"
    write(join(parts).drop_vars("scan"), path)
    return path


def test_smooth_fit(run, spectrum_file, tmp_path):
    """Strength chosen or given, said in the table and in JSON; the figure of spectra comes with --out."""
    at = ("fit", spectrum_file, "--model", "torrance-sparrow")
    written = tmp_path / "fit.json"
    code, out, err = run(*at, "--smooth", "sigma=wavelength", "--out", tmp_path / "fit", "--json", written)
    assert code == 0, err
    found = json.loads(written.read_text(encoding="utf-8"))
    assert found["smooth"]["sigma"]["by"] == "wavelength"
    assert found["smooth"]["sigma"]["scale"] == pytest.approx(0.23, abs=0.03)
    assert 18 < found["effective_values"] < 24
    sigma = found["parameters"]["sigma"]
    assert sigma["by"] == "wavelength"
    assert list(sigma["values"])[::7] == ["400", "750"]
    assert (tmp_path / "fit" / "spectra.png").exists()
    assert "sigma is smooth over wavelength, strength" in out
    assert "of 24 values" in out
    heading = next(line for line in out.splitlines() if line.strip().startswith("wavelength [nm]"))
    assert heading.split() == ["wavelength", "[nm]", "ks", "kd", "[sr⁻¹]", "sigma"]
    assert all(len(line) <= 80 for line in out.splitlines())
    assert as_json(run, *at, "--smooth", "sigma=wavelength:1e-4")["smooth"]["sigma"]["strength"] == 1e-4
    for wrong in ("sigma", "sigma=wavelength:x", "sigma=wavelength:1:2:3", "sigma=channel"):
        code, out, err = run(*at, "--smooth", wrong)
        assert code != 0
        assert err.startswith("gonio: ")


def test_joint_fit(run, tmp_path):
    """Weights one a scan, the shape shared unless grouped; several scans without --joint are refused."""
    files = []
    for name, slope in (("dull", 0.3), ("bright", 0.1)):
        files.append(tmp_path / f"{name}.csv")
        values = {"ks": slope * 2, "kd": 0.1, "sigma": slope}
        write(simulate(catalogue["torrance-sparrow"], values, [20.0, 50.0], np.arange(-70, 71, 5.0)), files[-1])
    at = ("fit", *files, "--model", "torrance-sparrow")
    code, out, err = run(*at)
    assert code != 0
    assert "2 scans are given: add --joint" in err
    found = as_json(run, *at, "--joint", "--group", "sigma=scan", "--share", "kd")["parameters"]
    assert found["sigma"]["by"] == found["ks"]["by"] == "scan"
    assert found["sigma"]["values"]["dull"]["value"] == pytest.approx(0.3, rel=1e-6)
    assert found["ks"]["values"]["bright"]["value"] == pytest.approx(0.2, rel=1e-6)
    assert found["kd"]["value"] == pytest.approx(0.1, rel=1e-6)
    shared = as_json(run, *at, "--joint")
    assert 0.1 < shared["parameters"]["sigma"]["value"] < 0.3
    assert shared["points"] == 116
    code, out, err = run(*at, "--joint")
    assert "fitted to 2 scans jointly" in out
    assert "ks[dull]" in out
    code, out, err = run("fit", files[0], files[0], "--model", "lambert", "--joint")
    assert "given twice" in err
    other = tmp_path / "again" / "dull.csv"
    other.parent.mkdir()
    other.write_text(files[0].read_text(encoding="utf-8"), encoding="utf-8")
    named = as_json(run, "fit", files[0], other, "--model", "lambert", "--joint")["parameters"]["rho"]["values"]
    assert sorted(named) == sorted([str(files[0]), str(other)])


def test_an_instrument_is_folded_in(run, tmp_path):
    """In the fit, in its JSON and the ranking's, in the figure; and a step too coarse is told with its remedy."""
    seen = Instrument(detector_half_angle=2.0, step=0.2)
    truth = {"ks": 0.3, "kd": 0.05, "sigma": 0.02}
    path = tmp_path / "narrow.csv"
    write(simulate(catalogue["torrance-sparrow"], truth, [10.0, 40], np.arange(-20, 81.0), instrument=seen), path)
    cones = ("--detector-half-angle", 2, "--weighting", "relative")
    record = as_json(run, "fit", path, "--model", "torrance-sparrow", *cones)
    assert record["instrument"] | {"error": 0} == {
        "source_half_angle": 0,
        "detector_half_angle": 2,
        "step": 0.5,
        "error": 0,
    }
    assert record["parameters"]["sigma"]["value"] == pytest.approx(0.02, rel=1e-3)
    assert record["metrics"]["delta"] < 1e-3
    blind = as_json(run, "fit", path, "--model", "torrance-sparrow", *cones[2:])
    assert blind["parameters"]["sigma"]["value"] > 0.021
    (ranked,) = as_json(run, "compare", path, "--models", "torrance-sparrow", *cones)
    assert ranked["ranking"][0]["instrument"]["detector_half_angle"] == 2
    code, out, _ = run("fit", path, "--model", "torrance-sparrow", *cones, "--cone-step", 2)
    assert code == 0
    assert "folded in, half-angle of detector 2 deg" in out.replace("\n", " ")
    assert "add --cone-step 0.5" in out.replace("\n", " ")
    assert run("plot", path, "--models", "torrance-sparrow", *cones, "--out", tmp_path / "f.png")[0] == 0
    code, _, err = run("fit", path, "--model", "ggx", "--source-half-angle", 45)
    assert code != 0
    assert "--source-half-angle is 45: give a number from 0 to 30" in err


def test_a_noise_floor_keeps_negative_values(run, tmp_path):
    path = tmp_path / "dark.csv"
    path.write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n10,0,0.3\n10,20,0.28\n10,40,-0.01\n", encoding="utf-8")
    command = ("fit", path, "--model", "lambert", "--weighting", "relative")
    assert "--noise-floor" in run(*command)[2]
    assert as_json(run, *command, "--noise-floor", 0.1)["noise_floor"] == 0.1


def test_outliers_are_listed_and_a_robust_loss_lets_them_go(run, tmp_path):
    truth = {"ks": 0.3, "kd": 0.02, "sigma": 0.15}
    scan = simulate(catalogue["torrance-sparrow"], truth, [10.0, 40], np.arange(-70, 71, 5.0), noise=0.01)
    scan["brdf"].values[[3, 25, 40]] *= 3
    path = tmp_path / "wrong.csv"
    write(scan, path)
    command = ("fit", path, "--model", "torrance-sparrow", "--weighting", "uncertainty")
    record = as_json(run, *command, "--loss", "cauchy")
    assert record["loss"]["name"] == "cauchy"
    assert record["loss"]["points_discounted"] == pytest.approx(3, abs=2)
    assert record["parameters"]["kd"]["value"] == pytest.approx(0.02, rel=0.01)
    plain = as_json(run, *command)
    assert plain["loss"] == {"name": "squared", "scale": None, "points_discounted": 0}
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(plain["outliers"]["points"]) == 3
    for point in plain["outliers"]["points"]:
        row = [float(cell) for cell in lines[point["line"] - 1].split(",")[:3]]
        assert row[0] == point["theta_i"]
        assert abs(row[1]) == point["theta_r"]
        assert point["brdf"] in [float(value) for value in lines[point["line"] - 1].split(",")]
    shown = " ".join(run(*command)[1].split())
    assert "outliers: " in shown
    assert "fit with --loss cauchy" in shown
    assert "points count for less than half" in " ".join(run(*command, "--loss", "huber")[1].split())
    code, _, err = run(*command, "--loss", "l1")
    assert code != 0
    assert "no loss 'l1': choose one of squared, huber, cauchy" in err
    clean = simulate(catalogue["torrance-sparrow"], truth, [10.0, 40], np.arange(-70, 71, 5.0), noise=0.01)
    write(clean, path, force=True)
    assert "outliers" not in run(*command)[1]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("eval ggx --at 10,20 --set rho_s=1 --set width=-1", "width is -1, outside its bounds"),
        ("eval disney --at 10,20 --set scale=1 --set roughness=9", "roughness is 9, outside its bounds 0.05 to 1"),
        ("draw ggx --set rho_s=1 --set width=-1", "width is -1, outside its bounds"),
    ],
)
def test_values_that_a_fit_would_refuse_are_refused_in_an_evaluation(run, command, message):
    code, out, err = run(*command.split())
    assert (code, out) == (1, "")
    assert message in err
    assert err.count("\n") == 1
