"""Two sets of data in plane, above, and their difference, below."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.measured import dataset
from gonio.plotting.page import current
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.panels import Curve, panel_curves
from gonio.plotting.style import (
    MEASURED,
    angle_ticks,
    colour,
    heading,
    house_style,
    mark_specular,
    new_figure,
    quantity_of,
    shared_legend,
    theta_r_label,
    value_label,
)
from gonio.resampling.difference import Difference

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def difference_figure(difference: Difference, name: str, reference: str, *, most: int = 6) -> "Figure":
    """One column for each incidence angle: both sets on a logarithmic axis, and their difference in per cent below.

    The difference is that of the set `name` from the set `reference`, relative to the latter. Dots are the reference,
    crosses the other where it was measured at that direction, circles where it was interpolated.
    """
    panels, note = panel_curves(difference.points, side_by_side(most))
    narrow = current().sides is not None
    with house_style():
        figure = new_figure(max(2.5 * len(panels), 5.0) + 0.6, 5.4)
        axes = figure.subplots(2, len(panels), squeeze=False, sharex="col", height_ratios=(1, 1) if narrow else (2, 1))
        for k, curve in enumerate(panels):
            _values(axes[0, k], curve, name, reference)
            _errors(axes[1, k], curve)
            axes[0, k].set_title(f"θᵢ = {curve.theta_i:g}°")
            axes[1, k].set_xlabel(theta_r_label(figure, len(panels)))
        axes[0, 0].set_ylabel(value_label(dataset.unit(difference.points), quantity_of(panels[0].points)))
        axes[1, 0].set_ylabel("diff. [%]" if narrow else "difference [%]")
        shared_legend(figure, axes[0, 0])
        heading(figure, f"{name} against {reference}", f"rms {100 * difference.rms:.3g} % by solid angle", note)
    return figure


def _values(ax: "Axes", curve: Curve, name: str, reference: str) -> None:
    values, exact = curve.points["other"].values, curve.points["exact"].values
    ax.plot(curve.theta_r, curve.measured, **MEASURED, label=reference, zorder=1)
    style: dict[str, Any] = {"linestyle": "none", "markersize": 4, "color": colour(0), "zorder": 2}
    ax.plot(curve.theta_r[exact], values[exact], marker="x", **style, label=f"{name}, measured")
    if not exact.all():
        ax.plot(curve.theta_r[~exact], values[~exact], marker="o", mfc="none", **style, label=f"{name}, interpolated")
    if (curve.measured > 0).any():
        ax.set_yscale("log", nonpositive="mask")
    mark_specular(ax, curve.theta_i)
    angle_ticks(ax, curve.theta_r[0], curve.theta_r[-1])


def _errors(ax: "Axes", curve: Curve) -> None:
    used = np.abs(curve.measured) > 0
    error = 100 * (curve.points["other"].values[used] / curve.measured[used] - 1)
    ax.axhline(0, color="0.6", linewidth=0.8)
    ax.plot(curve.theta_r[used], error, color=colour(1), marker=".", markersize=3.5, linestyle="none")
    mark_specular(ax, curve.theta_i)
