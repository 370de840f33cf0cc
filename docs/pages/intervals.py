"""Writes docs/intervals.md from benchmarks/intervals.json."""

from math import sqrt
from statistics import fmean
from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "intervals.json", DOCS / "intervals.md"
METHODS = {"percentile": "percentiles", "bca": "BCa", "robust": "robust covariance"}


def percents(rates: dict[str, float]) -> list[str]:
    return [f"{100 * rate:.1f}" for rate in rates.values()]


def means(row: dict[str, Any]) -> list[object]:
    """One surface and noise: the mean over the parameters for each kind of interval, and the band."""
    rates = list(row["rates"].values())
    mean = {kind: fmean(of_parameter[kind] for of_parameter in rates) for kind in rates[0]}
    return [row["surface"], row["noise"], *percents(mean | {"band": row["band"]})]


def overall(rows: list[dict[str, Any]]) -> str:
    """The mean of the default intervals over all parameters of all surfaces, and the least and the most of them."""
    rates = [100 * of_parameter["robust"] for row in rows for of_parameter in row["rates"].values()]
    return (
        f"Over all {len(rates)} parameters below, intervals of the default, the robust covariance, contain the true value in\n"
        f"{fmean(rates):.1f} % of the repetitions on average, in {min(rates):.0f} to {max(rates):.0f} % for each parameter."
    )


def page(record: dict[str, Any]) -> str:
    setting, cases = record["setting"], list(record["cases"].values())
    simulated = [row for row in cases if "resampled" not in row]
    resampled = [row for row in cases if "resampled" in row]
    level, (first, last) = 100 * setting["level"], setting["theta_r"]
    kinds = [f"{kind} [%]" for kind in next(iter(simulated[0]["rates"].values()))]
    spread, spread_of_bootstrap = (
        100 * sqrt(setting["level"] * (1 - setting["level"]) / setting[name]) for name in ("scans", "bootstrap_scans")
    )
    dates = " and ".join(sorted({row["date"] for row in cases}))
    machines = " and ".join(sorted({row["machine"] for row in cases}))
    minutes = sum(row["seconds"] for row in cases) / 60
    *angles, last_angle = (f"{angle:g}" for angle in setting["theta_i"])
    single = [
        [row["surface"], row["noise"], name, *percents(rates)]
        for row in simulated
        for name, rates in row["rates"].items()
    ]
    drawn = [
        [row["resampled"], name, *percents({method: rates[method] for method in METHODS})]
        for row in resampled
        for name, rates in row["rates"].items()
    ]
    return f"""# Coverage of intervals

{measured("make intervals", dates, machines, f"The measurement took {minutes:.0f} minutes.")}

A {level:g} % interval should contain the true value in {level:g} of 100 repetitions of a measurement. Here each measurement is
simulated {setting["scans"]} times. theta_i is {", ".join(angles)} or {last_angle} deg. theta_r goes from {first:g} to {last:g} deg in steps of {setting["theta_r_step"]:g} deg. The
weighting is uniform. The noise is normal, and it has one of two forms: *constant* is the same at every point,
*proportional* is proportional to the value there. The numbers are the percentage of intervals that contain the true
value.

## Means over the parameters

*band* is the interval of the fitted curve from the robust covariance, as a mean over the directions of the scan. With
{setting["scans"]} repetitions, the percentage for one parameter has a standard uncertainty of {spread:.1f}.

{table(["surface", "noise", *kinds, "band [%]"], map(means, simulated), 2)}

{overall(simulated)}

## Each parameter

{table(["surface", "noise", "parameter", *kinds], single, 3)}

## Bootstrap

The surface is `{resampled[0]["surface"]}`, with {resampled[0]["noise"]} noise. There are {setting["bootstrap_scans"]} scans with {setting["bootstrap_draws"]} draws each, because every draw
is a fit. A percentage has a standard uncertainty of {spread_of_bootstrap:.1f}. The last column is the robust covariance on the same scans.

{table(["kind of draw", "parameter", *(f"{name} [%]" for name in METHODS.values())], drawn, 2)}

## What the numbers mean

- **robust** is the default. It estimates the noise from the residual of each point (HC3), so it needs no assumption on
  how the noise depends on the signal. Where few points determine a value, such as the specular weight at 50 deg, there
  are few residuals, and the intervals are a little too narrow.
- **scaled** is the formula of textbooks, s² (J'J)⁻¹. It is right for constant noise. With proportional noise the peak
  scatters more than the mean of all points. Then the intervals of values that the peak determines are too narrow, and
  the others are too wide.
- **absolute** takes the uncertainty that the scan states. Here that uncertainty is the true one, so these intervals
  must be right.
- **profile** is the profile likelihood at the level of the robust covariance.
- **bootstrap**: draws of kind `residual` correct the residuals for leverage, as the robust covariance does. Draws of
  kind `pairs` do not, and their intervals are too narrow where few points determine a value. BCa also needs the bias,
  which so few draws estimate badly.
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make intervals")
