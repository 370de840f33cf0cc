"""The course of an annealing search (guo2023, appendix A.7)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gonio.plotting.style import COLOURS, heading, house_style, line_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def convergence(
    histories: Mapping[str, npt.NDArray[np.float64]],
    *,
    exact: float | None = None,
    relative: bool = False,
    title: str = "",
) -> "Figure":
    """Best E (eq 11) of every chain over the iterations, on logarithmic axes; `exact` draws the least possible E.

    `relative` says that the histories are divided by the least E.
    """
    with house_style():
        figure = new_figure(6.2, 3.7)
        ax = figure.subplots()
        for k, (name, history) in enumerate(histories.items()):
            for chain, course in enumerate(np.atleast_2d(history.T)):
                label = name if chain == 0 else None
                ax.plot(np.arange(1, len(course) + 1), course, **line_style(k), label=label)
        if exact is not None:
            ax.axhline(exact, color=COLOURS[-1], linewidth=1.0, linestyle=":", label="exact weights")
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xlabel("iteration")
        ax.set_ylabel("best E so far / least E [1]" if relative else "best E so far (eq 11) [1]")
        ax.legend()
        heading(figure, title)
    return figure
