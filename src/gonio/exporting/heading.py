"""What stands at the top of every written file: what it is, where it comes from, and what to know before it is used."""

import math
import textwrap
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib.metadata import version

from gonio.exporting.subject import ONE, Subject
from gonio.literature.references import reference
from gonio.outside import printable

WIDTH = 110
QUANTITY = "f, the BRDF in 1/sr, without the cosine of the reflection angle; 0 below the horizon"
FRAME = "unit vectors from the surface, w_i to the light and w_r to the viewer; z is the surface normal"


def heading(subject: Subject, what: str, *, quantity: str = QUANTITY, frame: str = FRAME) -> list[str]:
    """Lines of text: program, model, source, values with unit and standard uncertainty, and what the model violates.

    what: the first line, which says what the file is.
    """
    model = subject.model
    published = reference(model.cite)
    facts = {
        "written by": f"gonio {version('gonio')} on {datetime.now(UTC).date().isoformat()}",
        "model": f"{model.name}: {model.title}",
        "source": str(published) if published else model.cite or "not stated",
        "values": subject.origin,
        "wavelength": _wavelengths(subject),
        "quantity": quantity,
        "frame": frame,
        **{f"violates {name}": why for name, why in model.violates.items()},
        **subject.facts,
    }
    if model.confidence != "confirmed":
        facts["formula"] = f"{model.confidence}: read in an abstract or in other papers, not in its source"
    lines = [printable(what), ""]
    for name, text in facts.items():
        lines += textwrap.wrap(
            printable(f"{name}: {text}"), WIDTH, subsequent_indent="  ", break_long_words=True, break_on_hyphens=False
        )
    return [*lines, "", *map(printable, value_lines(subject))]


def value_lines(subject: Subject) -> Iterator[str]:
    """A line for every value: its name, unit, and standard uncertainty, and what it means."""
    for label, values in subject.sets.items():
        if label != ONE and len(subject.sets) > 1:
            yield f"{subject.by} {printable(label)}"
        for name, value in values.items():
            unit = subject.unit(name)
            meaning = subject.model.shape[name].help if name in subject.model.shape else "weight"
            text = f"{name} = {value:.9g}{'' if unit == '1' else f' {unit}'}"
            yield f"  {text}  {_uncertainty(subject.uncertainty(name, label))}({meaning})"


def _uncertainty(value: float) -> str:
    if math.isnan(value):
        return ""
    return "not determined " if math.isinf(value) else f"standard uncertainty {value:.2g} "


def _wavelengths(subject: Subject) -> str:
    if subject.by == "wavelength":
        return f"{', '.join(subject.sets)} nm"
    if subject.by:
        return f"{subject.by} {', '.join(map(printable, subject.sets))}"
    return "not stated" if subject.wavelength is None else f"{subject.wavelength:g} nm"
