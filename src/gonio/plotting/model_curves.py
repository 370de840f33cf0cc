"""A model without data, in the plane of incidence: one curve for each incidence angle."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.model import Model
from gonio.plotting.page import current
from gonio.plotting.style import (
    angle_ticks,
    heading,
    house_style,
    line_style,
    mark_specular,
    new_figure,
    shared_legend,
    theta_r_label,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
DECADES = 1e6  # the axis ends this many times below the maximum: no goniometer measures less


def in_plane(model: Model, values: Mapping[str, float], theta_i: float) -> tuple[Values, Values]:
    """Signed theta_r [deg] from horizon to horizon, with the specular direction, and the BRDF there."""
    theta_r = np.unique(np.append(np.linspace(-89, 89, 1425), theta_i))
    geometry = Geometry.in_plane(np.full_like(theta_r, theta_i), theta_r)
    return theta_r, np.array(np.broadcast_to(np.asarray(model(geometry, values), dtype=float), theta_r.shape))


def model_curves(
    model: Model, values: Mapping[float, Mapping[str, float]], unit: str, title: str = "", linear: bool = False
) -> "Figure":
    """BRDF over signed theta_r for values by incidence angle [deg]; logarithmic unless linear, or a value negative."""
    with house_style():
        figure = new_figure(6.4, 3.6)
        ax = figure.add_subplot()
        least, most = np.inf, 0.0
        for k, (theta_i, parameters) in enumerate(values.items()):
            theta_r, f = in_plane(model, parameters, theta_i)
            ax.plot(theta_r, f, **line_style(k), label=f"θᵢ = {theta_i:g}°")
            mark_specular(ax, theta_i)
            least, most = min(least, float(f.min())), max(most, float(f.max()))
        if least >= 0 and most > 0 and not linear:
            ax.set_yscale("log")
            ax.set_ylim(max(least, most / DECADES) / 1.5, most * 1.5)
        angle_ticks(ax, -90, 90)
        ax.set_xlabel(theta_r_label(figure, 1))
        ax.set_ylabel(value_label(unit))
        if current().sides:
            shared_legend(figure, ax)
        else:
            figure.legend(loc="outside right upper")
        heading(figure, title, model.name if model.name not in title else "")
    return figure
