"""A stack fitted block by block: what is written, what is marked, what is taken up again, and what is refused."""

import math
import os
import time

import numpy as np
import pytest
import xarray as xr

import stacks
from gonio.files import FormatError
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.stack import store as lane_store
from gonio.fitting.stack.manifest import BlockGrid, Manifest
from gonio.fitting.stack.run import fit_block, prepare
from gonio.measured.stack_store import open_stack
from stacks import asked, contents, means, put, write_stack


def prepared(tmp_path, **options):
    force, out = options.pop("force", False), tmp_path / options.pop("out", "out.zarr")
    return prepare(asked(tmp_path / "stack.zarr", out, **{"block": 4} | options), force)


def fitted(tmp_path, **options):
    """A run of all its blocks, in this process."""
    run = prepared(tmp_path, **options)
    run.begin()
    for block in run.todo:
        fit_block(run.job, block)
    return run


@pytest.mark.parametrize(
    ("lanes", "most", "chunk"),
    [
        ({"sample": 10}, 4, (4,)),
        ({"sample": 3}, 2048, (3,)),
        ({"x": 5, "y": 7}, 20, (2, 7)),
        ({"x": 5, "y": 7}, 3, (1, 3)),
        ({"wavelength": 3, "x": 40, "y": 40}, 100, (1, 2, 40)),
    ],
)
def test_blocks_hold_every_lane_once(lanes, most, chunk):
    blocks = BlockGrid.of(lanes, most)
    assert blocks.chunk == chunk
    seen = np.zeros(tuple(lanes.values()), dtype=int)
    for block in range(len(blocks)):
        region = tuple(blocks.region(block).values())
        seen[region] += 1
        assert seen[region].size == blocks.size(block) <= most
        assert tuple(s.start // c for s, c in zip(region, chunk, strict=True)) == blocks.place(block)
    assert (seen == 1).all()


def test_a_block_holds_at_least_one_lane():
    with pytest.raises(ValueError, match="--block is 0"):
        BlockGrid.of({"sample": 3}, 0)


@pytest.mark.parametrize("lanes", [{"sample": 10}, {"x": 3, "y": 5}])
def test_the_store_holds_what_one_call_gives(tmp_path, lanes):
    stack = write_stack(tmp_path / "stack.zarr", lanes)
    run = fitted(tmp_path)
    found = xr.open_zarr(run.job.out).load()
    expected = means(run.job.prepared()[0], stack)
    for name in expected.data_vars:
        np.testing.assert_array_equal(found[name].values, expected[name].values, err_msg=name)
        assert found[name].dims == expected[name].dims
        assert found[name].dtype == expected[name].dtype
    first = next(iter(lanes))
    assert found[first].values.tolist() == [10 * k for k in range(lanes[first])]
    assert found["label"].values.tolist() == [f"no {k}" for k in range(lanes[first])]
    assert found["parameter"].values.tolist() == ["rho"]
    assert found.sel(parameter="rho")["value"].shape == tuple(lanes.values())
    assert found.attrs["model"] == "lambert"


def test_lanes_may_stand_anywhere_among_the_dimensions(tmp_path):
    stack = write_stack(tmp_path / "first.zarr", {"x": 3, "y": 5})
    put(stack.transpose("direction", "y", "x"), tmp_path / "stack.zarr")
    found = xr.open_zarr(fitted(tmp_path).job.out).load()
    assert found["value"].dims == ("y", "x", "parameter")
    expected = means(prepared(tmp_path).job.prepared()[0], stack)["value"].transpose("y", "x", "parameter")
    np.testing.assert_array_equal(found["value"].values, expected.values)


def test_each_value_of_a_set_is_a_lane_when_asked(tmp_path):
    scan = write_stack(tmp_path / "first.zarr", {"sample": 2}).drop_vars("label")
    colours = xr.concat([scan, 2 * scan], "wavelength", combine_attrs="override").assign_coords(
        wavelength=[450.0, 650.0]
    )
    colours["brdf"].attrs["units"] = "sr-1"
    put(colours, tmp_path / "stack.zarr")
    run = fitted(tmp_path, each=("wavelength",))
    assert run.job.blocks.dims == ("wavelength", "sample")
    found = xr.open_zarr(run.job.out)["value"].load()
    # summed in another order where chunks differ, so the last digit may
    np.testing.assert_allclose(found.sel(wavelength=650.0).values, 2 * found.sel(wavelength=450.0).values, rtol=1e-14)


def test_what_is_not_fitted_says_so(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    run = prepared(tmp_path)
    run.begin()
    fit_block(run.job, 1)
    found = xr.open_zarr(run.job.out).load()
    attrs = found["status"].attrs
    meanings = dict(zip(attrs["flag_values"], attrs["flag_meanings"].split(), strict=True))
    said = [meanings[int(v)] for v in found["status"].values]
    assert said == ["not_fitted_yet"] * 4 + ["converged"] * 4 + ["not_fitted_yet"] * 2
    assert np.isnan(found["value"].values[:4]).all()
    assert np.isfinite(found["value"].values[4:8]).all()


def test_a_record_says_what_came_of_the_lanes(tmp_path):
    stack = write_stack(tmp_path / "first.zarr", {"sample": 10}).drop_vars("label")
    stack["brdf"].values[5] = np.nan
    put(stack, tmp_path / "stack.zarr")
    run = fitted(tmp_path)
    record = run.manifest.record(1)
    assert record.lanes == 4
    assert record.statuses == {"converged": 3, "no_points": 1}
    cost = xr.open_zarr(run.job.out)["cost"].load()
    worst = cost.isel(sample=slice(4, 8)).idxmax("sample").item()
    assert record.worst == {"at": {"sample": worst}, "cost": cost.sel(sample=worst).item(), "status": "converged"}
    assert record.started <= record.written
    assert math.isfinite(record.peak_megabytes)


def test_what_is_marked_is_not_computed_again(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    run = fitted(tmp_path)
    before = contents(run.job.out)
    again = prepared(tmp_path)
    assert again.resumed
    assert again.todo == []
    record = fit_block(again.job, 2)
    assert record == run.manifest.record(2)
    assert [len(run.manifest.starts(block)) for block in range(3)] == [1, 1, 1]
    assert contents(run.job.out) == before


@pytest.mark.parametrize("files", [0, 1, 7])
def test_a_block_that_was_half_written_is_written_anew(tmp_path, monkeypatch, files):
    """The computation ends after so many files; what it left, and a chunk of nonsense, is replaced."""
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    undisturbed = contents(fitted(tmp_path, out="undisturbed.zarr").job.out)
    run = prepared(tmp_path)
    run.begin()
    left = iter(range(files))
    real = lane_store.synchronise

    def synchronise(path):
        if next(left, None) is None:
            raise OSError("no space left on the device")
        real(path)

    monkeypatch.setattr(lane_store, "synchronise", synchronise)
    with pytest.raises(
        ValueError, match=r"block 1 \(sample 4 to 7\): .*\(no space left on the device\): is the disk full\?"
    ):
        fit_block(run.job, 1)
    monkeypatch.undo()
    assert run.manifest.written() == set()
    (run.job.out / "value" / "c" / "1" / "0").write_bytes(b"half")
    again = prepared(tmp_path)
    assert again.resumed
    for block in again.todo:
        fit_block(again.job, block)
    assert contents(run.job.out) == undisturbed
    assert len(run.manifest.starts(1)) == 2


def test_unfinished_files_of_a_killed_process_are_removed(tmp_path):
    """Those from before the computation of the block; a younger file may be another worker's."""
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    run = prepared(tmp_path)
    run.begin()
    names = ("value/c/1/0.a.partial", "cost/c/1.b.partial", "cost/c/1.c.partial", "cost/c/2.d.partial")
    *old, young, of_another = files = [run.job.out / name for name in names]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"half")
    later = time.time() + 60
    os.utime(young, (later, later))
    run.manifest.start(1)  # a process that was killed
    time.sleep(0.05)  # a file's time may be some milliseconds off
    for block in run.todo:
        fit_block(run.job, block)
    assert not any(file.exists() for file in old)
    assert young.exists()
    assert of_another.exists()  # block 2 was begun once: nobody was killed in it


def test_the_mark_comes_after_the_chunks_are_on_the_disk(tmp_path, monkeypatch):
    write_stack(tmp_path / "stack.zarr", {"sample": 3})
    run = prepared(tmp_path)
    run.begin()
    synchronised, real = [], lane_store.synchronise
    monkeypatch.setattr(lane_store, "synchronise", lambda path: synchronised.append(path) or real(path))

    def mark(manifest, record, real=Manifest.mark):
        chunks = {p for p in run.job.out.glob("*/c/**/*") if p.is_file() and p.parts[-2] != "manifest"}
        written = {p for p in chunks if p.relative_to(run.job.out).parts[0] in ("value", "cost", "status", "points")}
        assert written
        assert written <= set(synchronised)
        assert {p.parent for p in written} <= set(synchronised)
        real(manifest, record)

    monkeypatch.setattr(Manifest, "mark", mark)
    fit_block(run.job, 0)
    assert run.manifest.is_written(0)


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"problem": ProblemOptions(weighting="relative")}, "its problem weighting was log, and is relative now"),
        ({"problem": ProblemOptions(bounds={"rho": (0, 1)})}, "its problem bounds rho was not given"),
        ({"settings": {"searches": 3}}, "its fit searches was not given, and is 3 now"),
        ({"block": 5}, "its block sample was 4, and is 5 now"),
    ],
)
def test_another_run_is_refused_by_what_differs(tmp_path, options, what):
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    fitted(tmp_path)
    with pytest.raises(ValueError, match=f"holds the fit of another run: {what}.*; choose another --out, or --force"):
        prepared(tmp_path, **options)


def test_a_torn_note_is_passed_over_and_a_damaged_mark_is_named(tmp_path):
    """A power cut can tear the last line of the notes, which are not synchronised; a mark is whole or not there."""
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    run = fitted(tmp_path)
    with run.manifest._starts(1).open("a", encoding="utf-8") as file:
        file.write("17645")
    assert len(run.manifest.starts(1)) == 1
    run.manifest._mark(1).write_text("{}", encoding="utf-8")
    with pytest.raises(FormatError, match=r"0000001\.json, line 1: is no mark of a written block: remove it"):
        run.manifest.record(1)


def shine(angle):
    return 1 + 0 * angle


def test_a_weight_function_is_known_by_its_name(tmp_path):
    """Its repr holds an address in memory, by which no later process would know the run again."""
    write_stack(tmp_path / "stack.zarr", {"sample": 2})
    run = prepared(tmp_path, problem=ProblemOptions(g1=shine))
    run.begin()
    assert run.manifest.run()["problem"]["g1"].endswith("test_run.shine")


def test_another_stack_is_refused_and_force_starts_anew(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    fitted(tmp_path)
    write_stack(tmp_path / "stack.zarr", {"sample": 12})
    with pytest.raises(ValueError, match="its stack shape sample was 10, and is 12 now"):
        prepared(tmp_path)
    run = prepared(tmp_path, force=True)
    assert not run.resumed
    assert len(run.todo) == 3
    assert Manifest(run.job.out).written() == {0, 1, 2}  # what is there stays until the run begins
    run.begin()
    assert Manifest(run.job.out).written() == set()


def test_other_directions_are_another_stack(tmp_path):
    stack = write_stack(tmp_path / "stack.zarr", {"sample": 4})
    fitted(tmp_path)
    moved = stack.drop_vars("label").assign_coords(theta_i=stack["theta_i"] + 1)
    put(moved, tmp_path / "stack.zarr")
    with pytest.raises(ValueError, match="its stack checksum was"):
        prepared(tmp_path)


def test_what_is_no_run_is_not_overwritten(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 4})
    (tmp_path / "out.zarr").mkdir()
    (tmp_path / "out.zarr" / "notes.txt").write_text("mine")
    with pytest.raises(FileExistsError, match="--force"):
        prepared(tmp_path)
    run = prepared(tmp_path, force=True)
    with pytest.raises(FileExistsError, match="directory of other files"):
        run.begin()
    assert (tmp_path / "out.zarr" / "notes.txt").read_text() == "mine"


def test_what_is_no_stack_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(ValueError, match=r"stack.zarr: there is no such Zarr store"):
        prepared(tmp_path)
    (tmp_path / "stack.zarr").write_text("theta_i,theta_r,brdf\n")
    with pytest.raises(ValueError, match="is no Zarr store"):
        prepared(tmp_path)
    (tmp_path / "stack.zarr").unlink()
    stack = write_stack(tmp_path / "stack.zarr", {"sample": 4}).drop_vars("label")
    (tmp_path / "stack.zarr" / "zarr.json").write_text("{")
    with pytest.raises(ValueError, match=r"zarr\.json, line 1") as refused:
        prepared(tmp_path)
    assert "\n" not in str(refused.value)
    put(stack.rename(brdf="btdf"), tmp_path / "other.zarr")
    with pytest.raises(ValueError, match=r"no variable brdf.*it has btdf"):
        prepare(asked(tmp_path / "other.zarr", tmp_path / "out.zarr"))
    put(stack.isel(sample=0), tmp_path / "one.zarr")
    with pytest.raises(ValueError, match=r"one scan.*no stack"):
        prepare(asked(tmp_path / "one.zarr", tmp_path / "out.zarr"))
    put(stack.isel(sample=slice(0, 0)), tmp_path / "none.zarr")
    with pytest.raises(ValueError, match="holds no scan"):
        prepare(asked(tmp_path / "none.zarr", tmp_path / "out.zarr"))
    assert not (tmp_path / "out.zarr").exists()


def test_a_chunk_of_the_stack_that_cannot_be_read_names_the_block(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 16}, chunk=8)
    run = prepared(tmp_path)
    run.begin()
    (tmp_path / "stack.zarr" / "brdf" / "c" / "1" / "0").write_bytes(b"nonsense")
    fit_block(run.job, 1)
    with pytest.raises(ValueError, match=r"block 2 \(sample 8 to 11\): "):
        fit_block(run.job, 2)


def test_a_stack_of_gonios_own_writer_keeps_its_texts(tmp_path):
    from gonio import write

    stack = write_stack(tmp_path / "first.zarr", {"sample": 4})
    write(stack, tmp_path / "stack.zarr")
    assert open_stack(tmp_path / "stack.zarr")["label"].values.tolist() == [f"no {k}" for k in range(4)]
    found = xr.open_zarr(fitted(tmp_path).job.out)
    assert found["label"].values.tolist() == [f"no {k}" for k in range(4)]


def test_the_stand_in_is_found_by_its_name():
    """Workers import it: a function of a test's own would not reach them."""
    assert means.__module__ == stacks.__name__


def test_no_lanes_give_a_solution_of_none_at_once(tmp_path, monkeypatch):
    """The store of many lanes is made by it, so it must hold the same variables, and touch no device."""
    pytest.importorskip("jax")
    from gonio.fitting.many import fit_many as batch

    stack = write_stack(tmp_path / "stack.zarr", {"x": 3, "y": 2})
    problem = prepared(tmp_path).job.prepared()[0]
    full = batch.fit_many(problem, stack)
    monkeypatch.setattr(batch, "_device", lambda name: pytest.fail("a device was asked for"))
    empty = batch.fit_many(problem, stack.isel(x=slice(0, 0)))
    assert {n: (v.dims, v.dtype, list(v.attrs)) for n, v in empty.data_vars.items()} == {
        n: (v.dims, v.dtype, list(v.attrs)) for n, v in full.data_vars.items()
    }
    assert set(empty.attrs) == set(full.attrs)
    assert empty.sizes == dict(full.sizes) | {"x": 0}
    with pytest.raises(ValueError, match="no precision"):
        batch.fit_many(problem, stack.isel(x=slice(0, 0)), precision="float16")
