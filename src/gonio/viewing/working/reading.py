"""A file that was uploaded, read in a process of its own, where a damaged or hostile one can do no harm."""

from pathlib import Path

import xarray as xr

from gonio.files import FormatError
from gonio.fitting.solution import Solution
from gonio.fitting.stored import is_solution
from gonio.formats import read
from gonio.measured.stack import foreign_dims


def read_uploaded(path: Path) -> xr.Dataset | Solution:
    """The scan, or the fit with its scan, that a file holds; errors name the file alone, and not where it lies."""
    try:
        if is_solution(path):
            solution = Solution.load(path)
            if not solution.has_scan:
                raise ValueError(f"{path.name}: holds a fit without its scan: open the scan")
            return solution
        scan = read(path)
    except FormatError as error:
        raise FormatError(path.name, error.what.replace(str(path), path.name), error.where) from None
    except (ValueError, OSError) as error:
        raise ValueError(str(error).replace(str(path), path.name).replace(str(path.parent), "")) from None
    if foreign_dims(scan):
        raise ValueError(f"{path.name}: holds several scans side by side: write one of them by gonio convert")
    return scan.load()
