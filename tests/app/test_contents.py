"""What `gonio info` and `gonio check` make of files that hold something else than one scan."""

import json

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, fit, read, simulate, write
from gonio.measured.dataset import flatten
from stacks import write_stack


@pytest.fixture
def scan():
    model = catalogue["cauchy-lorentz"]
    values = {"ks": 2.0, "kdd": 30.0, "kid": 0.1, "sigma": 0.15, "gamma": 20.0}
    return simulate(model, values, [30.0, 50.0], np.arange(-80, 81, 8.0), noise=0.01)


@pytest.fixture
def fit_file(tmp_path, scan):
    fit(Problem(catalogue["cauchy-lorentz"], scan, grouped={"ks": ("theta_i",)})).save(tmp_path / "solution.nc")
    return tmp_path / "solution.nc"


def test_info_describes_a_fit(run, fit_file):
    code, out, err = run("info", fit_file)
    assert (code, err) == (0, "")
    assert "cauchy-lorentz fitted to 42 points [sr⁻¹]" in " ".join(out.split())
    assert "ks[30]" in out
    assert "± " in out
    record = json.loads(run("info", fit_file, "--json", "-")[1])
    assert record["kind"] == "fit"
    assert list(record["parameters"]["ks"]["values"]) == ["30", "50"]
    assert record["parameters"]["gamma"]["unit"] == "deg"


@pytest.mark.parametrize("label", [False, True])
def test_info_describes_a_stack_without_its_values(run, tmp_path, label):
    stack = write_stack(tmp_path / "stack.zarr", {"x": 3, "y": 5})
    if not label:
        (tmp_path / "own").mkdir()
        write(stack.drop_vars([n for n in stack.coords if stack[n].dtype.kind in "UO"]), tmp_path / "own/stack.zarr")
    path = tmp_path / ("stack.zarr" if label else "own/stack.zarr")
    for chunk in (path / "brdf" / "c").rglob("*"):
        if chunk.is_file():
            chunk.write_bytes(b"damaged")
    code, out, err = run("info", path)
    assert (code, err) == (0, "")
    words = " ".join(out.split())
    assert "stack of 15 scans" in words
    assert "x 3 x y 5" in words
    assert "values were not read" in words
    record = json.loads(run("info", path, "--json", "-")[1])
    assert record["kind"] == "stack"
    assert record["scans"] == {"x": 3, "y": 5}


def test_check_of_a_stack_says_that_it_takes_one_scan(run, tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 3})
    code, out, err = run("check", tmp_path / "stack.zarr")
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "holds many scans" in err


def test_one_scan_in_a_store_is_a_scan(run, tmp_path, scan):
    write(scan, tmp_path / "scan.zarr")
    assert json.loads(run("info", tmp_path / "scan.zarr", "--json", "-")[1])["kind"] == "scan"
    assert run("check", tmp_path / "scan.zarr")[0] == 0
    xr.testing.assert_allclose(flatten(read(tmp_path / "scan.zarr"))["brdf"], flatten(scan)["brdf"])


@pytest.mark.parametrize("command", ["info", "check"])
@pytest.mark.parametrize("keep", [200, 3000])
def test_a_damaged_fit_is_one_line(run, fit_file, command, keep):
    fit_file.write_bytes(fit_file.read_bytes()[:keep])
    code, out, err = run(command, fit_file)
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "byte" in err


def test_numbers_that_cannot_be_rounded_are_shown_as_they_are(run, tmp_path):
    """A wavelength of 1e308 nm has no ninth decimal; multiplying it by 1e9 is an overflow."""
    path = tmp_path / "scan.csv"
    path.write_text(
        "theta_i_deg,theta_r_deg,wavelength_nm,brdf_sr-1\n10,20,1e308,0.1\n30,20,500,0.1\n", encoding="utf-8"
    )
    code, text, err = run("info", path)
    assert (code, err) == (0, "")
    assert "1e+308" in text


def test_a_remark_of_a_million_characters_is_cut(run, tmp_path):
    path = tmp_path / "scan.csv"
    rows = "theta_i_deg,theta_r_deg,brdf_sr-1\n10,20,0.1\n30,20,0.2\n"
    path.write_text(f"# {'x' * 50_000}\n{rows}", encoding="utf-8")
    out = run("info", path)[1]
    assert len(out) < 3000
    assert "and 49000 more characters; --json has them all" in " ".join(out.split())
    assert len(json.loads(run("info", path, "--json", "-")[1])["provenance"][0]) == 50_000
