"""Height maps of instruments, some forty formats (Olympus LEXT first), through SurfaceTopography where it is there.

It is imported only when such a file is opened, because that takes seconds.
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from gonio.door.text import MOST_VALUES, clip
from gonio.files import FormatError
from gonio.topography.heights import Grid

EXTRA = "pip install 'gonio[topography]'"
OWN = "SDF, X3P, NPY, and a matrix of numbers in text"


def read(path: Path) -> Grid:
    """The heights of a file. Raises FormatError where SurfaceTopography is not installed, or does not read it."""
    try:
        import SurfaceTopography
    except ImportError as error:
        what = (
            f"is no height map that gonio reads by itself ({OWN}); those of instruments need another package: {EXTRA}"
        )
        raise FormatError(path, what, "byte 0") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with SurfaceTopography.open_topography(str(path)) as reader:
                return _grid(path, reader.topography(), reader.format())
    except FormatError:
        raise
    except Exception as error:  # forty readers of another package may raise any exception for a damaged file
        said = clip(" ".join(f"{type(error).__name__}: {error}".split()), 160)
        raise FormatError(path, f"is no height map that SurfaceTopography reads ({said})", "byte 0") from error


def _grid(path: Path, found: Any, kind: str) -> Grid:
    if found.dim != 2:
        raise FormatError(path, "holds a line of heights, and gonio reads areas", "byte 0")
    if not found.is_uniform:
        raise FormatError(path, "holds points in no grid: resample them first", "byte 0")
    if not found.unit:
        raise FormatError(path, "says no unit of lengths: save it in a format that does", "byte 0")
    if found.nb_grid_pts[0] * found.nb_grid_pts[1] > MOST_VALUES:
        raise FormatError(path, f"holds more than {MOST_VALUES} heights: cut out a part", "byte 0")
    scaled = found.to_unit("um")
    z = np.ma.filled(np.ma.masked_invalid(scaled.heights()).astype(float), np.nan).T  # SurfaceTopography has x first
    dx, dy = (float(side) / count for side, count in zip(scaled.physical_sizes, scaled.nb_grid_pts, strict=True))
    return Grid(np.ascontiguousarray(z), dx, dy, "byte 0", _provenance(found.info, kind))


def _provenance(info: Any, kind: str) -> str:
    """The format, and instrument and time where the file says them."""
    instrument = info.get("instrument") or {}
    said = {"format": kind, "instrument": instrument.get("name"), "vendor": instrument.get("vendor")}
    said["acquired"] = info.get("acquisition_time")
    return "\n".join(f"{name}: {clip(str(value), 200)}" for name, value in said.items() if value)
