"""The weighted terms of a fitted model, each on its own, and their sum."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.model import Model
from gonio.plotting.page.sheet import side_by_side, stacked
from gonio.plotting.panels import origin_word, panel_curves
from gonio.plotting.style import (
    LOG,
    MEASURED,
    SCALES,
    angle_ticks,
    heading,
    house_style,
    line_style,
    mark_specular,
    new_figure,
    quantity_of,
    scale_word,
    shared_legend,
    symbol,
    theta_r_label,
    value_label,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure


Values = npt.NDArray[np.float64]


def components(
    scan: xr.Dataset,
    model: Model,
    parts_at: "Callable[[xr.Dataset], Mapping[str, Values]]",
    *,
    title: str = "",
    most: int = 4,
    scales: Sequence[str] = SCALES,
) -> "Figure":
    """One column for each incidence angle, linear above and logarithmic below: every weight times its term.

    `scales` names the rows; where a page has no room for both, the logarithmic one is drawn.

    `parts_at` gives the weighted terms at the directions of a flat scan, as Solution.components does.
    """
    panels, note = panel_curves(scan, side_by_side(most))
    measured = origin_word(scan)
    with house_style():
        scales = scales[-stacked(len(scales)) :]
        figure = new_figure(max(2.7 * len(panels), 5.0) + 0.6, 2.4 * len(scales) + 0.6)
        axes = figure.subplots(len(scales), len(panels), squeeze=False, sharex="col")
        for k, curve in enumerate(panels):
            parts = parts_at(curve.fine)
            for ax in axes[:, k]:
                ax.plot(curve.theta_r, curve.measured, **MEASURED, label=measured)
                for j, (weight, part) in enumerate(parts.items()):
                    term = model.terms[weight].__name__.replace("_", " ")
                    ax.plot(curve.fine_theta_r, part, **line_style(j), label=f"{symbol(weight)} × {term}")
                ax.plot(curve.fine_theta_r, sum(parts.values()), color="0.0", linewidth=1.0, label="sum")
                mark_specular(ax, curve.theta_i)
                angle_ticks(ax, curve.theta_r[0], curve.theta_r[-1])
            positive = curve.measured[curve.measured > 0]
            if scales[-1] == LOG:
                axes[-1, k].set_yscale("log")
                axes[-1, k].set_ylim(max(positive.min() / 30, positive.max() / 1e8), positive.max() * 2.5)
            axes[0, k].set_title(f"θᵢ = {curve.theta_i:g}°")
            axes[-1, k].set_xlabel(theta_r_label(figure, len(panels)))
        unit = value_label(dataset.unit(scan), quantity_of(panels[0].points))
        for row, scale in enumerate(scales):
            axes[row, 0].set_ylabel(f"{unit}{scale_word(scale, scales)}")
        shared_legend(figure, axes[0, 0], columns=3)
        heading(figure, title, note)
    return figure
