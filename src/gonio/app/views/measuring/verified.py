"""A verification as plain data and for people: deviations by eq 9, each with its range."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from gonio.app.output import figure, table
from gonio.verification import Compared, Deviation, Mirrored

PERCENT = 100.0


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
