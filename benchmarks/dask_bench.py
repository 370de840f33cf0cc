"""Two workers against one: `gonio fit-stack` of 200 000 simulated scans, in turn; `python benchmarks/dask_bench.py`.

Every scan has 3 x 161 directions in plane, and is Cauchy-Lorentz with ks of its own at each incidence angle and 1 %
noise. The figure is the ratio of times of the fitting phase, with the cluster up, from the first task to the last
block on the disk; the whole command is beside it. What is compiled is kept from a first run of a few scans, which is
not counted but told: that is how a second stack of the same kind is fitted. The load is told too, since the figure
means nothing on a machine that others use.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import xarray as xr

from gonio import Geometry, catalogue
from gonio.measured.dataset import make_scan
from gonio.processes import THREADS
from gonio.processes.portable import cores

SCANS, CHUNK = 200_000, 2_000
THETA_I = (30.0, 45.0, 60.0)
THETA_R = np.arange(-80, 81.0)
NOISE = 0.01
FIRST = 2048  # scans of the run that compiles: one block
TARGET = 1.7
MODEL = "cauchy-lorentz"
GONIO = "from gonio.app.cli import main; main()"


def directions() -> xr.Dataset:
    incidence, reflection = (a.ravel() for a in np.meshgrid(THETA_I, THETA_R, indexing="ij"))
    return make_scan(incidence, reflection, np.zeros(incidence.size))


def simulated(scans: int, seed: int, offset: int = 0) -> xr.Dataset:
    """A stack of so many scans (sample, direction), each of values of its own."""
    scan, random = directions(), np.random.default_rng((seed, offset))
    own = {"kdd": (1, 6), "kid": (0.02, 0.1), "sigma": (0.08, 0.3), "gamma": (15, 45)}
    values = {name: random.uniform(*ends, (scans, 1)) for name, ends in own.items()}
    by_angle = np.repeat(random.uniform(0.02, 0.2, (scans, len(THETA_I))), len(THETA_R), axis=1)
    geometry = Geometry.from_degrees(scan["theta_i"].values, scan["theta_r"].values, scan["phi"].values)
    true = np.asarray(catalogue[MODEL](geometry, values | {"ks": by_angle}))
    brdf = (true * (1 + NOISE * random.standard_normal(true.shape))).astype(np.float32)
    stack = scan.assign(brdf=(("sample", "direction"), brdf, {"units": "sr-1"}))
    return stack.assign_coords(sample=np.arange(offset, offset + scans))


def write_stack(path: Path, scans: int = SCANS, seed: int = 0) -> None:
    """The stack in a Zarr store, made and written chunk by chunk."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not yet in the specification of Zarr
        for first in range(0, scans, CHUNK):
            part = simulated(min(CHUNK, scans - first), seed, first)
            how: Any = {"mode": "w", "zarr_format": 3} if not first else {"append_dim": "sample"}
            encoding = {} if first else {"encoding": {"brdf": {"chunks": (CHUNK, part.sizes["direction"])}}}
            part.to_zarr(path, **how, **encoding)


def command(stack: Path, out: Path, *more: str) -> list[str]:
    """`gonio fit-stack` of the stack, as a process."""
    fit = ["fit-stack", str(stack), "--model", MODEL, "--group", "ks=theta_i", "--out", str(out)]
    return [sys.executable, "-c", GONIO, *fit, *more]


def results(out: Path) -> dict[str, bytes]:
    """Every file of a store of results but the manifest, which tells the time."""
    files = {p.relative_to(out): p for p in out.rglob("*") if p.is_file()}
    return {str(n): p.read_bytes() for n, p in files.items() if n.parts[0] not in ("manifest", "zarr.json")}


def fitted(stack: Path, folder: Path, workers: int) -> dict[str, Any]:
    """One whole command with so many workers: times [s], the fits' statuses, the largest worker [MB]."""
    from gonio.fitting.stack.manifest import Manifest

    out, told = folder / f"by-{workers}.zarr", folder / f"by-{workers}.json"
    shutil.rmtree(out, ignore_errors=True)
    told.unlink(missing_ok=True)
    started = time.perf_counter()
    subprocess.run(
        command(stack, out, "--workers", str(workers), "--json", str(told)),
        check=True,
        stdout=subprocess.DEVNULL,
        env=os.environ | dict.fromkeys(THREADS, "1") | {"JAX_COMPILATION_CACHE_DIR": str(folder / "compiled")},
    )
    whole = time.perf_counter() - started
    found = json.loads(told.read_text(encoding="utf-8"))
    records = list(Manifest(out).records())
    return {
        "seconds": round(found["seconds"], 2),
        "whole_command_seconds": round(whole, 2),
        "fits_per_second": round(found["fits_per_second"], 1),
        "statuses": found["statuses"],
        "peak_MB": round(max(r.peak_megabytes for r in records)),
        "load": round(os.getloadavg()[0], 1),
    }


def measure(scans: int = SCANS, pairs: int = 5, budget: float = 1800.0) -> dict[str, Any]:
    """The ratio and what it is made of; as many pairs in turn as the budget [s] allows, one at least.

    None with the reason where there are no two cores, or Dask or JAX is missing.
    """
    out: dict[str, Any] = {"dask_two_over_one": None, "scans": scans, "directions": len(THETA_I) * len(THETA_R)}
    if cores() < 2:
        return out | {"reason": "one processor core: two workers would share it"}
    try:
        import distributed
        import jax
    except ImportError as error:
        return out | {"reason": f"{error.name} is not installed: pip install 'gonio[cluster]'"}
    versions = {"distributed": distributed.__version__, "jax": jax.__version__}
    runs: list[dict[str, dict[str, Any]]] = []
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_stack(folder / "first.zarr", min(scans, FIRST))
        first = fitted(folder / "first.zarr", folder, 1)
        write_stack(folder / "stack.zarr", scans)
        while len(runs) < pairs and (not runs or (time.perf_counter() - begun) * (1 + 1 / len(runs)) < budget):
            runs.append({str(n): fitted(folder / "stack.zarr", folder, n) for n in (1, 2)})
        equal = results(folder / "by-1.zarr") == results(folder / "by-2.zarr")
    ratio = {key: [r["1"][key] / r["2"][key] for r in runs] for key in ("seconds", "whole_command_seconds")}
    return out | {
        "dask_two_over_one": round(median(ratio["seconds"]), 3),
        "reason": "",
        "target": TARGET,
        "whole_command_two_over_one": round(median(ratio["whole_command_seconds"]), 3),
        "pairs": len(runs),
        "bitwise_equal": equal,
        "first_run": first | {"scans": min(scans, FIRST)},
        "versions": versions,
        "runs": runs,
    }


if __name__ == "__main__":
    print(json.dumps(measure(*map(int, sys.argv[1:])), indent=2))
