"""Writes docs/solver-quality.md from benchmarks/nist.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "nist.json", DOCS / "solver-quality.md"
SOLVERS = {
    "digits": "gonio",
    "curve_fit": "SciPy `curve_fit`, default settings (method lm)",
    "least_squares": "SciPy `least_squares`, default settings (method trf)",
    "tight": 'SciPy `least_squares`, 3-point differences, tolerances 1e-15, `x_scale="jac"`',
}
COLUMNS = {  # what a column of numbers says of the two starts, and how it is printed
    "digits": ("digits of values, gonio", ".1f"),
    "digits_of_deviations": ("digits of standard deviations, gonio", ".1f"),
    "evaluations": ("evaluations, gonio", "d"),
    "ms": ("time, gonio [ms]", ".1f"),
    "curve_fit": ("digits, `curve_fit`", ".1f"),
    "least_squares": ("digits, `least_squares`", ".1f"),
    "tight": ("digits, `least_squares`, tolerances 1e-15", ".1f"),
}


def solved(record: dict[str, Any], solver: str, start: int) -> int:
    return sum(row[solver][start] >= record["digits_required"] for row in record["problems"])


def cells(row: dict[str, Any]) -> list[object]:
    pairs = [" / ".join(format(number, form) for number in row[name]) for name, (_, form) in COLUMNS.items()]
    return [row["problem"], row["difficulty"], row["values"], row["points"], *pairs]


def page(record: dict[str, Any]) -> str:
    problems, bar = record["problems"], f"{record['digits_required']:g}"
    bar_deviation, printed = (f"{record[name]:g}" for name in ("digits_of_deviations_required", "certified_digits"))
    counts = [[label, solved(record, name, 0), solved(record, name, 1)] for name, label in SOLVERS.items()]
    of_rounding = record["deviations_of_rounding"]
    least = min(min(row["digits_of_deviations"]) for row in problems if row["problem"] not in of_rounding)
    return f"""# Solver quality: NIST's certified problems

{measured("make nist", record["date"], record["machine"])}

NIST publishes {len(problems)} problems of nonlinear regression (nist1998). Each has certified values and standard deviations with
{printed} digits, and two starting points: start 1 is far from the solution, start 2 is near it. gonio solves them with the
local search of every fit, `gonio.fitting.search.descent`. The settings are the same for all problems. The search gets
the residual of a problem and nothing else, so its derivatives are differences. `tests/fitting/search/test_nist.py`
requires {bar} matching digits of every value, for {record["problems_required"][0]} problems from start 1 and for {record["problems_required"][1]} from start 2. For the standard
deviations of a solved problem it requires {bar_deviation} digits, with one exception: {", ".join(of_rounding)}.

{table(["solver", f"problems with {bar} digits from start 1, of {len(problems)}", "from start 2"], counts, 1)}

The number of matching digits is minus the decimal logarithm of the relative error of the worst value. It is at most
{printed}, because NIST prints {printed} digits. Where a cell has two numbers, the first is for start 1 and the second for start 2.
An evaluation is one call of the residual; calls for differences are counted too. The time is the shortest of {record["runs"]} runs
on one thread.

{table(["problem", "difficulty", "values", "points", *(head for head, _ in COLUMNS.values())], map(cells, problems), 2)}

## What the numbers mean

- **Why the search finds nearly all digits.** SciPy's search stops where the sum of squares no longer changes. Near its
  minimum that sum changes with the square of the error, so only half of the digits are then right. gonio goes on with
  Newton steps from extrapolated derivatives, to the point where the residual is orthogonal to the tangent plane. Small
  tolerances alone do not give these digits.
- **Standard deviations** come from the same Jacobian and the same factorisation as the covariance of a fit. Without
  {", ".join(of_rounding)}, at least {least:.1f} digits match. Lanczos1 is a sum of exponentials that is rounded to 14 digits. Its
  residual of 8e-14 is this rounding error. In double precision each value of it has a rounding error of half a percent,
  and the standard deviations are proportional to the residual. In one trial with 80-bit numbers, which is not part of
  this measurement, 6.8 digits matched.
- **What the numbers do not show.** The problems are small, and most have one minimum. How gonio and simulated annealing
  find the lowest of several minima of a scan is compared in [another page](annealing.md).
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make nist")
