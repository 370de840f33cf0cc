"""Every mistake that is looked for, and `check`, which looks for all."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import xarray as xr

from gonio.findings import angles, clipped, magnitude
from gonio.findings.cosine import cosine_left_in
from gonio.findings.curves import Curve, curves, reflected
from gonio.findings.grain import grain
from gonio.findings.turned import turned
from gonio.measured.check import Finding, worst_first
from gonio.measured.check import check as basic
from gonio.measured.dataset import is_degree
from gonio.resampling.hemisphere import Reflectance

UNREADABLE = (
    "no-directions",
    "stack",
    "unit",
    "no-value",
    "all-zero",
    "beyond-arithmetic",
)  # nothing else is seen then


@dataclass(frozen=True)
class Measured:
    """A scan as the mistakes see it: the whole, its values of reflected light in use, and its curves in plane."""

    scan: xr.Dataset
    table: Sequence[Reflectance] = ()

    @cached_property
    def flat(self) -> xr.Dataset:
        """The flat values in use of light that was reflected."""
        return reflected(self.scan)

    @cached_property
    def curves(self) -> list[Curve]:
        """The curves in plane."""
        return curves(self.flat)


# What looks for a mistake, by the names of the findings that it may give.
MISTAKES: Mapping[tuple[str, ...], Callable[[Measured], list[Finding]]] = {
    ("sign-reversed", "azimuth-mirrored"): lambda seen: turned(seen.flat),
    ("cosine-left-in",): lambda seen: cosine_left_in(seen.flat, seen.curves),
    ("radians",): lambda seen: angles.radians(seen.flat),
    ("percent", "factor-pi", "reflectance-above-one"): lambda seen: magnitude.too_large(
        seen.scan, seen.curves, seen.table
    ),
    ("angle-zero-shifted",): lambda seen: angles.angle_zero_shifted(seen.curves),
    ("saturated",): lambda seen: clipped.saturated(seen.flat, seen.curves),
    ("floor",): lambda seen: clipped.floor(seen.flat),
}

NAMES = tuple(name for names in MISTAKES for name in names)


def check(scan: xr.Dataset, table: Sequence[Reflectance] = ()) -> list[Finding]:
    """Look for everything that is wrong with a scan.

    Errors stop every fit; warnings say what may be wrong and what would mend it (docs/findings.md); notes inform.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    table : sequence of Reflectance
        The reflectances of a table over the hemisphere (`gonio.resampling.hemisphere`), where they were integrated,
        which takes up to seconds; without them energy is judged by what was measured in plane.

    Returns
    -------
    list of Finding
        The findings, the worst first, each with what is wrong, where, and the remedy; empty where nothing is.

    """
    found = basic(scan)
    if any(finding.name in UNREADABLE for finding in found):
        return found
    seen = Measured(scan, table)
    # what a lobe or the energy of a BRDF shows says nothing of a ratio
    if seen.flat.sizes["direction"] and not is_degree(scan):
        found = [finding for look in MISTAKES.values() for finding in look(seen)] + grain(seen.flat) + found
    return worst_first(found)
