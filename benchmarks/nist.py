"""NIST's certified nonlinear-regression problems: matching digits of gonio's local search, and of SciPy.

`make nist` writes benchmarks/nist.json, of which docs/pages/solver_quality.py makes a page. Problems, formulas and the
count of digits are those of tests/fitting/search/test_nist.py, which requires them; the times and the comparison are
measured here only.
"""

import json
import sys
import time
import warnings
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import curve_fit, least_squares

from figures import machine
from places import ROOT, loaded

RECORD = Path(__file__).resolve().parent / "nist.json"
RUNS = 5  # the shortest of so many runs counts: what the longer ones took more is other work of the machine
NEEDED = (25, 27)  # problems that must be solved from the far and from the near start

nist = loaded(ROOT / "tests" / "fitting" / "search" / "test_nist.py")


def attempt(work: Callable[[], np.ndarray], certified: np.ndarray) -> float:
    """Matching digits of what a solver returns; none where it gives up."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            return nist.digits(work(), certified)
        except (RuntimeError, ValueError):
            return 0.0


def milliseconds(work: Callable[[], Any]) -> float:
    times = []
    for _ in range(RUNS):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return 1000 * min(times)


def by_scipy(problem: Any, start: np.ndarray) -> dict[str, Callable[[], np.ndarray]]:
    """SciPy's two functions with their default settings, and the second with every tolerance at rounding error."""

    def model(x: np.ndarray, *b: float) -> np.ndarray:
        return problem.residual(np.array(b)) + problem.y

    tight = {"jac": "3-point", "x_scale": "jac", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "max_nfev": 2000}
    return {
        "curve_fit": lambda: curve_fit(model, problem.x, problem.y, start)[0],
        "least_squares": lambda: least_squares(problem.residual, start).x,
        "tight": lambda: least_squares(problem.residual, start, **tight).x,
    }


def measure(problem: Any) -> dict[str, Any]:
    """One problem: everything that is measured is a list of two, for the two starts."""
    row: dict[str, Any] = {"problem": problem.name, "difficulty": problem.level}
    row |= {"values": len(problem.values), "points": len(problem.y)}
    for start, first in enumerate(problem.starts):
        values, deviations, evaluations = nist.solve(problem, start)
        measured = {"digits": values, "digits_of_deviations": deviations, "evaluations": evaluations}
        measured["ms"] = milliseconds(lambda first=first: nist.descend(nist.LeastSquares(problem.residual), first))
        measured |= {name: attempt(work, problem.values) for name, work in by_scipy(problem, first).items()}
        for name, number in measured.items():
            row.setdefault(name, []).append(number)
    return row


def main() -> int:
    if not nist.FOLDER.is_dir():
        print(f"no certified problems at {nist.FOLDER}: nothing to measure")
        return 0
    rows = []
    for name in nist.MODELS:
        rows.append(measure(nist.load(nist.FOLDER / f"{name}.dat")))
        print(name, *(f"{digits:.1f}" for digits in rows[-1]["digits"]), flush=True)
    record = {
        "machine": machine(),
        "date": date.today().isoformat(),
        "runs": RUNS,
        "certified_digits": nist.CERTIFIED,
        "digits_required": nist.BAR,
        "digits_of_deviations_required": nist.BAR_DEVIATION,
        "deviations_of_rounding": list(nist.ROUNDING),
        "problems_required": NEEDED,
        "problems": rows,
    }
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    solved = [sum(row["digits"][start] >= nist.BAR for row in rows) for start in (0, 1)]
    print(f"{solved[0]} and {solved[1]} of {len(rows)} problems solved from starts 1 and 2")
    return 0 if solved[0] >= NEEDED[0] and solved[1] >= NEEDED[1] else 1


if __name__ == "__main__":
    sys.exit(main())
