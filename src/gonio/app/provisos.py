"""What one has to know to read a fit: the instrument that was folded in, and the loss."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gonio.fit.solution import Solution


def instrument_record(solution: "Solution") -> dict[str, float]:
    """The instrument that was folded into a fit, and how well, as plain data."""
    return asdict(solution.instrument) | {"error": float(solution.dataset.attrs.get("instrument_error", 0.0))}


COARSE = 0.1  # of what a fit leaves over: a change of the rule for the cones that shows


def instrument_lines(solutions: Sequence["Solution"]) -> Iterator[str]:
    """What was folded into fits, and what to do where that was done too coarsely; nothing for single directions."""
    instrument = solutions[0].instrument
    if not instrument:
        return
    cones = {"source": instrument.source_half_angle, "detector": instrument.detector_half_angle}
    listed = ", ".join(f"{name} {angle:g} deg" for name, angle in cones.items() if angle)
    yield f"folded in, half-angle of {listed}: values are the surface's own, errors those of what the instrument reads"
    for solution in solutions:
        if (error := instrument_record(solution)["error"]) > COARSE:
            yield (
                f"[bold]{solution.model_name}: too coarse[/bold]: half the step would change it by {error:.0%} of what "
                f"the fit leaves over: add --cone-step {instrument.finer().step:g}"
            )


def loss_record(solution: "Solution") -> dict[str, Any]:
    """The loss of a fit, the scatter that it measures errors by, and how many points it discounts, as plain data."""
    attrs = solution.dataset.attrs
    return {
        "name": attrs.get("loss", "squared"),
        "scale": float(attrs.get("loss_scale", "nan")),
        "points_discounted": int(attrs.get("points_discounted", 0)),
    }


def loss_lines(solution: "Solution") -> Iterator[str]:
    """How a robust loss went; nothing for squared errors."""
    record = loss_record(solution)
    if record["name"] == "squared":
        return
    yield (
        f"{record['name']} loss: {record['points_discounted']} of {solution.dataset.attrs['points']} points count for "
        f"less than half; the weighted residual of the others scatters by {record['scale']:.3g}"
    )
