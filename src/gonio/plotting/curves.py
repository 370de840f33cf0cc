"""In-plane curves, measured and modelled, linear and logarithmic (guo2023, Figs 10 and 11)."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gonio.comparison.metrics import at_specular
from gonio.measured import dataset
from gonio.measured.sound import is_stated
from gonio.plotting.page.sheet import side_by_side, stacked
from gonio.plotting.panels import Curve, by_origin, origin_word, panel_curves
from gonio.plotting.style import (
    BARS,
    HOLLOW,
    LOG,
    MEASURED,
    SCALES,
    Band,
    Predictor,
    angle_ticks,
    as_label,
    heading,
    house_style,
    line_style,
    mark_specular,
    new_figure,
    quantity_of,
    scale_word,
    shared_legend,
    theta_r_label,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def curves(
    scan: xr.Dataset,
    fits: Mapping[str, Predictor],
    *,
    title: str = "",
    normalised: bool = False,
    bands: Mapping[str, Band] | None = None,
    most: int = 6,
    scales: Sequence[str] = SCALES,
) -> "Figure":
    """One column for each incidence angle, linear above and logarithmic below; dots are measured, lines the fits.

    `scales` names the rows; where a page has no room for both, the logarithmic one is drawn.

    Bars are the standard uncertainties that the scan states, shades the 95 % bands of fits that have one. `normalised`
    divides every curve by its own value at the specular angle, as the paper draws them.
    """
    panels, note = panel_curves(scan, side_by_side(most))
    measured = origin_word(scan)
    with house_style():
        scales = scales[-stacked(len(scales)) :]
        figure = new_figure(max(2.5 * len(panels), 5.0) + 0.6, 2.4 * len(scales) + 0.6)
        axes = figure.subplots(len(scales), len(panels), squeeze=False, sharex="col")
        for k, curve in enumerate(panels):
            for ax in axes[:, k]:
                _draw(ax, curve, fits, measured, normalised)
                _shade(ax, curve, fits, bands or {})
            axes[0, k].set_title(f"θᵢ = {curve.theta_i:g}°")
            axes[-1, k].set_xlabel(theta_r_label(figure, len(panels)))
            if scales[-1] == LOG:
                axes[-1, k].set_yscale("log")
                _log_limits(axes[-1, k])
        for row, scale in enumerate(scales):
            unit = "f / f(θᵢ)" if normalised else value_label(dataset.unit(scan), quantity_of(panels[0].points))
            axes[row, 0].set_ylabel(f"{unit}{scale_word(scale, scales)}")
        shared_legend(figure, axes[0, 0])
        heading(figure, title, note)
    return figure


def _draw(ax: "Axes", curve: Curve, fits: Mapping[str, Predictor], measured: str, normalised: bool) -> None:
    scale = at_specular(curve.theta_r, curve.measured, curve.theta_i) if normalised else 1.0
    for label, rows in by_origin(curve.points, measured).items():
        style = MEASURED if label in (measured, "measured") else MEASURED | HOLLOW
        ax.plot(curve.theta_r[rows], curve.measured[rows] / scale, **style, label=label, zorder=1)
    if "uncertainty" in curve.points and (stated := is_stated(curve.points["uncertainty"].values)).any():
        spread = curve.points["uncertainty"].values[stated] / scale
        label = "standard uncertainty"
        ax.errorbar(curve.theta_r[stated], curve.measured[stated] / scale, spread, **BARS, label=label, zorder=0.9)
    for k, (name, predictor) in enumerate(fits.items()):
        modelled = predictor(curve.fine)
        scale = at_specular(curve.fine_theta_r, modelled, curve.theta_i) if normalised else 1.0
        ax.plot(curve.fine_theta_r, modelled / scale, **line_style(k), label=as_label(name), zorder=2)
    mark_specular(ax, curve.theta_i)
    angle_ticks(ax, curve.theta_r[0], curve.theta_r[-1])


def _shade(ax: "Axes", curve: Curve, fits: Mapping[str, Predictor], bands: Mapping[str, Band]) -> None:
    for k, name in enumerate(fits):
        if name in bands:
            lower, upper = bands[name](curve.fine)
            label = "" if k else "95 % band"
            shade = {"color": line_style(k)["color"], "alpha": 0.22, "linewidth": 0, "zorder": 1.5}
            ax.fill_between(curve.fine_theta_r, lower, upper, **shade, label=label)


def _log_limits(ax: "Axes", most_decades: float = 8.0) -> None:
    """From just below the least positive measured value, so that a model's vanishing tail does not flatten the data."""
    # of the dots alone
    measured = np.concatenate([line.get_ydata() for line in ax.lines if line.get_linestyle() == "None"])
    positive = measured[measured > 0]
    if positive.size:
        least, most = positive.min(), positive.max()
        ax.set_ylim(max(least / 2, most / 10**most_decades), most * 2.5)
