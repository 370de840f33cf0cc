"""Text from outside, such as names in a file, on its way to a terminal, a figure or a table of another program.

A file may hold anything: control characters that a terminal obeys or that no XML may hold, and cells that a spreadsheet
runs as formulas. Here it becomes harmless; nothing is left out.
"""


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
