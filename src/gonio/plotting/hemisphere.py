"""A BRDF over the whole hemisphere seen from above, on a true polar projection (guo2023, Figs 8 and 9)."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.plotting.style import BRDF_LABELS, heading, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
DISTANCES = 91  # from the normal to 89 deg
AZIMUTHS = 181


def hemisphere(
    panels: Mapping[str, tuple[float, Callable[[Geometry], Values]]],
    *,
    unit: str,
    title: str = "",
    logarithmic: bool = False,
    one_scale: bool = False,
) -> "Figure":
    """Top views side by side, each a name with its incidence angle [deg] and a function of directions.

    The distance from the centre is theta_r, the angle is phi; the forward side, phi = 180 deg, is on the right. A cross
    marks the specular direction. `one_scale` gives all panels the colours of the first.
    """
    distance, azimuth = top_view()
    views = {
        name: np.asarray(brdf(Geometry.from_degrees(np.full_like(distance, theta_i), distance, azimuth)))
        for name, (theta_i, brdf) in panels.items()
    }
    with house_style():
        from matplotlib.colors import LogNorm, Normalize

        columns = min(len(panels), 2)
        rows = -(-len(panels) // columns)
        figure = new_figure(4.5 * columns, 3.5 * rows + 0.3)
        top = max(float(v.max()) for v in views.values())
        for k, (name, view) in enumerate(views.items()):
            ax: Any = figure.add_subplot(rows, columns, k + 1, projection="polar")
            positive = view[view > 0]
            most = max(top if one_scale else float(view.max()), 0.0) or 1.0  # any scale where nothing is reflected
            least = max(float(positive.min(initial=most)), most / 1e6)
            norm = LogNorm(least, most) if logarithmic and positive.size else Normalize(0.0, most)
            mesh = ax.pcolormesh(
                np.radians(azimuth - 180.0),
                distance,
                view,
                norm=norm,
                cmap="cividis",
                shading="gouraud",
                rasterized=True,
            )
            theta_i = panels[name][0]
            mark_directions(ax, theta_i)
            ax.set_title(f"{name}, θᵢ = {theta_i:g}°", pad=12)
            figure.colorbar(mesh, ax=ax, label=BRDF_LABELS[unit], shrink=0.75, pad=0.14)
        heading(figure, title, "centre θᵣ = 0, rim 90°; angle φ; + specular direction")
    return figure


def top_view() -> tuple[Values, Values]:
    """Grid of theta_r and phi [deg] over the hemisphere."""
    distance, azimuth = np.meshgrid(np.linspace(0.0, 89.0, DISTANCES), np.linspace(0.0, 360.0, 2 * AZIMUTHS - 1))
    return distance, azimuth


def mark_directions(ax: Any, theta_i: float) -> None:
    """Angles round the rim and outwards, forward on the right, and a cross in the specular direction."""
    ax.plot(0.0, theta_i, marker="+", color="white", markersize=9, markeredgewidth=1.4)
    ax.set_ylim(0, 90)
    ax.set_yticks([30, 60], ["30°", "60°"], color="white", fontsize=7.5)
    ax.set_rlabel_position(118)
    ax.set_xticks(np.radians([0, 90, 180, 270]), ["180°\nforward", "270°", "0°\nback", "90°"], fontsize=8)
    ax.tick_params(axis="x", pad=7)
    ax.grid(color="white", alpha=0.35, linewidth=0.6)
