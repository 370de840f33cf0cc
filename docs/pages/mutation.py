"""Writes docs/mutation.md from benchmarks/mutation.json."""

from typing import Any

from _pages import BENCHMARKS, DOCS, measured, table, write

RECORD, PAGE = BENCHMARKS / "mutation.json", DOCS / "mutation.md"
OUTCOMES = ("killed", "equivalent", "slight", "survived")
HEADS = ["changes", *OUTCOMES]


def counted(head: str, rows: dict[str, dict[str, int]]) -> str:
    return table([head, *HEADS], ([name, *(row[count] for count in HEADS)] for name, row in rows.items()), 1)


def listed(changes: list[dict[str, str]]) -> str:
    """One line for each change."""
    lines = [
        f"- `{one['place']}` {one['kind']}: `{one['was']}` → `{one['now']}`"
        + (f"; {one['note']}" if "note" in one else "")
        for one in changes
    ]
    return "\n".join(lines) or "None."


def page(record: dict[str, Any]) -> str:
    """The counts, then every change that no test saw."""
    sample = f"at most {record['sample']} of each kind in each function, chosen by seed {record['seed']}"
    changed = sample if record["sample"] else "every place"
    if record["only"]:
        changed += f"; only functions whose name has {record['only']}"
    more = f"It took {record['minutes']:.0f} minutes. Changed: {changed}."
    of_outcome = {name: [one for one in record["unseen"] if one["outcome"] == name] for name in OUTCOMES}
    return f"""# A wrong sign, cosine or prefactor makes a test fail

{measured("make mutation", record["date"], record["machine"], more)}

Each place of each function that a term runs is changed once. Then the tests that run the function are run, and one of
them must fail. There are three kinds of change:

- *sign*: plus and minus are exchanged, a minus is removed, or a comparison is reversed;
- *cosine*: the two directions are exchanged, or tilt and local incidence, x and y, or sine and cosine;
- *prefactor*: a number or a constant is doubled, an exponent is raised by one, or times and over are exchanged.

Only tests count that compare values with something independent. These are {record["tests"]} tests of
{", ".join(f"`tests/{name}`" for name in record["counted"])}.
Left out are {", ".join(f"`{name}`" for name in record["not_counted"])}:
they compare a model with itself, or look at no value.

A change has one of four results:

- *killed*: a test fails.
- *equivalent*: no value changes by more than {record["same"]:g} of itself. Values are compared at random shape values within the bounds (seed {record["seed"]})
  and at {record["directions"]} directions, poles and grazing directions included. Such a change is no error.
- *slight*: no value changes by more than {record["slight"]:g} of itself. Such a change concerns how a value is computed, for example the
  number of nodes of a quadrature.
- *survived*: a value changes by more, and no test fails.

**{record["all"]["survived"]} of {record["all"]["changes"]} changes survived.**

{counted("kind of change", record["kinds"] | {"**all**": record["all"]})}

A function that several models share counts in the row of each of them.

{counted("model", record["models"])}

## Survived

{listed(of_outcome["survived"])}

## Slight

{listed(of_outcome["slight"])}

## Equivalent

{listed(of_outcome["equivalent"])}
"""


if __name__ == "__main__":
    write(page, RECORD, PAGE, "make mutation")
