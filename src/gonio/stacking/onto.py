"""Scans taken at common directions, and the error that this cost over all of them."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.measured.dataset import directions
from gonio.resampling.difference import difference
from gonio.resampling.resample import is_on, resample


@dataclass
class Onto:
    """The directions at which every scan is taken, those of the file `path`, and an account of what that cost."""

    path: Path
    target: xr.Dataset
    scans: int = 0
    changed: int = 0  # scans that have other directions of their own
    gaps: int = 0  # values that are missing after it, of `gappy` scans
    gappy: int = 0
    errors: dict[str, float] = field(default_factory=dict)  # relative rms, of the scans that were changed

    @staticmethod
    def of(scan: xr.Dataset, path: Path) -> "Onto":
        """The directions of a scan, those of several sets each once."""
        return Onto(path, directions(scan))

    def taken(self, scan: xr.Dataset, path: Path) -> xr.Dataset:
        """A scan at these directions: as measured where it has them, else interpolated, and NaN outside."""
        taken = resample(scan, self.target)
        self.scans += 1
        missing = int(np.isnan(taken["brdf"].values).sum())
        self.gaps += missing
        self.gappy += missing > 0
        if not is_on(scan, self.target):
            found = difference(taken, scan)
            self.changed += bool(found.missing or found.exact < found.count or found.error.any())
            self.errors[str(path)] = found.rms if found.count else math.nan
        return taken

    @property
    def words(self) -> str:
        """The account in one line, for the history."""
        text = f"taken at the directions of {self.path.name}"
        known = {path: rms for path, rms in self.errors.items() if math.isfinite(rms)}
        if not self.changed:
            text += ": every value as measured"
        elif known:
            worst = max(known, key=lambda path: known[path])
            text += (
                f": {self.changed} of {self.scans} scans have others; rms error by solid angle "
                f"{100 * float(np.median(list(known.values()))):.3g} % (median of {len(known)}), "
                f"at most {100 * known[worst]:.3g} % ({Path(worst).name})"
            )
        if len(self.errors) > len(known):
            text += f"; {len(self.errors) - len(known)} without an error, as they have no value there"
        return text + (f"; {self.gaps} values missing in {self.gappy} scans" if self.gaps else "")
