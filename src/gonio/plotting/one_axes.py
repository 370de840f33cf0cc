"""Figures on one pair of axes that the caller brings: all incidence angles of a scan together."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.plotting.panels import Curve, by_origin, panel_curves, with_gaps
from gonio.plotting.style import (
    COLOURS,
    DASHES,
    HOLLOW,
    MEASURED,
    THETA_R,
    Predictor,
    as_label,
    quantity_of,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Fits = Mapping[str, Predictor]
FINEST = 1e-8  # of the largest value: the axis ends there, where a model's tail vanishes


def curves_on(ax: "Axes", scan: xr.Dataset, fits: Fits) -> None:
    """Measured dots and the lines of fits, on a logarithmic axis; each incidence has a colour, each fit its dashes."""
    panels, _ = panel_curves(scan)
    for k, curve in enumerate(panels):
        colour = COLOURS[k % len(COLOURS)]
        for origin, rows in by_origin(curve.points, "measured").items():
            filled = origin != "measured"
            style = MEASURED | {"color": colour} | (HOLLOW if filled else {})
            label = f"θᵢ = {curve.theta_i:g}°" + (f", {origin}" if filled else "")
            ax.plot(curve.theta_r[rows], curve.measured[rows], **style, label=label)
        for j, (name, predictor) in enumerate(fits.items()):
            line: dict[str, Any] = {"color": colour, "linestyle": DASHES[j % len(DASHES)], "linewidth": 1.2}
            ax.plot(curve.fine_theta_r, predictor(curve.fine), **line, label=None if k else as_label(name))
    measured = np.concatenate([curve.measured for curve in panels])
    if (measured > 0).any() and not dataset.is_degree(panels[0].points):
        ax.set_yscale("log")
        positive = measured[measured > 0]
        ax.set_ylim(max(positive.min() / 2, positive.max() * FINEST), positive.max() * 2.5)
    _finish(ax, value_label(dataset.unit(scan), quantity_of(panels[0].points)))


def residuals_on(ax: "Axes", scan: xr.Dataset, fits: Fits) -> None:
    """The difference of every fit from the measured values, over the peak of its curve."""
    panels, _ = panel_curves(scan)
    for k, curve in enumerate(panels):
        for j, (name, predictor) in enumerate(fits.items()):
            colour, dashes = COLOURS[k % len(COLOURS)], DASHES[j % len(DASHES)]
            label = f"θᵢ = {curve.theta_i:g}°" + (f", {as_label(name)}" if len(fits) > 1 else "")
            ax.plot(*_relative(curve, predictor), color=colour, linestyle=dashes, linewidth=1.2, label=label)
    ax.axhline(0, color="0.4", linewidth=0.8)
    _finish(ax, "model − data" if dataset.is_degree(panels[0].points) else "(model − data) / peak [%]")


def _relative(curve: Curve, predictor: Predictor) -> tuple[Any, Any]:
    error = predictor(curve.points) - curve.measured
    peak = 1.0 if dataset.is_degree(curve.points) else curve.measured.max() / 100
    return with_gaps(curve.theta_r, error / peak)


def _finish(ax: "Axes", label: str) -> None:
    ax.set_xlabel(THETA_R)
    ax.set_ylabel(label)
    ax.legend(fontsize=8)


ON_ONE_AXES: Mapping[str, Callable[["Axes", xr.Dataset, Fits], None]] = {
    "curves": curves_on,
    "residuals": residuals_on,
}
