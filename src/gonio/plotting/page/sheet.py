"""What is asked of a printed figure, declared once for Python, for every command that draws, and for the pages."""

import functools
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from gonio.options import Option, Panel, one_of
from gonio.plotting.page.stylesheet import read_style

FORMATS = ("pdf", "png", "svg")
INCHES = {"mm": 1 / 25.4, "cm": 1 / 2.54, "in": 1.0}
SIZE = re.compile(r"\s*([0-9]*\.?[0-9]+)\s*[x×]\s*([0-9]*\.?[0-9]+)\s*(mm|cm|in)\s*", re.IGNORECASE)
LEAST, MOST = 20 / 25.4, 1200 / 25.4  # inches: a side of a figure, from a vignette to a poster
POINTS = 9.0  # the size of text that figures have of their own
TEXTS = (
    "font.size",
    "axes.titlesize",
    "axes.labelsize",
    "xtick.labelsize",
    "ytick.labelsize",
    "legend.fontsize",
    "legend.title_fontsize",
    "figure.titlesize",
    "figure.labelsize",
)


@dataclass(frozen=True, kw_only=True)
class Page:
    """The page of a figure; what is not given is as the figure has it of its own.

    size: width and height with a unit, `85x60mm`, `8.5x6cm` or `3.3x2.4in`; the file has exactly that size, and fewer
    incidence angles are drawn, with a word, where it has no room for all. font: the size of all text [pt]. dpi: pixels
    an inch of PNG, and of the coloured areas of PDF and SVG. title: the title instead of the figure's own, empty for
    none. style: a Matplotlib style file, whose settings come before the figure's own and after size, font and dpi.
    format: the formats of a figure whose name has no suffix, with commas.
    Raises ValueError for what is none of that, and FileNotFoundError for a style file that is not there.
    """

    PANEL: ClassVar = Panel.FIGURE
    size: Annotated[str, Option("width and height of the figure: 85x60mm, or in cm or in", metavar="WxHmm")] = ""
    font: Annotated[float | None, Option("size of all text, in points", metavar="PT", lowest=4, highest=72)] = None
    dpi: Annotated[float | None, Option("pixels an inch", lowest=20, highest=2400)] = None
    title: Annotated[str | None, Option('title of the figure; "" for none', metavar="TEXT")] = None
    style: Annotated[str, Option("colours, lines and fonts, from a Matplotlib file", metavar="FILE.mplstyle")] = ""
    format: Annotated[
        str, Option("formats of a figure named without a suffix: pdf, png, svg", metavar="A,B", names=FORMATS)
    ] = "png,svg"

    def __post_init__(self) -> None:
        for name, bounds in (("font", (4, 72)), ("dpi", (20, 2400))):
            value = getattr(self, name)
            if value is not None:
                Option("", lowest=bounds[0], highest=bounds[1]).within(value, name)
        _ = self.sides, self.suffixes

    @functools.cached_property
    def suffixes(self) -> tuple[str, ...]:
        """The suffixes of a figure named without one."""
        names = [part.strip().lower().removeprefix(".") for part in self.format.split(",") if part.strip()]
        for name in names:
            if name not in FORMATS:
                raise ValueError(f"figures are not written as {name!r}: choose {one_of(FORMATS)}")
        if not names:
            raise ValueError(f"no format of figures is named: choose {one_of(FORMATS)}")
        return tuple(f".{name}" for name in dict.fromkeys(names))

    @functools.cached_property
    def sides(self) -> tuple[float, float] | None:
        """Width and height [inch] where a size is given, by itself or by the style."""
        if not self.size:
            own = self._styled.get("figure.figsize")
            return None if own is None else (float(own[0]), float(own[1]))
        found = SIZE.fullmatch(self.size)
        if not found:
            raise ValueError(f"a size of {self.size!r} is not of the form 85x60mm, 8.5x6cm or 3.3x2.4in")
        width, height = (float(found[k]) * INCHES[found[3].lower()] for k in (1, 2))
        if not all(LEAST <= side <= MOST for side in (width, height)):
            raise ValueError(f"a size of {self.size} is beyond the possible: give sides from 20 to 1200 mm")
        return width, height

    @property
    def points(self) -> float:
        """The size of text [pt]."""
        return self.font or float(self._styled.get("font.size", POINTS))

    @functools.cached_property
    def _styled(self) -> dict[str, Any]:
        return read_style(self.style) if self.style else {}

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of Matplotlib that the page asks for, over those of a figure's own."""
        settings = dict(self._styled)
        if self.font:
            settings |= dict.fromkeys(TEXTS, self.font)
        if self.dpi:
            settings["savefig.dpi"] = self.dpi
        if self.sides:
            settings["savefig.bbox"] = "standard"  # a tight one would have another size
        return settings

    @property
    def is_plain(self) -> bool:
        """Whether nothing is asked that changes what has room where."""
        return not (self.size or self.font or self.style or self.title)


PLAIN = Page()
_current: ContextVar[Page] = ContextVar("page", default=PLAIN)


def current() -> Page:
    """The page that is drawn on."""
    return _current.get()


@contextmanager
def drawn_on(page: Page) -> Iterator[Page]:
    """Figures that are drawn and saved within are for that page."""
    token = _current.set(page)
    try:
        yield page
    finally:
        _current.reset(token)


def target_of(out: str, formats: Sequence[str]) -> tuple[Path, tuple[str, ...]]:
    """Where a figure goes and in which formats: that of the suffix, or those given, as `.png`, without one.

    A dot before a digit, as in `width-0.5`, begins no suffix. ValueError for a suffix of no format of figures.
    """
    path = Path(out)
    if path.suffix.lower().removeprefix(".") in FORMATS:
        return path.with_suffix(""), (path.suffix,)
    if path.suffix[1:2].isalpha():
        known = one_of(f".{name}" for name in FORMATS)
        raise ValueError(f"{out}: figures are written as {known}, not {path.suffix}: choose one of these")
    return path, tuple(formats)


def points(own: float) -> float:
    """The size [pt] of a text that is `own` on a page of the usual text; every text has the size that is asked for."""
    page = current()
    return page.font or own * page.points / POINTS


def side_by_side(most: int, width: float = 1.3) -> int:
    """How many panels have room side by side, at most `most`; `width` [inch] is what one needs with the usual text."""
    page = current()
    if page.sides is None:
        return most
    text = page.points / POINTS
    return max(1, min(most, int((page.sides[0] - 0.45 * text) / (width * text))))


def stacked(most: int, height: float = 1.35) -> int:
    """How many rows of panels have room under a title and over a legend, at most `most`; `height` [inch] as above."""
    page = current()
    if page.sides is None:
        return most
    text = page.points / POINTS
    return max(1, min(most, int((page.sides[1] - text) / (height * text))))
