"""In-plane curves of several samples, channels or wavelengths in one panel for each incidence angle."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.plotting.page.sheet import side_by_side, stacked
from gonio.plotting.panels import Curve, by_origin, evenly, panel_curves
from gonio.plotting.style import (
    COLOURS,
    DASHES,
    HOLLOW,
    LOG,
    MEASURED,
    SCALES,
    Predictor,
    angle_ticks,
    as_label,
    colour,
    heading,
    house_style,
    mark_specular,
    new_figure,
    quantity_of,
    scale_word,
    shared_legend,
    theta_r_label,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Fits = Mapping[str, Predictor]
MOST_PANELS = 6
MOST_SAMPLES = len(COLOURS)
CHANNELS = {"R": "#D55E00", "G": "#009E73", "B": "#0072B2"}  # red, green and blue that the colour-blind tell apart
CROSS = {"marker": "x", "markersize": 3, "markeredgewidth": 0.8}
DECADES = 8.0  # below the largest value: the axis ends there
DECIMALS = 2  # of an incidence angle [deg] by which curves share a panel


def samples(
    data: Mapping[str, tuple[xr.Dataset, Fits]], *, title: str = "", scales: Sequence[str] = SCALES
) -> "Figure":
    """One column for each incidence angle, with the dots of all samples and the lines of their fits.

    `data` holds, by the name in the legend, a scan of one set of directions and its fits. A colour is a sample, that
    of their names for channels R, G and B, and every second has hollow dots; dashes are a model. Crosses are values
    that were not measured: interpolated, or filled by a symmetry or a model.
    Raises ValueError for more samples than there are colours, for
    values of different units, and where a sample holds no in-plane curve.
    """
    if len(data) > MOST_SAMPLES:
        raise ValueError(f"{len(data)} sets of data are too many for one panel: choose at most {MOST_SAMPLES}")
    units = {name: dataset.unit(scan) for name, (scan, _) in data.items()}
    if len(set(units.values())) > 1:
        told = ", ".join(f"{name} in {unit}" for name, unit in units.items())
        raise ValueError(f"values of different units share no axis: {told}")
    found = {name: panel_curves(scan, scan.sizes["direction"]) for name, (scan, _) in data.items()}
    every = sorted({round(curve.theta_i, DECIMALS) for curves, _ in found.values() for curve in curves})
    count = side_by_side(MOST_PANELS)
    angles = [every[k] for k in evenly(len(every), count)]
    notes = [note for note in dict.fromkeys(note for _, note in found.values()) if note]
    notes += [f"{len(angles)} of {len(every)} incidence angles"] * (len(angles) < len(every))
    with house_style():
        scales = scales[-stacked(len(scales)) :]
        figure = new_figure(max(2.5 * len(angles), 5.0) + 0.6, 2.4 * len(scales) + 0.6)
        axes = figure.subplots(len(scales), len(angles), squeeze=False, sharex="col")
        handles: dict[str, Any] = {}
        for k, angle in enumerate(angles):
            here = {name: curve for name, (all_, _) in found.items() for curve in all_ if _is_at(curve, angle)}
            for row, scale in enumerate(scales):
                handles |= _panel(axes[row, k], here, data, scale)
                mark_specular(axes[row, k], angle)
            axes[0, k].set_title(f"θᵢ = {angle:g}°")
            axes[-1, k].set_xlabel(theta_r_label(figure, len(angles)))
        label = value_label(next(iter(units.values())), _quantity([scan for scan, _ in data.values()]))
        for row, scale in enumerate(scales):
            axes[row, 0].set_ylabel(f"{label}{scale_word(scale, scales)}")
        shared_legend(figure, list(handles.values()))
        heading(figure, title, "; ".join(notes))
    return figure


def _tints(names: Sequence[str]) -> list[Any]:
    """A colour for each sample; channels have those of their names, if all have such a name."""
    channels = [CHANNELS.get(name.rpartition("channel ")[2], "") for name in names]
    are_channels = all(channels) and len(set(channels)) == len(names)
    return channels if are_channels else [colour(k) for k in range(len(names))]


def _is_at(curve: Curve, theta_i: float) -> bool:
    return round(curve.theta_i, DECIMALS) == theta_i


def _quantity(scans: Sequence[xr.Dataset]) -> str:
    found = {quantity_of(scan) for scan in scans}
    return found.pop() if len(found) == 1 else "BSDF"


def _panel(
    ax: Any, here: Mapping[str, Curve], data: Mapping[str, tuple[xr.Dataset, Fits]], scale: str
) -> dict[str, Any]:
    """Draws the curves at one incidence angle; the artists by their label."""
    drawn: dict[str, Any] = {}
    order, models = list(data), sorted({model for _, fits in data.values() for model in fits})
    tints = _tints(order)
    for name, curve in here.items():
        k = order.index(name)
        style = MEASURED | {"color": tints[k]} | (HOLLOW | {"markersize": 3} if k % 2 else {})
        for kind, rows in by_origin(curve.points, "measured").items():
            label = name if kind == "measured" else f"{name}, {kind}"
            cross = {} if kind == "measured" else CROSS
            at = (curve.theta_r[rows], curve.measured[rows])
            (drawn[label],) = ax.plot(*at, **style | cross, label=as_label(label), zorder=1)
        for model, predictor in data[name][1].items():
            line = {"color": tints[k], "linestyle": DASHES[models.index(model) % len(DASHES)], "linewidth": 1.2}
            label = f"{name}, {model}"
            (drawn[label],) = ax.plot(curve.fine_theta_r, predictor(curve.fine), **line, label=as_label(label))
    measured = np.concatenate([curve.measured for curve in here.values()])
    positive = measured[measured > 0]
    if scale == LOG and positive.size:
        ax.set_yscale("log")
        ax.set_ylim(max(positive.min() / 2, positive.max() / 10**DECADES), positive.max() * 2.5)
    ends = np.concatenate([curve.theta_r for curve in here.values()])
    angle_ticks(ax, ends.min(), ends.max())
    return drawn
