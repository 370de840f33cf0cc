"""The budget of a reduction to read: rows in the style of the GUM."""

import numpy as np
import numpy.typing as npt

from gonio.reduction.budget import Budget

HEADS = ("cause", "type", "distribution", "over angles", "u [%]", "least", "largest")
LEFT = 4  # columns of text, before those of numbers
TITLE = "uncertainty budget, (1/f) (df/dx) u(x)"
NOTE = "combined: root of the sum of squares; expanded: k = 2 times that, about 95 %"


def rows(found: Budget) -> list[tuple[str, ...]]:
    """The lines of a budget by HEADS: relative standard uncertainties in per cent over the directions in use.

    u is the root of the mean square over directions, then the least and the largest. The last two are the combined
    uncertainty and the expanded one.
    """
    out = [
        (
            row.cause + f" ({len(row.parts)})" * (len(row.parts) > 1),
            row.type,
            row.distribution,
            row.shape,
            *_percent(row.by_direction),
        )
        for row in found.rows
    ]
    out.append(("combined", "", "", "", *_percent(found.combined)))
    return [*out, ("expanded, k=2", "", "", "", *_percent(found.expanded))]


def _percent(values: npt.NDArray[np.float64]) -> tuple[str, str, str]:
    size = 100 * np.abs(values)
    if not len(size):
        return "–", "–", "–"
    return f"{np.sqrt(np.mean(size**2)):.3g}", f"{size.min():.3g}", f"{size.max():.3g}"
