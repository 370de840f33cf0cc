"""The options of a class, in its page, from their declarations (`gonio.options`): no second list of them."""

from dataclasses import is_dataclass
from typing import Any

from sphinx.application import Sphinx

from gonio.options import options_of


def with_options(_app: Sphinx, what: str, _name: str, obj: Any, _options: Any, lines: list[str]) -> None:
    """Append the options that a dataclass declares to its docstring."""
    if what == "class" and is_dataclass(obj) and (declared := options_of(obj)):
        lines += ["", ".. rubric:: Options", ""]
        for name, option in declared.items():
            lines += [f"``{name}``", f"    {option.help}", ""]


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", with_options, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
