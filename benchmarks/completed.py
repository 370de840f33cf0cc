"""Corrected predictions on the measured scans, each incidence angle left out in turn: `make completed`.

Writes benchmarks/completed.json, which docs/completion.md is made from, scan by scan. A scan that is there is kept, so
an interrupted run goes on. Delete the file to make all anew. The figures of the scans are those of `gonio compare
--correct`. The coating over all azimuths is filled from its plane of incidence, and judged by all else.
"""

import json
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from figures import machine
from gonio import Problem, catalogue, complete, fit, write
from gonio.completion.correction import LEVEL, RELATIVE
from gonio.completion.prior import materials
from gonio.measured import dataset
from gonio.measured.masking import mask
from surfaces import DATA, SCANS, anoblack_ec1, usable

RECORD = Path(__file__).resolve().with_suffix(".json")
MODEL = "gonio-best"
WAYS = {"prior": (), "no_prior": ("--no-prior",)}
MINUTES = 40  # that one command may take


def judged(path: Path, model: str, more: tuple[str, ...]) -> dict[str, Any]:
    """What `gonio compare --correct` says of a scan."""
    program = Path(sys.executable).with_name("gonio")
    start = [program] if program.exists() else [sys.executable, "-m", "gonio"]
    options = (
        "--models",
        model,
        "--weighting",
        "log",
        "--validate",
        "theta_i",
        "--correct",
        "--keep-all",
        "--workers",
        "1",
    )
    command = [*start, "compare", path, *options, *more, "--json", "-"]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60 * MINUTES)
    row = json.loads(done.stdout)[0]["ranking"][0]
    figures = {name: row[name]["log10_rmse"] for name in ("validated", "validated_plain")}
    return figures | {"free": row["free_parameters"], "intervals": row["intervals"], "by_fold": row["by_fold"]}


def own(name: str) -> tuple[str, ...]:
    """The option that leaves the material of a scan out of the prior."""
    found = [material for material in materials() if name.endswith(material)]
    return ("--without", ",".join(found)) if found else ()


def of_scan(path: Path, folder: Path) -> dict[str, Any]:
    """With the prior, without it, and the prior with a Lambertian alone in the place of a model."""
    scan = usable(path, positive=True)
    kept = folder / f"{path.stem}.csv"  # what the files' headers warn of is left out
    write(dataset.points(scan), kept, force=True)
    found = {
        way: judged(kept, MODEL, (*more, *(own(path.stem) if way == "prior" else ()))) for way, more in WAYS.items()
    }
    return found | {
        "prior_alone": judged(kept, "lambert", own(path.stem)),
        "points": dataset.points(scan).sizes["direction"],
    }


def full_azimuth() -> dict[str, Any]:
    """A coating over all azimuths, filled from its plane of incidence."""
    scan = anoblack_ec1()
    points = dataset.points(scan)
    outside = np.flatnonzero(~dataset.is_in_plane(points))
    known = mask(dataset.flatten(scan), exclude=~dataset.is_in_plane(dataset.flatten(scan)))
    solution = fit(Problem(catalogue[MODEL], known, weighting="log"))
    wanted = points.isel(direction=outside)
    measured = np.log10(wanted["brdf"].values)
    found: dict[str, Any] = {"in_plane": dataset.points(known).sizes["direction"], "outside": len(outside)}
    found["plain"] = rms(measured - np.log10(solution.brdf(wanted)))
    for way in WAYS:
        found[way] = filled(complete(known, solution, wanted, prior=way == "prior"), measured)
    return found


def filled(done: xr.Dataset, measured: np.ndarray) -> dict[str, float]:
    off = measured - np.log10(done["brdf"].values)
    uncertainty = done["uncertainty"].values / done["brdf"].values / RELATIVE
    return {"log10_rmse": rms(off), "held": float(np.mean(np.abs(off) <= LEVEL * uncertainty))}


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> int:
    if not DATA.is_dir():
        print(f"no measured data at {DATA}: nothing to do")
        return 0
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {"scans": {}}
    record |= {"machine": machine(), "date": date.today().isoformat(), "materials": len(materials())}
    record["model"] = MODEL
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(SCANS.glob("*.csv"), key=lambda path: path.stat().st_size):
            if path.stem not in record["scans"]:
                record["scans"][path.stem] = of_scan(path, Path(folder))
                keep(record)
                print(
                    path.stem,
                    *(f"{k} {v['validated']:.4f}" for k, v in record["scans"][path.stem].items() if k != "points"),
                )
    if "full_azimuth" not in record:
        record["full_azimuth"] = full_azimuth()
        keep(record)
    return 0


def keep(record: dict[str, Any]) -> None:
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
