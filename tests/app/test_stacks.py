"""The command about stacks: what it tells, what it takes up again, and what it refuses."""

import errno
import json
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue
from gonio.fitting import fit
from stacks import put, write_stack

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
pytestmark = pytest.mark.usefixtures("quick_compilation")  # of what this process fits, not of its workers


@pytest.fixture
def stack(tmp_path):
    scans = write_stack(tmp_path / "stack.zarr", {"sample": 6})
    scans["brdf"].values[4] = np.nan
    put(scans, tmp_path / "stack.zarr")
    return tmp_path / "stack.zarr"


@pytest.fixture
def here(monkeypatch):
    """Blocks are fitted in this process, and no cluster is started."""
    from gonio.fitting.stack import cluster as clusters
    from gonio.fitting.stack.run import fit_block

    client = SimpleNamespace(nthreads=lambda: {"here": 1})

    @contextmanager
    def connected(scheduler="", workers=0, preload=()):
        yield clusters.Cluster(client, "http://127.0.0.1:8787/status", is_local=True)

    def fit_blocks(client, run):
        run.begin()
        for block in run.todo:
            yield fit_block(run.job, block)

    monkeypatch.setattr(clusters, "connected", connected)
    monkeypatch.setattr(clusters, "fit_blocks", fit_blocks)


def command(stack, *more):
    return ("fit-stack", stack, "--model", "lambert", "--out", stack.with_name("out.zarr"), "--block", 2, *more)


def test_a_stack_is_fitted_by_processes_and_told_of(run, stack, monkeypatch):
    """The whole way, with a worker of its own that compiles as users have it."""
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(stack.with_name("compiled")))
    code, out, err = run(*command(stack, "--workers", 1, "--json", stack.with_name("fit.json")))
    assert code == 0, err
    assert "1 worker on this machine" in err
    assert max(map(len, out.splitlines())) <= 80
    record = json.loads(stack.with_name("fit.json").read_text())
    assert record["scans"] == 6
    assert record["blocks"] == 3
    assert record["blocks_resumed"] == 0
    assert sum(record["statuses"].values()) == 6
    assert record["statuses"]["converged"] == 5
    assert record["fits_per_second"] == pytest.approx(6 / record["seconds"])
    assert f"{record['fits_per_second']:.4g} fits a second" in out
    found = xr.open_zarr(stack.with_name("out.zarr")).load()
    scans = xr.open_zarr(stack).load().drop_vars("label")
    for k in (0, 1, 2, 3, 5):
        alone = fit(Problem(catalogue["lambert"], scans.isel(sample=k, drop=True), weighting="log")).dataset
        # a search of many ends where a step wins 1e-10 of E: 1e-5 of a scatter of 1 %
        np.testing.assert_allclose(found["value"].values[k], alone["value"].values, rtol=1e-6)
    assert np.isnan(found["value"].values[4]).all()
    worst = int(np.nanargmax(found["cost"].values))
    assert record["worst"]["at"] == {"sample": 10 * worst}
    assert f"worst: E {found['cost'].values[worst]:.3g}".replace("e-0", "e-") in out
    code, out, err = run("info", stack.with_name("out.zarr"))
    assert code == 0, err
    assert "lambert fitted to 6 of 6 scans" in " ".join(out.split())


def test_a_run_goes_on_and_says_so(run, stack, here):
    code, _, err = run(*command(stack))
    assert code == 0, err
    assert "1 worker on this machine; dashboard at http://127.0.0.1:8787/status" in err
    assert "resuming" not in err
    code, out, err = run(*command(stack))
    assert code == 0, err
    assert "nothing to do: 3 of 3 blocks are there" in out
    assert "converged" in out
    assert "weighting of every fit: log, as all values of the scans are positive" in " ".join(out.split())
    (stack.with_name("out.zarr") / "manifest" / "0000001.json").unlink()
    code, out, err = run(*command(stack))
    assert code == 0, err
    assert "resuming: 2 of 3 blocks are there" in err
    assert "fits a second" in out


def test_ctrl_c_is_one_line_that_says_how_to_go_on(run, stack, here, monkeypatch):
    from gonio.fitting.stack import cluster as clusters

    real = clusters.fit_blocks

    def interrupted(client, run):
        yield next(real(client, run))
        raise KeyboardInterrupt

    monkeypatch.setattr(clusters, "fit_blocks", interrupted)
    code, out, err = run(*command(stack))
    assert (code, out) == (130, "")
    assert err.splitlines()[1:] == ["stopped: 1 of 3 blocks are there, and the same command goes on with the others"]
    code, _, err = run(*command(stack, "--force"))
    assert code == 130
    assert "the same command without --force goes on" in err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--weighting", "relative"), "its problem weighting was log, and is relative now"),
        (("--bound", "rho=0.1:2"), "its problem bounds rho was not given"),
        (("--setting", "searches=5"), "its fit solver searches was 0, and is 5 now"),
    ],
)
def test_another_fit_is_refused_with_what_differs(run, stack, here, more, said):
    run(*command(stack))
    code, out, err = run(*command(stack, *more))
    assert (code, out) == (1, "")
    assert said in err
    assert len(err.splitlines()) == 1
    assert "--force" in err
    code, _, err = run(*command(stack, *more, "--force"))
    assert code == 0, err


def test_what_cannot_be_fitted_is_one_line(run, stack, here, tmp_path):
    refusals = {
        ("fit-stack", tmp_path / "none.zarr", "--model", "lambert", "--out", tmp_path / "o"): "no such Zarr store",
        command(stack, "--hold", "rho=half-width"): "hold rho at a number",
        command(stack, "--group", "rho=colour"): "no coordinate 'colour' to group by",
        command(stack, "--hold", "rho=0.5"): "every parameter is held",
        command(stack, "--each", "colour"): "'colour'",
        command(stack, "--weighting", "heavy"): "choose one of auto, uniform",
        command(stack, "--bound", "rho=1"): "name=lower:upper",
        command(stack, "--block", "0"): "--block is 0",
    }
    for arguments, said in refusals.items():
        code, out, err = run(*arguments)
        assert (code, out) == (1, ""), arguments
        assert said in err
        assert len(err.splitlines()) == 1
    assert not stack.with_name("out.zarr").exists()


def test_an_existing_record_is_refused_before_the_fit(run, stack, here):
    stack.with_name("fit.json").write_text("{}")
    code, _, err = run(*command(stack, "--json", stack.with_name("fit.json")))
    assert code == 1
    assert "fit.json exists" in err
    assert not stack.with_name("out.zarr").exists()


def test_the_record_goes_to_standard_output(run, stack, here):
    code, out, _ = run(*command(stack, "--json", "-"))
    assert code == 0
    assert json.loads(out)["blocks"] == 3


def test_without_bokeh_verbose_says_how_to_see_the_dashboard(run, stack, here, monkeypatch):
    from gonio.fitting.stack import cluster as clusters

    @contextmanager
    def connected(scheduler="", workers=0, preload=()):
        client = SimpleNamespace(nthreads=lambda: {"a": 1, "b": 1})
        yield clusters.Cluster(client, "", is_local=False)

    monkeypatch.setattr(clusters, "connected", connected)
    _, _, err = run(*command(stack))
    assert err == "2 workers\n"
    _, _, err = run(*command(stack, "--force", "--verbose"))
    assert err.count("no dashboard, which needs bokeh: pip install 'gonio[cluster]'") == 1


def test_help_fits_a_terminal_and_loads_no_numerics(run):
    code, out, _ = run("fit-stack", "--help")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    for option in ("--each", "--block", "--workers", "--scheduler", "--force", "--setting", "--device", "--precision"):
        assert option in out


@pytest.mark.parametrize("step", ["create", "write"])
def test_a_full_disk_is_told_with_the_name_of_the_store(run, here, stack, monkeypatch, step):
    def no_room(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(f"gonio.fitting.stack.store.{step}", no_room)
    code, _, err = run(*command(stack))
    assert code == 1
    assert f"No space left on device: '{stack.with_name('out.zarr')}'" in err
    assert ".gonio" not in err


@pytest.fixture
def folder(tmp_path):
    """A folder of scans, of which one holds a zero, which relative weighting gives no weight."""
    (tmp_path / "csv").mkdir()
    rows = [f"{i},{r}" for i in (10, 30) for r in (-40, 0, 40)]
    for k in (1, 2, 3, 10):
        lines = [f"{row},0.{k}" for row in rows]
        if k == 3:
            lines[-1] = f"{rows[-1]},0"
        (tmp_path / "csv" / f"wafer{k}.csv").write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n" + "\n".join(lines) + "\n")
    return tmp_path / "csv"


def test_a_folder_is_stacked_by_one_command_and_fitted_by_another(run, folder, here):
    """F42 of the cases: names come back with the results, and those of fits that failed in the summary."""
    made = folder.with_name("stack.zarr")
    code, out, err = run("stack", folder, "--out", made)
    assert (code, err) == (0, "")
    assert "4 scans of 6 values [sr⁻¹]: wafer1, wafer2, wafer3, wafer10" in out
    code, out, err = run(*command(made, "--weighting", "relative", "--json", made.with_name("fit.json")))
    assert code == 0, err
    found = xr.open_zarr(made.with_name("out.zarr"))
    assert [str(name) for name in found["sample"].values] == ["wafer1", "wafer2", "wafer3", "wafer10"]
    values = found["value"].sel(parameter="rho").load()
    np.testing.assert_allclose(values.sel(sample="wafer10"), 0.10 * np.pi, rtol=1e-12)
    assert np.isnan(values.sel(sample="wafer3"))
    assert "failed: 1 scan: wafer3 (not weighed)" in out
    assert "weighting of every fit: relative, as asked" in out
    record = json.loads(made.with_name("fit.json").read_text())
    assert record["failed"] == {"scans": 1, "first": [{"at": {"sample": "wafer3"}, "status": "not_weighed"}]}
    assert record["weighting"] == "relative"


def test_of_many_failures_the_first_are_named(run, tmp_path, here):
    scans = write_stack(tmp_path / "stack.zarr", {"sample": 9})
    scans["brdf"].values[2:] = np.nan
    put(scans, tmp_path / "stack.zarr")
    code, out, err = run(*command(tmp_path / "stack.zarr"))
    assert code == 0, err
    words = " ".join(out.split())
    named = ", ".join(f"{10 * k} (no points)" for k in range(2, 7))
    assert f"failed: 7 scans: {named}, and 2 more" in words


def test_a_stack_tells_of_what_it_leaves_out(run, folder):
    (folder / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    code, out, err = run("stack", folder, "--out", folder.with_name("s.zarr"), "--json", folder.with_name("s.json"))
    assert code == 0
    assert err.startswith(f"gonio: {folder / 'photo.png'}: left out: byte 0: is a PNG picture")
    assert "no scans, and left out: 1 of 5 files (photo.png)" in out
    record = json.loads(folder.with_name("s.json").read_text())
    assert record["names"] == ["wafer1", "wafer2", "wafer3", "wafer10"]
    assert list(record["left_out"]) == [str(folder / "photo.png")]


def test_other_directions_in_a_stack_are_one_line(run, folder):
    (folder / "wafer4.csv").write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n10,0,1\n10,20,1\n30,0,1\n")
    code, out, err = run("stack", folder, "--out", folder.with_name("s.zarr"))
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "wafer10.csv" not in err
    assert "wafer4.csv: has theta_i 10 deg, theta_r 20 deg" in err
    assert "--resample" in err
    code, out, err = run("stack", folder, "--out", folder.with_name("s.zarr"), "--resample", "--divide", "2")
    assert code == 0, err
    assert "rms error" in " ".join(out.split())


def fitted(folder, *more):
    return ("fit-stack", folder, "--model", "lambert", "--out", folder.with_name("out.zarr"), "--block", 2, *more)


def test_a_folder_is_fitted_at_once_and_taken_up_again(run, folder, here):
    """The stack is made beside the results, and again only where a file has changed."""
    made = folder.with_name("out-stack.zarr")
    code, out, err = run(*fitted(folder))
    assert code == 0, err
    assert f"made the stack {made} of 4 scans, as gonio stack does" in err
    assert [str(name) for name in xr.open_zarr(folder.with_name("out.zarr"))["sample"].values][2:] == [
        "wafer3",
        "wafer10",
    ]
    code, out, err = run(*fitted(folder))
    assert code == 0, err
    assert f"the stack {made} was made of these files before" in err
    assert "nothing to do" in out
    changed = folder / "wafer1.csv"
    changed.write_text(changed.read_text().replace("0.1", "0.15"))
    code, out, err = run(*fitted(folder))
    assert (code, out) == (1, "")
    assert f"{made} exists" in err
    assert "--force" in err
    code, _, err = run(*fitted(folder, "--force"))
    assert code == 0, err
    assert f"made the stack {made}" in err


def test_several_files_are_fitted_and_one_is_no_stack(run, folder, here):
    one, two = folder / "wafer1.csv", folder / "wafer2.csv"
    code, out, err = run("fit-stack", one, "--model", "lambert", "--out", folder.with_name("out.zarr"))
    assert (code, out) == (1, "")
    assert "make one by gonio stack FILES --out STACK.zarr, or take gonio fit for one scan" in err
    code, out, err = run("fit-stack", two, one, "--model", "lambert", "--out", folder.with_name("out.zarr"))
    assert code == 0, err
    assert [str(name) for name in xr.open_zarr(folder.with_name("out.zarr"))["sample"].values] == ["wafer2", "wafer1"]
