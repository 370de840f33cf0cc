"""The stack that was made of many files, as plain data and for people."""

from collections.abc import Iterator
from typing import Any

from gonio.app.output import warn
from gonio.files import FormatError
from gonio.outside import shortened
from gonio.stacking import Stacked
from gonio.units import unit_label

MOST_SKIPPED = 5  # files of a folder that are named with the reason why they are no scans; the others are counted


def reason(error: FormatError) -> str:
    """Why a file is no scan, without its name."""
    return f"{error.where}: {error.what}" if error.where else error.what


def warn_of_skipped(done: Stacked) -> None:
    """Say on standard error which files of a folder are no scans, the first of them with the reason."""
    for error in done.skipped[:MOST_SKIPPED]:
        warn(error.path, f"left out: {reason(error)}")


def record(done: Stacked) -> dict[str, Any]:
    """What came of it, as plain data."""
    return {
        "out": str(done.path),
        "scans": len(done.names),
        "names": done.names,
        "directions": done.directions,
        "unit": done.unit,
        "history": done.notes,
        "left_out": {str(error.path): reason(error) for error in done.skipped},
    }


def lines(done: Stacked) -> Iterator[str]:
    """The same for people."""
    head = f"{len(done.names)} scans of {done.directions} values [{unit_label(done.unit)}]: "
    yield shortened(head, done.names, "", most=160)
    yield from done.notes[1:]
    yield f"wrote {done.path}; gonio fit-stack {done.path} --model MODEL --out FITS.zarr fits it"
