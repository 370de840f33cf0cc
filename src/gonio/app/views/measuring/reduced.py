"""What a reduction gave, as plain data and for people: the budget in the style of the GUM, flags, steps."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gonio.app.output import strong, table
from gonio.reduction.budget import COVERAGE, MOST_CORRELATED, Budget, budget, correlation
from gonio.reduction.reduce import flags
from gonio.reduction.standards import Absolute
from gonio.reduction.steps.filling import UNDER, solid_angle
from gonio.resampling.conversion import in_words
from gonio.results.reduction import HEADS, LEFT, NOTE, TITLE, rows

if TYPE_CHECKING:
    import xarray as xr
    from rich.table import Table

    from gonio.reduction.standards import Relative
    from gonio.resampling.conversion import Conversion

MOST_LINES = 200  # of a history, beyond which the rest is counted
PRINTED = "eq 10 of guo2023 as printed lacks the solid angle"


def record(scan: "xr.Dataset", done: "Conversion", how: "Absolute | Relative | None" = None) -> dict[str, Any]:
    """The reduction as plain data. `correlation` between directions is there for up to MOST_CORRELATED of them."""
    found = budget(scan)
    used = found.scan.sizes["direction"]
    out = {
        "out": str(done.path),
        "format": done.format.name,
        "directions": scan.sizes["direction"],
        "fill": scan.attrs.get("fill") or None,
        "k": COVERAGE,
        "budget": found.record(),
        "combined": found.combined.tolist(),
        "expanded": found.expanded.tolist(),
        "in_use": {n: found.scan[n].values.tolist() for n in ("theta_i", "theta_r", "phi", "brdf")},
        "correlation": correlation(found.scan).tolist() if used <= MOST_CORRELATED else None,
        "flags": flags(scan),
        "history": scan.attrs["history"].splitlines(),
        "left_out": list(done.left_out),
    }
    if isinstance(how, Absolute) and scan.attrs.get("fill") == UNDER:
        omega = solid_angle(how.radius.value, how.distance.value)
        out["solid_angle"] = omega
        out["eq10_as_printed"] = {"note": PRINTED, "values": (scan["brdf"].values * omega).tolist()}
    return out


def lines(scan: "xr.Dataset", done: "Conversion", how: "Absolute | Relative | None" = None) -> "Iterator[Any]":
    """The same for people."""
    history = scan.attrs["history"].splitlines()
    yield from history[:MOST_LINES]
    if len(history) > MOST_LINES:
        yield f"and {len(history) - MOST_LINES} more lines of history, which the file holds"
    found = budget(scan)
    if found.rows:
        yield budget_table(found)
        yield NOTE
    if isinstance(how, Absolute) and scan.attrs.get("fill") == UNDER:
        omega = solid_angle(how.radius.value, how.distance.value)
        first = float(scan["brdf"].values[0])
        yield f"{PRINTED}: it gives {first * omega:.7g} where f is {first:.7g} 1/sr, short of 1/Omega = {1 / omega:.8g}"
    masked = sum(one["masked"] for one in flags(scan))
    if flags(scan):
        yield strong("flags", f": {len(flags(scan))}, of which {masked} mask a value; none is left out or changed")
    yield f"wrote {done.path} as {done.format.title}, {scan.sizes['direction']} directions"
    yield from (f"left out: {line}" for line in done.left_out)
    yield f"as the file reads now: {in_words(done.error, done.format)}"


def budget_table(found: Budget) -> "Table":
    """The budget in the style of the GUM."""
    out = table(*HEADS, title=TITLE, left=LEFT)
    listed = rows(found)
    for k, row in enumerate(listed):
        if k == len(found.rows):
            out.add_section()
        out.add_row(*row)
    return out
