"""The words by which Python asks for a figure: those of the command line, for its page and for what is drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from gonio.options import one_of
from gonio.plotting.page import Page
from gonio.plotting.page.sheet import target_of
from gonio.plotting.style import SCALES, fit_to_page, save
from gonio.results.view import Direction, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BOTH = "both"
OF_PAGE = tuple(field.name for field in fields(Page))
OF_VIEW = ("scale", "theta_i", "at", "normalised", "band")
OF_FILE = ("out", "force")


class Words(TypedDict, total=False):
    """What `gonio.plot` takes beside the scan, its fits and the kind of figure."""

    size: str | tuple[float, float]
    font: float
    dpi: float
    title: str
    style: str | Path
    format: str
    scale: str
    theta_i: float | Sequence[float]
    at: Direction | Sequence[Direction]
    normalised: bool
    band: bool
    out: str | Path
    force: bool


def page_of(words: Mapping[str, Any]) -> Page:
    """The page that the words ask for.

    Raises TypeError for a word that is none, ValueError for a value that no page has, and FileNotFoundError for a style
    file that is not there.
    """
    if unknown := [word for word in words if word not in (*OF_PAGE, *OF_VIEW, *OF_FILE)]:
        raise TypeError(f"plot takes no {unknown[0]!r}: it takes {one_of((*OF_PAGE, *OF_VIEW, *OF_FILE))}")
    given = {name: value for name, value in words.items() if name in OF_PAGE and value is not None}
    if not isinstance(size := given.get("size", ""), str):
        sides = np.asarray(size, dtype=float)
        if sides.shape != (2,):
            raise ValueError(f"size is {size!r}: give width and height in mm, (85, 60), or a text such as '85x60mm'")
        given["size"] = "{:.6f}x{:.6f}mm".format(*sides)
    if "style" in given:
        given["style"] = str(given["style"])
    return Page(**given)


def view_of(words: Mapping[str, Any]) -> View:
    """What is drawn, as the words ask for it; ValueError for what is no scale, angle or direction."""
    scale = words.get("scale", BOTH)
    if scale not in (*SCALES, BOTH):
        raise ValueError(f"scale is {scale!r}: choose {one_of((*SCALES, BOTH))}")
    angles = np.atleast_1d(np.asarray(words.get("theta_i", ()), dtype=float))
    places = np.asarray(words.get("at", ()), dtype=float)
    if places.size and (places.ndim > 2 or places.shape[-1] != 3 or not np.isfinite(places).all()):
        raise ValueError(f"at is {words['at']!r}: give theta_i, theta_r and phi in degrees, or a list of such")
    return View(
        normalised=bool(words.get("normalised", False)),
        banded=bool(words.get("band", False)),
        scales=SCALES if scale == BOTH else (scale,),
        theta_i=tuple(angles.tolist()),
        at=[(a, b, c) for a, b, c in places.reshape(-1, 3).tolist()],
    )


def finished(figure: "Figure", page: Page, words: Mapping[str, Any]) -> "Figure":
    """The figure fitted to the page that is drawn on, and written where the words name a file."""
    fit_to_page(figure)
    if page.dpi:
        figure.set_dpi(page.dpi)
    if out := words.get("out"):
        target, suffixes = target_of(str(out), page.suffixes)
        save(figure, target, suffixes, bool(words.get("force", False)))
    return figure
