"""Writes docs/fuzzing.md from benchmarks/fuzzing.json."""

from collections.abc import Mapping
from typing import Any

from _pages import BENCHMARKS, DOCS, table, write

RECORD, PAGE = BENCHMARKS / "fuzzing.json", DOCS / "fuzzing.md"
EVERY_DOOR = {
    "fit": "files of fits, which `Solution.save` writes",
    "stack": "Zarr stores of stacks of scans",
    "scan": "scans, the smallest file of every format",
}
HEAD = """# Damaged and hostile files

`make fuzz` measures this: it damages valid files at random and gives each to gonio. A seed and a number determine each
input. `make pages` writes this page; do not edit it. These are the kinds of damage:

- bytes are changed, removed, inserted, repeated or exchanged; files are cut off or joined;
- counts become 2^62, -1, 0 or 2^31;
- numbers become `1e999`, `nan`, `-1`, `1,5` or nothing;
- a million brackets are opened inside each other;
- XML entities are declared that expand to gigabytes;
- files get byte-order marks, mixed line ends, decimal commas or UTF-16.

## Files of every format

gonio recognises each file and reads it, as `gonio.read` does. There are two good results:

- *read*: a valid Dataset. Its angles are finite and in range, no value is infinite, and not all values are zero.
- *refused*: an error of one line that names the file and the line or the byte.

Everything else is a *failure*: another exception, a warning, more than 2 s of processor time or more than 200 MB of
memory. *Recognised* is the percentage of inputs that are still recognised as the format. The others are of another
format or of none; the same rules hold for them.

"""
HEAD_OF_DOORS = """
## Files through every door

A file from outside gets into gonio through one of four doors: `gonio info`, `gonio check`, `Solution.load`, and the
start of `gonio fit-stack`, before its first fit. Here each input goes through all four. The inputs
are damaged copies of three kinds of files:

{inputs}

A door takes a file, or it refuses the file in one line that names it. *Taken* counts the inputs that at least one door
takes; *refused* counts those that all doors refuse. Everything else is a *failure*: another exception, a warning, a
second line, a command that takes a file and prints nothing or that prints before it refuses, more than 2 s of processor
time at one door, or more than 200 MB of memory. *Recognised* is the percentage of inputs that at least one door takes,
or refuses for another reason than that the file is of another kind. The longest time is that of one door.

"""


def cells(name: str, row: Mapping[str, Any]) -> list[object]:
    recognised = f"{100 * row['reached'] / max(row['inputs'], 1):.0f}"
    counts = [row[key] for key in ("read", "refused", "failures", "slowest_ms", "peak_MB", "date", "machine")]
    return [name, row["inputs"], recognised, *counts]


def counted(of: str, good: str, rows: list[list[object]]) -> str:
    """The table of some inputs; `of` is what a row is called, `good` what is not refused."""
    if not rows:
        return "Not measured yet.\n"
    counts = ["inputs", "recognised [%]", good, "refused", "failures"]
    heads = [of, *counts, "longest time [ms]", "largest memory [MB]", "date", "machine"]
    return table(heads, rows, 1, last=2) + "\n"


def page(record: dict[str, Any]) -> str:
    formats = [cells(name, row) for name, row in sorted(record.items()) if name not in EVERY_DOOR]
    doors = [cells(name, record[name]) for name in EVERY_DOOR if name in record]
    inputs = ";\n".join(f"- `{name}`: {meaning}" for name, meaning in EVERY_DOOR.items())
    head_of_doors = HEAD_OF_DOORS.format(inputs=f"{inputs}.")
    return HEAD + counted("format", "read", formats) + head_of_doors + counted("kind", "taken", doors)


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make fuzz")
