"""The budget of a scan's uncertainty over theta_r: one panel for each incidence angle, one line for each cause."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gonio.measured.dataset import is_in_plane, signed_theta_r
from gonio.plotting.panels import first_set
from gonio.plotting.style import THETA_R_SHORT, as_label, heading, house_style, line_style, new_figure, shared_legend
from gonio.reduction.budget import Budget, budget

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS, COLUMNS = 6, 3
DECADES = 3  # of the axis: smaller parts say nothing beside the largest


def drawn_angles(found: Budget, most: int = MOST_PANELS) -> list[float]:
    """At most so many incidence angles [deg] with directions in the plane of incidence, spread over those there are.

    Raises ValueError where no direction lies in the plane, or nothing is stated.
    """
    plane = is_in_plane(found.scan)
    if not plane.any() or not found.rows:
        what = "no direction in the plane of incidence" if found.rows else "no uncertainty"
        raise ValueError(f"the scan has {what}, so there is no figure of a budget: leave it out")
    angles = np.unique(np.round(found.scan["theta_i"].values[plane], 3))
    some: list[float] = angles[np.unique(np.linspace(0, len(angles) - 1, most).round().astype(int))].tolist()
    return some


def budget_figure(found: Budget, *, title: str = "", angles: Sequence[float] = ()) -> "Figure":
    """Relative standard uncertainty [%] by cause over the signed theta_r, and the combined one.

    angles: of incidence [deg]; without any MOST_PANELS, spread over those there are. Directions in the plane of
    incidence are drawn, of a scan of several wavelengths, channels .. those of the first. All panels have the scale of
    the whole budget. Raises ValueError where no direction lies in the plane, or nothing is stated.
    """
    some = list(angles) or drawn_angles(found)
    flat, words = first_set(found.scan)
    found = budget(flat) if words else found
    plane = is_in_plane(found.scan)
    rows, columns = -(-len(some) // COLUMNS), min(len(some), COLUMNS)
    with house_style():
        figure = new_figure(2.6 * columns + 1.4, 2.5 * rows + 0.9)
        axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for ax, theta_i in zip(axes, some, strict=False):
            _draw(ax, found, plane, theta_i)
        for ax in axes[len(some) :]:
            ax.set_visible(False)
        for ax in axes[::columns]:
            ax.set_ylabel("standard uncertainty [%]")
        top = 100 * float(found.combined[plane].max())
        if top > 0:
            axes[0].set_yscale("log")
            axes[0].set_ylim(top * 10.0**-DECADES, top * 2)
        shared_legend(figure, axes[0])
        heading(figure, title, words)
    return figure


def _draw(ax: "Axes", found: Budget, plane: np.ndarray, theta_i: float) -> None:
    at = np.flatnonzero(plane & (np.abs(found.scan["theta_i"].values - theta_i) < 1e-3))
    signed = signed_theta_r(found.scan)[at]
    order = np.argsort(signed, kind="stable")
    for k, row in enumerate(found.rows):
        size = 100 * np.abs(row.by_direction[at][order])
        ax.plot(signed[order], np.where(size > 0, size, np.nan), **line_style(k), label=as_label(row.cause))
    combined = 100 * found.combined[at][order]
    ax.plot(signed[order], combined, color="0.2", linewidth=2.0, label="combined")
    ax.set_title(f"θᵢ = {theta_i:g}°")
    ax.set_xlabel(THETA_R_SHORT)
