"""Causes of systematic uncertainty in a stack: kept where all scans state the same ones, else left out with a word."""

import numpy as np
import pytest

from gonio import catalogue, simulate, write
from gonio.files import FormatError
from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.measured.causes import causes, with_causes
from gonio.measured.stack_store import open_stack
from gonio.stacking import stack, writing

LAMBERT = catalogue["lambert"]
NAMES = ("filter", "zero")


def put(path, rho, names=NAMES, theta_r=(-40.0, 0.0, 40.0), total=False):
    scan = simulate(LAMBERT, {"rho": rho}, [10.0, 30.0], theta_r, noise=0.01)
    values = scan["brdf"].values
    sizes = {"filter": 0.01 * values, "zero": -0.002 * np.arange(len(values)), "dark": 1e-3 + 0 * values}
    scan = with_causes(scan, {name: rho * sizes[name] for name in names}) if names else scan
    scan = scan.drop_vars(["systematic", "cause"]) if total else scan
    write(scan, path)
    return scan


@pytest.mark.parametrize("total", [False, True])
def test_causes_that_all_scans_state_are_kept(tmp_path, monkeypatch, total):
    monkeypatch.setattr(writing, "SCANS_OF_CHUNK", 2)  # three scans are then two chunks
    each = [put(tmp_path / f"{k}.csv", 0.1 * k, total=total) for k in (1, 2, 3)]
    done = stack([tmp_path / f"{k}.csv" for k in (1, 2, 3)], tmp_path / "s.zarr")
    assert not [note for note in done.notes if "left out" in note]
    found = open_stack(tmp_path / "s.zarr")
    for k, scan in enumerate(each):
        lane = found.isel(sample=k).load()
        own = causes(lane)
        assert list(own) == list(causes(scan))
        for name, shift in causes(scan).items():
            np.testing.assert_allclose(own[name], shift, rtol=1e-12)
        np.testing.assert_allclose(lane["uncertainty_systematic"], scan["uncertainty_systematic"], rtol=1e-12)
        alone, of_lane = (fit(Problem(LAMBERT, one)) for one in (scan, lane))
        np.testing.assert_allclose(of_lane.dataset["shift_by_cause"], alone.dataset["shift_by_cause"], rtol=1e-9)


def test_the_order_of_causes_is_no_difference(tmp_path):
    put(tmp_path / "a.csv", 0.1)
    put(tmp_path / "b.csv", 0.2, NAMES[::-1])
    stack([tmp_path / "a.csv", tmp_path / "b.csv"], tmp_path / "s.zarr")
    own = causes(open_stack(tmp_path / "s.zarr").isel(sample=1).load())
    np.testing.assert_allclose(own["zero"], -0.2 * 0.002 * np.arange(6), rtol=1e-12)


@pytest.mark.parametrize("other", [("filter",), ("filter", "dark"), ()])
@pytest.mark.parametrize("first", [0, 1])
def test_other_causes_are_left_out_with_the_files_that_have_them(tmp_path, other, first):
    names = [NAMES, NAMES, NAMES]
    names[first] = other
    for k, own in enumerate(names):
        put(tmp_path / f"{k}.csv", 0.1, own)
    done = stack([tmp_path / f"{k}.csv" for k in range(3)], tmp_path / "s.zarr")
    told = "1 of 3 scans state other causes (1.csv)" if first else "2 of 3 scans state other causes (1.csv, 2.csv)"
    assert f"systematic uncertainties left out: {told}" in done.notes
    found = open_stack(tmp_path / "s.zarr")
    assert not {"systematic", "uncertainty_systematic", "cause"} & set(found.variables)


def test_at_other_directions_every_cause_is_interpolated_with_its_sign(tmp_path):
    put(tmp_path / "a.csv", 0.1)
    put(tmp_path / "b.csv", 0.1, theta_r=(-40.0, 10.0, 40.0))
    done = stack([tmp_path / "a.csv", tmp_path / "b.csv"], tmp_path / "s.zarr", resample=True)
    assert not [note for note in done.notes if "left out" in note]
    each = [causes(open_stack(tmp_path / "s.zarr").isel(sample=k).load()) for k in (0, 1)]
    assert list(each[0]) == list(each[1]) == ["filter", "zero"]
    for name in each[0]:
        np.testing.assert_allclose(each[1][name], each[0][name], rtol=0.01, atol=5e-5)  # linear over 30 deg and more


def test_causes_of_a_damaged_stack_are_refused_in_one_line(tmp_path):
    put(tmp_path / "a.csv", 0.1)
    stack([tmp_path / "a.csv"], tmp_path / "s.zarr")
    chunk = next((tmp_path / "s.zarr" / "cause" / "c").rglob("*"))
    chunk = chunk if chunk.is_file() else next(p for p in chunk.rglob("*") if p.is_file())
    chunk.write_bytes(b"\x00" * 8)
    with pytest.raises(FormatError) as error:
        open_stack(tmp_path / "s.zarr")
    assert "\n" not in str(error.value)
