"""Writes docs/completion.md from benchmarks/completed.json."""

from typing import Any

import numpy as np
from _pages import BENCHMARKS, DOCS, measured, table, write

from gonio.completion.process import LENGTHS, MOST, SEVERAL

RECORD, PAGE = BENCHMARKS / "completed.json", DOCS / "completion.md"
WAYS = {
    "prior": "corrected, with the prior",
    "no_prior": "corrected, without it",
    "prior_alone": "a Lambertian, corrected",
}
GOALS = {"prior": (0.097, 0.082), "no_prior": (0.103, None)}  # lg RMSE: mean, geometric mean
HELD = (90, 98)  # % of the values that the 95 % intervals are to hold


def errors(scans: dict[str, Any]) -> dict[str, np.ndarray]:
    """Left-out lg RMSE of the model alone and of every way, over the scans."""
    found = {way: np.array([scan[way]["validated"] for scan in scans.values()]) for way in WAYS}
    return {"plain": np.array([scan["prior"]["validated_plain"] for scan in scans.values()])} | found


def mean_row(name: str, values: dict[str, np.ndarray], of: Any) -> list[str]:
    return [f"**{name}**", *(f"**{of(one):.4f}**" for one in values.values()), "", ""]


def geometric(values: np.ndarray) -> float:
    return float(np.exp(np.mean(np.log(values))))


def share(held: int, count: int) -> str:
    return f"{100 * held / count:.0f}" if count else "–"


def rows(scans: dict[str, Any]) -> list[list[str]]:
    out = []
    for name, scan in scans.items():
        one = scan["prior"]["intervals"]
        held = (share(one["interior_held"], one["interior"]), share(one["steepest_held"], one["steepest"]))
        own = [scan["prior"]["validated_plain"], *(scan[way]["validated"] for way in WAYS)]
        out.append([name, *(f"{value:.4f}" for value in own), *held])
    values = errors(scans)
    return [*out, mean_row("mean", values, np.mean), mean_row("geometric mean", values, geometric)]


def significance(scans: dict[str, Any]) -> str:
    """Whether the correction and the prior gain more than two standard errors of the mean logarithm over the scans."""
    values = errors(scans)
    pairs = {
        "The correction without the prior": ("no_prior", "plain"),
        "The correction with the prior": ("prior", "plain"),
        "The prior, beside the correction without it": ("prior", "no_prior"),
    }
    out = []
    for words, (new, old) in pairs.items():
        ratios = np.log(values[new] / values[old])
        mean, error = float(np.mean(ratios)), float(np.std(ratios, ddof=1) / np.sqrt(len(ratios)))
        clear = "" if abs(mean) > 2 * error else ": less than two standard errors, so no difference that means anything"
        better = int(np.sum(values[new] < values[old]))
        out.append(
            f"- {words} changes the geometric mean by {100 * np.expm1(mean):+.1f} % "
            f"(standard error {100 * error:.1f} %){clear}. It is better on {better} of {len(ratios)} scans."
        )
    return "\n".join(out)


def goals(scans: dict[str, Any]) -> str:
    values, out = errors(scans), []
    for way, (mean, geometric_mean) in GOALS.items():
        found = float(np.mean(values[way]))
        said = f"- {WAYS[way].capitalize()}: mean lg RMSE {found:.4f}; {judged(found, mean)}."
        if geometric_mean is not None:
            other = geometric(values[way])
            said += f" Geometric mean {other:.4f}; {judged(other, geometric_mean)}."
        out.append(said)
    for kind in ("interior", "steepest"):
        count, held = (sum(s["prior"]["intervals"][k] for s in scans.values()) for k in (kind, f"{kind}_held"))
        percent = 100 * held / count
        reached = "reached" if HELD[0] <= percent <= HELD[1] else "not reached"
        out.append(
            f"- The 95 % intervals hold {percent:.1f} % of {count} values left out at {PLACES[kind]}; the goal is "
            f"{HELD[0]} to {HELD[1]} %: {reached}."
        )
    return "\n".join(out)


PLACES = {"interior": "all angles but the steepest", "steepest": "the steepest angle of each scan"}


def judged(found: float, goal: float) -> str:
    return f"the goal of {goal:g} is " + ("reached" if found <= goal else f"missed by {100 * (found / goal - 1):.1f} %")


def azimuths(found: dict[str, Any]) -> str:
    ways = [(words, found[way]) for way, words in WAYS.items() if way in found]
    lines = [["the model alone", f"{found['plain']:.4f}", "–"]]
    lines += [[words, f"{one['log10_rmse']:.4f}", f"{100 * one['held']:.1f}"] for words, one in ways]
    narrow = min(one["held"] for _, one in ways) < HELD[0] / 100
    words = (
        "\n\nThe intervals are too narrow here: nothing out of the plane took part in choosing how the uncertainty is made."
        * narrow
    )
    return table(["filled by", "lg RMSE", "held by 95 % intervals [%]"], lines, 1) + words


def page(record: dict[str, Any]) -> str:
    scans = dict(sorted(record["scans"].items()))
    first = errors(scans)["plain"]
    heads = ["scan", "model alone", *WAYS.values(), "held [%]", "steepest [%]"]
    return f"""# Corrected predictions

{measured("make completed", record["date"], record["machine"])}

A model has few values, so it misses something of every surface, and misses it again at the next angle. `gonio complete` and
`gonio compare --correct` learn that from the residuals of the fit ([how](howto/completing.md)).

Each incidence angle of {len(scans)} measured scans is left out in turn. `{record["model"]}` is fitted in logarithms to the rest, the
correction is learned from the same rest, and both predict the angle. The numbers are lg RMSE, the rms error of the decimal logarithm: those of
`gonio compare SCAN --models {record["model"]} --weighting log --validate theta_i --correct --keep-all`. When a scan of one of the {record["materials"]} public
materials is judged, that material is left out of the prior.

{table(heads, rows(scans), 1)}

*a Lambertian, corrected* uses no parametric form of the lobe: all of it is learned. *held* is how many of the values left out lie in their 95 % intervals, with the
prior; *steepest* is that of the steepest incidence angle, which is extrapolated.

## Goals, and what came out

{goals(scans)}

{significance(scans)}

The model alone has a mean of {np.mean(first):.4f} and a geometric mean of {geometric(first):.4f}. Lengths, bounds and the growth of the uncertainty were chosen on these same
scans, so the figures are a little too good; on other surfaces the gain may be smaller.

## Out of the plane

AnoBlack EC1 on aluminium, measured over all azimuths: {record["full_azimuth"]["outside"]} values out of the plane of incidence are predicted from
{record["full_azimuth"]["in_plane"]} values in it.

{azimuths(record["full_azimuth"])}

## How the uncertainty is made

The residual lg m - lg f is a Gaussian process (rasmussen2006) of three coordinates, ln(shift + 0.05), the distance from the back direction, and cos θᵢ cos θᵣ. None
changes where light and detector are exchanged. Its variance has four parts: a smooth one; one that resembles what `gonio-best` misses of public materials; one of each
curve of one incidence angle, which is taken for an error of that curve's measurement; and noise. Their sizes are those of the largest likelihood of the residuals of
the scan, each with an upper bound in units of the rms residual. Lengths ({", ".join(f"{length:g}" for length in LENGTHS)}) and bounds were chosen on the scans above alone.
Where a scan has more than {MOST} values, {SEVERAL} processes each learn from {MOST} of them at even steps, and the mean of their predictions is taken (breiman1996).

The process knows nothing of how models fail where source and detector are both low. So the uncertainty is multiplied by a factor. Take the smaller of θᵢ and θᵣ of the
direction, less the largest such value of the scan. The factor is 1 where that is -20° or below, grows linearly to 3.5 at 0°, and to 6 at 20° and beyond. It was chosen on the scans above so that the
steepest angle is held often enough. The standard uncertainty that is written is that of one measured value: of the correction and of the noise. That of the fitted values is not in it.

The public materials are the RGL database (dupuy2018, CC0) as networks of Neural-BRDF (MIT) stand for them. `make prior` fits each and writes the table.
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make completed")
