"""A light curve with the band of its uncertainty, the observed magnitudes, and the shares of the facets."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.plotting.page import current
from gonio.plotting.style import (
    BARS,
    COLOURS,
    MEASURED,
    as_label,
    colour,
    heading,
    house_style,
    line_style,
    new_figure,
    shared_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Values = npt.NDArray[np.float64]

TIME, PHASE = "time", "phase"
OVER = (TIME, PHASE)
TWICE = 2.0  # standard uncertainties on either side in the band
MOST = len(COLOURS)  # names that have a line of their own
BESIDE = 45  # sizes of text from which the label of the axis has room in the middle, with the day to its right


def light_curve_figure(
    curve: xr.Dataset,
    times: Any = None,
    measured: Values | None = None,
    spread: Values | None = None,
    *,
    over: str = TIME,
    title: str = "",
) -> "Figure":
    """The magnitude, brighter above, with a band of two standard uncertainties; below the share of each name.

    Parameters
    ----------
    curve : xarray.Dataset
        As `gonio.photometry.light_curve` gives it.
    times : array_like (times,), optional
        Times (datetime64) or numbers for the axis; without them the places of the rows, from 1.
    measured, spread : array_like (times,), optional
        Observed magnitudes and their standard deviations; NaN where there is none.
    over : str
        `time`, or `phase` for the phase angle, where rows in no order are dots.
    title : str
        Of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Not yet saved.

    Raises
    ------
    ValueError
        No time has light, or there are more names than colours.

    """
    m = curve["magnitude"].values
    if not np.isfinite(m).any():
        raise ValueError("no facet is lit and seen at any time: there is no light curve to draw")
    if curve.sizes["facet"] > MOST:
        raise ValueError(f"{curve.sizes['facet']} names of facets have no room: give facets of one part one name")
    x, label = _axis(curve, times, over)
    order = np.argsort(x, kind="stable")
    curve, x = curve.isel(time=order), x[order]
    with house_style():
        figure = new_figure(6.4, 5.0 if curve.sizes["facet"] > 1 else 3.8)
        several = curve.sizes["facet"] > 1
        axes = figure.subplots(
            2 if several else 1, 1, sharex=True, squeeze=False, height_ratios=(2.2, 1) if several else (1,)
        )
        top = axes[0, 0]
        _magnitudes(top, curve, x, over == PHASE)
        if measured is not None and np.isfinite(measured).any():
            bars = np.nan_to_num(np.asarray(spread if spread is not None else np.zeros_like(m)), nan=0.0)[order]
            top.errorbar(x, np.asarray(measured)[order], bars, **(BARS | {"zorder": 1}))
            top.plot(x, np.asarray(measured)[order], **(MEASURED | {"zorder": 1.5}), label="observed")
        top.invert_yaxis()
        top.set_ylabel(f"{curve.attrs['band']} [mag, {curve.attrs['system']}]")
        if several:
            _shares(axes[1, 0], curve, x, over == PHASE)
        axes[-1, 0].set_xlabel(label)
        _dated(figure, axes[-1, 0], x)
        shared_legend(figure, _handles(axes))
        heading(figure, title)
    return figure


def _axis(curve: xr.Dataset, times: Any, over: str) -> tuple[Any, str]:
    """Where each row is on the axis, and the label of that."""
    if over == PHASE:
        return curve["phase_angle"].values, "phase angle [deg]"
    if over != TIME:
        raise ValueError(f"a light curve is drawn over {' or '.join(OVER)}, and not over {over!r}")
    if times is None:
        return np.arange(1, curve.sizes["time"] + 1), "row"
    values = np.asarray(times)
    return values, "time (UTC)" if values.dtype.kind == "M" else "time"


def _magnitudes(ax: "Axes", curve: xr.Dataset, x: Any, dots: bool) -> None:
    seen = np.isfinite(curve["magnitude"].values)
    m = np.where(seen, curve["magnitude"].values, np.nan)
    systematic = np.nan_to_num(curve["uncertainty_systematic"].values, nan=0.0)
    half = TWICE * np.hypot(curve["uncertainty"].values, systematic)
    half = np.where(np.isfinite(half), half, np.nan)
    label = "computed, ± 2 u of the fits" if np.nanmax(half, initial=0.0) > 0 else "computed"
    if dots:
        ax.errorbar(x, m, np.nan_to_num(half, nan=0.0), fmt="o", ms=2.4, elinewidth=0.7, color=colour(0),
                    label=label)  # fmt: skip
        return
    ax.plot(x, m, **line_style(0), marker="o" if len(x) < 3 else "", label=label)
    ax.fill_between(x, m - half, m + half, color=colour(0), alpha=0.2, linewidth=0)


def _shares(ax: "Axes", curve: xr.Dataset, x: Any, dots: bool) -> None:
    for k, name in enumerate(curve["facet"].values.tolist(), start=1):
        style = line_style(k)
        if dots:
            style |= {"linestyle": "none", "marker": "o", "markersize": 2.4}
        ax.plot(x, 100 * curve["share"].sel(facet=name).values, **style, label=as_label(str(name)))
    ax.set_ylim(-3, 103)
    ax.set_ylabel("share [%]")


def _handles(axes: Any) -> list[Any]:
    """The artists of the legend, of both panels."""
    return [handle for ax in axes.ravel() for handle in ax.get_legend_handles_labels()[0]]


def _dated(figure: "Figure", ax: "Axes", x: Any) -> None:
    """Few labels of dates, each short, with the day beside the axis."""
    if np.asarray(x).dtype.kind != "M":
        return
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    room = figure.get_figwidth() * 72 / current().points
    if room < BESIDE:
        ax.set_xlabel(ax.get_xlabel(), loc="left")
    locator: Any = AutoDateLocator(  # type: ignore[no-untyped-call]
        minticks=3, maxticks=max(int(room / 6), 4)
    )
    ax.xaxis.set_major_locator(locator)
    ax.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
