"""The answer to what was asked of a scan, before the values: a verdict, what it rests on, and what else was tried."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from gonio.app.output import figure, strong, table
from gonio.measured import dataset
from gonio.units import unit_label

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.comparison.answer import Answer

MOST = 5  # models that are listed
FEWEST_ANGLES = 3  # of which one is the steepest
MUCH = 1.5  # times the error at the other angles
WORDS = {"theta_i": "each incidence angle, left out in turn", "out-of-plane": "all that is out of plane, left out"}


def lines(which: str, answer: "Answer") -> Iterator[Any]:
    """The answer for people; `which` names what was fitted."""
    yield from head_lines(which, answer)
    if len(answer.rows) > 1:
        yield ranking(answer)


def head_lines(which: str, answer: "Answer") -> Iterator[Any]:
    """The verdict and what it rests on, so that it can be repeated: points, weighting, what was left out."""
    yield strong(answer.verdict.words)
    yield f"{which}: {_points(answer)}"
    yield f"weighting: {_weighting(answer)}"
    yield f"judged by: {_judged(answer)}"
    yield from steepest_lines(answer)
    yield from contradicted_lines(answer)


def steepest_lines(answer: "Answer") -> Iterator[str]:
    """How much more the best model errs at the steepest angle, which was extrapolated; nothing unless it is much."""
    from gonio.comparison.assessment import scored_parts

    best = answer.best
    angled = scored_parts(best) if answer.left_out == "theta_i" else []
    errors = {float(name.split()[1]): best.by_fold[name] for name in angled}
    if len(errors) < FEWEST_ANGLES:
        return
    steepest = max(errors)
    others = [error for angle, error in errors.items() if angle != steepest]
    at_others = float(np.sqrt(np.mean(np.square(others)))) if best.metric == "log10_rmse" else float(np.mean(others))
    if errors[steepest] > MUCH * at_others:
        title = "lg RMSE" if best.metric == "log10_rmse" else "E"
        yield (
            f"steeper angles are extrapolated: {best.model.name}, left-out {title} {figure(errors[steepest])} at the "
            f"steepest, {steepest:g} deg, and {figure(at_others)} at the others"
        )


def dropped_lines(answer: "Answer") -> Iterator[str]:
    """Which models were looked at and did not come near; nothing where all were fitted to the end."""
    if answer.dropped:
        names = ", ".join(answer.dropped)
        yield f"not ranked, as quick fits say that they do not come first (--models all ranks them): {names}"


def _points(answer: "Answer") -> str:
    """How many points are fitted, and what was done with the scan since it was read."""
    scan = answer.problem.data
    done = [line for line in scan.attrs.get("history", "").splitlines() if not line.startswith(("read from", "joined"))]
    steps = "".join(f"; {line}" for line in done)
    return f"{len(answer.problem.measured)} points of {dataset.flatten(scan).sizes['direction']}{steps}"


def _weighting(answer: "Answer") -> str:
    """The weighting by name, and why."""
    solution = answer.best.solution
    attrs = solution.dataset.attrs
    floor = f" with a noise floor of {figure(attrs['noise_floor'])} {unit_label(solution.unit)}" * (
        attrs["noise_floor"] > 0
    )
    reason = f", as {attrs['weighting_reason']}" if attrs["weighting_reason"] else ", as asked"
    return f"{attrs['weighting']}{floor}{reason}"


def _judged(answer: "Answer") -> str:
    if not answer.left_out:
        return "the points that were fitted alone; nothing says how well it predicts others"
    parts = f"{answer.left_out} parts of blocks of directions, each left out in turn"
    return WORDS.get(answer.left_out, parts if answer.left_out.isdigit() else f"{answer.left_out}, left out in turn")


def contradicted_lines(answer: "Answer") -> Iterator[Any]:
    """What no fit was shown, and why; nothing where all values were."""
    if answer.contradicted:
        points = sum(len(one.rows) for one in answer.contradicted)
        yield strong(
            f"{_counted(points)} left out of every fit", ", as the scan contradicts them (--keep-all fits them):"
        )
        yield from (f"- {one.words} ({_counted(len(one.rows))})" for one in answer.contradicted)


def _counted(points: int) -> str:
    return f"{points} point{'s' * (points != 1)}"


def ranking(answer: "Answer") -> "Table":
    """The models that predict best, and how many others were tried."""
    metric = answer.best.metric
    title = "lg RMSE" if metric == "log10_rmse" else "E"
    out = table("model", "values", f"fitted {title}", *([f"left-out {title}"] if answer.left_out else []))
    for row in answer.rows[:MOST]:
        left_out = [figure(row.validated[metric])] if answer.left_out else []
        out.add_row(row.model.name, f"{row.effective_values:.3g}", figure(row.metrics[metric]), *left_out)
    others = len(answer.rows) - MOST
    words = [f"{others} more models were fitted"] if others > 0 else []
    if answer.dropped:
        words.append(f"{len(answer.dropped)} more do not come first, as quick fits say")
    if answer.raced < len(answer.problem.measured):
        words.append(f"models were compared on {answer.raced} of {len(answer.problem.measured)} points")
    out.caption, out.caption_justify = "; ".join([*words, "gonio compare SCAN shows all"]), "left"
    return out
