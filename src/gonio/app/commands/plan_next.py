"""`gonio plan next`: the directions to measure next, so that wanted values of a fit become surer or models differ."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from gonio.app import arguments, names
from gonio.app.help_page import Example
from gonio.app.options import ModelName, OutputOptions, Scan, ScanOptions, chosen_models
from gonio.app.output import Plain, progress_bar, show
from gonio.fitting.objective.options import ProblemOptions
from gonio.options import Option, Panel

if TYPE_CHECKING:
    import xarray as xr

    from gonio.fitting.solution import Solution

EXAMPLES = (
    Example("gonio plan next scan.csv --model ggx --want width --points 20", "Which 20 readings make width surest"),
    Example(
        "gonio plan next scan.csv --model ggx --points 40 --out next.csv", "Forty readings for all values, as a table"
    ),
    Example("gonio plan next scan.csv --model ggx --rival phong --points 10", "Ten that tell two models apart"),
)


@dataclass(frozen=True, kw_only=True)
class NextOptions:
    """What readings are wanted for, among which directions they are chosen, and what they cost."""

    PANEL: ClassVar = Panel.PLAN
    want: Annotated[str, Option("values to make surer, with commas: gamma,sigma; all unless named", metavar="A,B")] = ""
    points: Annotated[int, Option("number of readings", lowest=1, highest=10_000)] = 20
    rival: Annotated[
        str,
        Option("choose readings that tell these models from it instead", metavar="A,B", names=names.models),
    ] = ""
    noise: Annotated[
        str,
        Option(
            "standard deviation of a reading: 1%+0.5; else as the scan states or its residuals show", metavar="R%+C"
        ),
    ] = ""
    theta_i: Annotated[
        str, Option("incidence angles to choose from, with commas; else those of the scan", metavar="DEG,..")
    ] = ""
    theta_r: Annotated[
        str, Option("range of theta_r to choose from: -80:80; else that of the scan", metavar="LO:HI")
    ] = ""
    every: Annotated[float, Option("spacing of theta_r to choose from", metavar="DEG", lowest=0.05, highest=30)] = 1.0
    repeats: Annotated[bool, Option("let one direction be read more than once")] = False
    cost: Annotated[
        Mapping[str, float],
        Option("seconds of a reading, a degree of the arm and a move of the table: read=5,arm=0.5,table=60"),
    ] = field(default_factory=dict)


def command(
    scan: Scan,
    problem: ProblemOptions,
    data: ScanOptions,
    plan: NextOptions,
    output: OutputOptions,
    model: ModelName = "",
    solution: Annotated[
        Path | None, Option("the file solution.nc of a fit to the scan, in place of --model", panel=Panel.MODEL)
    ] = None,
    out: Annotated[
        Path | None,
        Option(
            "write the directions as .csv, or as a .toml that gonio measure takes", metavar="FILE", panel=Panel.OUTPUT
        ),
    ] = None,
) -> None:
    """Say where to measure next.

    Readings are chosen that make the wanted values of a fit surest beside those of the scan, or that tell its model
    from a rival, with the standard uncertainties that they are expected to bring.
    """
    from gonio.app.views.measuring import next_readings as view

    if out is not None and out.suffix.lower() not in (".csv", ".toml"):
        raise ValueError(f"{out}: directions are written as .csv, a plan for gonio measure as .toml: name the file so")
    if plan.rival and (plan.want or plan.cost):
        raise ValueError("--rival tells models apart: leave out --want and --cost, which are about values")
    fitted = _fitted(data.read(scan), problem, model, solution)
    directions, nearest = _reachable(fitted, plan, data.blocked)
    chosen, record, lines = _chosen(fitted, plan, directions, scan.name)
    if out is not None:
        view.write(chosen, out, output.force, nearest)
    output.show(record, [*lines, *view.blocked_lines(nearest)])
    if out is not None and output.json != "-":
        show(Plain(f"wrote {out}"))


def _chosen(
    fitted: "Solution", plan: NextOptions, directions: "xr.Dataset", scan: str
) -> "tuple[xr.Dataset, dict[str, Any], Iterable[Any]]":
    """The readings to take, as directions, as plain data and as lines for people."""
    from gonio.app.views.measuring import next_readings as view
    from gonio.design import Cost, Noise, next_readings
    from gonio.design.tell_apart import tell_apart

    noise = Noise.parsed(plan.noise) if plan.noise else None
    with progress_bar("choosing readings"):
        if plan.rival:
            rivals = chosen_models(plan.rival)
            apart = tell_apart(fitted, rivals, directions, plan.points, noise=noise, repeats=plan.repeats)
            return apart.directions, view.apart_record(apart), view.apart_lines(apart, fitted)
        cost, want = Cost.given(plan.cost) if plan.cost else None, arguments.listed(plan.want)
        found = next_readings(fitted, directions, plan.points, want, noise=noise, cost=cost, repeats=plan.repeats)
        return found.directions, view.record(found), view.lines(found, fitted, scan)


def _fitted(data: "xr.Dataset", problem: ProblemOptions, model: str, solution: Path | None) -> "Solution":
    """The fit of the model to the scan, or the one in the file."""
    from gonio import Problem
    from gonio.fitting import Solution, fit

    if solution is not None:
        if model or problem.given() != ProblemOptions().given():
            raise ValueError("--solution is a fit that has been made: leave out --model and the options of fits")
        return Solution.load(solution).with_scan(data)
    if not model:
        raise ValueError("say of which model the values are: --model NAME, or --solution FILE of a fit")
    (one,) = chosen_models(model) if "," not in model and model not in ("all", "family") else (None,)
    if one is None:
        raise ValueError(f"--model {model} names several models, and readings are planned for one: name it")
    with progress_bar("fitting") as progress:
        return fit(Problem(one, data, **problem.given()), progress=progress)


def _reachable(fitted: "Solution", plan: NextOptions, blocked: float) -> "tuple[xr.Dataset, float]":
    """The directions to choose from, and how near the beam they go: no nearer than the scan does, unless told."""
    from gonio.design import reachable
    from gonio.design.candidates import nearest_to_beam, parsed_range

    theta_i = arguments.incidence_angles(plan.theta_i) if plan.theta_i else []
    theta_r = parsed_range(plan.theta_r) if plan.theta_r else None
    nearest = blocked or nearest_to_beam(fitted.scan)
    return reachable(fitted.scan, theta_i, theta_r, plan.every, nearest), nearest
