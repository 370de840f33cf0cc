"""F43: a folder of files becomes a stack and is fitted in logarithms; names come back, and a short summary."""

import json

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, read, simulate, write
from gonio.app.views.stacks.fitted import undetermined_lines
from gonio.fitting import fit

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "csv").mkdir()
    rng = np.random.default_rng(5)
    for k in range(12):
        scan = simulate(catalogue["lambert"], {"rho": 0.1 + k / 20}, [10.0, 40], np.linspace(-60, 60, 7))
        scan["brdf"].values *= np.exp(0.05 * rng.standard_normal(scan["brdf"].shape))
        write(scan, tmp_path / "csv" / f"wafer{k}.csv")
    return tmp_path / "csv"


@pytest.fixture
def here(monkeypatch):
    """Blocks are fitted in this process, and no cluster is started."""
    from contextlib import contextmanager
    from types import SimpleNamespace

    from gonio.fitting.stack import cluster as clusters
    from gonio.fitting.stack.run import fit_block

    @contextmanager
    def connected(scheduler="", workers=0, preload=()):
        yield clusters.Cluster(SimpleNamespace(nthreads=lambda: {"here": 1}), "", is_local=True)

    def fit_blocks(client, run):
        run.begin()
        for block in run.todo:
            yield fit_block(run.job, block)

    monkeypatch.setattr(clusters, "connected", connected)
    monkeypatch.setattr(clusters, "fit_blocks", fit_blocks)


@pytest.mark.parametrize("weighting", ["log", "auto"])
def test_names_come_back_from_a_fit_in_logarithms(run, folder, here, weighting):
    made, out_path, saved = (folder.with_name(name) for name in ("stack.zarr", "fits.zarr", "fit.json"))
    code, out, err = run("stack", folder, "--out", made)
    assert (code, err) == (0, "")
    asked = ("--model", "lambert", "--weighting", weighting, "--out", out_path, "--json", saved)
    code, out, err = run("fit-stack", made, *asked)
    assert code == 0, err
    assert "bokeh" not in out + err
    assert len(out.splitlines()) <= 15
    record = json.loads(saved.read_text())
    assert record["weighting"] == "log"
    assert record["weighting_reason"] == {"log": "", "auto": "all values of the scans are positive"}[weighting]
    found = xr.open_zarr(out_path)
    assert found.attrs["weighting_reason"] == record["weighting_reason"]
    assert found["sample"].values.tolist() == [f"wafer{k}" for k in range(12)]
    alone = fit(Problem(catalogue["lambert"], read(folder / "wafer7.csv"), weighting="log"))
    mine = found.sel(sample="wafer7")
    assert float(mine["cost"]) == pytest.approx(alone.cost, rel=1e-9)
    assert float(mine["value"].sel(parameter="rho")) == pytest.approx(
        alone.values["rho"], rel=1e-5
    )  # a step may still win 1e-10 of E
    code, out, err = run("info", out_path)
    assert code == 0, err
    assert len(out.splitlines()) <= 15
    for said in (
        "lambert fitted to 12 of 12 scans",
        "converged 12",
        "names: wafer0, wafer1",
        "weighting of every fit: log",
    ):
        assert said in " ".join(out.split())
    code, out, err = run("info", out_path, "--json", "-")
    assert json.loads(out)["values"]["rho"]["least"] == pytest.approx(0.1, rel=0.1)


def test_a_damaged_store_of_fits_is_one_line(run, folder, here):
    out_path = folder.with_name("fits.zarr")
    code, _, err = run("fit-stack", folder, "--model", "lambert", "--out", out_path)
    assert code == 0, err
    mark = next((out_path / "manifest").glob("*0.json"))
    mark.write_text("{")
    (out_path / "value" / "zarr.json").write_text("{")
    code, out, err = run("info", out_path)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "fits.zarr" in err


def test_what_is_not_determined_is_said_with_the_remedy_and_no_alarm():
    (said,) = undetermined_lines({"index": 204, "extinction": 160, "rho_s": 204}, 300)
    assert said.startswith("not determined, in how many of 300 scans: index 204, extinction 160, rho_s 204.")
    assert "--dielectric, --material NAME, or --hold index=1.5 --hold extinction=0" in said
    (said,) = undetermined_lines({"gamma[30]": 2}, 300)
    assert "hold one (--hold gamma=VALUE)" in said
    assert not list(undetermined_lines({}, 300))


def test_values_that_a_stack_does_not_determine_are_counted_by_name():
    from gonio.fitting.stack.store import undetermined

    spread = np.array([[1.0, np.inf], [np.nan, np.inf], [2.0, 0.1]])
    fits = xr.Dataset({"uncertainty": (("sample", "parameter"), spread)}, coords={"parameter": ["rho_s", "index"]})
    assert undetermined(fits) == {"index": 2}
    assert undetermined(fits.drop_vars("uncertainty")) == {}
