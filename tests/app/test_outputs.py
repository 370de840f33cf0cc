"""What a command writes is never what it reads, whatever --force says."""

import shutil

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate, write
from gonio.fitting import fit
from stacks import write_stack


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a scan, a second one and a stack, which is the current one."""
    values = {"ks": 0.4, "kd": 0.1, "sigma": 0.2}
    scan = simulate(catalogue["torrance-sparrow"], values, [10.0, 40], np.arange(-75, 76, 15.0), noise=0.02, seed=1)
    for name in ("scan.csv", "other.csv"):
        write(scan, tmp_path / name)
    fit(Problem(catalogue["lambert"], scan)).save(tmp_path / "solution.nc")
    (tmp_path / "body.toml").write_text('[[facet]]\narea = 1\nnormal = [0, 0, 1]\nfit = "solution.nc"\n')
    (tmp_path / "pass.csv").write_text("theta_i_deg,theta_r_deg,phi_deg,distance_m\n30,30,180,1\n")
    write_stack(tmp_path / "stack.zarr", {"sample": 3})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


COMMANDS = {
    "fit --json": "fit scan.csv --model lambert --json scan.csv",
    "fit --json by another name": "fit scan.csv --model lambert --json ./x/../scan.csv",
    "fit --out": "fit scan.csv --model lambert --out scan.csv",
    "fit --out around": "fit scan.csv --model lambert --out .",
    "compare": "compare scan.csv --models lambert --json scan.csv",
    "plot": "plot scan.csv --models lambert --out scan.csv",
    "info": "info scan.csv --json scan.csv",
    "check": "check scan.csv --json scan.csv",
    "plan-next": "plan-next scan.csv --model lambert --out scan.csv",
    "diff": "diff scan.csv other.csv --json other.csv",
    "convert": "convert scan.csv new.csv --onto other.csv --json other.csv",
    "convert onto": "convert scan.csv other.csv --onto other.csv",
    "reduce": "reduce scan.csv --out scan.csv",
    "eval": "eval lambert --set rho=0.5 --at 10,20 --material scan.csv --json scan.csv",
    "albedo": "albedo solution.nc --json solution.nc",
    "magnitude": "magnitude body.toml pass.csv --json pass.csv",
    "magnitude of a fit": "magnitude body.toml pass.csv --json solution.nc",
    "make stack": "stack scan.csv other.csv --out other.csv",
    "make stack in a folder": "stack . --out all.zarr",
    "make stack onto": "stack scan.csv --onto other.csv --out other.csv",
    "stack": "fit-stack stack.zarr --model lambert --out stack.zarr",
    "stack inside": "fit-stack stack.zarr --model lambert --out stack.zarr/fits",
    "stack around": "fit-stack stack.zarr --model lambert --out .",
    "stack --json": "fit-stack stack.zarr --model lambert --out fits.zarr --json stack.zarr/record.json",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_an_output_that_is_an_input_is_refused(run, here, name):
    before = contents(here)
    code, out, err = run(*COMMANDS[name].split(), "--force")
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "which is read: choose another name" in err
    assert contents(here) == before


def test_a_figure_without_a_suffix_does_not_take_the_place_of_its_scan(run, here):
    shutil.copy(here / "scan.csv", here / "scan.png")
    code, _, err = run("plot", "scan.png", "--models", "lambert", "--out", "scan", "--force")
    assert code == 1
    assert "which is read" in err


def test_two_outputs_have_two_names(run, here):
    code, _, err = run("fit", "scan.csv", "--model", "lambert", "--out", "r", "--json", "./r")
    assert code == 1
    assert "give two names" in err


def test_convert_writes_in_place_by_force(run, here):
    assert run("convert", "scan.csv", "scan.csv")[0] == 1
    code, out, _ = run("convert", "scan.csv", "scan.csv", "--force")
    assert code == 0
    assert "every value exact" in out
