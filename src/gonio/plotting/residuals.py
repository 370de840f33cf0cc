"""Residuals of a fit: the difference between model and measurement along every curve."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gonio.measured.dataset import is_degree
from gonio.plotting.page.sheet import side_by_side, stacked
from gonio.plotting.panels import panel_curves, with_gaps
from gonio.plotting.style import (
    Predictor,
    angle_ticks,
    as_label,
    heading,
    house_style,
    line_style,
    mark_specular,
    new_figure,
    shared_legend,
    theta_r_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def residuals(scan: xr.Dataset, fits: Mapping[str, Predictor], *, title: str = "", most: int = 6) -> "Figure":
    """One column for each incidence angle: above the difference over the curve's peak, below over each value.

    Of degrees of polarisation, which have no peak and may be zero, the difference itself is drawn alone. Where a page
    has no room for both, the former is drawn.
    """
    panels, note = panel_curves(scan, side_by_side(most))
    with house_style():
        of_degrees = is_degree(panels[0].points)
        count = 1 if of_degrees else stacked(2)
        figure = new_figure(max(2.5 * len(panels), 5.0) + 0.6, 2.4 + 2.4 * (not of_degrees))
        axes = figure.subplots(count, len(panels), squeeze=False, sharex="col", sharey="row")
        for k, curve in enumerate(panels):
            for j, (name, predictor) in enumerate(fits.items()):
                error = predictor(curve.points) - curve.measured
                positive = curve.measured > 0
                style = line_style(j) | {"linewidth": 1.2}
                whole = error if of_degrees else 100 * error / curve.measured.max()
                axes[0, k].plot(*with_gaps(curve.theta_r, whole), **style, label=as_label(name))
                relative = 100 * error / np.where(positive, curve.measured, np.nan)
                if count > 1:
                    axes[1, k].plot(*with_gaps(curve.theta_r, relative), **style)
            axes[0, k].set_title(f"θᵢ = {curve.theta_i:g}°")
            axes[-1, k].set_xlabel(theta_r_label(figure, len(panels)))
            for ax in axes[:, k]:
                ax.axhline(0, color="0.4", linewidth=0.8)
                mark_specular(ax, curve.theta_i)
                angle_ticks(ax, curve.theta_r[0], curve.theta_r[-1])
        axes[0, 0].set_ylabel("model − data" if of_degrees else "(model − data) / peak [%]")
        if count > 1:
            axes[1, 0].set_ylabel("(model − data) / data [%]")
            axes[1, 0].set_yscale("symlog", linthresh=10)
            axes[1, 0].set_yticks([-100, -10, 0, 10, 100, 1000], ["−100", "−10", "0", "10", "100", "1000"])
        shared_legend(figure, axes[0, 0])
        heading(figure, title, note)
    return figure
