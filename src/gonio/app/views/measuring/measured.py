"""A measurement that was made, or a part of it, as plain data and for people."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gonio.acquisition.journal import Content
from gonio.outside import printable


def record(content: Content, log: Path) -> dict[str, Any]:
    """What the journal holds."""
    taken = [one for one in content.records if "kind" in one]
    return {
        "log": str(log),
        "plan_sha256": content.plan.sha256,
        "steps": len(content.plan.steps),
        "done": len(content.done),
        "complete": content.is_complete,
        "readings": len(taken),
        "sessions": content.sessions,
        "repeated": [one["note"] for one in taken if one["note"] and not one["failed"]],
        "failures": [one["note"] for one in content.records if one.get("event") == "failure" or one.get("failed")],
        "overloaded": len(_overloaded(content)),
    }


def _overloaded(content: Content) -> list[dict[str, Any]]:
    """Readings that count and are overloaded all the same: no range holds them."""
    return [one for one in content.records if one.get("overload") and one.get("done")]


def lines(content: Content, log: Path) -> Iterator[str]:
    """The same for people."""
    found = record(content, log)
    yield (
        f"{found['done']} of {found['steps']} steps are measured: {found['readings']} readings in "
        f"{found['sessions']} session{'s' * (found['sessions'] != 1)}, {len(found['repeated'])} of them repeated in "
        "another range"
    )
    for note in dict.fromkeys(found["failures"]):
        count = found["failures"].count(note)
        yield f"failed and tried again: {printable(note)} ({count} time{'s' * (count != 1)})"
    if found["overloaded"]:
        yield f"{found['overloaded']} readings overload the largest range, and are marked"
    yield f"wrote {log}"


def tail_line(content: Content, log: Path) -> str:
    """What is said where the journal ended in a torn line."""
    return f"{content.torn} bytes after its last whole line, which a crash tore, go to {log.name}.torn"
