"""Fits of scans of up to 2000 wavelengths by whole commands: `make bench-hyperspectral`, and part of `make bench`.

A simulated scan of 34 directions a wavelength, with a lobe that no model here has exactly, and weights of its own at
each wavelength. Each command is a process of its own, from reading the file to the last line of the report; those of
BOUND must take less than 60 s and 2 GB. Processor time stands beside wall time, because it is what remains of a
measurement on a machine that others use too. Writes benchmarks/hyperspectral.json.
"""

import json
import os
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

import numpy as np

from big import GONIO, measured
from figures import machine
from gonio import write
from gonio.measured.dataset import make_scan
from gonio.processes.portable import cores

RECORD = Path(__file__).resolve().parent / "hyperspectral.json"
SECONDS, MEGABYTES = 60.0, 2000.0
THETA_I, THETA_R = (20.0, 50.0), np.arange(-80.0, 81.0, 10.0)
# wavelengths, command, whether its time and memory are bound
COMMANDS = (
    (500, "fit --model torrance-sparrow --group sigma=wavelength", True),
    (2000, "fit --model torrance-sparrow", True),
    (2000, "fit --model torrance-sparrow --out DIR", False),
    (2000, "fit --model torrance-sparrow --group sigma=wavelength", False),
    (2000, "fit --model torrance-sparrow --weighting log", False),
    (2000, "fit --model torrance-sparrow --weighting relative", False),
    (500, "fit --model torrance-sparrow --share kd --group sigma=wavelength", False),
    (500, "fit --model torrance-sparrow --group sigma=theta_i --group ks=theta_i", False),
    (500, "fit --model torrance-sparrow --smooth sigma=wavelength", False),
    (500, "fit --model torrance-sparrow --loss cauchy", False),
    (500, "fit --model ggx", False),
    (500, "fit --model ggx --group width=wavelength", False),
    (500, "fit --model ggx --group rho_s=wavelength", False),
    (500, "fit --model cauchy-lorentz", False),
    (500, "fit --model gonio-best", False),
    (200, "compare", False),
)


def scan(wavelengths: int) -> object:
    """The simulated scan."""
    random = np.random.default_rng(0)
    w, theta_i, theta_r = (a.ravel() for a in np.meshgrid(np.arange(wavelengths), THETA_I, THETA_R, indexing="ij"))
    brdf = 0.1 + 0.3 * np.exp(-(((theta_r - theta_i) / 8) ** 2)) * (400 + w) / 600
    brdf += 0.001 * random.standard_normal(len(brdf))
    return make_scan(theta_i, theta_r, brdf, coordinates={"wavelength": 400.0 + w})


def main() -> int:
    rows, failed = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for count, command, bound in COMMANDS:
            path = Path(folder) / f"{count}.csv"
            if not path.exists():
                write(scan(count), path)
            verb, *options = command.replace("DIR", str(Path(folder) / "out")).split()
            try:
                one = measured([sys.executable, "-c", GONIO, verb, str(path), *options])
            except subprocess.CalledProcessError as error:
                print(f"{count:5} {command}: {error}")
                failed += 1
                continue
            slow = bound and (one["seconds"] > SECONDS or one["peak_MB"] > MEGABYTES)
            failed += slow
            rows.append({"wavelengths": count, "command": command, "bound": bound} | one)
            print(
                f"{count:5} {command}: {one['seconds']:.1f} s, processor {one['processor_seconds']:.1f} s, "
                f"{one['peak_MB']} MB{' TOO MUCH' * slow}",
                flush=True,
            )
    about = {"machine": machine(), "cores": cores(), "load": round(os.getloadavg()[0], 1)}
    record = about | {"date": date.today().isoformat(), "rows": rows}
    RECORD.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
