"""What was handed on to another program: the files, the proof and the remarks, for people and as plain data."""

from collections.abc import Iterator
from typing import Any

from gonio.app.output import figure, strong
from gonio.exporting.entry import Exported
from gonio.exporting.subject import ONE
from gonio.exporting.target import Proof


def record(done: Exported, proof: Proof | None) -> dict[str, Any]:
    """The export as plain data."""
    sets = {label: dict(values) for label, values in done.subject.sets.items()}
    found: dict[str, Any] = {
        "target": done.target.name,
        "files": [str(path) for path in done.files],
        "model": done.subject.model.name,
        "origin": done.subject.origin,
        "values": sets[ONE] if list(sets) == [ONE] else sets,
        "numbers": dict(done.numbers),
        "remarks": list(done.remarks),
    }
    if proof is not None:
        found["check"] = {"how": proof.how, "error": proof.error, "limit": proof.limit}
    return found


def lines(done: Exported, proof: Proof | None) -> Iterator[Any]:
    """The same for people."""
    model = done.subject.model
    yield strong(model.name, f" for {done.target.title}: {done.subject.origin}")
    for name, number in done.numbers.items():
        yield f"{name.replace('_', ' ')}: {figure(number) if isinstance(number, float) else number}"
    if proof is not None:
        yield f"checked: {proof.how}; largest relative error {proof.error:.2g}, allowed {proof.limit:.2g}"
    for name, why in model.violates.items():
        yield f"the model violates {name}: {why}"
    yield from done.remarks
    for path in done.files:
        yield f"wrote {path}"
