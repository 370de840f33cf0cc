"""A verification as plain data and for people: deviations by eq 9, each with its range."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gonio.app.output import figure, table, uncertain
from gonio.verification import Compared, Deviation, Mirrored, Outcome

PERCENT = 100.0
VERDICTS = {True: "passes", False: "fails", None: "no verdict"}
FINE = 1e-5  # of a number
HOW_KNOWN = {
    "": "let the file state standard deviations, or give --uncertainty, the expanded one (k = 2) of the set-up",
    "deg": "let the file state standard deviations, or give --zero, its standard uncertainty in degrees",
}


def _deviation(one: Deviation) -> dict[str, Any]:
    return {
        "values": one.what,
        "count": one.count,
        "delta": one.delta,
        "expanded_uncertainty": one.expanded,
        "passes": one.passes,
    }


def mirror_record(found: Sequence[Mirrored], deviations: Sequence[Deviation]) -> dict[str, Any]:
    """Every reflectance with its theory, and a deviation for each polarisation."""
    return {
        "procedure": "specular",
        "deviations": [_deviation(one) for one in deviations],
        "reflectances": [
            {
                "polarisation": one.polarisation,
                **{name: getattr(one, name).tolist() for name in ("theta_i", "measured", "theory", "uncertainty")},
                "error_of_unknown_polarisation": one.error.tolist(),
            }
            for one in found
        ],
    }


def mirror_lines(found: Sequence[Mirrored], deviations: Sequence[Deviation]) -> Iterator[Any]:
    """The same for people."""
    rows = table("polarisation", "theta_i", "R measured", "R theory", "difference [%]")
    for one in found:
        for theta_i, measured, theory in zip(one.theta_i, one.measured, one.theory, strict=True):
            off = PERCENT * (measured / theory - 1)
            rows.add_row(one.polarisation, f"{theta_i:g}", f"{measured:.5f}", f"{theory:.5f}", f"{off:+.3f}")
    yield rows
    yield _table(deviations)
    for one in found:
        if one.polarisation == "unknown":
            worst = int(np.argmax(one.error))
            yield (
                f"the polarisation is unknown: theory for s or p differs from this by up to "
                f"{PERCENT * one.error[worst]:.3g} %, at theta_i = {one.theta_i[worst]:g} deg; state it in the plan"
            )
    yield _verdict(deviations)


def diffuse_record(found: Compared, deviations: Sequence[Deviation], by: Sequence[Deviation]) -> dict[str, Any]:
    """Deviations by the range of theta_r, and of each incidence angle over all of it."""
    return {
        "procedure": "diffuse",
        "deviations": [_deviation(one) for one in deviations],
        "by_theta_i": [_deviation(one) for one in by],
        "directions": found.points.sizes["direction"],
        "beyond_the_certificate": found.missing,
    }


def diffuse_lines(found: Compared, deviations: Sequence[Deviation], by: Sequence[Deviation]) -> Iterator[Any]:
    """The same for people."""
    yield _table([*deviations, *by] if len(by) > 1 else deviations)
    if found.missing:
        yield f"{found.missing} directions of the scan lie beyond the certificate, and do not count"
    yield _verdict(deviations[-1:])


def _table(deviations: Sequence[Deviation]) -> Any:
    rows = table("values", "number", "delta [%]", "U (k = 2) [%]")
    for one in deviations:
        known = figure(PERCENT * one.expanded) if one.expanded == one.expanded else "-"
        rows.add_row(one.what, f"{one.count}", figure(PERCENT * one.delta), known)
    return rows


def _verdict(deviations: Sequence[Deviation]) -> str:
    """Whether delta (guo2023, eq 9) is below half the expanded uncertainty."""
    passed = [one.passes for one in deviations]
    if None in passed:
        return "no verdict: the uncertainty is not known; give --uncertainty, the expanded one (k = 2)"
    if all(passed):
        return "the set-up passes: delta (eq 9) is below half the expanded uncertainty"
    bad = "; ".join(one.what for one in deviations if not one.passes)
    return f"the set-up does not pass: delta (eq 9) is not below half the expanded uncertainty of {bad}"


def checks_record(
    found: Mapping[str, Outcome], known: Mapping[str, float], left_out: Mapping[str, str]
) -> dict[str, Any]:
    """Every check with its number, uncertainty and verdict. known: expanded uncertainties of the set-up, by check."""
    return {
        "procedure": "checks",
        "checks": [
            {
                "check": name,
                "what": one.what,
                "number": one.number,
                "unit": one.unit,
                "uncertainty": one.uncertainty,
                "count": one.count,
                "limit": one.limit(known[name]),
                "passes": one.passes(known[name]),
                "details": [detail._asdict() for detail in one.details],
                "notes": list(one.notes),
                "remedy": one.remedy,
            }
            for name, one in found.items()
        ],
        "left_out": dict(left_out),
    }


def checks_lines(
    found: Mapping[str, Outcome], known: Mapping[str, float], left_out: Mapping[str, str]
) -> Iterator[Any]:
    """The same for people; a remedy where a check fails."""
    rows = table("check", "number ± u", "limit", "values", "verdict", left=1)
    for name, one in found.items():
        limit = one.limit(known[name])
        shown = f"{figure(limit)} {one.unit}".rstrip() if math.isfinite(limit) else "–"
        verdict = VERDICTS[one.passes(known[name])]
        rows.add_row(name, f"{_with(one.number, one.uncertainty)} {one.unit}".rstrip(), shown, f"{one.count}", verdict)
    yield rows
    for name, one in found.items():
        yield f"{name}: {one.what}"
        yield from (f"  {detail.what}: {_with(detail.value, detail.uncertainty)}" for detail in one.details)
        yield from (f"  {note}" for note in one.notes)
    for name, one in found.items():
        passed = one.passes(known[name])
        if passed is False:
            yield f"{name} fails: {one.remedy}"
        elif passed is None:
            yield f"{name} has no verdict, as no uncertainty is known: {HOW_KNOWN.get(one.unit, HOW_KNOWN[''])}"
    yield from (f"{name} was left out: {why}" for name, why in left_out.items())


def _with(value: float, spread: float) -> str:
    """A value with its uncertainty; all digits of a value near one that is known to better than 1e-5."""
    if not math.isfinite(spread):
        return figure(value)
    if 0 < spread < FINE < abs(value):
        return f"{value:.{1 - math.floor(math.log10(spread))}f} ± {spread:.1e}"
    return uncertain(value, spread)
