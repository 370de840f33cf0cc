"""Profile likelihood: how the cost rises along each value, against the parabola of its standard uncertainty."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gonio.fitting.certainty.profile import Profile
from gonio.plotting.page.sheet import side_by_side
from gonio.plotting.style import colour, heading, house_style, new_figure, shared_legend, symbol
from gonio.units import unit_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 4
DECADE = 10.0  # the ratio of the ends of a profile from which its axis is logarithmic


def profiles(results: Sequence[Profile], uncertainties: Mapping[str, float], *, title: str = "") -> "Figure":
    """One panel for each value: the rise of the cost, the interval, and the parabola of the standard uncertainty."""
    columns = min(len(results), side_by_side(COLUMNS))
    rows = -(-len(results) // columns)
    with house_style():
        figure = new_figure(max(2.3 * columns, 4.6) + 0.4, 2.3 * rows + 0.6)
        axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for ax, profile in zip(axes, results, strict=False):
            _draw(ax, profile, uncertainties[profile.name])
        for ax in axes[len(results) :]:
            ax.set_visible(False)
        for ax in axes[::columns]:
            ax.set_ylabel("rise of the cost [1]")
        axes[0].set_ylim(-0.03 * results[0].factor ** 2, 1.5 * results[0].factor ** 2)
        shared_legend(figure, axes[0])
        heading(figure, title)
    return figure


def _draw(ax: "Axes", profile: Profile, uncertainty: float) -> None:
    from scipy.interpolate import PchipInterpolator

    low, high = profile.at[0], profile.at[-1]
    ax.axvspan(max(profile.lower, low), min(profile.upper, high), color=colour(0), alpha=0.12, linewidth=0, zorder=0)
    logarithmic = low > 0 and high > DECADE * low
    fine = np.geomspace(low, high, 201) if logarithmic else np.linspace(low, high, 201)
    smooth = PchipInterpolator(profile.at, profile.rise)(fine) if low < high else np.zeros_like(fine)
    ax.plot(fine, smooth**2, color=colour(0), linewidth=1.5, label="profile")
    ax.plot(profile.at, profile.rise**2, color=colour(0), marker=".", markersize=4, linestyle="none")
    if np.isfinite(uncertainty):
        parabola = ((fine - profile.value) / uncertainty) ** 2
        ax.plot(fine, parabola, color=colour(1), linestyle="--", linewidth=1.2, label="standard uncertainty")
    ax.axhline(profile.factor**2, color="0.4", linewidth=0.8, label=f"{100 * profile.level:g} % level")
    ax.set_xlabel(f"{symbol(profile.name)} [{unit_label(profile.unit) or '1'}]")
    if logarithmic:
        ax.set_xscale("log")  # on a linear axis the minimum is a point at the left edge
    else:
        ax.locator_params(axis="x", nbins=4)
