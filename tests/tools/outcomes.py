"""What may come of a file: a valid Dataset, or one line that names the file and the place."""

import os
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import height_files
from doors import through_doors
from gonio import formats as registry
from gonio.files import FormatError
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import ABSOLUTE, DIRECTIONS, HORIZON, RELATIVE
from gonio.tables import read_table
from gonio.topography.files import FOREIGN, read_heights, reader_of

LONGEST = 2.0  # s of processor time for one file
LONGEST_MESSAGE = 1000  # characters beside the path
ALLOWED = ("is empty", "no such file", "is a directory", "is not a regular file")  # these have no place
# Files that go through every door, and what a door says to a file that is of another kind than its own.
EVERY_DOOR = ("fit", "stack", "scan")
TABLE = "table"  # files of `gonio import`
HEIGHTS = tuple(height_files.KINDS)  # height maps, of `gonio topography`
OF_ANOTHER_KIND = (
    "is no solution of a fit",
    "is no Zarr store",
    "is a directory",
    "none of the formats",
    "knows no BRDF",
)
AXES = {axis for system in SYSTEMS.values() for axis in system.axes}


def wrong_with_dataset(scan: Any) -> str:
    """What is wrong with a Dataset that a reader returned; empty where nothing is."""
    if missing := [n for n in ("brdf", *DIRECTIONS[:3]) if n not in scan.variables]:
        return f"has no {missing}"
    if missing := [n for n in DIRECTIONS[:3] if n not in scan.coords]:
        return f"{missing} is no coordinate"
    brdf = scan["brdf"]
    if brdf.attrs.get("units") not in (ABSOLUTE, RELATIVE):
        return "brdf has no unit"
    if brdf.dtype.kind != "f" or np.isinf(brdf.values).any():
        return f"brdf is infinite, or {brdf.dtype}"
    finite = np.isfinite(brdf.values)
    if not brdf.values[finite].any() and "every value is zero" not in scan.attrs.get("history", ""):
        return "no value of brdf is there and not zero"
    for name in (n for n in DIRECTIONS if n in scan.coords):
        angle = scan[name]
        if not set(angle.dims) <= set(brdf.dims):
            return f"{name} is over {angle.dims}, brdf over {brdf.dims}"
        low, high = (0.0, HORIZON) if name.startswith("theta") else (-np.inf, np.inf)
        good = np.isfinite(angle.values) & (angle.values >= low) & (angle.values <= high)
        if not good.all() and not _over(good, angle.dims, brdf)[finite].all():
            return f"{name} is not finite, or not within {low:g} to {high:g}, where brdf is finite"
    return _wrong_with_axes(scan) or _wrong_with_rest(scan)


def _over(values: Any, dims: tuple, brdf: Any) -> Any:
    """Values over some dimensions of brdf, spread over all of them."""
    order = [d for d in brdf.dims if d in dims]
    turned = np.transpose(values, [dims.index(d) for d in order])
    return np.broadcast_to(turned.reshape([brdf.sizes[d] if d in dims else 1 for d in brdf.dims]), brdf.shape)


def _wrong_with_axes(scan: Any) -> str:
    for dim in scan["brdf"].dims:
        if dim in AXES and dim in scan.coords:
            values = scan[dim].values
            if not np.isfinite(values).all() or len(np.unique(values)) < len(values):
                return f"the axis {dim} has gaps or repeats"
    return ""


def _wrong_with_rest(scan: Any) -> str:
    if "wavelength" in scan.coords:
        wavelength = scan["wavelength"].values.astype(float)
        if not (np.isfinite(wavelength) & (wavelength > 0)).all():
            return "a wavelength is not finite and positive"
    for name in ("uncertainty", "uncertainty_systematic"):
        if name in scan and np.isinf(scan[name].values.astype(float)).any():
            return f"{name} is infinite"
    return ""


def wrong_with_heights(heights: Any) -> str:
    """What is wrong with a height map that a reader returned; empty where nothing is."""
    z, used = heights["z"].values, heights["mask"].values == 0
    if z.ndim != 2 or z.dtype.kind != "f" or not np.isfinite(z[used]).all() or np.isfinite(z[~used]).any():
        return "z is no matrix of numbers, or its mask is not that of what is missing"
    for name in ("x", "y"):
        steps = np.diff(heights[name].values)
        if not (np.isfinite(steps) & (steps > 0)).all() or heights[name].attrs.get("units") != "um":
            return f"{name} does not grow, or has no unit"
    if used.mean() < 0.8 or np.ptp(z[used]) == 0 or np.abs(z[used]).max() > 1e12:
        return "too much is missing, or the heights cannot be"
    return ""


def wrong_with_error(error: FormatError, path: Path) -> str:
    """What is wrong with a refusal; empty where it names the file and a place in one line that can be printed."""
    text = str(error)
    if str(path) not in text:
        return "does not name the file"
    if not text.isprintable():
        return "is not one line of printable characters"
    if len(text) > LONGEST_MESSAGE + len(str(path)):
        return f"is {len(text)} characters long"
    place = (
        error.where.rpartition(", ")[2] if Path(path).is_dir() else error.where
    )  # in a directory, a file comes first
    if not place.startswith(("line ", "byte ")) and not any(words in text for words in ALLOWED):
        return f"names no place (where is {error.where!r})"
    return ""


class TooLong(BaseException):
    """The alarm; no `except Exception` of a reader catches it."""


def attempt(path: Path, name: str, begin: Callable[[], None] = lambda: None) -> tuple[str, str, bool]:
    """Read a file: read, refused or failed; why; and whether it was recognised as the format `name`.

    A fit, a stack or a scan of any format goes through every door, and counts as recognised where one of them takes it,
    or finds what is wrong beyond its kind. `begin` is called before each door, which has its own seconds.
    """
    reached = False
    try:
        if name in EVERY_DOOR:
            said = through_doors(path, begin)
            reached = not all(any(kind in line for kind in OF_ANOTHER_KIND) for line in said)
            return ("refused" if all(said) else "read"), "", reached
        if name == TABLE:
            reached = True
            wrong = wrong_with_dataset(read_table(path))
            return ("failed", f"Dataset of a table: {wrong}", reached) if wrong else ("read", "", reached)
        if name in HEIGHTS:
            reader = reader_of(path)
            reached = name.endswith(reader.name)
            says_all = reader.says_all or reader is FOREIGN
            wrong = wrong_with_heights(read_heights(path) if says_all else read_heights(path, pitch=0.5))
            return ("failed", f"Dataset of heights: {wrong}", reached) if wrong else ("read", "", reached)
        found = registry.recognise(path)
        reached = found.name == name
        scan = found.read(path)  # the rest of gonio.read, which asks every format once more
        wrong = wrong_with_dataset(scan)
        return ("failed", f"Dataset of {found.name}: {wrong}", reached) if wrong else ("read", "", reached)
    except FormatError as error:
        wrong = wrong_with_error(error, path)
        text = str(error).replace(str(path), "FILE")[:200]
        return ("failed", f"FormatError {wrong}: {text!r}", reached) if wrong else ("refused", "", reached)
    except TooLong as error:
        return "failed", f"takes over {LONGEST:g} s at {_last_lines(error)}", reached
    except Exception as error:
        return "failed", f"{type(error).__name__} at {_last_lines(error)}: {str(error)[:160]!r}", reached


def _last_lines(error: BaseException) -> str:
    """The last places in gonio that an error came through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if f"{os.sep}gonio{os.sep}" in f.filename] or frames
    return " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in reversed(ours[-2:]))
