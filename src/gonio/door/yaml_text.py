"""YAML from outside as a tree of nodes: nothing is constructed from it, and it has no alias and no endless nesting."""

from pathlib import Path
from typing import Any

import yaml

from gonio.files import FormatError

MOST_EVENTS = 100_000  # scalars, lists and mappings; a table of any length is one of them
DEEPEST = 20
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def composed(path: Path, text: str, kind: str) -> yaml.Node | None:
    """The tree of nodes, None for a text without content; `kind` says in an error what the file was taken for.

    Raises FormatError with the line for what is no YAML, holds an alias, or is nested or long beyond reason.
    """
    try:
        depth = 0
        for count, event in enumerate(yaml.parse(text, Loader=_LOADER)):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if isinstance(event, yaml.AliasEvent):
                raise FormatError(path, f"holds a YAML alias, which no {kind} does", line_of(event))
            if depth > DEEPEST or count > MOST_EVENTS:
                size = f"is nested more than {DEEPEST} deep" if depth > DEEPEST else f"holds over {MOST_EVENTS} entries"
                raise FormatError(path, f"{size}: this is no {kind}", line_of(event))
        return yaml.compose(text, Loader=_LOADER)
    except yaml.MarkedYAMLError as error:
        where = f"line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise FormatError(path, f"is no valid YAML: {error.problem or error.context}", where) from error
    except yaml.YAMLError as error:  # a character that YAML forbids
        raise FormatError(path, f"is no valid YAML: {' '.join(str(error).split())[:120]}") from error


def line_of(node: Any) -> str:
    """The line of a node or an event in words."""
    return f"line {node.start_mark.line + 1}"
