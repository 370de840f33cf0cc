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
    """The whole way, with a worker of its own."""
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(stack.with_name("compiled")))
    code, out, err = run(*command(stack, "--workers", 1, "--json", stack.with_name("fit.json")))
    assert code == 0, err
    assert "1 worker on this machine; " in err
    assert "dashboard" in err
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
        alone = fit(Problem(catalogue["lambert"], scans.isel(sample=k, drop=True))).dataset
        np.testing.assert_allclose(found["value"].values[k], alone["value"].values, rtol=1e-12)  # one linear weight
    assert np.isnan(found["value"].values[4]).all()
    worst = int(np.nanargmax(found["cost"].values))
    assert record["worst"]["at"] == {"sample": 10 * worst}
    assert f"worst: E {found['cost'].values[worst]:.3g}".replace("e-0", "e-") in out
    code, _, err = run("info", stack.with_name("out.zarr"))
    assert code == 1
    assert "holds what gonio fit-stack found, and no scan: open it by xarray.open_zarr" in err


def test_a_run_goes_on_and_says_so(run, stack, here):
    code, _, err = run(*command(stack))
    assert code == 0, err
    assert "1 worker on this machine; dashboard at http://127.0.0.1:8787/status" in err
    assert "resuming" not in err
    code, out, err = run(*command(stack))
    assert code == 0, err
    assert "nothing to do: 3 of 3 blocks are there" in out
    assert "converged" in out
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
        (("--weighting", "relative"), "its problem weighting was uniform, and is relative now"),
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


def test_without_bokeh_a_word_says_how_to_see_the_dashboard(run, stack, here, monkeypatch):
    from gonio.fitting.stack import cluster as clusters

    @contextmanager
    def connected(scheduler="", workers=0, preload=()):
        client = SimpleNamespace(nthreads=lambda: {"a": 1, "b": 1})
        yield clusters.Cluster(client, "", is_local=False)

    monkeypatch.setattr(clusters, "connected", connected)
    _, _, err = run(*command(stack))
    assert "2 workers; no dashboard, which needs bokeh: pip install 'gonio[cluster]'" in err


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
