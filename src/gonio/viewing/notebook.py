"""`gonio.view`: a scan and its fit on a page with sliders, in a notebook or in a browser."""

import html
import re
import sys
import tempfile
import warnings
import webbrowser
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from gonio.fitting.solution import Solution
from gonio.measured.sound import missing
from gonio.model import Model
from gonio.models import catalogue
from gonio.outside import printable
from gonio.viewing.assembled import in_one_file, refuse_unwritable, written
from gonio.viewing.session import FIRST, FIT, Opened, Session

if TYPE_CHECKING:
    from gonio.viewing.widget import View

HEIGHT = "46rem"
WITHOUT = (
    "This page has its sliders, and Python cannot read or set them: that takes anywidget "
    "(pip install 'gonio[notebook]', then restart the kernel)."
)


@dataclass(frozen=True, eq=False)
class Page:
    """A page in one file, which shows itself in a notebook and can be written.

    session: what is on it.
    """

    session: Session

    @cached_property
    def html(self) -> str:
        """The page."""
        return in_one_file(self.session, self.session.needed())

    def write(self, path: str | Path, force: bool = False) -> Path:
        """Write the page to a file that opens in any browser, without gonio and without network.

        Raises FileExistsError for a file that exists, without `force`, and ValueError for a name that does not end in
        .html.
        """
        return written(self.html, Path(path), force)

    def __repr__(self) -> str:
        return f"<Page: {', '.join(printable(one.name) for one in self.session.opened)}; write(path) writes it>"

    def _repr_html_(self) -> str:
        """The page in a frame of its own, so that its style and its scripts do not reach the notebook."""
        return f"<p>{html.escape(WITHOUT)}</p>{frame(self.html)}"


def view(
    scan: xr.Dataset | Solution,
    solution: Solution | None = None,
    *,
    model: Model | str = "",
    values: Mapping[str, float] | None = None,
    out: str | Path | None = None,
    force: bool = False,
) -> "View | Page":
    """Look at a scan and its fit on a page: curves with error bars, and a slider for every parameter.

    In a notebook the page stands below the cell, as a widget whose `values` follow the sliders and move them. Elsewhere
    it is written to a temporary file, and opens in the browser. It needs no network in either case.

    Parameters
    ----------
    scan : xarray.Dataset or Solution
        The scan; or a fit that holds the points that it was fitted to.
    solution : Solution, optional
        A fit of the scan: the sliders begin at its values, and the curves have its band.
    model : Model or str
        The model to begin with; `gonio-best` unless another is named. Without a fit and without values it is fitted
        first.
    values : mapping, optional
        Values to begin with, by parameter. Weights that are not given are the best for the shape.
    out : str or Path, optional
        Write the page to this file, and show nothing.
    force : bool
        Whether a file that exists is replaced.

    Returns
    -------
    View or Page
        In a notebook with anywidget (`pip install 'gonio[notebook]'`) a View: `values` by name are read and set,
        `model` is the model, `solution` the fit, which the button "Fit" replaces, `write(path)` writes the page. Else a
        Page, which has `write`.

    Raises
    ------
    FileExistsError
        The file exists, and `force` is not set.
    KeyError
        There is no such model, or the model has no such parameter.
    ValueError
        The Dataset is no scan, the fit holds no points, or the fit is of other groups than the scan has.

    Examples
    --------
    >>> import gonio
    >>> solution = gonio.fit(gonio.sample("coating"), "ggx")
    >>> gonio.view(solution, out="page.html")
    <Page: a simulated scan; write(path) writes it>

    """
    session = _session(scan, solution, model, values or {})
    if out is not None:
        refuse_unwritable(Path(out), force)
    _fit_first(session)
    if out is not None:
        page = Page(session)
        page.write(out, force)
        return page
    if not _in_notebook():
        return _in_browser(Page(session))
    if find_spec("anywidget") is None:
        return Page(session)
    from gonio.viewing.widget import View

    return View(session)


def frame(page: str, height: str = HEIGHT) -> str:
    """A page in a frame that has no access to anything outside it: to cookies, to storage, or to what is around it."""
    return (
        f'<iframe title="gonio: scan, model and sliders" sandbox="allow-scripts allow-downloads" loading="lazy" '
        f'style="display:block;width:100%;height:{height};border:0" srcdoc="{html.escape(page)}"></iframe>'
    )


def _session(
    scan: xr.Dataset | Solution, solution: Solution | None, model: Model | str, values: Mapping[str, float]
) -> Session:
    if isinstance(scan, Solution):
        if solution is not None:
            raise ValueError("two fits are given: give the scan, and the fit as the second")
        solution = scan
        scan = solution.scan
    if lacking := missing(scan):
        raise ValueError(
            f"the Dataset has no {lacking}: a scan needs brdf and the coordinates theta_i, theta_r and phi"
        )
    first = model or (solution.model if solution else FIRST)
    chosen = catalogue[first] if isinstance(first, str) else first
    models = {**catalogue, chosen.name: chosen} | ({solution.model.name: solution.model} if solution else {})
    opened = Opened(_named(scan), scan, {FIT: solution} if solution else {})
    opened.described()  # refuses a fit of other groups, and a scan without values
    if solution and values:
        raise ValueError("a fit has its own values: leave values out, or the fit")
    from gonio.viewing.values import of_model

    return Session(
        [opened],
        models,
        model=chosen.name,
        values=of_model(opened, chosen).checked(values) and dict(values),
        begin_with_model=bool(model),
    )


def _fit_first(session: Session) -> None:
    from gonio.viewing.working.beginning import fit_first

    for words in fit_first(session, FIT):
        warnings.warn(words, stacklevel=3)


def _named(scan: xr.Dataset) -> str:
    """The file of a scan, or in words what it is, from its history."""
    history = str(scan.attrs.get("history", ""))
    found = re.search(r"^read from (.*) as ", history, re.MULTILINE)
    return found[1] if found else "a simulated scan" if history.startswith("simulated") else "a scan"


def _in_notebook() -> bool:
    """Whether a kernel runs this, whose outputs a notebook shows."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return shell is not None and hasattr(shell, "kernel")


def _in_browser(page: Page) -> Page:
    """The page, opened from a temporary file, which stays: the browser may read it later."""
    folder = Path(tempfile.mkdtemp(prefix="gonio-view-"))
    path = page.write(folder / "page.html")
    if not webbrowser.open(path.as_uri()):
        warnings.warn(f"no browser could be opened: the page is {path}", stacklevel=3)
    return page
