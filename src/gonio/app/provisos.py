"""What one has to know to read a fit: the instrument that was folded in, the loss, and points that do not belong."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gonio.units import label

if TYPE_CHECKING:
    import xarray as xr

    from gonio.fit.outliers import Scrutiny
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


ANGLES = ("theta_i", "theta_r", "phi")


def outlier_record(scrutiny: "Scrutiny") -> dict[str, Any]:
    """Every point beyond the threshold, and whether the model is to blame, as plain data."""
    listed = []
    for region, rows in scrutiny.regions.items():
        for row in rows:
            point = scrutiny.points.isel(direction=int(row))
            one: dict[str, Any] = {name: float(point[name]) for name in (*ANGLES, "brdf")}
            line = int(point["line"]) if "line" in point.variables else None
            listed.append(one | {"region": region, "studentised": float(scrutiny.studentised[row]), "line": line})
    return {
        "threshold": scrutiny.threshold,
        "sign_agreement": scrutiny.agreement,
        "systematic": scrutiny.systematic,
        "points": listed,
    }


def outlier_lines(scrutiny: "Scrutiny") -> Iterator[str]:
    """Where points lie that do not belong, and what to do about them; nothing where all belong."""
    if scrutiny.systematic:
        same = (1 + scrutiny.agreement) / 2
        yield (
            f"[bold]systematic misfit[/bold]: {same:.0%} of neighbours err to the same side, where chance gives 50%: "
            "the model lacks something, so points far off are no outliers for that alone"
        )
    for region, rows in scrutiny.regions.items():
        far = "far off" if scrutiny.systematic else "[bold]outliers[/bold]"
        yield f"{far}: {_place(scrutiny.points.isel(direction=rows))}: {region}"
    if scrutiny.beyond.any() and not scrutiny.systematic:
        yield "fit with --loss cauchy, which lets them go, or give them mask = 3 in the file"


def _place(points: "xr.Dataset", most: int = 3) -> str:
    """How many points, their range of angles, and the lines of the file for the first few."""
    ranges = []
    for angle in ANGLES:
        low, high = float(points[angle].min()), float(points[angle].max())
        ranges.append(f"{angle} {low:g}" if low == high else f"{angle} {low:g} to {high:g}")
    count = points.sizes["direction"]
    text = f"{count} point{'s' * (count > 1)} near {', '.join(ranges)} {label('degree')}"
    if "line" not in points.variables:
        return text
    lines = [str(int(line)) for line in points["line"].values[:most]]
    rest = f" and {count - most} more" if count > most else ""
    return f"{text} (line{'s' * (count > 1)} {', '.join(lines)}{rest})"
