"""The folder of a fit: the solution and its figures; and before the fit whether figures have room on their page."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gonio.app.output import warn
from gonio.comparison.ranking import problems_of, settled
from gonio.fitting.certainty.bootstrap import kept
from gonio.fitting.certainty.profile import Profile
from gonio.fitting.fitting import fit
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.projection import Projection
from gonio.measured import dataset
from gonio.plotting.page import Page, drawn_on
from gonio.results.prediction import row_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from gonio.app.views.fit.certainty import Certainty, CertaintyOptions
    from gonio.comparison import Row
    from gonio.model import Model

KINDS = ("curves", "residuals", "components")
AT_ONCE = Projection(grid=2, searches=1, max_steps=1, line=2, rounds=0)  # some values, of the size of the right ones


def refuse_without_room(
    page: Page, scan: "xr.Dataset", models: "Sequence[Model]", options: ProblemOptions, certainty: "CertaintyOptions"
) -> None:
    """ValueError where the page has no room for the figures of the fit, before that takes its time.

    They are drawn for a fit that is ended at once. Of several models that is the one of the fewest terms: where its
    figures have no room, those of the others have none.
    """
    from gonio.plotting.style import fit_to_page

    if page.is_plain:
        return
    model = min(models, key=lambda one: (len(one.weights), len(one.name)))
    points = dataset.points(scan)
    in_plane = dataset.is_in_plane(points)
    few = points.isel(direction=np.flatnonzero(in_plane)) if in_plane.any() else points
    (problem,) = problems_of(few, [model], settled(few, options.given()))
    solution = fit(problem, AT_ONCE)
    at, rise = np.array([0.123, 0.456, 0.789]), np.array([-3.0, 0.0, 3.0])
    profiled = [
        Profile(name, "1", 0.456, 0.95, 2.0, at, rise, 0.234, 0.567, False, False)
        for name in (certainty.names(problem) if len(models) == 1 else [])
    ]
    for kind, draw in _figures(few, row_of(solution, few), profiled):
        with drawn_on(page):
            try:
                figure = draw()
            except ValueError:  # nothing to show, which is said when the fit is written
                continue
            try:
                fit_to_page(figure)
            except ValueError as error:
                raise ValueError(f"{kind}: {error}") from error


def write(page: Page, folder: Path, data: "xr.Dataset", row: "Row", answers: "Certainty") -> None:
    """The solution as a file, and the figures that it has something for.

    A figure that shows nothing of such a scan, or has no room, is left out with a word: the fit is worth more.
    """
    from gonio.plotting.style import save

    solution = row.solution if answers.drawn is None else kept(row.solution, answers.drawn)
    solution.save(folder / "solution.nc")
    for kind, draw in _figures(data, row, answers.profiles):
        with drawn_on(page):
            try:
                save(draw(), folder / kind, page.suffixes)
            except ValueError as error:
                warn(Path(kind), f"this figure is left out: {error}")


def _figures(
    data: "xr.Dataset", row: "Row", profiled: Sequence[Profile]
) -> "Iterator[tuple[str, Callable[[], Figure]]]":
    """The figures of a fit by name."""
    from gonio.app.views import figures
    from gonio.plotting.profiles import profiles
    from gonio.results.figures import has_spectra
    from gonio.results.view import View

    solution = row.solution
    kinds = [*KINDS] + ["convergence"] * (solution.dataset.attrs["solver"] == "anneal")
    kinds += ["spectra"] * has_spectra(solution)
    for kind in kinds:
        ranked = {row.model.name: (data, [row])}
        yield kind, partial(figures.draw, kind, ranked, View(banded=kind == "curves"))
    if profiled:
        yield "profiles", lambda: profiles(profiled, solution.uncertainties, title=row.model.name)
