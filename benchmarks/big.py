"""Fits of a table as large as MERL's: `make bench-big`.

1 458 000 directions in half-difference angles with three channels, simulated with 1 % noise. Every model is fitted in a
process of its own, from Python and by `gonio fit`, and the four of BOUND must take less than 10 s and 2 GB; that of
another process does not count. Writes benchmarks/big.json. Arguments are models, those of MODELS without any. Processor
time stands beside wall time, because it is what remains of a measurement on a machine that others use too.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from figures import machine
from gonio import Geometry, Problem, catalogue, read, write
from gonio.fitting import fit
from gonio.measured.coordinates import grid
from gonio.processes.portable import cores

RECORD = Path(__file__).resolve().parent / "big.json"
BOUND = ("lambert", "torrance-sparrow", "ward", "cauchy-lorentz")
MODELS = (*BOUND, "ggx", "gonio-best")  # these two have dearer terms
SECONDS, MEGABYTES = 10.0, 2000.0
STEPS = (90, 90, 180)  # of theta_h, theta_d and phi_d, as MERL has them
TRUTH = {"ks": 0.05, "kdd": 3.0, "kid": 0.05, "sigma": 0.15, "gamma": 30.0}
COLOURS = {"R": 1.0, "G": 0.8, "B": 0.5}  # what every weight is multiplied by
NOISE = 0.01
GONIO = "from gonio.app.cli import main; main()"


def table() -> Any:
    """The simulated scan, NaN below the horizon, as a reader of such files gives it."""
    h, d, p = STEPS
    axes = {"theta_h": 90 * (np.arange(h) / h) ** 2, "theta_d": np.arange(d) * 90 / d, "phi_d": np.arange(p) * 180 / p}
    scan = grid("half-difference", **axes)
    theta_i, theta_r, phi = (scan[name].values for name in ("theta_i", "theta_r", "phi"))
    model, random = catalogue["cauchy-lorentz"], np.random.default_rng(0)
    values = np.empty((len(COLOURS), *theta_i.shape))
    for k, factor in enumerate(COLOURS.values()):
        colour = {name: value * (factor if name in model.weights else 1) for name, value in TRUTH.items()}
        for row in range(h):  # all directions at once would take gigabytes
            values[k, row] = model(Geometry.from_degrees(theta_i[row], theta_r[row], phi[row]), colour)
    values *= 1 + NOISE * random.standard_normal(values.shape)
    values[:, np.maximum(theta_i, theta_r) > 90] = np.nan
    scan = scan.assign_coords(channel=list(COLOURS))
    return scan.assign(brdf=(("channel", *axes), values, {"units": "sr-1"}))


def measured(command: list[str]) -> dict[str, float]:
    """Wall and processor time [s] and peak memory [MB] of one process, its start with it."""
    started = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return {
        "seconds": round(time.perf_counter() - started, 2),
        "processor_seconds": round(used.ru_utime + used.ru_stime, 2),
        "peak_MB": round(used.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)),
    }


def fitted(model: str, path: str, out: str) -> None:
    """In a process of its own: read, then fit; what the fit alone took goes into the file `out`."""
    scan = read(path)
    started, used = time.perf_counter(), time.process_time()
    solution = fit(Problem(catalogue[model], scan))
    seconds, processor = time.perf_counter() - started, time.process_time() - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
    record = {"seconds": round(seconds, 2), "processor_seconds": round(processor, 2), "peak_MB": round(peak)}
    record |= {name: solution.dataset.attrs[name] for name in ("points", "points_searched", "evaluations")}
    record |= {"E": solution.cost, "status": solution.status.value}
    Path(out).write_text(json.dumps(record), encoding="utf-8")


def main(models: list[str]) -> int:
    record: dict[str, Any] = {
        "machine": machine(),
        "cores": cores(),
        "load_before": round(os.getloadavg()[0], 1),
        "date": date.today().isoformat(),
        "models": {},
    }
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "table.nc", Path(folder) / "fit.json"
        write(table(), path)
        for model in models:
            subprocess.run([sys.executable, __file__, "--fit", model, str(path), str(out)], check=True)
            one = json.loads(out.read_text(encoding="utf-8"))
            json_file = str(Path(folder) / "solution.json")
            command = [sys.executable, "-c", GONIO, "fit", str(path), "--model", model, "--json", json_file, "--force"]
            one["gonio_fit"] = measured(command)
            record["models"][model] = one
            slow = model in BOUND and any(
                m["seconds"] > SECONDS or m["peak_MB"] > MEGABYTES for m in (one, one["gonio_fit"])
            )
            failed += slow
            print(
                f"{model:18} fit {one['seconds']:6.2f} s, {one['peak_MB']} MB, E {one['E']:.6g}; gonio fit "
                f"{one['gonio_fit']['seconds']:6.2f} s, {one['gonio_fit']['peak_MB']} MB{' TOO MUCH' * slow}",
                flush=True,
            )
    RECORD.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return int(failed > 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--fit"]:
        fitted(*sys.argv[2:])
    else:
        sys.exit(main(sys.argv[1:] or list(MODELS)))
