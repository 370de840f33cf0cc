"""The figure of a height map: the map, its spectrum with the band that light sees, and its slopes."""

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.plotting.page.sheet import current, side_by_side, stacked
from gonio.plotting.style import colour, heading, house_style, line_style, new_figure, shared_legend
from gonio.topography.heights import values
from gonio.topography.light.facets import density_of_slopes
from gonio.topography.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PIXELS = 1000  # along a side of the drawn map: more have no room on a page
PANELS = 3
WIDTH, HEIGHT = 2.2, 1.9  # inches that a panel needs beside others, and below others
FEW = 8  # points of a spectrum that are drawn as dots too
TAILS = (0.5, 99.5)  # percent of the heights that the colours span


def topography_figure(summary: Summary, *, title: str = "") -> "Figure":
    """A map [um], its radial spectrum S2 [um^4] over frequency [1/um], and the density of its slopes.

    The panels are side by side where the page has room for them, else below each other, as many as have room. The band
    that light sees is shaded. Colours of the map span the heights without the outermost half percent at either end.
    """
    columns = PANELS if side_by_side(PANELS, WIDTH) == PANELS else 1
    rows = 1 if columns == PANELS else stacked(PANELS, HEIGHT)
    with house_style():
        figure = new_figure(9.6, 3.4) if columns == PANELS else new_figure(3.4, 8.4)
        axes = np.ravel(figure.subplots(rows, columns, squeeze=False))
        draw: list[Callable[[Axes], list[Any]]] = [
            functools.partial(_map, figure, summary),
            functools.partial(_spectrum, summary),
            functools.partial(_slopes, summary),
        ]
        handles = [artist for ax, panel in zip(axes, draw, strict=False) for artist in panel(ax)]
        if handles:
            shared_legend(figure, handles, columns=len(handles))
        heading(figure, title, f"{len(axes)} of {PANELS} panels have room" if len(axes) < PANELS else "")
    return figure


def _map(figure: "Figure", summary: Summary, ax: "Axes") -> list[Any]:
    """Draws the map with its bar of colours; nothing for the legend."""
    z = values(summary.heights)
    step = max(-(-max(z.shape) // MOST_PIXELS), 1)
    shown = z[::step, ::step]
    low, high = np.nanpercentile(shown, TAILS)
    width, height = summary.sides
    unit, scale = ("um", 1.0) if max(width, height) < 5000 else ("mm", 1e-3)
    image = ax.imshow(
        shown,
        cmap="viridis",
        vmin=low,
        vmax=high,
        origin="lower",
        extent=(0, width * scale, 0, height * scale),
        interpolation="nearest",
        aspect="equal",
    )
    ax.set_facecolor("0.85")  # missing points
    ax.grid(False)
    ax.set_xlabel(f"x [{_mu(unit)}]")
    ax.set_ylabel(f"y [{_mu(unit)}]")
    bar = figure.colorbar(image, ax=ax, shrink=0.9, extend="both")
    bar.set_label("height z [µm]")
    ax.set_title("levelled heights")
    return []


def _mu(unit: str) -> str:
    return unit.replace("um", "µm")


def _spectrum(summary: Summary, ax: "Axes") -> list[Any]:
    """Draws the spectrum; the artist of the band that light sees, none where it sees none."""
    found = summary.spectrum
    drawn = found.radial > 0
    ax.loglog(found.f[drawn], found.radial[drawn], **line_style(0), marker="o" if drawn.sum() < FEW else "")
    ax.set_xlabel("frequency f [1/µm]")
    ax.set_ylabel("spectrum S₂ [µm⁴]")
    ax.set_title("height spectrum")
    if summary.seen is None:
        return []
    ends = max(summary.seen.least, float(found.f.min())), min(summary.seen.most, float(found.f.max()))
    tint = {"color": colour(4), "alpha": 0.18, "linewidth": 0, "zorder": 0}
    return (
        [ax.axvspan(*ends, **tint, label=f"seen at {1000 * summary.seen.wavelength:g} nm")] if ends[0] < ends[1] else []
    )


def _slopes(summary: Summary, ax: "Axes") -> list[Any]:
    """Draws the density of slopes beside that of two models; the artists."""
    radius, density = density_of_slopes(summary.slopes.length)
    drawn = radius <= np.quantile(summary.slopes.length, 0.999)
    dots = ax.semilogy(radius[drawn], density[drawn], **_dots(), label="slopes of the map")
    m = summary.widths.m
    fine = np.linspace(0, float(radius[drawn].max()), 200)
    gaussian = np.exp(-((fine / m) ** 2)) / (math.pi * m**2)
    low = float(density[drawn].min()) / 3
    curve = np.where(gaussian > low, gaussian, np.nan)
    dashed = ax.semilogy(fine, curve, **line_style(1), label="Gaussian of the same Sdq")
    width = summary.widths.ggx_width
    ggx = width**2 / (math.pi * (width**2 + fine**2) ** 2)
    dotted = ax.semilogy(fine, ggx, **line_style(2), label="GGX of the same median")
    ax.set_ylim(bottom=low)
    ax.set_xlabel("slope |∇z| [1]")
    ax.set_ylabel("density P₂₂ [1]")
    ax.set_title("slopes")
    return [*dots, *dashed, *dotted]


def _dots() -> dict[str, Any]:
    points = current().points / 9
    return {"color": "0.25", "marker": "o", "markersize": 3 * points, "linestyle": "none", "markeredgewidth": 0}
