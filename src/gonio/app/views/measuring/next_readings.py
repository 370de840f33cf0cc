"""Planned readings for people, as plain data and as a table of directions."""

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.app.output import figure, strong, table
from gonio.design.rivals import TELLING
from gonio.files import replacing
from gonio.fitting.status import Status
from gonio.measured.dataset import is_in_plane, signed_theta_r

if TYPE_CHECKING:
    import xarray as xr

    from gonio.design import Noise, Plan
    from gonio.design.tell_apart import Apart
    from gonio.fitting.solution import Solution

COLUMNS = ("order", "theta_i_deg", "theta_r_deg", "phi_deg")
WORSE = 1.05  # times a value's uncertainty after a uniform grid: less need not be said


def rows(directions: "xr.Dataset") -> list[tuple[int, float, float, float]]:
    """Order of measuring from 1, theta_i, theta_r from 0 to 90 and phi [deg] of directions in their order."""
    angles = (directions[n].values.tolist() for n in ("theta_i", "theta_r", "phi"))
    return [(k, *one) for k, one in enumerate(zip(*angles, strict=True), start=1)]


def write(directions: "xr.Dataset", path: Path, force: bool, nearest: float) -> None:
    """The directions as CSV, theta_r from 0 to 90 with phi = 180 on the forward side; or as a plan, by the suffix.

    nearest: the angle to the source [deg] within which the arm stands in the beam. FileExistsError where the file
    exists, without `force`.
    """
    if path.suffix.lower() == ".toml":
        from gonio.acquisition.layout import Layout, planned

        in_plane = bool(is_in_plane(directions).all())
        theta_r = signed_theta_r(directions) if in_plane else directions["theta_r"].values
        phi = [None] * len(theta_r) if in_plane else directions["phi"].values.tolist()
        wanted = zip(directions["theta_i"].values.tolist(), np.asarray(theta_r).tolist(), phi, strict=True)
        planned(wanted, Layout(blocked=nearest)).write(path, force)
        return
    lines = [",".join(COLUMNS), *(",".join(f"{value:g}" for value in row) for row in rows(directions))]
    with replacing(path, force) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def record(plan: "Plan") -> dict[str, Any]:
    """A plan for values as plain data; infinite uncertainties become null."""
    return {
        "wanted": list(plan.wanted),
        "directions": _directions(plan.directions),
        "uncertainties": {
            name: {"now": plan.now[name], "after": plan.after[name], "uniform": plan.uniform[name]} for name in plan.now
        },
        "uncertainties_systematic": dict(plan.systematic),
        "efficiency": plan.efficiency,
        "noise": _noise(plan.noise),
        "seconds": plan.seconds,
        "left_out_theta_i": list(plan.left_out),
        "at_bound": list(plan.at_bound),
    }


def lines(plan: "Plan", solution: "Solution", which: str) -> Iterator[Any]:
    """A plan for values, for people."""
    count = plan.directions.sizes["direction"]
    values = "all values" if len(plan.wanted) == len(plan.now) else ", ".join(plan.wanted)
    points = solution.dataset.attrs["points"]
    yield strong(f"{count} readings for {values}", f" of {solution.model.name}, beside the {points} of {which}")
    yield from _status_lines(solution)
    yield from _listed(plan.directions)
    yield _uncertainties(plan)
    yield from _noise_lines(plan.noise, solution)
    yield f"no other {count} readings are better by more than {_percent(1 / plan.efficiency - 1)}"
    if plan.guarded and plan.guarded[1] > WORSE:
        name, ratio = plan.guarded
        yield f"{name}, not wanted, is kept within {ratio:.2g} times its uncertainty after a uniform grid"
    for name in plan.at_bound:
        yield f"{name} lies at its bound, and is taken as held there"
    for name, part in plan.systematic.items():
        yield strong(name, f": a systematic part of {figure(part)} stays, however many readings{_enough(plan, name)}")
    if plan.seconds is not None:
        angles = ", ".join(f"{angle:g}" for angle in plan.left_out)
        yield f"they take {plan.seconds:.0f} s{f'; not worth a move of the table: theta_i {angles}' if angles else ''}"


def apart_record(apart: "Apart") -> dict[str, Any]:
    """A plan that tells models apart, as plain data."""
    return {
        "rivals": list(apart.rivals),
        "directions": _directions(apart.directions),
        "noncentrality": {"now": apart.now, "after": apart.after, "uniform": apart.uniform, "enough": TELLING},
        "noise": _noise(apart.noise),
    }


def apart_lines(apart: "Apart", solution: "Solution") -> Iterator[Any]:
    """A plan that tells models apart, for people."""
    count = apart.directions.sizes["direction"]
    yield strong(f"{count} readings that tell {solution.model.name} from {' and '.join(apart.rivals)}")
    yield from _status_lines(solution)
    yield from _listed(apart.directions)
    found = table("readings", "noncentrality", "enough")
    named = {"so far": apart.now, f"with these {count}": apart.after, f"with a uniform grid of {count}": apart.uniform}
    for name, value in named.items():
        found.add_row(name, figure(value), "yes" if value >= TELLING else "no")
    yield found
    yield (
        f"if {solution.model.name} is the true model, a test of fit of the other at 5 % misses that 2 times in 100 at "
        f"a noncentrality of {TELLING:g}"
    )
    yield from _noise_lines(apart.noise, solution)


def _status_lines(solution: "Solution") -> Iterator[Any]:
    """What is wrong with the fit that the plan trusts; nothing where nothing is."""
    if solution.status not in (Status.CONVERGED, Status.AT_BOUND):
        yield strong("the plan trusts a fit", f": {solution.status}")


def blocked_lines(nearest: float) -> Iterator[str]:
    """How near the beam no direction was chosen; nothing where all were free."""
    if nearest > 0:
        yield f"directions nearer than {nearest:.3g} deg to the incident beam are left out"


def _listed(directions: "xr.Dataset") -> Iterator[str]:
    """The directions in the order of measuring, a line for each incidence angle and azimuth."""
    flat = bool(is_in_plane(directions).all())
    angle = signed_theta_r(directions) if flat else directions["theta_r"].values
    phi = np.zeros(len(angle)) if flat else directions["phi"].values
    rows = list(zip(directions["theta_i"].values.tolist(), phi.tolist(), angle.tolist(), strict=True))
    for (theta_i, azimuth), some in groupby(rows, key=lambda row: row[:2]):
        plane = "" if flat else f", phi {azimuth:g}"
        yield f"theta_i {theta_i:g}{plane}: theta_r {', '.join(_runs([row[2] for row in some]))}"


def _runs(angles: list[float]) -> Iterator[str]:
    """Angles in their order, three or more a degree apart as `30 to 36`."""
    start = 0
    for k in range(1, len(angles) + 1):
        if k < len(angles) and abs(abs(angles[k] - angles[k - 1]) - 1) < 1e-9:
            continue
        run = angles[start:k]
        yield from [f"{run[0]:g} to {run[-1]:g}"] if len(run) > 2 else [f"{one:g}" for one in run]
        start = k


def _uncertainties(plan: "Plan") -> Any:
    count = plan.directions.sizes["direction"]
    found = table("standard uncertainty", "now", f"with these {count}", f"with a uniform grid of {count}")
    for name in (*plan.wanted, *(n for n in plan.now if n not in plan.wanted)):
        found.add_row(name, *(figure(column[name]) for column in (plan.now, plan.after, plan.uniform)))
    return found


def _noise_lines(noise: "Noise", solution: "Solution") -> Iterator[str]:
    yield (
        f"taken for the noise of a reading: {noise} ({noise.said}), independent from one to the next, in a fit that "
        f"weighs by it{_weighting(noise, solution)}"
    )


def _weighting(noise: "Noise", solution: "Solution") -> str:
    """How to have that fit, where the one at hand weighs otherwise; in logarithms errors in proportion weigh alike."""
    weighting, floor = solution.dataset.attrs["weighting"], float(solution.dataset.attrs["noise_floor"])
    if not noise.relative:
        return "" if weighting in ("uniform", "uncertainty") else " (--weighting uniform)"
    wanted = noise.constant / noise.relative
    in_proportion = wanted < float(solution.scan["brdf"].min())
    if weighting == "uncertainty" or (
        in_proportion and (weighting == "log" or (weighting == "relative" and not floor))
    ):
        return ""
    if weighting == "relative" and wanted and 0.5 < floor / wanted < 2:
        return ""
    return f" (--weighting relative{'' if in_proportion else f' --noise-floor {wanted:.2g}'})"


def _enough(plan: "Plan", name: str) -> str:
    """Whether the random part is small beside the systematic one, after which readings pay nothing."""
    if plan.now[name] < plan.systematic[name] / 2:
        return "; the random part is below half of it already, and further readings pay little"
    if plan.after[name] < plan.systematic[name] / 2:
        return "; with these the random part is below half of it, and more would pay little"
    return ""


def _percent(part: float) -> str:
    return f"{max(100 * part, 0.1):.1f} %"


def _noise(noise: "Noise") -> dict[str, Any]:
    return {"relative": noise.relative, "constant": noise.constant, "from": noise.said}


def _directions(directions: "xr.Dataset") -> list[dict[str, float]]:
    return [dict(zip(COLUMNS, row, strict=True)) for row in rows(directions)]
