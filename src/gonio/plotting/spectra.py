"""Fitted values over wavelength, with their standard uncertainties."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.style import as_label, heading, house_style, line_style, new_figure, shared_legend, symbol
from gonio.units import unit_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SPECTRAL = "wavelength"
MOST_COLUMNS = 3
MOST_LINES = 7  # one for each colour

Parameters = Mapping[str, Mapping[str, Any]]  # as Solution.parameters gives them


def spectra(fits: Mapping[str, Parameters], *, title: str = "") -> "Figure":
    """One panel for each parameter with a value for each wavelength; bars are one standard uncertainty.

    `fits` holds the parameters of each fit by its name. A parameter that is grouped by other coordinates as well has a
    line for each of their values. A hollow marker is a value that the data do not determine, or that is held.
    Raises ValueError where no parameter has one value for each wavelength, or a panel would hold too many lines.
    """
    panels = {p: None for parameters in fits.values() for p, values in parameters.items() if _is_spectral(values)}
    if not panels:
        raise ValueError("spectra shows parameters with one value for each wavelength: this fit has none")
    with house_style():
        columns = min(len(panels), side_by_side(MOST_COLUMNS, 1.6))
        rows = -(-len(panels) // columns)
        figure = new_figure(max(2.9 * columns, 4.4) + 0.4, 2.5 * rows + 0.9)
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        styles: dict[str, int] = {}  # the same line has the same style in every panel
        for ax, name in zip(grid, panels, strict=False):
            _panel(ax, name, {fit: p[name] for fit, p in fits.items() if name in p and _is_spectral(p[name])}, styles)
        for ax in grid[len(panels) :]:
            ax.remove()
        _legend(figure, grid[: len(panels)])
        heading(figure, title)
    return figure


def _is_spectral(parameter: Mapping[str, Any]) -> bool:
    return SPECTRAL in parameter.get("by", "").split(",")


def _panel(ax: "Axes", name: str, fits: Mapping[str, Mapping[str, Any]], styles: dict[str, int]) -> None:
    for fit, parameter in fits.items():
        for group, points in _lines(parameter):
            text = ", ".join(part for part in (fit, group) if part)
            style = line_style(styles.setdefault(text, len(styles)))
            if len(styles) > MOST_LINES:
                raise ValueError(f"spectra has room for {MOST_LINES} lines: fit fewer models, or group by fewer values")
            x, y, spread = np.array(sorted(points), dtype=float).T
            determined = np.isfinite(spread)
            x_bars, y_bars = x[determined], y[determined]
            ax.plot(x, y, **style, label=as_label(text))
            ax.errorbar(x_bars, y_bars, spread[determined], fmt="o", markersize=3, capsize=2, color=style["color"])
            ax.plot(x[~determined], y[~determined], "o", markersize=4, markerfacecolor="white", color=style["color"])
    unit = unit_label(str(next(iter(fits.values()))["unit"])) or "1"
    ax.set_xlabel("wavelength [nm]")
    ax.set_ylabel(f"{symbol(name)} [{unit}]")


def _lines(parameter: Mapping[str, Any]) -> Iterator[tuple[str, list[tuple[float, float, float]]]]:
    """Each spectrum: its group beside the wavelength, and wavelength [nm], value and standard uncertainty."""
    by = parameter["by"].split(",")
    spectral = by.index(SPECTRAL)
    lines: dict[str, list[tuple[float, float, float]]] = {}
    for key, value in parameter["values"].items():
        labels = key.split(",")
        group = ", ".join(f"{c} {v}" for c, v in zip(by, labels, strict=True) if c != SPECTRAL)
        lines.setdefault(group, []).append((float(labels[spectral]), value["value"], value["uncertainty"]))
    yield from lines.items()


def _legend(figure: "Figure", panels: Any) -> None:
    """Under all panels, if a panel has more than one line."""
    most = max(panels, key=lambda ax: len(ax.get_legend_handles_labels()[1]))
    if len(most.get_legend_handles_labels()[1]) > 1:
        shared_legend(figure, most, columns=3)
