"""The commands about fits: one model, several side by side, and figures of them."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import (
    Blocked,
    Bootstrap,
    Bound,
    ConeStep,
    CovarianceKind,
    Derive,
    DetectorHalfAngle,
    Floor,
    Force,
    Group,
    Hold,
    Json,
    LossName,
    MaterialName,
    ModelName,
    Models,
    NoiseFloor,
    ProfileOf,
    Resample,
    Scans,
    Seed,
    Select,
    Setting,
    Share,
    Smoothed,
    SolverName,
    SourceHalfAngle,
    Wavelength,
    Weigh,
    Workers,
    chosen_models,
    problem_options,
    read_joint,
    read_scan,
)
from gonio.app.options import workers as processes
from gonio.app.terminal import app

if TYPE_CHECKING:
    import xarray as xr

    from gonio.app.certainty import Certainty
    from gonio.compare import Row
    from gonio.fitting.certainty.outliers import Scrutiny


class Figure(StrEnum):
    """What `gonio plot` draws."""

    CURVES = "curves"
    RESIDUALS = "residuals"
    COMPONENTS = "components"
    HEMISPHERE = "hemisphere"
    CONVERGENCE = "convergence"
    SPECTRA = "spectra"
    ERRORS = "errors"


@app.command("fit")
def fit_scan(
    scans: Scans,
    model: ModelName,
    joint: Annotated[
        bool, typer.Option("--joint", help="several scans at once: weights one a scan, the shape shared")
    ] = False,
    solver: SolverName = "projection",
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    smooth: Smoothed = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    noise_floor: NoiseFloor = 0.0,
    loss: LossName = "squared",
    source_half_angle: SourceHalfAngle = 0.0,
    detector_half_angle: DetectorHalfAngle = 0.0,
    cone_step: ConeStep = 0.5,
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
    """Fit one model to a scan, or to several jointly: values, uncertainties, metrics."""
    from gonio import Problem, catalogue
    from gonio.app import arguments, present
    from gonio.app.certainty import Question, ask
    from gonio.compare import assess
    from gonio.files import refuse_existing
    from gonio.fitting import fit
    from gonio.fitting.certainty.outliers import scrutinise

    data = read_joint([(path, read_scan(path, blocked, floor, select)) for path in scans], joint)
    cones = (source_half_angle, detector_half_angle, cone_step)
    options = problem_options(
        data, hold, group, share, smooth, bound, weighting, noise_floor, loss, material, wavelength, cones
    )
    problem = Problem(catalogue[model], data, **options)
    question = Question(bootstrap, resample, seed, profile, derived)
    question.refuse_unfit(problem)
    if out:
        refuse_existing(Path(out), force)
    with present.progress_bar(f"fitting {model}") as progress:
        row = assess(problem, fit(problem, arguments.solver(solver, seed, setting), progress, covariance))
    scrutiny, certainty = scrutinise(problem, row.solution.vector(problem.names)), ask(problem, row.solution, question)
    if out:
        _write_fit(Path(out), data, row, scrutiny, certainty, force)
    if json:
        present.emit_json(present.solution_record(row, scrutiny, certainty), json, force)
    if json != "-":
        _show_fit(scans, row, scrutiny, certainty, out)


@app.command("compare")
def compare_models(
    scans: Scans,
    models: Models = "family",
    solver: SolverName = "projection",
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    smooth: Smoothed = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    noise_floor: NoiseFloor = 0.0,
    loss: LossName = "squared",
    source_half_angle: SourceHalfAngle = 0.0,
    detector_half_angle: DetectorHalfAngle = 0.0,
    cone_step: ConeStep = 0.5,
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
    workers: Workers = 0,
    json: Json = "",
    force: Force = False,
) -> None:
    """Fit several models to scans and rank them."""
    from gonio.app import arguments, present, provisos
    from gonio.compare import rank

    chosen, search = chosen_models(models), arguments.solver(solver, seed, setting)
    cones = (source_half_angle, detector_half_angle, cone_step)
    loaded = [(path, read_scan(path, blocked, floor, select)) for path in scans]
    found = []
    with present.progress_bar("comparing") as progress:
        for done, (path, data) in enumerate(loaded):
            options = problem_options(
                data, hold, group, share, smooth, bound, weighting, noise_floor, loss, material, wavelength, cones
            )
            rows = rank(
                data,
                chosen,
                by=rank_by,
                solver=search,
                left_out=validate,
                workers=processes(workers, len(chosen)),
                progress=lambda f, done=done: progress((done + f) / len(loaded)),  # type: ignore[misc]
                **options,
            )
            found.append((path, rows))
    if json:
        present.emit_json([_ranking_record(path, rows) for path, rows in found], json, force)
    if json != "-":
        for path, rows in found:
            present.console().print(present.ranking_table(path.stem, rows))
            for line in provisos.instrument_lines([row.solution for row in rows]):
                present.console().print(line)
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
    smooth: Smoothed = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    weighting: Weigh = "uniform",
    noise_floor: NoiseFloor = 0.0,
    loss: LossName = "squared",
    source_half_angle: SourceHalfAngle = 0.0,
    detector_half_angle: DetectorHalfAngle = 0.0,
    cone_step: ConeStep = 0.5,
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
    cones = (source_half_angle, detector_half_angle, cone_step)
    ranked = {}
    with present.progress_bar("fitting") as progress:
        for path in scans:
            data = read_scan(path, blocked, floor, select)
            options = problem_options(
                data, hold, group, share, smooth, bound, weighting, noise_floor, loss, material, wavelength, cones
            )
            ranked[path.stem] = (data, rank(data, chosen, solver=search, progress=progress, **options))
    drawn = drawing.draw(figure.value, ranked, normalised=normalised, banded=band)
    for path in save(drawn, target, suffixes, force):
        present.console().print(f"wrote {path}")


def _ranking_record(path: Path, rows: "list[Row]") -> dict[str, Any]:
    from gonio.app import provisos

    ranking = [
        {
            "model": row.model.name,
            "free_parameters": row.free_parameters,
            "effective_values": row.effective_values,
            "status": str(row.solution.status),
            "instrument": provisos.instrument_record(row.solution),
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


def _write_fit(
    folder: Path, data: "xr.Dataset", row: "Row", scrutiny: "Scrutiny", certainty: "Certainty", force: bool
) -> None:
    from gonio.app import drawing, present
    from gonio.fitting.certainty.bootstrap import kept
    from gonio.plot.profiles import profiles
    from gonio.plot.style import save

    folder.mkdir(parents=True, exist_ok=True)
    solution = row.solution if certainty.drawn is None else kept(row.solution, certainty.drawn)
    solution.save(folder / "solution.nc", force)
    present.emit_json(present.solution_record(row, scrutiny, certainty), str(folder / "fit.json"), force)
    kinds = ["curves", "residuals", "components"] + ["convergence"] * (row.solution.dataset.attrs["solver"] == "anneal")
    kinds += ["spectra"] * drawing.has_spectra(row.solution)
    for kind in kinds:
        drawn = drawing.draw(kind, {row.model.name: (data, [row])}, banded=kind == "curves")
        save(drawn, folder / kind, force=force)
    if certainty.profiles:
        shown = profiles(certainty.profiles, row.solution.uncertainties, title=row.model.name)
        save(shown, folder / "profiles", force=force)


def _show_fit(scans: list[Path], row: "Row", scrutiny: "Scrutiny", certainty: "Certainty", out: str) -> None:
    from gonio.app import fitted_values, present, provisos
    from gonio.fitting.certainty.covariance import COVARIANCES

    terminal, attrs = present.console(), row.solution.dataset.attrs
    which = scans[0].name if len(scans) == 1 else f"{len(scans)} scans jointly"
    terminal.print(f"[bold]{attrs['model']}[/bold] fitted to {which}, {attrs['points']} points")
    terminal.print(f"{attrs['solver']}, {attrs['seconds']:.3g} s: {attrs['status']}")
    told = (provisos.sample_lines(row.solution), provisos.instrument_lines([row.solution]))
    for line in (*told[0], *told[1], *provisos.loss_lines(row.solution)):
        terminal.print(line)
    for line in fitted_values.smooth_lines(row):
        terminal.print(line)
    if attrs["covariance"] != "robust":
        terminal.print(f"{attrs['covariance']} covariance: {COVARIANCES[attrs['covariance']]}")
    for part in fitted_values.solution_tables(row.solution):
        terminal.print(part)
    for line in (*present.verdict_lines(row, certainty), *provisos.outlier_lines(scrutiny)):
        terminal.print(line)
    for answer in certainty.tables():
        terminal.print(answer)
    terminal.print(present.metrics_table(row.metrics))
    if out:
        terminal.print(f"wrote {out}/")
