"""What a report is about: a fit, the scan that it was fitted to, and what is known beside both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.plausibility import Verdict
from gonio.plotting.panels import parted
from gonio.plotting.style import quantity_of
from gonio.resampling.hemisphere import Reflectance
from gonio.results.energy import of_table
from gonio.results.laws import of_fit
from gonio.units import unit_label

MOST_SETS = 3  # channels, wavelengths .. whose curves and values are shown


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file that was read: its name and SHA-256, which is empty where it has none."""

    name: str
    sha256: str = ""


@dataclass(frozen=True, kw_only=True)
class Known:
    """What neither a scan nor a fit can say. about: as `about.About`. date: of the report. command: what was typed."""

    about: Mapping[str, Any] = field(default_factory=dict)
    date: str = ""
    command: str = ""
    seed: int | None = None
    files: Sequence[Source] = ()


@dataclass(frozen=True)
class Case:
    """A fit with its scan. whole: the scan as it was read, None where the fit alone is known."""

    solution: Solution
    whole: xr.Dataset | None
    known: Known

    @cached_property
    def points(self) -> xr.Dataset:
        """The points that were fitted (direction,)."""
        return self.solution.scan

    @cached_property
    def scan(self) -> xr.Dataset:
        """The scan as it was read, masked values too; else the points that were fitted."""
        return self.points if self.whole is None else self.whole

    @cached_property
    def flat(self) -> xr.Dataset:
        """The values of the scan that are in use (direction,)."""
        return dataset.points(self.scan)

    @cached_property
    def sets(self) -> dict[str, xr.Dataset]:
        """The channels, wavelengths .. that are shown, by what each is in words; at most MOST_SETS, evenly chosen."""
        every = list(self.all_sets.items())
        chosen = np.unique(np.linspace(0, len(every) - 1, MOST_SETS).round().astype(int))
        return dict(every[k] for k in chosen.tolist())

    @cached_property
    def all_sets(self) -> dict[str, xr.Dataset]:
        """Every channel, wavelength .. by what it is in words."""
        return parted(self.flat)

    @cached_property
    def table(self) -> list[Reflectance]:
        """How much light the measured directions hold together; nothing in plane, and for relative data."""
        return of_table(self.scan)

    @cached_property
    def part_known(self) -> Mapping[str, bool]:
        """Of each set that is shown whether the fit has values for it: values of a set may all have been left out."""
        return {words: self._is_known(part) for words, part in self.sets.items()}

    def _is_known(self, part: xr.Dataset) -> bool:
        try:
            self.solution.places(part)
        except ValueError:
            return False
        return True

    @cached_property
    def laws(self) -> dict[str, list[Verdict]]:
        """The verdicts on the fit by set (`laws.of_fit`); ValueError for groups of other coordinates."""
        return of_fit(self.solution)

    @property
    def unit(self) -> str:
        """The unit of the values for people."""
        return unit_label(self.solution.unit)

    @property
    def is_absolute(self) -> bool:
        """Whether the values are calibrated."""
        return self.solution.unit == dataset.ABSOLUTE

    @property
    def quantity(self) -> str:
        """BRDF, BTDF, or BSDF of both."""
        return quantity_of(self.flat)

    @property
    def model(self) -> str:
        """The name of the model."""
        return self.solution.model.name
