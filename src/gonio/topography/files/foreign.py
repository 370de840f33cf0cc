"""Height maps of instruments, some forty formats (Olympus LEXT first), through SurfaceTopography where it is there.

It is imported only when such a file is opened, because that takes seconds.
"""

import contextlib
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gonio.door.text import MOST_VALUES, clip
from gonio.files import FormatError
from gonio.topography.heights import Grid

EXTRA = "pip install 'gonio[topography]'"
LEXT = "lext"  # Olympus, as SurfaceTopography calls it
MASK = 4  # of the TIFF tag PhotometricInterpretation: a page that is a mask
UNMEASURED = "invalid"  # what LEXT calls its page of points that were not measured
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
        with warnings.catch_warnings(), _without_remarks():
            warnings.simplefilter("ignore")
            with SurfaceTopography.open_topography(str(path)) as reader:
                grid = _grid(path, reader.topography(), reader.format())
                return _without_unmeasured(path, grid) if reader.format() == LEXT else grid
    except FormatError:
        raise
    except Exception as error:  # forty readers of another package may raise any exception for a damaged file
        raise FormatError(path, f"is no height map that SurfaceTopography reads{_why(error)}", "byte 0") from error


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


@contextlib.contextmanager
def _without_remarks() -> Iterator[None]:
    """Without what packages log of a damaged file, bytes of it included: readers try in turn, and one error says it."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _why(error: Exception) -> str:
    """What a reader of SurfaceTopography says of a damaged file of its format; else what may be wrong."""
    from SurfaceTopography.Exceptions import CorruptFile, UnsupportedFormatFeature

    # Which of forty readers said what, and any other exception, is of no use to who has the file.
    if isinstance(error, CorruptFile | UnsupportedFormatFeature):
        return f" ({clip(' '.join(str(error).split()), 160)})"
    return f", and none of {OWN}: it is damaged, or holds something else, which gonio info may tell"


def _without_unmeasured(path: Path, grid: Grid) -> Grid:
    """NaN where the mask of a LEXT file says that nothing was measured, which SurfaceTopography does not read.

    It is a page of one bit a point, set where a point is missing: with the photometric interpretation of a mask, or the
    description INVALID.
    """
    from tifffile import TiffFile  # which SurfaceTopography needs for LEXT, too

    with TiffFile(path) as file:
        pages = [page for page in file.pages if page.photometric == MASK or _called(page) == UNMEASURED]
        masks = [np.asarray(page.asarray()).astype(bool) for page in pages]
    for mask in masks:
        if mask.shape != grid.z.shape:
            sizes = " and ".join(f"{rows} x {columns}" for rows, columns in (mask.shape[:2], grid.z.shape))
            raise FormatError(path, f"the page of missing points and that of heights differ in size: {sizes}", "byte 0")
        grid.z[mask] = np.nan
    return grid


def _called(page: Any) -> str:
    """The description of a TIFF page, in small letters."""
    return str(page.description).strip().lower()


def _provenance(info: Any, kind: str) -> str:
    """The format, and instrument and time where the file says them."""
    instrument = info.get("instrument") or {}
    said = {"format": kind, "instrument": instrument.get("name"), "vendor": instrument.get("vendor")}
    said["acquired"] = info.get("acquisition_time")
    return "\n".join(f"{name}: {clip(str(value), 200)}" for name, value in said.items() if value)
