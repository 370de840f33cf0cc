"""The directional-hemispherical reflectance of a table: as plain data, and in a line."""

from collections.abc import Sequence
from typing import Any

from gonio.app.output import figure
from gonio.resampling.hemisphere import WHOLE, Reflectance


def record(found: Sequence[Reflectance]) -> list[dict[str, Any]]:
    """The reflectances as plain data."""
    return [
        {"theta_i": one.theta_i, "phi_i": one.phi_i, **one.labels, "value": one.value, "covered": one.covered}
        for one in found
    ]


def in_words(told: Sequence[dict[str, Any]]) -> str:
    """The range of the reflectances in a line, and how much of the hemisphere the table covers."""
    values, covered = [one["value"] for one in told], min(one["covered"] for one in told)
    text = f"{figure(min(values))} to {figure(max(values))}" if len(told) > 1 else figure(values[0])
    if covered < WHOLE:
        return f"{text} in the {100 * covered:.3g} % of the hemisphere, or more, that are covered"
    return f"{text}, directional-hemispherical"
