"""Readers of height maps: each knows its files by their first bytes. READERS lists them; a new one is one more entry.

What none of them knows goes to SurfaceTopography, which the extra `gonio[topography]` installs.
"""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from gonio.door import text
from gonio.files import FormatError
from gonio.outside import printable
from gonio.topography.files import foreign, matrix, sdf, x3p
from gonio.topography.files.matrix import Stated
from gonio.topography.heights import Grid, add_history, make_heights

HEAD = 65_536  # bytes that a reader may look at: a matrix may begin with many lines of remarks


class Reader(NamedTuple):
    """One kind of file: its name, whether a file that begins with some bytes is one, and how it is read.

    says_all: whether a file states its pitch and its unit, so that nobody else has to.
    """

    name: str
    title: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path, Stated], Grid]
    says_all: bool = True


READERS = (
    Reader("sdf", "SDF (ISO 25178-71)", sdf.recognises, lambda path, _: sdf.read(path)),
    Reader("x3p", "X3P (ISO 25178-72)", x3p.recognises, lambda path, _: x3p.read(path)),
    Reader("npy", "array of NumPy", matrix.is_array, matrix.read_array, says_all=False),
    Reader("matrix", "matrix in text", matrix.is_text, matrix.read_text, says_all=False),
)
FOREIGN = Reader(
    "foreign", "a file of an instrument, by SurfaceTopography", lambda head: True, lambda path, _: foreign.read(path)
)


def reader_of(path: Path) -> Reader:
    """The reader of a file, from its content. Raises FormatError for a file that is empty, packed or none."""
    start = text.head(path, HEAD, archives=True)
    if not start:
        raise FormatError(path, "is empty", "byte 0")
    found = next((reader for reader in READERS if reader.recognises(start)), FOREIGN)
    # An archive without the index of X3P may be one of an instrument, whose files are archives too.
    if found.name == "x3p" and not x3p.is_x3p(path):
        return FOREIGN
    return found


def read_heights(path: str | Path, *, pitch: float | tuple[float, float] | None = None, unit: str = "") -> xr.Dataset:
    """Read a height map; the format is recognised by the content of the file.

    gonio itself reads SDF (ISO 25178-71), X3P (ISO 25178-72), matrices in text and arrays of NumPy. Files of
    instruments, such as Olympus LEXT, are read by SurfaceTopography: `pip install 'gonio[topography]'`.

    Parameters
    ----------
    path : str or Path
        The file.
    pitch : float or tuple of float, optional
        Distance of neighbouring points [um], or those along x and y: for a matrix that does not say it.
    unit : str
        Unit of the heights of a matrix that does not say it: m, mm, um, nm or pm; without it um, which `history` says.

    Returns
    -------
    xarray.Dataset
        `z` [um], NaN where nothing was measured, and `mask` over `y` and `x` [um].

    Raises
    ------
    FormatError
        A ValueError: the file is damaged or of no known format, a map of that size cannot be, or more than 20 % of the
        points are missing. It names the file, the place in it and the remedy.

    """
    path = Path(path)
    steps = (pitch, pitch) if isinstance(pitch, int | float) else tuple(pitch or (0.0, 0.0))
    stated = Stated(float(steps[0]), float(steps[1]), unit)
    reader = reader_of(path)
    if reader.says_all and stated != Stated():
        raise ValueError(f"{path}: is {reader.title}, which says pitch and unit itself: leave them out")
    grid = reader.read(path, stated)
    try:
        heights = make_heights(grid.z, grid.dx, grid.dy, provenance=grid.provenance)
    except ValueError as error:
        raise FormatError(path, str(error), grid.place) from error
    heights = add_history(heights, f"read from {printable(path.name)} as {reader.title}")
    if not reader.says_all:
        heights = add_history(heights, f"took heights in {unit or 'the unit of the file, or um where it says none'}")
    logging.getLogger(__name__).info("read %s as %s", printable(str(path)), reader.title)
    return heights
