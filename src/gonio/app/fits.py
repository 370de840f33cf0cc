"""The commands about fits: one model, several side by side, and figures of them."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import (
    Blocked,
    Bootstrap,
    Bound,
    CovarianceKind,
    Derive,
    Floor,
    Force,
    Group,
    Hold,
    Json,
    MaterialName,
    ModelName,
    Models,
    ProfileOf,
    Resample,
    Scan,
    Scans,
    Seed,
    Select,
    Setting,
    Share,
    SolverName,
    Wavelength,
    Weigh,
    chosen_models,
    problem_options,
    read_scan,
)
from gonio.app.terminal import app

if TYPE_CHECKING:
    import xarray as xr

    from gonio.app.certainty import Certainty
    from gonio.compare import Row


class Figure(StrEnum):
    """What `gonio plot` draws."""

    CURVES = "curves"
    RESIDUALS = "residuals"
    COMPONENTS = "components"
    HEMISPHERE = "hemisphere"
    CONVERGENCE = "convergence"
    ERRORS = "errors"


@app.command("fit")
def fit_scan(
    scan: Scan,
    model: ModelName,
    solver: SolverName = "projection",
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    setting: Setting = [],  # noqa: B006
    seed: Seed = 0,
    blocked: Blocked = 0.0,
    floor: Floor = "",
    select: Select = [],  # noqa: B006
    covariance: CovarianceKind = "robust",
    bootstrap: Bootstrap = 0,
    resample: Resample = "residual",
    profile: ProfileOf = "",
    derived: Derive = False,
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="write the solution, its JSON and figures")] = "",
    json: Json = "",
    force: Force = False,
) -> None:
    """Fit one model to a scan: values, uncertainties, metrics."""
    from gonio import Problem, catalogue
    from gonio.app import arguments, present
    from gonio.app.certainty import Question, ask
    from gonio.compare import assess
    from gonio.files import refuse_existing
    from gonio.fit import fit

    data = read_scan(scan, blocked, floor, select)
    options = problem_options(data, hold, group, share, bound, weighting, material, wavelength)
    problem = Problem(catalogue[model], data, **options)
    question = Question(bootstrap, resample, seed, profile, derived)
    question.refuse_unfit(problem)
    if out:
        refuse_existing(Path(out), force)
    with present.progress_bar(f"fitting {model}") as progress:
        row = assess(problem, fit(problem, arguments.solver(solver, seed, setting), progress, covariance))
    certainty = ask(problem, row.solution, question)
    if out:
        _write_fit(Path(out), data, row, certainty, force)
    if json:
        present.emit_json(present.solution_record(row, certainty), json, force)
    if json != "-":
        _show_fit(scan, row, certainty, out)


@app.command("compare")
def compare_models(
    scans: Scans,
    models: Models = "family",
    solver: SolverName = "projection",
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    setting: Setting = [],  # noqa: B006
    seed: Seed = 0,
    rank_by: Annotated[str, typer.Option("--rank", help="delta, E, nrmse or log10_rmse")] = "E",
    by_incidence: Annotated[bool, typer.Option("--by-incidence", help="nRMSE at each incidence angle too")] = False,
    validate: Annotated[
        str,
        typer.Option("--validate", metavar="BY", help="rank by what is left out: theta_i, out-of-plane, 5 (blocks)"),
    ] = "",
    blocked: Blocked = 0.0,
    floor: Floor = "",
    select: Select = [],  # noqa: B006
    json: Json = "",
    force: Force = False,
) -> None:
    """Fit several models to scans and rank them."""
    from gonio.app import arguments, present
    from gonio.compare import rank

    chosen, search = chosen_models(models), arguments.solver(solver, seed, setting)
    loaded = [(path, read_scan(path, blocked, floor, select)) for path in scans]
    found = []
    with present.progress_bar("comparing") as progress:
        for done, (path, data) in enumerate(loaded):
            options = problem_options(data, hold, group, share, bound, weighting, material, wavelength)
            rows = rank(
                data,
                chosen,
                by=rank_by,
                solver=search,
                left_out=validate,
                progress=lambda f, done=done: progress((done + f) / len(loaded)),  # type: ignore[misc]
                **options,
            )
            found.append((path, rows))
    if json:
        present.emit_json([_ranking_record(path, rows) for path, rows in found], json, force)
    if json != "-":
        for path, rows in found:
            present.console().print(present.ranking_table(path.stem, rows))
            if by_incidence:
                for part in present.incidence_tables(rows):
                    present.console().print(part)


@app.command("plot")
def plot_scan(
    scans: Scans,
    figure: Annotated[Figure, typer.Option("--figure", help="what to draw")] = Figure.CURVES,
    models: Models = "torrance-sparrow,wang-2016,liu-2016,cauchy-lorentz",
    solver: SolverName = "projection",
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    setting: Setting = [],  # noqa: B006
    seed: Seed = 0,
    normalised: Annotated[bool, typer.Option("--normalised", help="curves over their specular value")] = False,
    band: Annotated[bool, typer.Option("--band", help="shade the 95 % band of every fit")] = False,
    blocked: Blocked = 0.0,
    floor: Floor = "",
    select: Select = [],  # noqa: B006
    out: Annotated[str, typer.Option("--out", metavar="FILE", help=".png, .svg, or a name for both")] = "",
    force: Force = False,
) -> None:
    """Draw a scan and the models fitted to it."""
    from gonio.app import arguments, drawing, present
    from gonio.compare import rank
    from gonio.plot.style import save

    chosen, search = chosen_models(models), arguments.solver(solver, seed, setting)
    target, suffixes = arguments.figure_target(out or f"{scans[0].stem}-{figure.value}")
    ranked = {}
    with present.progress_bar("fitting") as progress:
        for path in scans:
            data = read_scan(path, blocked, floor, select)
            options = problem_options(data, hold, group, share, bound, weighting, material, wavelength)
            ranked[path.stem] = (data, rank(data, chosen, solver=search, progress=progress, **options))
    drawn = drawing.draw(figure.value, ranked, normalised=normalised, banded=band)
    for path in save(drawn, target, suffixes, force):
        present.console().print(f"wrote {path}")


def _ranking_record(path: Path, rows: "list[Row]") -> dict[str, Any]:
    ranking = [
        {
            "model": row.model.name,
            "free_parameters": row.free_parameters,
            "status": str(row.solution.status),
            "metrics": dict(row.metrics),
            "aicc": row.aicc,
            "bic": row.bic,
            "validated": dict(row.validated),
            "by_fold": dict(row.by_fold),
            "by_incidence": {f"{angle:g}": dict(m) for angle, m in row.by_incidence.items()},
        }
        for row in rows
    ]
    return {"scan": str(path), "ranking": ranking}


def _write_fit(folder: Path, data: "xr.Dataset", row: "Row", certainty: "Certainty", force: bool) -> None:
    from gonio.app import drawing, present
    from gonio.fit.bootstrap import kept
    from gonio.plot.profiles import profiles
    from gonio.plot.style import save

    folder.mkdir(parents=True, exist_ok=True)
    solution = row.solution if certainty.drawn is None else kept(row.solution, certainty.drawn)
    solution.save(folder / "solution.nc", force)
    present.emit_json(present.solution_record(row, certainty), str(folder / "fit.json"), force)
    kinds = ["curves", "residuals", "components"] + ["convergence"] * (row.solution.dataset.attrs["solver"] == "anneal")
    for kind in kinds:
        drawn = drawing.draw(kind, {row.model.name: (data, [row])}, banded=kind == "curves")
        save(drawn, folder / kind, force=force)
    if certainty.profiles:
        shown = profiles(certainty.profiles, row.solution.uncertainties, title=row.model.name)
        save(shown, folder / "profiles", force=force)


def _show_fit(scan: Path, row: "Row", certainty: "Certainty", out: str) -> None:
    from gonio.app import present
    from gonio.fit.covariance import COVARIANCES

    terminal, attrs = present.console(), row.solution.dataset.attrs
    terminal.print(f"[bold]{attrs['model']}[/bold] fitted to {scan.name}, {attrs['points']} points")
    terminal.print(f"{attrs['solver']}, {attrs['seconds']:.3g} s: {attrs['status']}")
    if attrs["covariance"] != "robust":
        terminal.print(f"{attrs['covariance']} covariance: {COVARIANCES[attrs['covariance']]}")
    terminal.print(present.solution_table(row.solution))
    for line in present.verdict_lines(row, certainty):
        terminal.print(line)
    for answer in certainty.tables():
        terminal.print(answer)
    terminal.print(present.metrics_table(row.metrics))
    if out:
        terminal.print(f"wrote {out}/")
