"""Writes docs/spectral-fits.md from benchmarks/spectral.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "spectral.json", DOCS / "spectral-fits.md"
OF_GAINS = [
    "wavelengths",
    "noise [% of each value]",
    "weighting",
    "error, free [%]",
    "error, auto [%]",
    "error, best fixed [%]",
    "error, free / auto",
    "error, auto / best fixed",
    "the same for the seed where it is largest",
]
OF_COSTS = [
    "model",
    "parameter with one value for each wavelength",
    "shape parameter shared by all wavelengths",
    "values",
    "time [s]",
    "excess of E",
]


def gain(row: dict[str, Any]) -> list[object]:
    free, auto, fixed = row["free"], row["auto"], row["best_fixed"]
    percents = [f"{100 * error:.2f}" for error in (free, auto, fixed)]
    ratios = [f"{ratio:.2f}" for ratio in (free / auto, auto / fixed, row["largest_auto_over_best_fixed"])]
    return [row["wavelengths"], f"{100 * row['noise']:g}", row["weighting"], *percents, *ratios]


def cost(row: dict[str, Any]) -> list[object]:
    excess = "not compared" if row["excess_of_E"] is None else f"{row['excess_of_E']:.1g}"
    return [
        row["model"],
        row["grouped"],
        ", ".join(row["shared"]) or "none",
        row["values"],
        f"{row['seconds']:.1f}",
        excess,
    ]


def page(record: dict[str, Any]) -> str:
    load = f"There were {record['load_a_core']:.1f} running tasks for each core."
    of_costs, (lowest, highest) = record["costs_of"], record["strengths"]
    return f"""# Spectral fits

{measured("make spectral", record["date"], record["machine"], load)}

## Values that are smooth over wavelength

The scans are simulated with Torrance-Sparrow, at wavelengths with unequal steps and with {record["directions"]} directions for each.
ks is a linear function of wavelength; kd and sigma have curvature. Each scan is fitted in three ways:

- *free*: each wavelength has values of its own;
- *auto*: all three parameters are smooth, and gonio chooses the strengths;
- *best fixed*: all three have the same strength, the one of {lowest:.0e} to {highest:.0e}, in steps of half a decade, that
  gives the smallest error. To find it, one must know the true values.

An error is the rms of the relative errors of all values, over {record["seeds"]} seeds of the noise.

{table(OF_GAINS, map(gain, record["gains"]), 0)}

## One shape value for each wavelength

The scans are simulated with {of_costs["wavelengths"]} wavelengths, {of_costs["directions"]} directions for each and noise of {100 * of_costs["noise"]:g} % of each value. One fit has a value of
the shape parameter for each wavelength. {of_costs["wavelengths"]} other fits each have the data of one wavelength. The excess of E is the
squared error of the first fit divided by the sum over the others, minus 1. If the wavelengths share another shape
parameter, they cannot be fitted separately, and there is nothing to compare.

{table(OF_COSTS, map(cost, record["costs"]), 3)}
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make spectral")
