"""Writes docs/where-to-measure.md from benchmarks/designs.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "designs.json", DOCS / "where-to-measure.md"
SURFACES = ("Al", "SR107")


def fractions(record: dict[str, Any]) -> list[list[str]]:
    """A row for each noise and set of incidence angles: sigma, gamma and both, of either surface."""
    rows: dict[tuple[str, str], dict[tuple[str, str], str]] = {}
    for one in record["fractions"]:
        angles = "30, 40, 50" if len(one["theta_i"]) == 3 else "20 to 70"
        rows.setdefault((one["noise"], angles), {})["+".join(one["want"]), one["surface"]] = f"{one['fraction']:.3f}"
    wants = ("sigma", "gamma", "sigma+gamma")
    return [[*key, *(", ".join(found[want, s] for s in SURFACES) for want in wants)] for key, found in rows.items()]


def page(record: dict[str, Any]) -> str:
    """The page as Markdown."""
    noise = "noise: 1 % and 1 a.u."
    repeated = record["repeated"]
    uniform, designed = repeated["uniform"], repeated["designed"]
    ratio = {name: designed[name]["sd"] / uniform[name]["sd"] for name in ("sigma", "gamma")}
    half = record["whole"]["Al 114"]
    third = record["whole"]["Al 76"]
    worst = min(one[kind] for one in record["whole"].values() for kind in ("efficiency", "efficiency_of_repeats"))
    alike = " and ".join(f"{record['alike'][s]:.3f}" for s in SURFACES)
    rivals = [
        [name, *(f"{found[kind]:.3g}" for kind in ("uniform", "t_optimal", "least"))]
        for name, found in record["rivals"].items()
    ]
    return f"""# Where to measure next

{measured("make designs", record["date"], record["machine"])}

A reading at one direction says more of a value than at another. `gonio plan next` fits a model to the scan that you have, and chooses the
readings that make the values you want surest. A test runs the commands on this page.

```sh
gonio sample coating --out coating.csv
gonio plan next coating.csv --model ggx --want rho_s,index --points 30 --out next.csv
```

```text
...
30 readings for rho_s, index of ggx, beside the 196 of coating.csv
...
 standard uncertainty      now with these 30 with a uniform grid of 30
 ─────────────────────────────────────────────────────────────────────
...
wrote next.csv
```

It prints the directions in the order of measuring: along the arm and back, one incidence angle after another. The table has the standard
uncertainties that are expected now, with these readings, and with as many on a uniform grid. `next.csv` has the columns `order`,
`theta_i_deg`, `theta_r_deg` (0 to 90) and `phi_deg` (180 on the forward side); `--json -` has everything.

- **Work in rounds**: some 20 readings as a pilot, a plan, its readings, a fit to all of them, and again.
- `--theta-i 20,40,60`, `--theta-r -80:80`, `--every 2` and `--blocked 5` say what your goniometer can reach.
- `--noise 1%+0.5` is the standard deviation of a reading: relative and constant part. Without it the uncertainties that the scan states are
  taken, or what the residuals of the fit show.
- `--cost read=5,arm=0.5,table=60` are seconds: of a reading, a degree of the arm, and a move to another incidence angle. Angles that are not
  worth the move are left out.
- `--rival phong` chooses readings that tell the model from another one. `--repeats` lets one direction be read more than once.
- `--solution solution.nc` takes a fit that has been made.

```sh
gonio plan next coating.csv --model ggx --rival beckmann --points 10
```

The same in Python:

```python
import gonio
from gonio.design import Noise, next_readings, reachable
from gonio.fitting import fit

solution = fit(gonio.Problem(gonio.catalogue["ggx"], gonio.read("coating.csv"), weighting="log"))
directions = reachable(solution.scan, theta_r=(-80, 80), step=2, blocked=4)
plan = next_readings(solution, directions, 30, ["index"], noise=Noise(0.02, 0.0))
plan.after["index"] / plan.uniform["index"], plan.efficiency
```

## How it chooses

The rows a of the design are the derivatives of a reading by the free values, over its standard deviation, as the instrument of the fit reads it. The
readings give the information M, the sum of a a', to which that of the scan is added, and the values have the covariance C = M⁻¹. A plan
makes the sum of C_kk/u_k² small over the wanted values, with u_k what evenly spread readings would give: a greedy choice, then exchanges
of one direction for another (fedorov1972). Other values count for a little, 50 u_k where a wanted one has u_k, so that none of them is
abandoned. A fifth of all readings, those of the scan included, stands on a coarse grid that no model chose: a design for a wrong model is worse than a grid, and the grid
shows it.

The last lines say how good the plan is. No other design is better than a bound, which follows from the equivalence theorem
(kiefer1960): here whole designs reach {100 * worst:.1f} % of it, or more.

## What can be gained

The paper's model and surfaces, three incidence angles with 228 readings every 2 deg, 5 deg about the beam blocked. The numbers are the
fraction of these readings that gives sigma, gamma, or both the same uncertainty, if they are placed best (Al, SR107). *Both* is the worse of
the two where the sum of their variances is least; weighed so that both come out alike, it is {alike} instead of the first row's.
At an incidence angle that the uniform scan lacks, its weight ks has no uncertainty to be held to: there it counts by the median relative
uncertainty of the three others, which moves sigma or gamma alone by 0.001.

{table(["noise", "theta_i allowed [deg]", "sigma", "gamma", "both"], fractions(record), 5)}

- **One value: a third** of the readings or less is enough. **Two at once: about a half**, with three incidence angles: {114} of 228 readings
  give sigma {half["ratios"][0]:.2f} and gamma {half["ratios"][1]:.2f} times their uncertainty, and 76 give {third["ratios"][0]:.2f} and {third["ratios"][1]:.2f} times. A third for both needs a free choice of incidence angles and
  noise that is nearly constant.
- **In {repeated["repeats"]} repeated measurements** of Al ({noise}), 228 uniform readings scatter gamma by {uniform["gamma"]["sd"]:.3f} deg. A pilot of
  23 and 53 readings designed from its fit scatter it by {designed["gamma"]["sd"]:.3f} deg, {ratio["gamma"]:.2f} times as much, at a mean of {designed["gamma"]["mean"]:.2f} (true: 47).
- **What it costs**: sigma, which was not asked for, is then {ratio["sigma"]:.1f} times less certain than with the uniform readings. Ask for every
  value that you need.

## Rival models

Readings needed to tell the paper's model from a rival with a chance of 98 % (test at 5 %, one degree of freedom): on a uniform grid, by a
T-optimal design (atkinson1975), and what no design is below ({noise}).

{table(["surface and rival", "uniform", "T-optimal", "at least"], rivals, 1)}

## What it cannot do

- It takes the **noise** and the **model** at their word, and readings as independent of each other.
- **Systematic errors stay**, however many readings are taken. Where the scan states them, the plan names what they leave, and says when the
  random part is below half of it: further readings then pay little.
- Readings near the horizon look worth much, because the BRDF is large there. A cosine there is small too: state a noise that grows, or keep
  `--theta-r` below.
- The expected uncertainties are those of a fit that weighs readings by the noise; the plan names the option.
- It plans for one model, and for one wavelength or channel at a time.
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make designs")
