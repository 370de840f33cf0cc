"""What came of the fit of a stack, as plain data and for people."""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gonio.app.output import figure, table
from gonio.fitting.objective.from_scan import CONSTANTS
from gonio.fitting.stack.store import REACHED, failed
from gonio.outside import shortened
from gonio.stacking.writing import SAMPLE

MOST_NAMED = 5  # failed fits that the summary names; the others are counted

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.fitting.stack.manifest import Record
    from gonio.fitting.stack.run import Run


def record(run: "Run", stack: Path, out: Path, seconds: float) -> dict[str, Any]:
    """What came of all blocks, as plain data; seconds: what this run took of them."""
    records = list(run.manifest.records())
    fitted = sum(one.lanes for one in records if one.block not in run.done)
    return {
        "stack": str(stack),
        "out": str(out),
        "model": run.job.asked.model.name,
        "scans": run.job.blocks.lanes,
        "blocks": len(run.job.blocks),
        "blocks_resumed": len(run.done),
        "seconds": seconds,
        "fits_per_second": fitted / seconds if seconds else None,
        "weighting": run.job.asked.problem.weighting,
        "weighting_reason": run.job.asked.problem.weighting_reason,
        "noise_floor": run.job.asked.problem.noise_floor,
        "statuses": statuses_of(records),
        "undetermined": undetermined_in(records),
        "failed": _failed(run, records),
        "worst": max((r.worst for r in records if r.worst), key=lambda worst: worst["cost"], default=None),
    }


def statuses_of(records: "Iterable[Record]") -> dict[str, int]:
    """How many fits ended with which status, the most frequent first."""
    total: Counter[str] = Counter()
    for one in records:
        total.update(one.statuses)
    return dict(total.most_common())


def undetermined_in(records: "list[Record]") -> dict[str, int]:
    """In how many fits the data do not determine a value, by its name, the most frequent first."""
    total: Counter[str] = Counter()
    for one in records:
        total.update(one.undetermined)
    return dict(total.most_common())


def undetermined_lines(counts: dict[str, int], scans: int) -> Iterator[str]:
    """Which values the scans do not determine, why, and what to do about it; nothing where they determine all.

    A scan shows of `index` and `extinction` the Fresnel reflectance alone. Up to 60 deg from the normal of a facet it
    hardly changes, and cannot be told from the weight of its term, which then is not determined either.
    """
    if not counts:
        return
    if any(name.partition("[")[0] in CONSTANTS for name in counts):
        yield (
            f"not determined, in how many of {scans} scans: {_counted(counts)}. A scan shows index and extinction by "
            "the Fresnel reflectance alone, which hardly changes up to 60 deg from the normal. Say the material: "
            "--dielectric, --material NAME, or --hold index=1.5 --hold extinction=0"
        )
        return
    first = next(iter(counts)).partition("[")[0]
    yield (
        f"not determined, in how many of {scans} scans: {_counted(counts)}. Many values fit these scans alike: "
        f"hold one (--hold {first}=VALUE), or take a model of fewer values"
    )


def _counted(counts: dict[str, int]) -> str:
    return shortened("", [f"{name} {n}" for name, n in counts.items()], "", most=100)


def _failed(run: "Run", records: "list[Record]") -> dict[str, Any]:
    """How many fits reached no minimum, and the first of them by name and status."""
    counts = {r.block: sum(n for name, n in r.statuses.items() if name not in REACHED) for r in records}
    some = sorted(block for block, count in counts.items() if count)
    return {"scans": sum(counts.values()), "first": failed(run.job.out, run.job.blocks, some, MOST_NAMED)}


def _named(lane: dict[str, Any]) -> str:
    """A lane by its place: the name of a sample alone, other dimensions with theirs."""
    at = lane["at"]
    where = [str(v) for v in at.values()] if list(at) == [SAMPLE] else [f"{dim} {v}" for dim, v in at.items()]
    return f"{', '.join(where)} ({lane['status'].replace('_', ' ')})"


def lines(found: dict[str, Any]) -> "Iterator[Table | str]":
    """The same for people."""
    rows = table("status", "scans", "part")
    for status, count in found["statuses"].items():
        rows.add_row(status.replace("_", " "), f"{count}", f"{100 * count / found['scans']:.2f} %")
    yield rows
    yield from undetermined_lines(found["undetermined"], found["scans"])
    if failures := found["failed"]["scans"]:
        first = [_named(lane) for lane in found["failed"]["first"]]
        rest = f", and {failures - len(first)} more" * (failures > len(first))
        yield f"failed: {failures} scan{'s' * (failures > 1)}: {', '.join(first)}{rest}"
    floor = f" with a noise floor of {figure(found['noise_floor'])}" * (found["noise_floor"] > 0)
    yield f"weighting of every fit: {found['weighting']}{floor}, as {found['weighting_reason'] or 'asked'}"
    if found["seconds"]:
        yield f"{found['fits_per_second']:.4g} fits a second, {found['seconds']:.3g} s"
    else:
        yield f"nothing to do: {found['blocks']} of {found['blocks']} blocks are there"
    if worst := found["worst"]:
        where = ", ".join(f"{dim} {value}" for dim, value in worst["at"].items())
        yield f"worst: E {figure(worst['cost'])} at {where} ({worst['status'].replace('_', ' ')})"
    yield f"wrote {found['out']}"
