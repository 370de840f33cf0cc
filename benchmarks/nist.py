"""NIST's certified nonlinear-regression problems: matching digits of the local search, and of SciPy as it comes.

Writes docs/solver-quality.md and prints it: `make nist`. Problems, formulas and the count of digits are those of
tests/fitting/search/test_nist.py, which holds the bars; here the times and the comparison are measured beside them.
"""

import importlib.util
import platform
import sys
import time
import warnings
from collections.abc import Callable
from datetime import date
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy
from scipy.optimize import curve_fit, least_squares

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "docs" / "solver-quality.md"
SOLVERS = {
    "ours": "gonio",
    "curve_fit": "SciPy `curve_fit`, defaults (lm)",
    "least_squares": "SciPy `least_squares`, defaults (trf)",
    "tight": 'the same, 3-point differences, tolerances 1e-15, `x_scale="jac"`',
}
RUNS = 5  # the least time of so many counts: the rest is what else the machine did


def loaded(path: Path) -> ModuleType:
    """A Python file as a module, wherever it lies."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


nist = loaded(HERE.parent / "tests" / "fitting" / "search" / "test_nist.py")


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
    """SciPy's two front doors as they come, and its best search with every tolerance at rounding."""

    def model(x: np.ndarray, *b: float) -> np.ndarray:
        return problem.residual(np.array(b)) + problem.y

    tight = {"jac": "3-point", "x_scale": "jac", "xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15, "max_nfev": 2000}
    return {
        "curve_fit": lambda: curve_fit(model, problem.x, problem.y, start)[0],
        "least_squares": lambda: least_squares(problem.residual, start).x,
        "tight": lambda: least_squares(problem.residual, start, **tight).x,
    }


def measure(problem: Any) -> dict[str, Any]:
    """One row: a pair for the two starts of everything."""
    row: dict[str, Any] = {"problem": problem}
    for start, first in enumerate(problem.starts):
        values, deviations, evaluations = nist.solve(problem, start)
        found = {"ours": values, "deviations": deviations, "evaluations": evaluations}
        found["ms"] = milliseconds(lambda first=first: nist.descend(nist.LeastSquares(problem.residual), first))
        found |= {name: attempt(work, problem.values) for name, work in by_scipy(problem, first).items()}
        for name, number in found.items():
            row.setdefault(name, []).append(number)
    return row


def machine() -> str:
    info = Path("/proc/cpuinfo")
    names = info.read_text().splitlines() if info.exists() else []
    cpu = next((line.split(":")[1].strip() for line in names if line.startswith("model name")), platform.machine())
    return f"{cpu}; Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"


def pair(numbers: list[float], form: str) -> str:
    return " / ".join(format(number, form) for number in numbers)


def passed(rows: list[dict[str, Any]], solver: str, start: int) -> int:
    return sum(row[solver][start] >= nist.BAR for row in rows)


def markdown(rows: list[dict[str, Any]]) -> str:
    least = min(min(row["deviations"]) for row in rows if row["problem"].name not in nist.ROUNDING)
    counts = "\n".join(
        f"| {label} | {passed(rows, name, 0)} | {passed(rows, name, 1)} |" for name, label in SOLVERS.items()
    )
    table = "\n".join(map(line, rows))
    return f"""# Solver quality: NIST's certified problems

Made by `make nist` on {date.today().isoformat()}; {machine()}.

The 27 nonlinear-regression problems of NIST's Statistical Reference Datasets come with certified values and standard
deviations in 11 digits and with two starting points, far (1) and near (2). They are solved here by the local search
that every fit of gonio uses, `gonio.fitting.search.descent`, with the same settings for all 27, derivatives by
differences, and nothing told about a problem but its residual. `tests/fitting/search/test_nist.py` holds {nist.BAR:g}
digits of every value on all problems from start 2 and on 25 from start 1, and {nist.BAR_DEVIATION:g} digits of every
standard deviation.

| problems solved to {nist.BAR:g} digits, of {len(rows)} | start 1 | start 2 |
|---|---:|---:|
{counts}

Matching digits are those of the worst value, minus the decimal logarithm of its relative error, at most 11 because no
more are printed; pairs are starts 1 / 2. Evaluations are of the residual, those of differences included. Times are the
least of {RUNS} runs on one thread. The last three columns are SciPy's digits, in the order of the table above.

| problem | difficulty | values | points | digits | of deviations | evaluations | ms | `curve_fit` | trf | trf, tight |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
{table}

## Reading it

- **How the digits come.** A search ends where the cost no longer changes, which leaves half of the digits, because the
  cost is flat there. Newton steps with extrapolated derivatives then go to where the residual is orthogonal to the
  tangent plane. The search itself is SciPy's; tight tolerances alone do not find the last digits.
- **Standard deviations** are the textbook's, from the same Jacobian and factorisation as the covariance of a fit; the
  least match is {least:.1f} digits, Lanczos1 aside. That problem repeats a sum of exponentials in 14 digits: its
  residual, 8e-14, is what the 14th digit rounded, and double precision knows each to half a percent. The deviations
  are proportional to it. With the residual in 80 bits they matched to 6.8 digits, tried once and no part of this run.
- **What it does not show.** These are small problems, and most have one minimum worth finding. How gonio finds the
  right one of several for a scan is compared with annealing in [benchmarks](../benchmarks/results.md).
"""


def line(row: dict[str, Any]) -> str:
    problem = row["problem"]
    cells = [problem.name, problem.level, str(len(problem.values)), str(len(problem.y))]
    forms = {"ours": ".1f", "deviations": ".1f", "evaluations": "d", "ms": ".1f"}
    forms |= dict.fromkeys(("curve_fit", "least_squares", "tight"), ".1f")
    cells += [pair(row[name], form) for name, form in forms.items()]
    return f"| {' | '.join(cells)} |"


def main() -> int:
    if not nist.FOLDER.is_dir():
        print(f"no certified problems at {nist.FOLDER}: nothing to measure")
        return 0
    rows = [measure(nist.load(nist.FOLDER / f"{name}.dat")) for name in nist.MODELS]
    page = markdown(rows)
    PAGE.write_text(page, encoding="utf-8")
    print(page)
    return 0 if passed(rows, "ours", 0) >= 25 and passed(rows, "ours", 1) == len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
