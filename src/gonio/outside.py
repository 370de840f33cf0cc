"""Text from outside, such as names in a file, on its way to a terminal, a figure or a table of another program.

A file may hold anything: control characters that a terminal obeys or that no XML may hold, and cells that a spreadsheet
runs as formulas. Here it becomes harmless; nothing is left out. And names that people write: what they may have meant.
"""

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from html import escape
from textwrap import shorten
from typing import Generic, TypeVar


class PackageWarning(UserWarning):
    """Something is wrong with another package that brings models to gonio; the rest works."""


FORMULA = ("=", "+", "-", "@", "\t", "\r")  # what a spreadsheet takes for the beginning of a formula
_QUOTE = "'"  # before a cell, which a spreadsheet does not show


def printable(text: str, keep: str = "") -> str:
    """The text with every character that is not printable as its escape sequence.

    keep: characters that stay as they are, such as the ends of lines.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode() for c in text)


def as_cell(text: str) -> str:
    """The text for a cell of a CSV file: one that looks like a formula gets a quote before it."""
    return _QUOTE + text if text.lstrip(_QUOTE).startswith(FORMULA) else text


def from_cell(text: str) -> str:
    """The text that `as_cell` was given."""
    return text[1:] if text.startswith(_QUOTE) and text.lstrip(_QUOTE).startswith(FORMULA) else text


def nearest(name: str, names: Iterable[str], most: int = 3) -> str:
    """What somebody may have meant who wrote `name`: that name in other capitals, or the nearest few."""
    lowered = {known.lower(): known for known in names}
    if name.lower() in lowered:
        return f"did you mean {lowered[name.lower()]}?"
    return f"nearest: {', '.join(lowered[n] for n in get_close_matches(name.lower(), lowered, n=most, cutoff=0.0))}"


def shortened(head: str, items: Sequence[str], tail: str, most: int = 300) -> str:
    """A list in one line of at most `most` characters: what does not fit is counted."""
    for kept in range(len(items), -1, -1):
        rest = [f"and {len(items) - kept} more"] * (kept < len(items))
        text = head + ", ".join([*items[:kept], *rest]) + tail
        if len(text) <= most:
            return text
    return head[: most - len(tail) - 2] + ".." + tail


Entry = TypeVar("Entry")
LONGEST = 2900  # characters of the list that stands for a mapping by name


class NearestNames(dict[str, Entry], Generic[Entry]):
    """A mapping by name whose KeyError offers the nearest names, and whose repr is a short list.

    about: what `help` says of it.
    """

    def __init__(self, kind: str, entries: Mapping[str, Entry], about: str = "") -> None:
        super().__init__(entries)
        self.kind = kind
        self.__doc__ = about or type(self).__doc__

    def __missing__(self, name: str) -> Entry:
        raise KeyError(f"no {self.kind} is called {name!r}; {nearest(name, self)}")

    def __repr__(self) -> str:
        width = max(map(len, self), default=0)
        room = max(LONGEST // max(len(self), 1) - width - 2, 10)  # for the title on each line
        titles = {
            name: shorten(str(getattr(entry, "title", "")), room, placeholder=" ..") for name, entry in self.items()
        }
        lines = [f"{name:{width}}  {title}".rstrip() for name, title in titles.items()]
        return "\n".join([f"{len(self)} {self.kind}s:", *lines])

    def _repr_html_(self) -> str:
        """A table of names and titles, for notebooks."""
        rows = ((name, str(getattr(entry, "title", ""))) for name, entry in self.items())
        return f"<div><div>{len(self)} {escape(self.kind)}s</div>{html_table(('name', 'title'), rows)}</div>"


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts as HTML for notebooks, which is well-formed XML too; what is not printable is escaped."""
    head = "".join(f"<th>{escape(printable(cell))}</th>" for cell in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(printable(c))}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
