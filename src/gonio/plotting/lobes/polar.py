"""Values in the plane of incidence on a polar axis: the angle is theta_r, the radius the value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.plotting.lobes.radius import APART, Radius
from gonio.plotting.page.sheet import POINTS, side_by_side
from gonio.plotting.page.sheet import points as text_points
from gonio.plotting.panels import by_origin
from gonio.plotting.style import (
    DASHES,
    HOLLOW,
    LOG,
    MEASURED,
    SCALES,
    as_label,
    colour,
    heading,
    house_style,
    new_figure,
    shared_legend,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
SPECULAR: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 2)), "alpha": 0.7}
LABEL = 2.5  # times the size of text: the width of the label of a circle
WIDTH = 3.0  # inches that a half circle needs with its labels, with the usual text


@dataclass(frozen=True)
class Arc:
    """What is drawn of one incidence angle [deg]: the points of a flat scan at signed theta_r [deg], and lines.

    lines: theta_r [deg] and values by the name of the model.
    """

    theta_i: float
    lines: Mapping[str, tuple[Values, Values]] = field(default_factory=dict)
    theta_r: Values = field(default_factory=lambda: np.empty(0))
    points: xr.Dataset | None = None

    @property
    def measured(self) -> Values:
        """The values of the points."""
        return np.empty(0) if self.points is None else np.asarray(self.points["brdf"].values, dtype=float)


def polar(
    arcs: Sequence[Arc],
    *,
    unit: str,
    quantity: str = "BRDF",
    title: str = "",
    note: str = "",
    scales: Sequence[str] = SCALES,
    word: str = "measured",
) -> "Figure":
    """A half circle for each scale; a colour is an incidence angle, dots are measured, dashes tell models apart.

    The normal is upwards, the forward side on the right; a thin dashed line of the same colour is specular.
    The radius ends at the largest measured value, or that of the models where nothing was measured. What is not above
    the floor of a logarithmic radius, or is negative on a linear one, lies at the centre. `word` is what the values
    are, such as simulated. Where a page has no room for both scales the logarithmic one is drawn.
    """
    with house_style():
        scales = list(scales)[-side_by_side(len(scales), WIDTH) :]
        figure = new_figure(3.9 * len(scales) + 0.4, 3.4)
        values = np.concatenate([arc.measured for arc in arcs])
        if not (values > 0).any():
            values = np.concatenate([v for arc in arcs for _, v in arc.lines.values()] or [values])
        centres = []
        for k, scale in enumerate(scales):
            ax: Any = figure.add_subplot(1, len(scales), k + 1, projection="polar")
            radius = Radius.of(scale, values)
            for j, arc in enumerate(arcs):
                _draw(ax, arc, j, radius, word)
            apart = LABEL * text_points(POINTS) / 72 / _inches(figure, len(scales))
            _finish(ax, radius, value_label(unit, quantity), max(apart, APART))
            if len(scales) > 1:
                ax.set_title("logarithmic" if scale == LOG else "linear")
            centres.append(radius.centre(unit))
        _legend(figure, arcs, word)
        heading(figure, title, note, *(text for text in centres if text))
    return figure


def _draw(ax: Any, arc: Arc, k: int, radius: Radius, word: str) -> None:
    tint = colour(k)
    ax.plot(np.radians([arc.theta_i] * 2), [0, radius.end], color=tint, **SPECULAR, zorder=0.5)
    if arc.points is not None:
        for name, rows in by_origin(arc.points, word).items():
            style = MEASURED | {"color": tint} | (HOLLOW if name not in (word, "measured") else {})
            ax.plot(np.radians(arc.theta_r[rows]), radius.lengths(arc.measured[rows]), **style, zorder=2)
    for j, (theta_r, modelled) in enumerate(arc.lines.values()):
        line = {"color": tint, "linestyle": DASHES[j % len(DASHES)], "linewidth": 1.2}
        ax.plot(np.radians(theta_r), radius.lengths(modelled), **line, zorder=1.5)


def _inches(figure: "Figure", columns: int) -> float:
    """The radius of a half circle, about, beside its labels and over the legend."""
    width, height = figure.get_size_inches()
    return float(min(0.27 * width / columns, 0.28 * height))


def _finish(ax: Any, radius: Radius, label: str, apart: float) -> None:
    ax.set_thetamin(-90)
    ax.set_thetamax(90)
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    ax.set_rlim(0, radius.end)
    angles = [-90, -60, -30, 0, 30, 60, 90]
    ax.set_xticks(np.radians(angles), [f"{angle}°".replace("-", "−") for angle in angles])
    ax.set_yticks(*radius.circles(apart))
    below = (0, -2.2 * text_points(POINTS))  # the labels of the circles stand between
    words = f"radius: {label}, angle: θᵣ [deg]"
    ax.annotate(words, (0, 0), below, textcoords="offset points", ha="center", va="top", annotation_clip=False)


def _legend(figure: "Figure", arcs: Sequence[Arc], word: str) -> None:
    """Colours are incidence angles, marks are what the values are, dashes are models."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour(k), label=f"θᵢ = {arc.theta_i:.4g}°") for k, arc in enumerate(arcs)]
    kinds = dict.fromkeys(name for arc in arcs if arc.points is not None for name in by_origin(arc.points, word))
    for name in kinds:
        style = MEASURED | (HOLLOW if name not in (word, "measured") else {})
        handles.append(Line2D([], [], **style, label=name))
    names = list(dict.fromkeys(name for arc in arcs for name in arc.lines))
    for j, name in enumerate(names if kinds or len(names) > 1 else []):  # the title names a model alone
        dashes = DASHES[j % len(DASHES)]
        handles.append(Line2D([], [], color="0.25", linestyle=dashes, linewidth=1.2, label=as_label(name)))
    handles.append(Line2D([], [], color="0.25", **SPECULAR, label="specular direction"))
    shared_legend(figure, handles)
