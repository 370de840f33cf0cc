"""Every model on the measured scans, judged by the incidence angles that its fit was not shown: `make validated`.

Writes benchmarks/validated.json, which docs/real-surfaces.md is made from. Fits are logarithmic, so that every decade
counts alike, and nothing is grouped by incidence, because nothing would predict an angle that is left out.
"""

import json
import platform
import sys
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.progress import track

from gonio import Model, Problem, catalogue
from gonio.app.output import without_infinities
from gonio.comparison.answer import everything
from gonio.comparison.assessment import Row
from gonio.comparison.metrics import metrics
from gonio.comparison.ranking import compare
from gonio.fitting import fit
from gonio.fitting.certainty.hold_out import folds, predictions
from gonio.measured import dataset
from gonio.processes.portable import cores
from gonio.verification.checks.reciprocity import reciprocity
from surfaces import DATA, surfaces

HERE = Path(__file__).resolve().parent
OURS = "gonio-best"
TABLES = ("torrance-sparrow", "wang-2016", "liu-2016", "cauchy-lorentz")  # what the paper's tables compare
# The width of its diffuse lobe is freed, then each other part is held at nothing.
WITHOUT: dict[str, dict[str, Any]] = {
    "a diffuse lobe of free width": {"bounds": {"gamma": (1.0, 720.0)}},
    "no forward scatter": {"held": {"rho_f": 0.0, "s": 0.8}},
    "no scattered lobe": {"held": {"rho_s": 0.0, "m": 0.25, "h": 0.05}},
}
COATED, FREED = "coated-body", {"n_b": (1.05, 2.2)}  # its index is held unless it is bounded


def judged(scan: xr.Dataset, models: list[Model], **options: Any) -> list[Row]:
    return compare(scan, models, weighting="log", left_out="theta_i", workers=cores(), **options)


def record(row: Row) -> dict[str, Any]:
    return {
        "free": row.free_parameters,
        "status": row.solution.status.name,
        "fitted": _six_digits(row.metrics["log10_rmse"]),
        "left_out": _six_digits(row.validated["log10_rmse"]),
        "delta_left_out": _six_digits(row.validated["delta"]),
        "by_fold": {name: _six_digits(error) for name, error in row.by_fold.items()},
    }


def of_the_data(scan: xr.Dataset) -> dict[str, Any]:
    """What no model can know: how far exchanged directions differ, and how far repeated readings scatter, in lg.

    The rms error of a reciprocal model at a pair of exchanged directions is at least half their difference.
    """
    points = dataset.points(scan)
    found: dict[str, Any] = {"folds": {name: int(fold.sum()) for name, fold in folds(points, "theta_i")}}
    try:
        outcome = reciprocity(scan)
        found["reciprocity"] = {"pairs": outcome.count, "least": _six_digits(outcome.number / 2 / np.log(10))}
    except ValueError:  # no pair
        found["reciprocity"] = {"pairs": 0, "least": None}
    if "uncertainty" in points:
        relative = points["uncertainty"].values / points["brdf"].values
        stated = relative[np.isfinite(relative) & (relative > 0)]
        found["repeats"] = _six_digits(float(np.sqrt(np.mean(stated**2))) / np.log(10)) if stated.size else None
    return found


def _six_digits(value: float) -> float:
    return float(f"{value:.6g}")


def in_the_papers_metric(scan: xr.Dataset, weighting: str) -> dict[str, float]:
    """Left-out nRMSE (guo2023, Tables 2 and 3), for which every curve is divided by its own specular value."""
    out = {}
    for name in (*TABLES, OURS):
        problem = Problem(catalogue[name], scan, weighting=weighting)
        modelled, _ = predictions(problem, fit(problem), "theta_i")
        out[name] = _six_digits(metrics(problem.points, modelled)["nrmse"])
    return out


def main() -> int:
    if not DATA.is_dir():
        print(f"no measured data at {DATA}: nothing to do")
        return 0
    models = everything()
    found = {}
    for name, scan in track(list(surfaces()), "judging", disable=not sys.stderr.isatty()):
        rows = judged(scan, models)
        parts = {part: judged(scan, [catalogue[OURS]], **changed)[0] for part, changed in WITHOUT.items()}
        found[name] = {
            "points": rows[0].solution.dataset.attrs["points"],
            **of_the_data(scan),
            "models": {row.model.name: record(row) for row in rows},
            "freed": record(judged(scan, [catalogue[COATED]], bounds=FREED)[0]),
            "tail": next(row.solution.values["c"] for row in rows if row.model.name == OURS),
            "nrmse": {weighting: in_the_papers_metric(scan, weighting) for weighting in ("log", "uniform")},
            "without": {part: record(row) for part, row in parts.items()},
        }
        print(name, *(f"{r.model.name} {r.validated['log10_rmse']:.4f}" for r in rows[:3]), flush=True)
    machine = f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}"
    results = {"machine": machine, "date": date.today().isoformat(), "scans": found}
    (HERE / "validated.json").write_text(json.dumps(without_infinities(results), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
