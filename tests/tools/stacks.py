"""Stacks for tests of many fits, and a cheap fit of every lane that can be slow, fail, or end its process on demand.

Run as a program it fits a stack as `gonio fit-stack` does, so that it can be ended: stacks.py STACK OUT PAUSE WORKERS.
"""

import json
import os
import signal
import sys
import time
import warnings
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr

from gonio import catalogue, simulate
from gonio.fitting.stack.run import StackFit

LAMBERT = catalogue["lambert"]


@contextmanager
def only_here(scheduler="", workers=0, preload=()):
    """In place of `fitting.stack.cluster.connected`: this process alone, without workers."""
    from gonio.fitting.stack.cluster import Cluster

    yield Cluster(SimpleNamespace(nthreads=lambda: {"here": 1}), "", is_local=True)


def one_after_another(client, run):
    """In place of `fitting.stack.cluster.fit_blocks`: every block in this process."""
    from gonio.fitting.stack.run import fit_block

    run.begin()
    for block in run.todo:
        yield fit_block(run.job, block)


def write_stack(path: Path, lanes: dict[str, int], chunk: int = 8, seed: int = 0) -> xr.Dataset:
    """Lambertian scans over these lanes with noise of 1 %, five directions each."""
    scan = simulate(LAMBERT, {"rho": 1.0}, [30.0], [-60.0, -20, 20, 40, 60])
    random = np.random.default_rng(seed)
    shape = (*lanes.values(), scan.sizes["direction"])
    level = random.uniform(0.1, 1, shape[:-1])[..., None]
    values = scan["brdf"].values * level * (1 + 0.01 * random.standard_normal(shape))
    stack = scan.assign(brdf=((*lanes, "direction"), values, {"units": "sr-1"}))
    first = next(iter(lanes))
    stack = stack.assign_coords({first: 10 * np.arange(lanes[first])})
    stack = stack.assign_coords(label=(first, np.array([f"no {k}" for k in range(lanes[first])])))
    put(stack, path, encoding={"brdf": {"chunks": (chunk, *(shape[1:-1]), shape[-1])}})
    return stack


def put(stack: xr.Dataset, path: Path, **options: Any) -> None:
    """The stack as people will store it, by xarray's defaults."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr has not settled a type of fixed texts, nor consolidated metadata
        stack.to_zarr(path, **({"mode": "w", "zarr_format": 3} | options))


def means(
    problem: Any,
    stack: xr.Dataset,
    *,
    pause: float = 0.0,
    fails: int = -1,
    deadly: int = -1,
    once: str = "",
    **settings: Any,
) -> xr.Dataset:
    """A fit of Lambert's model: the mean, its scatter, and a status; needs no compiler.

    A block takes `pause` seconds. One that holds the lane labelled `fails` raises, one with `deadly` kills its process,
    but only until there is a file `once`, where that is given.
    """
    lanes = [d for d in stack["brdf"].dims if d not in problem.data["brdf"].dims]
    first = stack[lanes[0]].values if lanes[0] in stack.coords else np.empty(0)
    time.sleep(pause if first.size else 0)
    if deadly in first and not (once and Path(once).exists()):
        if once:
            Path(once).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if fails in first:
        raise ValueError(f"lane {fails} cannot be fitted")
    values = stack["brdf"].transpose(*lanes, "direction").values
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mean, scatter = np.nanmean(values, axis=-1), np.nanstd(values, axis=-1)
    empty = np.isnan(mean)
    flags = {"flag_values": np.array([0, 3], dtype=np.int8), "flag_meanings": "converged no_points"}
    return xr.Dataset(
        {
            "value": ((*lanes, "parameter"), np.pi * mean[..., None]),
            "at_bound": ((*lanes, "parameter"), np.zeros((*mean.shape, 1), dtype=bool)),
            "cost": (lanes, (scatter / mean) ** 2),
            "status": (lanes, np.where(empty, 3, 0).astype(np.int8), flags),
            "points": (lanes, np.isfinite(values).sum(axis=-1).astype(np.int32)),
            "held": ("parameter", [False]),
        },
        coords={"parameter": ["rho"], "unit": ("parameter", [""])},
        attrs={"model": problem.model.name, "settings": json.dumps(settings)},
    )


def contents(out: Path) -> dict[str, bytes]:
    """The bytes of every file of a store of results but of its manifest, which tells the time."""
    names = {p: p.relative_to(out) for p in out.rglob("*") if p.is_file()}
    return {str(n): p.read_bytes() for p, n in names.items() if n.parts[0] not in ("manifest", "zarr.json")}


def asked(stack: Path, out: Path, **options: Any) -> StackFit:
    """A fit of the stack by `means`."""
    return StackFit(LAMBERT, stack, out, **{"fit_many": means} | options)


if __name__ == "__main__":
    import stacks  # workers find the function in the module, not in the program
    from gonio.fitting.stack.cluster import fit_stack

    # A shell that started the tests in the background has told them to ignore the signal, which is inherited.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.modules["bokeh"] = None  # type: ignore[assignment]  # no dashboard, which takes a second to load
    source, target, seconds, processes = sys.argv[1:]
    declared = stacks.asked(Path(source), Path(target), block=3, settings={"pause": float(seconds)})
    fit_stack(declared, workers=int(processes))
