"""A BRDF over the hemisphere as a lobe: a surface in space whose distance from the origin is the value."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.geometry import Geometry
from gonio.plotting.hemisphere import VIEW_WIDTH
from gonio.plotting.lobes.radius import Radius
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.panels import by_origin
from gonio.plotting.style import (
    HOLLOW,
    LINEAR,
    MEASURED,
    as_label,
    heading,
    house_style,
    new_figure,
    shared_legend,
)
from gonio.units import unit_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
HORIZON = 89.0  # deg, as of the view from above: beyond it a BRDF is a small number over a small cosine
STEP = 3.0  # deg between directions of the surface
FINE = np.concatenate([[0.0], np.geomspace(0.2, 12.0, 12)])  # deg from the specular direction, where lobes are narrow
ELEVATION, AZIMUTH = 22.0, -65.0  # deg: seen from the side, a little from above, the forward side on the right
ZOOM = 1.38  # the circle of the largest value then fills the width
# The axes: direction, name, and where the name stands from its end: points to the right and up, and its alignment.
AXES = (
    ((1.0, 0.0, 0.0), "forward", (0, -4, "center", "top")),
    ((0.0, -1.0, 0.0), "side", (0, -3, "center", "top")),
    ((0.0, 0.0, 1.0), "normal", (0, 2, "center", "bottom")),
)


@dataclass(frozen=True)
class Lobe:
    """What is drawn at an incidence angle [deg]: a function of directions, NaN where it has no value, and dots.

    points: a flat scan of this incidence angle. word: what its values are, such as measured.
    """

    theta_i: float
    brdf: Callable[[Geometry], Values]
    points: xr.Dataset | None = None
    word: str = "measured"


def lobes(
    panels: Mapping[str, Lobe],
    *,
    unit: str,
    quantity: str = "BRDF",
    title: str = "",
    note: str = "",
    scale: str = LINEAR,
) -> "Figure":
    """Lobes side by side by their titles, all of one scale; colour repeats the distance from the origin.

    Every direction (x, y, z) is drawn at value times (x, y, z), with x forward, z along the normal, and phi = 90 deg
    on the side that is named; on a logarithmic scale the length is log10(value / floor). All axes have the scale on the
    left; the circles are at its end. A dashed line is the specular direction. The surface is open where there is no
    value.
    """
    with house_style():
        grids = [_grid(lobe.theta_i) for lobe in panels.values()]
        shapes = [_values(lobe, *grid) for lobe, grid in zip(panels.values(), grids, strict=True)]
        dots = [np.ravel(lobe.points["brdf"].values) for lobe in panels.values() if lobe.points is not None]
        radius = Radius.of(scale, np.concatenate([np.ravel(shape) for shape in shapes] + dots))
        columns = min(len(panels), side_by_side(2, VIEW_WIDTH))
        rows = -(-len(panels) // columns)
        figure = new_figure(4.2 * columns + 0.4, 3.6 * rows + 0.7)
        handles: dict[str, Any] = {}
        for k, (name, lobe) in enumerate(panels.items()):
            ax: Any = figure.add_subplot(rows, columns, k + 1, projection="3d", computed_zorder=False)
            handles |= _draw(ax, lobe, grids[k], shapes[k], radius)
            _frame(ax, radius, unit_label(unit))
            ax.set_title(as_label(name), y=0.92)
        shared_legend(figure, list(handles.values()))
        heading(figure, title, note, f"distance: {quantity}", radius.centre(unit))
    return figure


def _grid(theta_i: float) -> tuple[Values, Values]:
    """theta_r and phi [deg] over the hemisphere, close together near the specular direction."""
    theta = np.concatenate([np.arange(0.0, 90.0, STEP), [HORIZON], theta_i + FINE, theta_i - FINE])
    phi = np.concatenate([np.arange(0.0, 361.0, 2 * STEP), 180.0 + 2 * FINE, 180.0 - 2 * FINE])
    theta = np.unique(theta[(theta >= 0) & (theta <= HORIZON)].round(6))
    grid = np.meshgrid(theta, np.unique(phi.round(6)))
    return grid[0], grid[1]


def _values(lobe: Lobe, theta_r: Values, phi: Values) -> Values:
    geometry = Geometry.from_degrees(np.full_like(theta_r, lobe.theta_i), theta_r, phi)
    return np.array(np.broadcast_to(np.asarray(lobe.brdf(geometry), dtype=float), theta_r.shape))


def _unit_vectors(theta_r: Values, phi: Values) -> Values:
    """Directions (.., 3): those of a Geometry turned by half a circle, so that x is forward, where phi = 180 deg."""
    theta, azimuth = np.radians(theta_r), np.radians(phi)
    return np.stack([-np.sin(theta) * np.cos(azimuth), -np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=-1)


def _draw(ax: Any, lobe: Lobe, grid: tuple[Values, Values], values: Values, radius: Radius) -> dict[str, Any]:
    """The surface, the specular direction and the dots; the artists by their label."""
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    lengths = radius.lengths(values)
    corners = _unit_vectors(*grid) * lengths[..., None]
    faces = np.stack([corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]], axis=-2).reshape(
        -1, 4, 3
    )
    faces = faces[np.isfinite(faces).all(axis=(1, 2))]
    shade = np.linalg.norm(faces, axis=-1).mean(axis=-1) / radius.end
    colours = colormaps["cividis"](shade)
    ax.add_collection3d(
        Poly3DCollection(faces, facecolors=colours, edgecolors=colours, linewidths=0.2, rasterized=True)
    )
    theta = np.radians(lobe.theta_i)
    ends = [[0, radius.end * np.sin(theta)], [0, 0], [0, radius.end * np.cos(theta)]]
    line = ax.plot(*ends, color="0.35", linewidth=0.8, linestyle=(0, (4, 2)), label="specular direction", zorder=3)[0]
    handles = {"specular direction": line}
    if lobe.points is not None:
        at = _unit_vectors(lobe.points["theta_r"].values, lobe.points["phi"].values)
        at = at * radius.lengths(lobe.points["brdf"].values)[:, None]
        for name, rows in by_origin(lobe.points, lobe.word).items():
            style = MEASURED | {"markersize": 2.0} | (HOLLOW if name not in (lobe.word, "measured") else {})
            handles[name] = ax.plot(*at[rows].T, **style, label=name, zorder=4)[0]
    return handles


def _frame(ax: Any, radius: Radius, label: str) -> None:
    """The surface and the plane of incidence as circles of the largest value, three named axes and one scale."""
    ax.set_axis_off()
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_ticks([])
    ax.set_proj_type("ortho")  # lengths along an axis are true to scale
    ax.view_init(elev=ELEVATION, azim=AZIMUTH)
    end = radius.end
    ax.set_xlim(-end, end)
    ax.set_ylim(-end, end)
    ax.set_zlim(0, end)
    ax.set_box_aspect((2, 2, 1), zoom=ZOOM)
    turn = np.linspace(0, 2 * np.pi, 181)
    half = turn[:91]
    thin = {"color": "0.75", "linewidth": 0.7, "zorder": 0.5}
    ax.plot(end * np.cos(turn), end * np.sin(turn), 0 * turn, **thin)
    ax.plot(end * np.cos(half), 0 * half, end * np.sin(half), **thin)
    for (x, y, z), name, place in AXES:
        ax.plot([-end * x, end * x], [-end * y, end * y], [0, end * z], **thin)
        _write(ax, (end * x, end * y, end * z), f"{name} [{label}]", place)
    ax.plot([-end, -end], [0, 0], [0, end], color="0.3", linewidth=0.8)
    for length, text in zip(*radius.circles(), strict=True):
        ax.plot([-end, -0.96 * end], [0, 0], [length] * 2, color="0.3", linewidth=0.8)
        _write(ax, (-end, 0, length), text, (-3, 0, "right", "center"))


def _write(ax: Any, at: tuple[float, float, float], text: str, place: tuple[float, float, str, str]) -> None:
    """A text beside a place in space: points to the right and up, and its own alignment."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform  # type: ignore[import-untyped]

    x, y, _ = proj_transform(*at, ax.get_proj())
    right, up, horizontal, vertical = place
    ax.annotate(
        text, (x, y), (right, up), textcoords="offset points", ha=horizontal, va=vertical, annotation_clip=False
    )
