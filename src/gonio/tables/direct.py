"""What `gonio.read` does with a table that is no tidy CSV: take it where its headings state all, else say how to."""

from pathlib import Path

import xarray as xr

from gonio.files import FormatError
from gonio.tables.read import understood
from gonio.tables.request import Request

MOST_BYTES = 2**20  # a larger file is not looked through for the sake of a message: gonio import reads it


def read_stated(path: Path, refused: FormatError) -> xr.Dataset:
    """The scan of a table whose headings state names, units and the quantity.

    Raises `refused`, why it is no tidy CSV, for any other table, with the command that reads it, or that would with
    what the user alone knows.
    """
    if path.stat().st_size > MOST_BYTES:
        raise FormatError(path, f"{refused.what}; if it is a table, {Request().command(path)} reads it", refused.where)
    try:
        table = understood(path, Request())
    except FormatError as error:
        if ": gonio import " not in error.what:
            raise refused from None
        raise FormatError(path, f"{refused.what}; or as another table: {error.what}", refused.where) from None
    if table.is_stated:
        return table.scan
    raise FormatError(path, f"{refused.what}; or, to read it as it is, {Request().command(path)}", refused.where)
