"""Degree and angle of linear polarisation over the hemisphere seen from above."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.plotting.hemisphere import VIEW_WIDTH, mark_directions, top_view
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.style import explanation, heading, house_style, new_figure
from gonio.polarisation import angle_of_linear_polarisation, degree_of_linear_polarisation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
FAINTEST = 0.02  # share of linear polarisation below which its angle is not drawn


def polarisation(panels: Mapping[str, tuple[float, Callable[[Geometry], Values]]], *, title: str = "") -> "Figure":
    """Top views side by side, each a title with its incidence angle [deg] and Stokes vectors (..., 4) of directions.

    Colour is the degree of linear polarisation. Strokes show the direction of the electric field of the reflected light
    as seen from above: tangential is s, radial is p. Where the degree is below FAINTEST there is no stroke.
    """
    with house_style():
        columns = min(len(panels), side_by_side(2, VIEW_WIDTH))
        rows = -(-len(panels) // columns)
        figure = new_figure(4.0 * columns + 0.9, 3.5 * rows + 0.7)
        axes = []
        for k, (name, (theta_i, light)) in enumerate(panels.items()):
            ax: Any = figure.add_subplot(rows, columns, k + 1, projection="polar")
            distance, azimuth = top_view()
            share = degree_of_linear_polarisation(_light(light, theta_i, distance, azimuth))
            mesh = ax.pcolormesh(
                np.radians(azimuth - 180.0),
                distance,
                share,
                vmin=0,
                vmax=1,
                cmap="cividis",
                shading="gouraud",
                rasterized=True,
            )
            _strokes(ax, light, theta_i)
            mark_directions(ax, theta_i)
            ax.set_title(name, pad=12)
            axes.append(ax)
        figure.colorbar(mesh, ax=axes, label="degree of linear polarisation [1]", shrink=0.75, pad=0.08)
        words = "centre θᵣ = 0, rim 90°; angle φ; + specular direction; strokes: electric field"
        heading(figure, title, explanation(words))
    return figure


def _light(light: Callable[[Geometry], Values], theta_i: float, distance: Values, azimuth: Values) -> Values:
    return np.asarray(light(Geometry.from_degrees(np.full_like(distance, theta_i), distance, azimuth)))


def _strokes(ax: Any, light: Callable[[Geometry], Values], theta_i: float) -> None:
    distance, azimuth = np.meshgrid([15.0, 35.0, 55.0, 75.0], np.arange(0.0, 360.0, 30.0))
    vectors = _light(light, theta_i, distance, azimuth)
    share = degree_of_linear_polarisation(vectors)
    shown = share > FAINTEST
    angle = np.radians(angle_of_linear_polarisation(vectors))
    # on the page s = k x z points clockwise and p = k x s outwards
    page_angle = np.radians(azimuth - 180.0)
    s = np.array([np.sin(page_angle), -np.cos(page_angle)])
    p = np.array([np.cos(page_angle), np.sin(page_angle)])
    field = np.cos(angle) * s + np.sin(angle) * p
    ax.quiver(
        page_angle[shown],
        distance[shown],
        field[0][shown],
        field[1][shown],
        color="white",
        pivot="middle",
        headwidth=0,
        headlength=0,
        headaxislength=0,
        scale=22,
        width=0.004,
    )
