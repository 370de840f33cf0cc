"""`gonio.report`: one call from a scan or a fit to its page."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from datetime import date as date_type
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.comparison.answer import fit
from gonio.door.binary import sha256
from gonio.files import refuse_existing
from gonio.fitting.solution import Solution
from gonio.fitting.stored import SOLUTION_FILE as SOLUTION_FILE
from gonio.measured.dataset import points, unit
from gonio.reporting.about import checked, read_about
from gonio.reporting.case import Case, Known, Source
from gonio.reporting.page import refuse_other_suffix, write


def report(
    of: Solution | xr.Dataset,
    path: str | Path,
    *,
    scan: xr.Dataset | None = None,
    about: Mapping[str, Any] | str | Path | None = None,
    date: str = "",
    interactive: bool = False,
    force: bool = False,
) -> Path:
    """Write a report on a scan or a fit: one page of HTML that needs nothing else, or PDF; `.md`, `.txt`: a short text.

    Parameters
    ----------
    of : Solution or xarray.Dataset
        A fit; or a scan, to which the best model is fitted first, as `gonio.fit(scan)` does.
    path : str or Path
        The file to write. A PDF is printed by an installed Chromium, or by WeasyPrint (`pip install 'gonio[pdf]'`).
    scan : xarray.Dataset, optional
        The scan of a fit as it was read, for what the fit does not hold: masked values, header, systematic
        uncertainties.
    about : mapping or path, optional
        What a scan cannot say of the sample, the instrument and the environment, by the names of BiRD's universal
        format, or a YAML file of them.
    date : str
        Of the report; today where it is empty.
    interactive : bool
        Whether the page of HTML ends in that of `gonio.view`, with sliders: some 400 kB more. The report is read
        without scripts all the same.
    force : bool
        Whether a file that exists is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    FileExistsError
        The file exists, and `force` is not set.
    ValueError
        The suffix is another, nothing is installed that prints a PDF, the interactive page has no page of HTML to stand
        in, a key is none of BiRD's, the scan is not that of the fit, or the fit has no points and no scan is given.

    Examples
    --------
    >>> import gonio
    >>> solution = gonio.fit(gonio.sample("coating"), "ggx")
    >>> gonio.report(solution, "page.html", about={"sample": {"name": "SRT1"}}).name
    'page.html'

    """
    refuse_other_suffix(Path(path))
    refuse_existing(Path(path), force)
    told = read_about(Path(about)) if isinstance(about, str | Path) else checked(about or {})
    if isinstance(of, xr.Dataset):
        scan, of = of, fit(of)
    case = Case(with_points(of, scan), scan, Known(about=told, date=dated(date)))
    return write(case, Path(path), force, with_sliders=interactive)


def with_points(solution: Solution, scan: xr.Dataset | None) -> Solution:
    """A fit with the points that it was fitted to, from the scan where it does not hold them.

    Raises ValueError where the scan has not the values that were fitted.
    """
    if scan is None:
        return solution
    if not solution.has_scan:
        return solution.with_scan(scan)
    flat = points(scan)
    if unit(flat) != solution.unit or not np.isin(solution.scan["brdf"].values, flat["brdf"].values).all():
        raise ValueError(
            "this scan has not the values that were fitted: give the scan of the fit, corrected and selected as it was"
        )
    return solution


def sources(files: Sequence[Path]) -> Sequence[Source]:
    """Files as a report names them."""
    return [Source(name=path.name, sha256=sha256(path)) for path in files]


def dated(text: str = "") -> str:
    """A date as ISO 8601 has it, that of today in Greenwich where none is given; ValueError for what is no date."""
    if not text:
        return datetime.now(UTC).date().isoformat()
    try:
        return date_type.fromisoformat(text).isoformat()
    except ValueError:
        raise ValueError(f"the date of a report is {text!r}: give it as in 2026-01-31") from None
