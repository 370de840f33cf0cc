"""Writes docs/answers.md from benchmarks/answers.json and from the thresholds in the code."""

from typing import Any

import numpy as np
from _pages import BENCHMARKS, DOCS, measured, table, write

from gonio.comparison import answer, consistency, race, runs, verdict
from gonio.fitting.objective import automatic

RECORD, PAGE = BENCHMARKS / "answers.json", DOCS / "answers.md"

HEAD = f"""# Which model describes a scan

{{measured}}

`gonio fit SCAN` and `gonio.fit(scan)` answer that with nothing else asked: which model, how well, with which values, and how sure.
`gonio compare SCAN` prints the ranking behind the answer. Each step can be replaced by an option; the study of the paper is
`gonio compare SCAN --models family --weighting uniform --validate none`.

## 1 What is left out of every fit

Some scans contradict themselves. Exchange of source and detector leaves a BRDF as it is, so f(a, b)/f(b, a) tells the error of a
measurement whatever the surface is. An incidence angle whose median abs ln f(a, b)/f(b, a) is over {consistency.OUTSTANDING:g} times that
of all pairs, and over {np.expm1(consistency.LEAST):.0%}, is left out, the worst first, as long as one stands out: what remains is the largest consistent
subset. It needs {consistency.FEWEST_ANGLES} incidence angles, and at most a third is left out. At the ends of a curve, up to {consistency.BEYOND}
values are left out behind a drop by more than a factor of {np.exp(consistency.EDGE):.1f} in one step, if no step near is a third as
steep: there the arm stands in the light, or the sample ends. gonio prints what it left out and why; `--keep-all` fits everything.

## 2 The weighting

`--weighting auto` takes, from the values in use:

| weighting | where | why |
|---|---|---|
| `log` | all values are positive, and no uncertainty is stated for all of them or they span more than {automatic.DECADES:g} decades | a model of a real surface misses by some per cent of the value, at the peak as in the wings |
| `uncertainty` | all are positive, within {automatic.DECADES:g} decades, and each has a stated uncertainty | the inverse variance is the weight of least variance |
| `relative` | some are not positive, or over {automatic.FEW:.0%} are less than three times their stated uncertainty | the logarithm of noise says nothing |

For `relative` the noise of small values is, from the first that the scan has: the median stated uncertainty of the smallest
{automatic.SMALLEST:.0%} of the values, the scatter of repeats among them, or the rms of the negative values. The noise floor is where it is
{automatic.RELATIVE_ERROR:.0%} of the value, and at least the value below which {automatic.RESOLVED:.0%} of the positive ones lie.
The choice and its reason are printed, and are in the JSON under `weighting`.

## 3 The models

Every model of the catalogue is quickly fitted to {race.LOOKED_AT} points by a few rough searches. Those within {race.SPREAD:g} times the least error, {race.FEWEST} at least
and {race.MOST} at most, are fitted by a few searches, the best first, as long as one may still predict better than the best so far; the best, and a second
within {(runs.CLOSE - 1):.0%} of it, are then fitted by all searches. None of this proves that the others are worse; `--models all` of `gonio compare` fits all.
Of more than {answer.RACED} points, so many stand for all while models are compared, and the best is then fitted to all.

## 4 What they are judged by

Each incidence angle is left out in turn, where the scan has three, else each of five parts of blocks of directions 5° wide. Models
are ranked by their error there, in the metric of the weighting: lg RMSE for logarithms, else E (eq 11) under the weights. A metric that the fit
did not see decides nothing. The error of the best of several models is a little too small, because the model was chosen by it.

## 5 The verdict

The error is told as a part of the value: 10^e − 1 of an lg RMSE of e, the root of E else. The scan's own scatter is how far positive
values lie off the cubic through their four neighbours on the curve, by the median; with coarse steps it is an upper bound.

| grade | left-out error |
|---|---|
| good | up to {verdict.GOOD:.0%}, or up to {verdict.OWN:g} times the scan's own scatter |
| fair | up to {verdict.FAIR:.0%} |
| poor | up to {verdict.POOR:.0%}: a factor of two |
| none | more: no model here describes the scan |

Values that no surface has are told: a reflectance above 1, an index below 1 without extinction. `--dielectric` keeps the index at 1 or
more and the extinction at 0, `--metal` the extinction at 1 or more. Intervals end at the bounds of the fit.

## On measured scans

`gonio fit SCAN` on {{count}} scans as their files are, with what the headers of some say to leave out: mean left-out lg RMSE **{{mean:.4f}}**,
the largest {{worst:.3f}}. Scans of up to 900 points took {{slowest:.0f}} s at most. *Left out* is in lg RMSE whatever the weighting.

"""
PEERS = """
`gonio compare FILE --models all --validate theta_i` with no weighting named, on the two sets that peers fitted with a binomial of 13
values: the best lg RMSE (in sample) with fewer values is {rows}.
"""


def page(record: dict[str, Any]) -> str:
    scans = record["scans"]
    errors = [one["left_out"] for one in scans.values()]
    small = [one["seconds"] for one in scans.values() if one["points"] <= 900]
    head = HEAD.format(
        measured=measured("make answers", record["date"], record["machine"]),
        count=len(scans),
        mean=np.mean(errors),
        worst=max(errors),
        slowest=max(small),
    )
    heads = ("scan", "model", "weighting", "grade", "points", "contradicted", "fitted", "left out", "s")
    rows = (
        (
            name,
            one["model"],
            one["weighting"]["name"],
            one["verdict"]["grade"],
            one["points"],
            one["contradicted"],
            f"{one['fitted']:.4f}",
            f"{one['left_out']:.4f}",
            f"{one['seconds']:.1f}",
        )
        for name, one in scans.items()
    )
    peers = ", ".join(f"{one['fitted']:.4f} on {name} ({one['model']})" for name, one in record["compared"].items())
    return head + table(heads, rows, 4) + "\n" + PEERS.format(rows=peers)


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make answers")
