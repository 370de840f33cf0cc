"""Put the figures of benchmarks/grain.json between the marks of docs/howto/grain.md: part of `make pages`."""

import re

from _pages import BENCHMARKS, DOCS, table, write

RECORD, PAGE = BENCHMARKS / "grain.json", DOCS / "howto" / "grain.md"
BEGIN, END = "<!-- from benchmarks/grain.json -->", "<!-- end -->"


def text(found: dict) -> str:
    """In how many of 100 repetitions each value came back, and all three at once."""
    rows = [
        (f"`{name}`", *(f"{share:.1f}" for share in shares.values() if isinstance(share, float)))
        for name, shares in found["models"].items()
    ]
    heads = ("model", "first width", "second width", "azimuth", "all three")
    return "\n".join(["Made by `make grain`.", "", table(heads, rows, 1)])


def page(found: dict) -> str:
    """The page with the figures of a record between its marks."""
    inside = re.compile(f"{re.escape(BEGIN)}\n.*{re.escape(END)}", re.DOTALL)
    return inside.sub(lambda _: f"{BEGIN}\n{text(found)}\n{END}", PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make grain")
