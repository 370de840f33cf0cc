"""A plan as plain data and for people: how long, in which order, and what is left out with reasons."""

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

from gonio.acquisition.plan import Plan, Skipped, Step
from gonio.app.output import table


def record(plan: Plan, out: Path | None) -> dict[str, Any]:
    """The plan itself, with its hash, its duration [s] and the file."""
    about = {"out": None if out is None else str(out), "sha256": plan.sha256, "duration_s": plan.duration}
    return about | {"readings": counts(plan)} | plan.record


def counts(plan: Plan) -> dict[str, int]:
    """How many readings of each kind."""
    kinds = [step.kind for step in plan.steps]
    return {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}


def lines(plan: Plan, out: Path | None) -> Iterator[Any]:
    """The order as a table, then what is left out, then how long it takes."""
    order = table("order", "kind", "theta_i", "theta_r", "phi", "readings", left=2)
    for number, steps in enumerate(_parts(plan), start=1):
        first, last = steps[0], steps[-1]
        ends = [f"{one.theta_r:g}" for one in (first, last) if one.theta_r is not None]
        reach = " to ".join(dict.fromkeys(ends)) or "-"
        order.add_row(f"{number}", first.kind, _angle(first.theta_i), reach, _angle(first.phi), f"{len(steps)}")
    yield order
    yield from _left_out(plan.skipped)
    every = ", ".join(f"{count} {kind}" for kind, count in counts(plan).items())
    yield f"{len(plan.steps)} readings ({every}), {time_of(plan.duration)} without repeats and changes of range"
    if out is not None:
        yield f"wrote {out}; gonio measure {out} --bench BENCH.toml --log RUN.jsonl measures it"


def _parts(plan: Plan) -> Iterator[list[Step]]:
    """Runs of readings of one kind at one incidence angle; what is read between them stands alone."""
    for _, steps in groupby(plan.steps, key=lambda step: (step.kind, step.theta_i, step.phi)):
        yield list(steps)


def _left_out(skipped: tuple[Skipped, ...]) -> Iterator[str]:
    """Directions that are left out, those of one incidence angle and reason together."""
    if not skipped:
        yield "nothing is left out"
    for (theta_i, phi, reason), some in groupby(skipped, key=lambda one: (one.theta_i, one.phi, one.reason)):
        angles = [one.theta_r for one in some]
        reach = f"{angles[0]:g}" if len(angles) == 1 else f"{min(angles):g} to {max(angles):g}"
        azimuth = "" if phi is None else f", phi = {phi:g}"
        yield f"left out: theta_i = {theta_i:g}, theta_r = {reach}{azimuth} ({len(angles)}): {reason}"


def _angle(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"


def time_of(seconds: float) -> str:
    """A duration in the two units that matter: `2 h 05 min`."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
