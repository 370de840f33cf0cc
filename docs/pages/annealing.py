"""Writes docs/annealing.md from benchmarks/results.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "results.json", DOCS / "annealing.md"
HEADS = [
    "scan",
    "model",
    "E, exact weights",
    "excess of E by annealing, shape free",
    "excess of E by annealing, shape held",
    "ratio of times, shape held",
]


def excess(row: dict[str, Any], shape: str) -> str:
    """How far annealing ends above exact weights; `shape` is the end of the names of both numbers."""
    return f"{row[f'E_anneal{shape}'] / row[f'E_exact{shape}'] - 1:.1e}"


def cells(row: dict[str, Any]) -> list[object]:
    excesses = excess(row, ""), excess(row, "_fixed_shape")
    return [row["scan"], row["model"], f"{row['E_exact']:.6g}", *excesses, f"{row['time_ratio_fixed_shape']:,.0f}"]


def page(record: dict[str, Any]) -> str:
    figures, when = record["figures"], record["details"]["anneal_over_exact_all_scans"]["measured"]
    runs, fits = record["runs"], record["fits"]
    rows = [
        ["Ratio of times, shape held: median of all fits", f"{figures['anneal_over_exact_all_scans']:,.0f}", ""],
        ["Ratio of times, shape held: smallest", f"{figures['anneal_over_exact_least']:,.0f}", ""],
        ["Ratio of times, shape free: median", f"{figures['anneal_over_exact_free_shape']:,.0f}", ""],
        [
            "Fits in which exact weights give no higher E, shape free and shape held",
            f"{record['holds']} of {len(fits)}",
            "all",
        ],
        [f"`gonio --help`, median of {runs} runs [s]", f"{figures['help_seconds']:.3f}", "at most 0.5"],
        [f"`import gonio`, median of {runs} runs [s]", f"{figures['import_seconds']:.3f}", "at most 0.3"],
        [
            f"`gonio fit` of the copper scan, one ks for each theta_i, median of {runs} runs [s]",
            f"{figures['fit_copper_seconds']:.2f}",
            "at most 3",
        ],
    ]
    return f"""# Exact weights and simulated annealing, and times to start

{measured("make bench", when["date"], when["machine"])}

For given shape values, gonio computes the weights of a model as the exact optimum of a linear problem. The paper fits
all values by simulated annealing (guo2023, Appendix A). Here both fit each measured scan with each model of the paper;
the first weight of a model has one value for each incidence angle. Annealing has {record["annealing_evaluations"]:,} evaluations. A ratio of times
is the time of annealing divided by the time of exact weights. *Shape held* means that the shape values are held where
the fit with exact weights found them; *shape free* means that they are fitted. Annealing is timed once. Exact weights
with held shape are timed {runs} times, and the median counts.

{table(["quantity", "value", "required"], rows, 1, last=1)}

E is the objective of the fit. The excess of E by annealing is its E divided by the E of exact weights, minus 1. "No
higher" allows for a relative rounding error of 1e-9.

{table(HEADS, map(cells, fits), 2)}
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make bench")
