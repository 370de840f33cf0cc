"""Readings as they come: the signal over theta_r, and what should be constant over time."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from gonio.plotting.style import MEASURED, THETA_R, as_label, colour, heading, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEADY = ("check", "incident", "standard")  # kinds that are read again and again at one place


def readings_figure(raw: xr.Dataset, progress: str = "") -> "Figure":
    """A figure of readings, a Dataset along `reading` as `gonio.acquisition.readings` gives it."""
    with house_style():
        figure = new_figure(7.2, 5.6)
        draw_readings(figure, raw, progress)
    return figure


def draw_readings(figure: "Figure", raw: xr.Dataset, progress: str = "") -> None:
    """Draw into a figure: signals of the sample above, a colour for each incidence angle, steadiness below.

    Attempts that were repeated are not drawn, but those that are overloaded in the largest range are, as hollow dots.
    Below are readings of the check direction, the incident beam and the standard over their first, less the darks.
    """
    attempt = raw["attempt"].values
    last = raw.isel(reading=np.flatnonzero(~np.append(attempt[1:] > attempt[:-1], False)))
    with house_style():
        upper, lower = figure.subplots(2, 1, height_ratios=(2.2, 1))
        _signals(upper, last)
        _steadiness(lower, last)
        heading(figure, "readings", progress)


def _signals(ax: "Axes", last: xr.Dataset) -> None:
    sample = last.isel(reading=last["kind"].values == "sample")
    signed = np.where(sample["phi"].values == 0, -1.0, 1.0) * sample["theta_r"].values
    theta_i = np.round(sample["theta_i"].values, 1)  # of positions read back
    for k, angle in enumerate(np.unique(theta_i)):
        for flag in (0.0, 1.0):
            rows = (theta_i == angle) & (sample["overload"].values == flag)
            hollow = {"markerfacecolor": "white", "markeredgewidth": 0.6} if flag else {}
            label = f"θᵢ = {angle:g}°" + ", overloaded" * bool(flag)
            if rows.any() or not flag:
                style = MEASURED | {"color": colour(k)} | hollow
                ax.plot(signed[rows], sample["signal"].values[rows], **style, label=label)
    if (sample["signal"].values > 0).any():
        ax.set_yscale("log", nonpositive="mask")
    ax.set_xlabel(THETA_R)
    ax.set_ylabel(f"signal [{as_label(str(last['signal'].attrs.get('units', '')))}]")
    if sample.sizes["reading"]:
        ax.legend(ncols=2)


def _steadiness(ax: "Axes", last: xr.Dataset) -> None:
    kinds, minutes = last["kind"].values, last["time"].values / 60
    for k, kind in enumerate(kind for kind in STEADY if (kinds == kind).any()):
        rows = np.flatnonzero(kinds == kind)
        dark = np.array([_dark(last, str(last["range"].values[row])) for row in rows])
        net = last["signal"].values[rows] - dark
        with np.errstate(divide="ignore", invalid="ignore"):
            change = 100 * (net / net[0] - 1)
        ax.plot(minutes[rows], change, color=colour(k), marker="o", markersize=3, label=kind)
        ax.legend()
    ax.axhline(0, color="0.7", linewidth=0.8)
    ax.set_xlabel("time [min]")
    ax.set_ylabel("change [%]")


def _dark(last: xr.Dataset, name: str) -> float:
    rows = (last["kind"].values == "dark") & (last["range"].values == name)
    return float(last["signal"].values[rows].mean()) if rows.any() else 0.0
