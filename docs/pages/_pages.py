"""What the scripts share that make a page of a JSON file of benchmarks/: where both are, tables, and writing."""

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
DOCS, BENCHMARKS = ROOT / "docs", ROOT / "benchmarks"


def table(heads: Sequence[str], rows: Iterable[Iterable[object]], texts: int, last: int = 0) -> str:
    """A table in Markdown. The first `texts` and the last `last` columns are texts, the others numbers, to the right."""
    lines = [" | ".join(map(str, cells)) for cells in (heads, *rows)]
    lines = [f"| {line} |" for line in lines]
    lines.insert(1, "|" + "---|" * texts + "---:|" * (len(heads) - texts - last) + "---|" * last)
    return "\n".join(lines)


def measured(command: str, when: str, machine: str, more: str = "") -> str:
    """The sentences that such a page begins with; `more` is said after them."""
    return (
        f"Measured by `{command}` on {when}; {machine}.\n`make pages` writes this page; do not edit it. {more}".rstrip()
    )


def write(page: Callable[[Any], str], record: Path, target: Path, command: str) -> None:
    """Write the page of a record. Without the record, which `command` makes, say so and leave the page as it is."""
    if not record.exists():
        print(f"{target.name} stays as it is: there is no {record}; {command} makes it", file=sys.stderr)
        return
    target.write_text(page(json.loads(record.read_text(encoding="utf-8"))), encoding="utf-8")
