"""What one has to know to read a fit: the instrument that was folded in, the loss, and points that do not belong."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gonio.app.output import strong
from gonio.units import unit_label

if TYPE_CHECKING:
    import xarray as xr

    from gonio.fitting.certainty.outliers import Scrutiny
    from gonio.fitting.solution import Solution


def instrument_record(solution: "Solution") -> dict[str, float]:
    """The instrument that was folded into a fit, and how well, as plain data."""
    return asdict(solution.instrument) | {"error": float(solution.dataset.attrs["instrument_error"])}


def sample_lines(solution: "Solution") -> Iterator[Any]:
    """That starts were searched on some of the points; nothing where that was on all."""
    searched, points = (int(solution.dataset.attrs[name]) for name in ("points_searched", "points"))
    if 0 < searched < points:
        yield f"starts were searched on {searched} of {points} points, the minimum on all"


SURE_GRID = 2  # shape values of one scan whose starts are a grid, which shows every minimum wider than its step


def minima_record(solution: "Solution") -> dict[str, Any]:
    """How many searches were followed, how many met the lowest minimum, and E of the next over it, as plain data."""
    return {name: solution.dataset.attrs[name] for name in ("searches", "searches_alike", "next_minimum")}


def minima_lines(solution: "Solution") -> Iterator[Any]:
    """That a lower minimum may exist, where of several searches one alone met the lowest; else nothing."""
    searches, alike = (int(solution.dataset.attrs[name]) for name in ("searches", "searches_alike"))
    further = float(solution.dataset.attrs["next_minimum"])
    if searches < 2 or alike > 1 or not further > 1 or len(solution.model.shape) <= SURE_GRID:
        return
    excess = f"{100 * (further - 1):.2g} % higher" if further < 2 else f"at {further:.3g} times it"
    more = f"of {searches} searches one met the lowest, the next ends {excess} in E"
    yield strong("a lower minimum may exist", f": {more}; --setting searches={4 * searches} looks further")


def grain_lines(solution: "Solution", points: "xr.Dataset") -> Iterator[Any]:
    """That the surface has a grain and the model none, where the points that were fitted were turned and show it."""
    from gonio.findings.grain import grain

    if not solution.model.for_turned:
        for finding in grain(points):
            yield strong("the surface has a grain", f": {finding.what}, and {solution.model.name} has no azimuth of it")
            yield finding.remedy


COARSE = 0.1  # of what a fit leaves over: a change of the rule for the cones that shows


def instrument_lines(solutions: Sequence["Solution"]) -> Iterator[Any]:
    """What was folded into fits, and what to do where that was done too coarsely; nothing for single directions."""
    instrument = solutions[0].instrument
    if not instrument:
        return
    cones = {"source": instrument.source_half_angle, "detector": instrument.detector_half_angle}
    listed = ", ".join(f"{name} {angle:g} deg" for name, angle in cones.items() if angle)
    yield f"folded in, half-angle of {listed}: values are the surface's own, errors those of what the instrument reads"
    for solution in solutions:
        if (error := instrument_record(solution)["error"]) > COARSE:
            what = f": half the step would change it by {error:.0%} of what the fit leaves over: add --cone-step "
            yield strong(f"{solution.model.name}: too coarse", f"{what}{instrument.finer().step:g}")


def loss_record(solution: "Solution") -> dict[str, Any]:
    """The loss of a fit, the scatter that it measures errors by, and how many points it discounts, as plain data."""
    attrs = solution.dataset.attrs
    return {
        "name": attrs["loss"],
        "scale": float(attrs["loss_scale"]),
        "points_discounted": int(attrs["points_discounted"]),
    }


def loss_lines(solution: "Solution") -> Iterator[Any]:
    """How a robust loss went; nothing for squared errors."""
    record = loss_record(solution)
    if record["name"] == "squared":
        return
    yield (
        f"{record['name']} loss: {record['points_discounted']} of {solution.dataset.attrs['points']} points count for "
        f"less than half; the weighted residual of the others scatters by {record['scale']:.3g}"
    )


ANGLES = ("theta_i", "theta_r", "phi")
MOST_LISTED = 1000  # points; where a model misses a file of millions, a list of all says no more


def outlier_record(scrutiny: "Scrutiny") -> dict[str, Any]:
    """The points beyond the threshold, the farthest MOST_LISTED of a region, and whether the model is to blame."""
    listed = []
    for region, rows in scrutiny.regions.items():
        some = scrutiny.points.isel(direction=rows[:MOST_LISTED])
        lines = some["line"].values.astype(int).tolist() if "line" in some.variables else [None] * len(rows)
        columns = {name: some[name].values.astype(float).tolist() for name in (*ANGLES, "brdf")}
        columns |= {"studentised": scrutiny.studentised[rows[:MOST_LISTED]].tolist(), "line": lines[:MOST_LISTED]}
        listed += [
            dict(zip(columns, row, strict=True)) | {"region": region} for row in zip(*columns.values(), strict=True)
        ]
    return {
        "beyond": int(scrutiny.beyond.sum()),
        "threshold": scrutiny.threshold,
        "sign_agreement": scrutiny.agreement,
        "systematic": scrutiny.systematic,
        "points": listed,
    }


def outlier_lines(scrutiny: "Scrutiny") -> Iterator[Any]:
    """Where points lie that do not belong, and what to do about them; nothing where all belong."""
    if scrutiny.systematic:
        same = (1 + scrutiny.agreement) / 2
        what = (
            f": {same:.0%} of neighbouring residuals have the same sign (random noise: 50%), so the model misses real "
        )
        yield strong("systematic misfit", f"{what}structure; large residuals are not necessarily bad readings")
    for region, rows in scrutiny.regions.items():
        where = f": {_place(scrutiny.points.isel(direction=rows))}: {region}"
        yield f"far off{where}" if scrutiny.systematic else strong("outliers", where)
    if scrutiny.beyond.any() and not scrutiny.systematic:
        yield "fit with --loss cauchy, which lets them go, or give them mask = 3 in the file"


def _place(points: "xr.Dataset", most: int = 3) -> str:
    """How many points, their range of angles, and the lines of the file for the first few."""
    ranges = []
    for angle in ANGLES:
        low, high = float(points[angle].min()), float(points[angle].max())
        ranges.append(f"{angle} {low:g}" if low == high else f"{angle} {low:g} to {high:g}")
    count = points.sizes["direction"]
    text = f"{count} point{'s' * (count > 1)} near {', '.join(ranges)} {unit_label('degree')}"
    if "line" not in points.variables:
        return text
    lines = [str(int(line)) for line in points["line"].values[:most]]
    rest = f" and {count - most} more" if count > most else ""
    return f"{text} (line{'s' * (count > 1)} {', '.join(lines)}{rest})"
