"""The directional-hemispherical reflectance of a table, and what is wrong with it."""

from collections.abc import Sequence

import xarray as xr

from gonio.measured.check import Finding, Severity
from gonio.resampling.hemisphere import Reflectance, contradictions, reflectances
from gonio.results.numbers import figure


def of_table(scan: xr.Dataset) -> list[Reflectance]:
    """The reflectances of a scan; none where its directions are too many and too scattered to be interpolated."""
    try:
        return reflectances(scan)
    except ValueError:
        return []


def findings(scan: xr.Dataset, found: Sequence[Reflectance]) -> list[Finding]:
    """A stated TIS that is not that of the table."""
    if wrong := contradictions(scan, found):
        one = max(wrong, key=lambda c: max(c.stated, c.table.value) / max(min(c.stated, c.table.value), 1e-300))
        what = f"the file states a TIS of {figure(one.stated)}, and its table integrates to {figure(one.table.value)}"
        remedy = "one of them is wrong, or the TIS is without the cosine, of half the azimuths or less a beam"
        return [Finding(Severity.WARNING, what, remedy, one.table.where, "tis")]
    return []
