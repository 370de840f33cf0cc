"""Whether a figure has room on its page: measured on what Matplotlib draws, as a reader would see it."""

import itertools
import math
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gonio.outside import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

TOUCHING = 2.0  # pixels by which boxes may meet: they are larger than the letters
LABELS_APART = 0.35  # decades: a shorter axis has too few of 1, 2 and 5 on it
LABELS_DENSE = 1.5  # decades: a longer axis has two powers of ten at least
SMALLEST = 3.0  # times the size of text: a panel with a shorter side shows nothing


def refuse_crowded(figure: "Figure", points: float) -> None:
    """ValueError with the remedy where texts overlap or leave the page, or where a panel has no room for its curves."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = FigureCanvasAgg(figure)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "constrained_layout not applied")  # the panels are measured below
        canvas.draw()
    wrong = _wrong(figure, canvas.get_renderer(), points)
    if wrong:
        width, height = figure.get_size_inches() * 25.4
        raise ValueError(
            f"the figure has no room on {width:.3g} x {height:.3g} mm with text of {points:g} pt: {printable(wrong)}; "
            "give a larger size, smaller text, a shorter title, fewer models or fewer incidence angles"
        )


def thin_labels(figure: "Figure") -> None:
    """Short logarithmic axes, which Matplotlib labels at 2, 3, 4 and 6 or closer, have fewer, at 2 and 5."""
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            if axis.get_scale() == "log" and high > low:
                _thin(axis, math.log10(high / low))


def _thin(axis: Any, decades: float) -> None:
    from matplotlib.ticker import AutoLocator, FuncFormatter, NullFormatter, ScalarFormatter

    if decades < LABELS_APART:
        axis.set_major_locator(AutoLocator())
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter(NullFormatter())
    else:
        axis.set_minor_formatter(FuncFormatter(_two_or_five) if decades < LABELS_DENSE else NullFormatter())


def _two_or_five(value: float, _: int | None = None) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    mantissa = round(value / 10**power)
    return rf"$\mathdefault{{{mantissa}\times10^{{{power}}}}}$" if mantissa in (2, 5) else ""


def _wrong(figure: "Figure", renderer: Any, points: float) -> str:
    width, height = figure.get_size_inches() * figure.dpi
    least = SMALLEST * points * figure.dpi / 72
    for ax in figure.axes:
        box = ax.get_window_extent(renderer)
        is_colour_bar = hasattr(ax, "_colorbar")
        if ax.get_visible() and (max if is_colour_bar else min)(box.width, box.height) < least:
            return "its panels are too small"
    boxes = list(visible_texts(figure, renderer))
    for text, box in boxes:
        if min(box.x0, box.y0) < -TOUCHING or box.x1 > width + TOUCHING or box.y1 > height + TOUCHING:
            return f"{text!r} is cut off"
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > TOUCHING and high > TOUCHING:
            return f"{one!r} overlaps {other!r}"
    return ""


def visible_texts(figure: "Figure", renderer: Any) -> Iterator[tuple[str, "Bbox"]]:
    """Every text that is drawn, with its box in pixels."""
    from matplotlib.text import Text

    texts = figure.findobj(Text)
    hidden = set(_not_drawn(figure))
    for text in texts:
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden:
            box = text.get_window_extent(renderer)
            if box.width > 1:
                yield text.get_text(), box


def _not_drawn(figure: "Figure") -> Iterator[int]:
    """Labels of ticks beyond the limits of their axis, and of axes that are not shown, exist without being drawn."""
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_transform().transform(axis.get_view_interval()))
            slack = 1e-6 * (high - low)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                place = axis.get_transform().transform(tick.get_loc())
                if not (ax.get_visible() and low - slack <= place <= high + slack):
                    yield from (id(tick.label1), id(tick.label2))
