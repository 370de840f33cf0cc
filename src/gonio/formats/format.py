"""What a file format is to gonio."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr


@dataclass(frozen=True)
class Holds:
    """What a file of one format can say; what a scan has beyond that is left out with a word, or refused.

    `sets`: the coordinates (of dataset.SETS) by which it tells several sets of directions apart; one set of any kind
    always fits. `variables`: the variables beside brdf that it keeps, `*` for all. `gaps`: whether a value may be
    missing. `quantity`: what it holds where that is no BRDF, as the scan's attribute of that name says.
    `relative`: whether it says that data are relative; one that cannot is never given relative data.
    """

    azimuths: bool = True
    anisotropic: bool = False
    transmission: bool = False
    relative: bool = False
    gaps: bool = False
    negative: bool = True
    sets: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    quantity: str = ""


@dataclass(frozen=True)
class Format:
    """One file format, declared at the end of the file that reads it.

    `recognises` sees the first bytes of a file (for a directory, the names in it, one a line), never its name. Formats
    are asked in the order of `rank`, so that a format without a signature of its own comes last.
    `write(scan, path)` may be None: a format that is only read. `layout(scan)` gives the directions that the format
    stores for a scan, as a Dataset of coordinates on the format's own dimensions; `write` then gets a scan on exactly
    these, NaN only where `holds.gaps` or below the horizon. Without a layout a format stores the scan's own directions
    and `write` gets any scan that `holds` allows.
    """

    name: str
    title: str
    suffix: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path], xr.Dataset]
    write: Callable[[xr.Dataset, Path], None] | None = None
    layout: Callable[[xr.Dataset], xr.Dataset] | None = None
    evaluate: Callable[..., npt.NDArray[np.float64]] | None = None
    holds: Holds = field(default_factory=Holds)
    rank: int = 0
