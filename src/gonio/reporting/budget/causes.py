"""The budget of a scan as blocks: the table in the style of the GUM, a picture by incidence angle, and correlations."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.plotting.budget.figure import budget_figure, drawn_angles
from gonio.plotting.page import Page, drawn_on
from gonio.plotting.panels import first_set
from gonio.reduction.budget import Budget, budget, correlation
from gonio.reporting.blocks import Cell, Notes, Picture, Pictures, Table, number
from gonio.reporting.figures import svg_element
from gonio.results.reduction import HEADS, LEFT, NOTE, TITLE, rows

PANEL = Page(size="85x85mm", font=8, title="")
MOST = 4  # incidence angles that are drawn
SHOWN = 6  # directions whose correlations are listed
LEGEND = (
    "Standard uncertainty of f by cause, in percent of it, over the signed θᵣ. A cause shifts all values together, "
    "each by its own amount; random errors are independent."
)


def budget_blocks(scan: xr.Dataset) -> Iterator[object]:
    """The budget of the values of a scan that are in use, by every cause that the scan states.

    Of a scan of several wavelengths, channels .. the table is of all, pictures and correlations of the first.
    """
    found = budget(scan)
    yield _table(found)
    yield Notes("budget-explained", [f"{NOTE[0].upper()}{NOTE[1:]}."], plain=True)
    flat, words = first_set(found.scan)
    shown = budget(flat) if words else found
    yield from _pictures(shown, words)
    yield from _correlations(shown, words)


def _table(found: Budget) -> Table:
    """The rows of `results.reduction`, with their numbers as data."""
    listed = [[*map(Cell, row[:LEFT]), *map(_number, row[LEFT:])] for row in rows(found)]
    return Table("causes", f"{TITLE[0].upper()}{TITLE[1:]}", HEADS, listed, left=LEFT)


def _number(text: str) -> Cell:
    return Cell(text, None if text == "–" else float(text), True)


def _pictures(found: Budget, words: str) -> Iterator[object]:
    try:
        every = drawn_angles(found, len(np.unique(found.scan["theta_i"].values)))
        angles = drawn_angles(found, MOST)
        with drawn_on(PANEL):
            pictures = [_picture(found, theta_i, words) for theta_i in angles]
    except ValueError as error:
        yield Notes("budget-figures", [f"No figure of the budget: {error}"], plain=True)
        return
    more = f" Shown are {len(angles)} of {len(every)} incidence angles." * (len(every) > len(angles))
    yield Pictures(LEGEND + more, pictures)


def _picture(found: Budget, theta_i: float, words: str) -> Picture:
    where = f"θᵢ = {theta_i:.4g}°" + f", {words}" * bool(words)
    name = f"budget-{theta_i:.4g}"
    return Picture(svg_element(budget_figure(found, angles=[theta_i]), name, f"Budget at {where}"), where)


def _correlations(found: Budget, words: str) -> Iterator[object]:
    """Between the errors of some directions, spread evenly over those in use as theta_i and signed theta_r order them.

    None where random errors are all that is known, as there is then none.
    """
    flat = found.scan
    if flat.sizes["direction"] < 2 or len(found.rows) < 2:
        return
    signed = np.where(dataset.is_in_plane(flat), dataset.signed_theta_r(flat), flat["theta_r"].values)
    order = np.lexsort((flat["phi"].values, signed, flat["theta_i"].values))
    chosen = order[np.unique(np.linspace(0, len(order) - 1, SHOWN).round().astype(int))]
    part = flat.isel(direction=chosen)
    names = [_direction(part.isel(direction=[k]), signed[chosen[k]]) for k in range(len(chosen))]
    if len(set(names)) < len(names):
        return  # readings of one direction, whose names are no keys
    between = correlation(part)
    listed = [[Cell(name), *(number(r, 3) for r in row)] for name, row in zip(names, between, strict=True)]
    caption = "Correlation between the errors of values, at θᵢ, θᵣ [deg]" + f", {words}" * bool(words)
    yield Table("correlations", caption, ["direction", *names], listed)


def _direction(one: xr.Dataset, signed: float) -> str:
    """The direction as `30, −40`; with its azimuth out of the plane of incidence."""
    text = f"{float(one['theta_i'].values[0]):.4g}, {signed:.4g}".replace("-", "−")
    return text if dataset.is_in_plane(one).all() else f"{text}, φ {float(one['phi'].values[0]):.4g}"
