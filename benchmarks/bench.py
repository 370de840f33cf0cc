"""Exact weights against annealing on the real scans, and how long starting takes.

Run alone on the machine: `make bench`. Writes its figures into results.json beside this file, where those of quick.py
stay, and prints them; docs/pages/annealing.py makes a page of them. Every figure is a ratio of two things timed in turn
in this process, or the median of repeated runs.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from figures import Figure, keep
from gonio import Problem, catalogue, read
from gonio.app.output import figure, table
from gonio.comparison.ranking import FAMILY
from gonio.fitting import Anneal, Projection, fit

HERE = Path(__file__).resolve().parent
SCANS = HERE.parent.parent / "shared" / "data" / "scans"
SCRIPT = Path(sys.executable).with_name("gonio")
EVALUATIONS = 20_000  # of annealing
RUNS = 11  # of everything that is quick; the median counts
ALLOWED = 1 + 1e-9  # E(Projection) <= E(Anneal) times this


def seconds(work: Callable[[], Any]) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def median_seconds(command: list[str], runs: int = RUNS) -> float:
    """Median wall time of a command as a whole process, after one run that is not counted."""
    times = [seconds(lambda: subprocess.run(command, check=True, capture_output=True)) for _ in range(runs + 1)]
    return float(np.median(times[1:]))


def annealing() -> Anneal:
    """The whole budget, whatever the temperature."""
    return Anneal(max_iterations=EVALUATIONS, final_temperature=0.0)


def compare(path: Path, name: str) -> dict[str, Any]:
    """Both solvers on one scan and model, shape free and shape held where the exact solver left it."""
    model = catalogue[name]
    grouped = {model.weights[0]: "theta_i"}
    free = Problem(model, read(path), grouped=grouped)
    solution = fit(free)
    held = {n: v for n, v in solution.values.items() if n in model.shape}
    fixed = Problem(model, free.data, held=held, grouped=grouped)
    exact = Projection()
    quick = float(np.median([seconds(lambda: exact.search(fixed)) for _ in range(RUNS)]))
    started = time.perf_counter()
    annealed_fixed = annealing().search(fixed)
    slow = time.perf_counter() - started
    free_slow = time.perf_counter()
    annealed = annealing().search(free)
    free_slow = time.perf_counter() - free_slow
    free_quick = seconds(lambda: exact.search(free))
    return {
        "scan": path.stem,
        "model": name,
        "points": len(free.measured),
        "E_exact": solution.cost,
        "E_anneal": annealed.cost,
        "E_exact_fixed_shape": exact.search(fixed).cost,
        "E_anneal_fixed_shape": annealed_fixed.cost,
        "time_ratio_fixed_shape": slow / quick,
        "time_ratio": free_slow / free_quick,
    }


def holds(row: dict[str, Any]) -> bool:
    """Whether the exact solver ends no higher than annealing, with free and with fixed shape."""
    return (
        row["E_exact"] <= row["E_anneal"] * ALLOWED
        and row["E_exact_fixed_shape"] <= row["E_anneal_fixed_shape"] * ALLOWED
    )


def startup() -> dict[str, float]:
    """Medians of whole processes: the two start-up times and one fit."""
    copper = [str(SCRIPT), "fit", str(SCANS / "jsss_mwir_copper.csv"), "--model", "cauchy-lorentz"]
    return {
        "help_seconds": median_seconds([str(SCRIPT), "--help"]),
        "import_seconds": median_seconds([sys.executable, "-c", "import gonio"]),
        "fit_copper_seconds": median_seconds([*copper, "--group", "ks=theta_i", "--json", "-"]),
    }


def excess(row: dict[str, Any], which: str) -> float:
    return float(row[f"E_anneal{which}"] / row[f"E_exact{which}"] - 1)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--startup-only", action="store_true", help="only the start-up times; nothing is written")
    only = parser.parse_args().startup_only
    if not SCANS.is_dir():
        print(f"no measured scans at {SCANS}: nothing to measure")
        return 0
    figures = startup()
    if only:
        print(json.dumps(figures, indent=2))
        return 0
    jobs = [(path, name) for path in sorted(SCANS.glob("*.csv")) for name in FAMILY]
    fits = [compare(path, name) for path, name in track(jobs, "fitting", disable=not sys.stderr.isatty())]
    ratios = [row["time_ratio_fixed_shape"] for row in fits]
    figures |= {
        "anneal_over_exact_all_scans": float(np.median(ratios)),
        "anneal_over_exact_least": float(np.min(ratios)),
        "anneal_over_exact_free_shape": float(
            np.median([r["time_ratio"] for r in fits if catalogue[r["model"]].shape])
        ),
    }
    results = keep(
        *(Figure(name, value) for name, value in figures.items()),
        holds=sum(map(holds, fits)),
        annealing_evaluations=EVALUATIONS,
        runs=RUNS,
        fits=fits,
    )
    show(results)
    return 0 if results["holds"] == len(fits) else 1


def show(results: dict[str, Any]) -> None:
    from rich.console import Console

    out = table("scan", "model", "E exact", "excess free", "fixed", "time ratio", left=2)
    for row in results["fits"]:
        cells = (figure(v) for v in (row["E_exact"], excess(row, ""), excess(row, "_fixed_shape")))
        out.add_row(row["scan"], row["model"], *cells, f"{row['time_ratio_fixed_shape']:,.0f}")
    console = Console(width=120)
    console.print(out)
    console.print(f"E(exact) <= E(anneal) (1 + 1e-9) in {results['holds']} of {len(results['fits'])} fits")
    for name, value in results["figures"].items():
        console.print(f"{name}: {'not measured' if value is None else format(value, '.4g')}")


if __name__ == "__main__":
    sys.exit(main())
