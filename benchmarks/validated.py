"""Every model on the measured scans, judged by the incidence angles that its fit was not shown: `make validated`.

Writes benchmarks/validated.json, which docs/real-surfaces.md is made from. Fits are logarithmic, so that every decade
counts alike, and nothing is grouped by incidence, because nothing would predict an angle that is left out.
"""

import json
import platform
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.progress import track

from gonio import Model, catalogue, read
from gonio.compare import Row, rank
from gonio.measured.dataset import make_scan
from gonio.measured.masking import mask
from gonio.processes import cores

HERE = Path(__file__).resolve().parent
DATA = HERE.parent.parent / "shared" / "data"
STARLINK_FLOOR = 1e-4  # 1/sr, the authors' own
WITHOUT = {  # parts of gonio-best, each held at nothing in turn
    "a diffuse lobe as wide as a Lambertian": {"gamma": 720.0},
    "no forward scatter": {"rho_f": 0.0, "s": 0.8},
    "no scattered lobe": {"rho_s": 0.0, "m": 0.25, "h": 0.05},
}
LEAST = 1e-9  # 1/sr: the peers' fits of the two full sets leave smaller values out, as those closer than this to
GRAZING = 1e-3  # the horizon, in cos theta_r


def usable(path: Path, positive: bool) -> xr.Dataset:
    """A scan without what its own header warns of; `positive` also masks what a relative error cannot weigh."""
    scan = read(path)
    theta_i, theta_r = scan["theta_i"].values, scan["theta_r"].values
    bad = np.zeros(theta_i.shape, dtype=bool)
    if path.stem.startswith("jsss"):
        bad |= (theta_i >= 80) | ((theta_i == 15) & (theta_r <= 3))
    if path.stem.startswith("starlink15"):
        bad |= scan["brdf"].values <= STARLINK_FLOOR
    if positive:
        bad |= scan["brdf"].values <= 0
    return mask(scan, exclude=bad)


def anoblack_ec1() -> xr.Dataset:
    """AnoBlack EC1 on aluminium over all azimuths: FRED's table of theta_r, azimuth from the mirror plane and BRDF."""
    rows, theta_i = [], np.nan
    for line in (DATA / "files" / "fred" / "AnoBlackEC1onAlum.txt").read_text(encoding="utf-8").splitlines()[2:]:
        numbers = [float(word) for word in line.split()]
        if len(numbers) == 2:
            theta_i = numbers[0]
        else:
            rows.append([theta_i, *numbers])
    theta_i_deg, theta_r, azimuth, brdf = np.array(rows).T
    return _as_peers_take_it(make_scan(theta_i_deg, theta_r, brdf, phi=180 - azimuth))


def merl_aluminium() -> xr.Dataset:
    """The in-plane slice of MERL's aluminium: five columns, theta_r signed."""
    theta_i, _, theta_r, _, brdf = np.loadtxt(DATA / "files" / "columns" / "merl_aluminium_slice.csv").T
    return _as_peers_take_it(make_scan(theta_i, theta_r, brdf))


def _as_peers_take_it(scan: xr.Dataset) -> xr.Dataset:
    grazing = np.cos(np.radians(scan["theta_r"].values)) <= GRAZING
    return mask(scan, exclude=(scan["brdf"].values <= LEAST) | grazing)


def scans() -> Iterator[tuple[str, xr.Dataset]]:
    yield from ((path.stem, usable(path, positive=True)) for path in sorted((DATA / "scans").glob("*.csv")))
    yield "AnoBlackEC1onAlum", anoblack_ec1()
    yield "merl_aluminium_slice", merl_aluminium()


def judged(scan: xr.Dataset, models: list[Model], **options: Any) -> list[Row]:
    return rank(scan, models, weighting="log", left_out="theta_i", workers=cores(), **options)


def record(row: Row) -> dict[str, Any]:
    return {
        "free": row.free_parameters,
        "status": row.solution.status.name,
        "fitted": row.metrics["log10_rmse"],
        "left_out": row.validated["log10_rmse"],
        "delta_left_out": row.validated["delta"],
        "by_fold": dict(row.by_fold),
        "values": row.solution.values,
    }


def main() -> int:
    if not DATA.is_dir():
        print(f"no measured data at {DATA}: nothing to do")
        return 0
    models = list(catalogue.values())
    found = {}
    for name, scan in track(list(scans()), "judging", disable=not sys.stderr.isatty()):
        rows = judged(scan, models)
        parts = {part: judged(scan, [catalogue["gonio-best"]], held=held)[0] for part, held in WITHOUT.items()}
        found[name] = {
            "points": rows[0].solution.dataset.attrs["points"],
            "models": {row.model.name: record(row) for row in rows},
            "without": {part: record(row) for part, row in parts.items()},
        }
        print(name, *(f"{r.model.name} {r.validated['log10_rmse']:.4f}" for r in rows[:3]), flush=True)
    machine = f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}"
    results = {"machine": machine, "date": date.today().isoformat(), "scans": found}
    (HERE / "validated.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
