"""A BRDF over the whole hemisphere seen from above, on a true polar projection (guo2023, Figs 8 and 9)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.plotting.page.sheet import points, side_by_side, stacked
from gonio.plotting.style import as_label, explanation, heading, house_style, new_figure, value_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
DISTANCES = 91  # from the normal to 89 deg
AZIMUTHS = 181
VIEW_WIDTH, VIEW_HEIGHT = 2.4, 2.0  # inches that a view needs with its labels, with the usual text


def hemisphere(
    panels: Mapping[str, tuple[float, Callable[[Geometry], Values]]],
    *,
    unit: str,
    title: str = "",
    logarithmic: bool = False,
    note: str = "",
    quantity: str = "BRDF",
) -> "Figure":
    """Top views side by side, each a title with its incidence angle [deg] and a function of directions.

    The distance from the centre is theta_r, the angle is phi; the forward side, phi = 180 deg, is on the right. A cross
    marks the specular direction, of transmission the one straight through. All panels have one scale of colours. A
    direction without a value, NaN, stays blank.
    """
    distance, azimuth = top_view()
    views = [
        np.asarray(brdf(Geometry.from_degrees(np.full_like(distance, theta_i), distance, azimuth)))
        for theta_i, brdf in panels.values()
    ]
    with house_style():
        from matplotlib.colors import LogNorm, Normalize

        columns = min(len(panels), side_by_side(2, VIEW_WIDTH))
        rows = -(-len(panels) // columns)
        figure = new_figure(4.0 * columns + 0.9, 3.5 * rows + 0.5)
        most = max(0.0, *(float(np.nanmax(v, initial=0.0)) for v in views)) or 1.0  # any scale where all is dark
        least = max(min(float(v[v > 0].min(initial=most)) for v in views), most / 1e6)
        lowest = min(0.0, *(float(np.nanmin(v, initial=0.0)) for v in views))  # below zero of degrees with a sign
        axes = []
        for k, (name, view) in enumerate(zip(panels, views, strict=True)):
            ax: Any = figure.add_subplot(rows, columns, k + 1, projection="polar")
            norm = LogNorm(least, most) if logarithmic and least < most else Normalize(lowest, most)
            mesh, gaps = _coloured(ax, view, norm)
            mark_directions(ax, panels[name][0], dark=gaps)
            ax.set_title(as_label(name), pad=12)
            axes.append(ax)
        figure.colorbar(mesh, ax=axes, label=value_label(unit, quantity), shrink=0.75, pad=0.08)
        heading(figure, title, note, explanation("centre θᵣ = 0, rim 90°; angle φ; + specular direction"))
    return figure


def _coloured(ax: Any, view: Values, norm: Any) -> tuple[Any, bool]:
    """The colours of the values over the top view, and whether directions stay blank."""
    distance, azimuth = top_view()
    gaps = bool(np.isnan(view).any())
    mesh = ax.pcolormesh(
        np.radians(azimuth - 180.0),
        distance,
        np.ma.masked_invalid(view) if gaps else view,
        norm=norm,
        cmap="cividis",
        shading="nearest" if gaps else "gouraud",  # which has no way to leave a direction blank
        rasterized=True,
    )
    return mesh, gaps


def top_view() -> tuple[Values, Values]:
    """Grid of theta_r and phi [deg] over the hemisphere."""
    distance, azimuth = np.meshgrid(np.linspace(0.0, 89.0, DISTANCES), np.linspace(0.0, 360.0, 2 * AZIMUTHS - 1))
    return distance, azimuth


def room_for_views(most: int) -> int:
    """How many views have room on the page, at most `most`."""
    return min(most, side_by_side(2, VIEW_WIDTH) * stacked(most, VIEW_HEIGHT))


def mark_directions(ax: Any, theta_i: float, dark: bool = False) -> None:
    """Angles round the rim and outwards, forward on the right, and a cross in the specular direction.

    dark: for views with blank directions, on which white marks would not be seen.
    """
    colour = "0.45" if dark else "white"
    ax.plot(0.0, theta_i, marker="+", color=colour, markersize=9, markeredgewidth=1.4)
    ax.set_ylim(0, 90)
    ax.set_yticks([30, 60], ["30°", "60°"], color=colour, fontsize=points(7.5))
    ax.set_rlabel_position(118)
    ax.set_xticks(np.radians([0, 90, 180, 270]), ["180°\nforward", "270°", "0°\nback", "90°"], fontsize=points(8))
    ax.tick_params(axis="x", pad=7)
    ax.grid(color="white", alpha=0.35, linewidth=0.6)
