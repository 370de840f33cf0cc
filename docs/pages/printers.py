"""Writes docs/printers.md from benchmarks/printers.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "printers.json", DOCS / "printers.md"
OUTCOMES = ("killed", "equivalent", "respelled", "survived")


def listed(rows: list[dict[str, Any]], outcome: str) -> str:
    """One line for each change of this outcome."""
    unseen = [(row["file"], one) for row in rows for one in row["unseen"] if one["outcome"] == outcome]
    return "\n".join(f"- `{file}:{one['line']}` {one['kind']}: `{one['text']}`" for file, one in unseen) or "None."


def page(record: dict[str, Any]) -> str:
    """The counts, then every change that no test saw."""
    sampled = [f"`{row['file']}`" for row in record["rows"] if row["sample"]]
    which = f"every place, but only some, drawn by a fixed seed, of {', '.join(sampled)}" if sampled else "every place"
    more = f"It took {record['minutes']:.0f} minutes. Changed: {which}. A file that has not changed is not tried again."
    rows = [[f"`{row['file']}`", *(row[k] for k in ("changes", *OUTCOMES)), row["date"]] for row in record["rows"]]
    total = ["**all**", *(record["all"][k] for k in ("changes", *OUTCOMES)), ""]
    return f"""# A mistake in the printers makes a test fail

{measured("make mutation-printers", record["date"], record["machine"], more)}

Models are handed on to other programs by tracing them as formulas (`src/gonio/symbols`) and printing these in other languages
(`src/gonio/exporting/languages`). Each place is changed once: operands are exchanged, an operator or a comparison is turned, a condition is denied, a number
is raised by one, or a word is replaced by another. Then the tests of formulas and of the language are run, with
{len(record["models"])} models that together have every operation: {", ".join(record["models"])}.

- *killed*: a test fails, or nothing can be printed any more.
- *equivalent*: what is printed stays the same but for blanks and ends of lines.
- *respelled*: something else is printed, and it computes the same values in C, JavaScript, Python and NumPy at directions and
  shape values that no test has.
- *survived*: something else is printed, and no test fails.

**{record["all"]["survived"]} of {record["all"]["changes"]} changes survived.**

{table(["file", "changes", *OUTCOMES, "tried on"], [*rows, total], 1)}

## Survived

{listed(record["rows"], "survived")}

## Respelled

{listed(record["rows"], "respelled")}
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make mutation-printers")
