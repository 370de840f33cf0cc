"""A scan or a fit as one page of HTML for people: what was measured, how, what the model says, and how sure that is.

The only place that writes HTML about a fit. The functions of `circumstances`, `measurement`, `fitted` and `checks` say
what there is to say as blocks (`blocks`), `page` puts these into the templates, and the same blocks become the JSON
that the page carries. So no number stands in one and not in the other.
"""

import importlib
from typing import Any

_HOMES = {"as_html": "page", "report": "entry"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"gonio.reporting has no {name!r}; it has {', '.join(_HOMES)}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
