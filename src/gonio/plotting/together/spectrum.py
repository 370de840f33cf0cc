"""Values over wavelength, or over channels, at one or several directions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.sound import is_stated
from gonio.plotting.panels import by_origin
from gonio.plotting.style import (
    BARS,
    COLOURS,
    DASHES,
    HOLLOW,
    LINEAR,
    LOG,
    MEASURED,
    as_label,
    colour,
    heading,
    house_style,
    line_style,
    new_figure,
    shared_legend,
    value_label,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]
STROKES = (
    ("_", 9),
    ("x", 5),
    ("+", 7),
    ("1", 8),
)  # of models at channels, with their sizes: a line between these means nothing
COLOUR_ORDER = "RGB"  # of channels, where a scan has no others


@dataclass(frozen=True)
class Series:
    """One direction in words, its points of a flat scan, and the values of fits by name at `labels`.

    labels: the wavelengths [nm] or channels at which the scan has a value, each once and in order.
    """

    direction: str
    points: xr.Dataset
    labels: npt.NDArray[Any]
    fits: Mapping[str, Values]


def spectrum(
    series: Sequence[Series],
    along: str,
    *,
    unit: str,
    quantity: str = "BRDF",
    title: str = "",
    note: str = "",
    scale: str = LINEAR,
    word: str = "measured",
) -> "Figure":
    """Values over `along`, which is wavelength or channel: dots are measured, bars are standard uncertainties.

    Fits are lines between their values at the wavelengths of the scan, and strokes at channels. With several
    directions a colour is a direction and dashes are a model. `word` is what the values are.
    Raises ValueError for more directions than there are colours.
    """
    if len(series) > len(COLOURS):
        raise ValueError(f"{len(series)} directions are too many for one panel: name at most {len(COLOURS)}")
    places = _places(series, along)
    with house_style():
        figure = new_figure(5.2, 3.6)
        ax = figure.subplots()
        handles: dict[str, Any] = {}
        models: dict[str, Any] = {}
        for k, one in enumerate(series):
            several = {"color": colour(k)} if len(series) > 1 else {}
            handles |= _dots(ax, one, along, places, several, word)
            models = _fits(ax, one, places, several) | models
        if scale == LOG and any((one.points["brdf"].values > 0).any() for one in series):
            ax.set_yscale("log", nonpositive="mask")
        if places:
            ax.set_xticks(list(places.values()), [as_label(name) for name in places])
            ax.set_xlim(-0.5, len(places) - 0.5)
        ax.set_xlabel("channel" if places else "wavelength [nm]")
        ax.set_ylabel(value_label(unit, quantity))
        shared_legend(figure, [*handles.values(), *models.values()], columns=3 if len(series) == 1 else 1)
        heading(figure, title, *([series[0].direction] if len(series) == 1 else []), note)
    return figure


def _places(series: Sequence[Series], along: str) -> dict[str, int]:
    """Where each channel stands on the axis; nothing for wavelengths, which are numbers."""
    if along == "wavelength":
        return {}
    names = list(dict.fromkeys(str(label) for one in series for label in one.labels))
    if set(names) <= set(COLOUR_ORDER):
        names.sort(key=COLOUR_ORDER.index)
    return {name: k for k, name in enumerate(names)}


def _x(labels: npt.NDArray[Any], places: Mapping[str, int]) -> Values:
    return np.array([places[str(label)] if places else float(label) for label in labels], dtype=float)


def _dots(
    ax: Any, one: Series, along: str, places: Mapping[str, int], several: dict[str, Any], word: str
) -> dict[str, Any]:
    x, y = _x(one.points[along].values, places), one.points["brdf"].values
    drawn: dict[str, Any] = {}
    if "uncertainty" in one.points and (stated := is_stated(one.points["uncertainty"].values)).any():
        bars = BARS | ({"ecolor": several["color"]} if several else {})
        spread = one.points["uncertainty"].values[stated]
        artist = ax.errorbar(x[stated], y[stated], spread, **bars, capsize=2, label="standard uncertainty", zorder=0.9)
        drawn["standard uncertainty"] = artist
    for name, rows in by_origin(one.points, word).items():
        style = MEASURED | {"markersize": 3.5} | several | (HOLLOW if name not in (word, "measured") else {})
        label = as_label(f"{one.direction}, {name}" if several else name)
        (drawn[label],) = ax.plot(x[rows], y[rows], **style, label=label, zorder=2)
    return drawn


def _fits(ax: Any, one: Series, places: Mapping[str, int], several: dict[str, Any]) -> dict[str, Any]:
    drawn: dict[str, Any] = {}
    for j, (name, values) in enumerate(one.fits.items()):
        style = line_style(j)
        if several:
            style.update(several, linestyle=DASHES[j % len(DASHES)])
        if places:
            marker, points = STROKES[j % len(STROKES)]
            style |= {"linestyle": "none", "marker": marker, "markersize": points, "markeredgewidth": 1.5}
        label = as_label(name)
        (drawn[label],) = ax.plot(_x(one.labels, places), values, **style, label=label, zorder=1.5)
    return drawn
