"""What people read of fits: predictions, residuals, metrics, tables, short reports and figures.

A Solution has these as its methods (`fitting.readable`), and finds them here by name. Each is loaded on first use, so
that a number is not paid for with Matplotlib or pandas.
"""

import importlib
from typing import Any

_HOMES = {
    "as_text": "text",
    "dataframe": "values",
    "in_a_line": "text",
    "metrics_of": "prediction",
    "plot": "figures",
    "predicted": "prediction",
    "residuals": "prediction",
    "row_of": "prediction",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"gonio.results has no {name!r}; it has {', '.join(_HOMES)}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
