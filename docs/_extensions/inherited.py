"""The parameters that a class inherits, on its own page: a Problem takes the options of ProblemOptions."""

import inspect
from typing import Any

from sphinx.application import Sphinx

SECTION = "Parameters\n----------\n"


def with_inherited(_app: Sphinx, what: str, _name: str, obj: Any, _options: Any, lines: list[str]) -> None:
    """Append the parameters of the nearest base that describes its own, where the class describes none."""
    if what != "class" or SECTION in "\n".join(lines) + "\n":
        return
    for base in obj.__mro__[1:-1]:
        described = inspect.cleandoc(base.__dict__.get("__doc__") or "")
        if SECTION in described:
            lines += ["", *described[described.index(SECTION) :].splitlines()]
            return


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", with_inherited, priority=100)  # before numpydoc reads the sections
    return {"parallel_read_safe": True, "parallel_write_safe": True}
