"""The directional-hemispherical reflectance of a table: as plain data, in a line, and what is wrong with it."""

from collections.abc import Sequence
from typing import Any

import xarray as xr

from gonio.app.output import figure
from gonio.measured.check import Finding, Severity
from gonio.resampling.hemisphere import WHOLE, Reflectance, contradictions, reflectances


def of_table(scan: xr.Dataset) -> list[Reflectance]:
    """The reflectances of a scan; none where its directions are too many and too scattered to be interpolated."""
    try:
        return reflectances(scan)
    except ValueError:
        return []


def record(found: Sequence[Reflectance]) -> list[dict[str, Any]]:
    """The reflectances as plain data."""
    return [
        {"theta_i": one.theta_i, "phi_i": one.phi_i, **one.labels, "value": one.value, "covered": one.covered}
        for one in found
    ]


def in_words(told: Sequence[dict[str, Any]]) -> str:
    """The range of the reflectances in a line, and how much of the hemisphere the table covers."""
    values, covered = [one["value"] for one in told], min(one["covered"] for one in told)
    text = f"{figure(min(values))} to {figure(max(values))}" if len(told) > 1 else figure(values[0])
    if covered < WHOLE:
        return f"{text} in the {100 * covered:.3g} % of the hemisphere, or more, that are covered"
    return f"{text}, directional-hemispherical"


def findings(scan: xr.Dataset, found: Sequence[Reflectance]) -> list[Finding]:
    """A stated TIS that is not that of the table."""
    if wrong := contradictions(scan, found):
        one = max(wrong, key=lambda c: max(c.stated, c.table.value) / max(min(c.stated, c.table.value), 1e-300))
        what = f"the file states a TIS of {figure(one.stated)}, and its table integrates to {figure(one.table.value)}"
        remedy = "one of them is wrong, or the TIS is without the cosine, of half the azimuths or less a beam"
        return [Finding(Severity.WARNING, what, remedy, one.table.where, "tis")]
    return []
