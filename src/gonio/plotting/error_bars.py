"""Errors of several models stacked for every sample and incidence angle (guo2023, Fig 12)."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gonio.plotting.style import colour, heading, house_style, new_figure, shared_legend

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HATCHES = ("", "///", "...", "xx")


def error_bars(
    errors: Mapping[str, Mapping[str, Sequence[float]]], theta_i: Sequence[float], *, metric: str, title: str = ""
) -> "Figure":
    """`errors[model][sample]` has one value for each incidence angle; each bar stacks the errors of all models."""
    samples = list(next(iter(errors.values())))
    with house_style():
        figure = new_figure(max(1.9 * len(samples), 4.0) + 0.8, 3.7)
        ax = figure.subplots()
        places = [k * (len(theta_i) + 1) + j for k in range(len(samples)) for j in range(len(theta_i))]
        base = np.zeros(len(places))
        for m, (model, by_sample) in enumerate(errors.items()):
            heights = np.array([value for sample in samples for value in by_sample[sample]], dtype=float)
            ax.bar(
                places,
                heights,
                bottom=base,
                width=0.82,
                color=colour(m),
                hatch=HATCHES[m % len(HATCHES)],
                edgecolor="white",
                linewidth=0.5,
                label=model,
            )
            base += heights
        ax.set_xticks(places, [f"{angle:g}°" for _ in samples for angle in theta_i])
        for k, sample in enumerate(samples):
            centre = k * (len(theta_i) + 1) + (len(theta_i) - 1) / 2
            ax.annotate(
                sample, (centre, 0), (0, -24), ("data", "axes fraction"), "offset points", ha="center", weight="bold"
            )
        ax.set_xlabel("incidence angle θᵢ of each sample", labelpad=20)
        ax.set_ylabel(f"{metric}, stacked [1]" if len(errors) > 1 else f"{metric} of {next(iter(errors))} [1]")
        ax.grid(axis="x", visible=False)
        ax.set_axisbelow(True)
        shared_legend(figure, ax)
        heading(figure, title)
    return figure
