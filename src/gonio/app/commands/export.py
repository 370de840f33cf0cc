"""`gonio export`: a model, a fit or a scan handed on to another program."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from gonio import catalogue
from gonio import fit as fitted
from gonio.app import names
from gonio.app.arguments import number
from gonio.app.correcting import CorrectionOptions
from gonio.app.help_page import Example
from gonio.app.model_options import ValueOptions
from gonio.app.options import Models, OutputOptions, ScanOptions, chosen_models
from gonio.app.views import exporting as view
from gonio.completion import Corrected, Correction
from gonio.exporting.entry import write
from gonio.exporting.subject import Subject, of_model, of_solution
from gonio.exporting.target import WORST
from gonio.fitting.solution import Solution
from gonio.fitting.stored import SOLUTION_FILE, is_solution
from gonio.models.publications import published as surfaces
from gonio.options import Option, Panel
from gonio.outside import nearest

EXAMPLES = (
    Example("gonio export results --to mitsuba --out coating_mitsuba.py", "A fit as a BSDF plugin for Mitsuba 3"),
    Example(
        "gonio export ggx --set rho_s=0.8,width=0.2 --to c --out coating.h --check",
        "A model with values as C, compiled and compared with gonio",
    ),
    Example("gonio export scan.csv --model ggx --to python --out coating.py", "A fitted model as a Python module"),
    Example(
        "gonio export scan.csv --model ggx --correct --to zemax --out corrected.bsdf",
        "A table of a fit, corrected by what the scan shows beyond it",
    ),
)


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """What is written, and how it is proved."""

    PANEL: ClassVar = Panel.OUTPUT
    to: Annotated[
        str, Option("the program to write for; without it the one of the suffix", metavar="TARGET", names=names.targets)
    ] = ""
    check: Annotated[bool, Option("prove the written file with what is installed here")] = False
    name: Annotated[str, Option("what the model is called inside the file", metavar="NAME")] = ""
    scale: Annotated[
        float | None, Option("the 1/sr of one unit of relative data", metavar="VALUE", panel=Panel.DATA)
    ] = None
    published: Annotated[
        str,
        Option(
            "values that a paper prints for a surface, such as Al or Cu",
            metavar="NAME",
            names=names.surfaces,
            panel=Panel.MODEL,
        ),
    ] = ""
    correct: Annotated[
        bool,
        Option(
            "write a table of the model corrected by what the scan shows beyond it, as `gonio complete` does",
            panel=Panel.MODEL,
        ),
    ] = False
    worst: Annotated[float, Option("largest relative rms error of a table", metavar="VALUE", lowest=0.0)] = WORST


def command(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="a model of `gonio models`, the file or folder of a fit, or a scan, to which the best model is fitted",
            show_default=False,
            autocompletion=Option("", names=names.models).completed,
        ),
    ],
    out: Annotated[Path, Option("the file to write", metavar="FILE", panel=Panel.OUTPUT)],
    export: ExportOptions,
    values: ValueOptions,
    correction: CorrectionOptions,
    used: ScanOptions,
    output: OutputOptions,
    model: Models = "",
) -> None:
    """Hand a model on to another program, as source code, a table or a material.

    The written file names its source, its values with their uncertainty, and what the model violates.
    """
    if not export.correct:
        correction.refuse_unused("--correct")
    chosen = correction.chosen if export.correct else None
    subject, name = _subject(source, export, values, used, model, chosen), export.name or called(source, out)
    done = write(subject, out, export.to, name, export.worst, output.force)
    proof = done.prove() if export.check else None
    output.show(view.record(done, proof), view.lines(done, proof))


def called(source: str, out: Path) -> str:
    """What a model is called in the written file: its own name, or for a fit that of the file."""
    return source if source in catalogue else out.stem


def _subject(
    source: str,
    export: ExportOptions,
    values: ValueOptions,
    used: ScanOptions,
    model: str,
    correction: Correction | None,
) -> Subject:
    """What is exported."""
    if source in catalogue:
        if correction is not None:
            raise ValueError("--correct needs a scan or a fit of one, and a model is named: leave it out")
        if model:
            raise ValueError("--model is fitted to a scan, and a model is named: leave it out")
        return _of_model(source, export, values, used)
    path = _file_of(source)
    if values != ValueOptions() or export.published:
        raise ValueError("--set, --material and --published belong to a model: a fit or a scan has its own values")
    if is_solution(path):
        if used != ScanOptions(select=used.select) or model:
            raise ValueError(f"{path}: holds a fit, and masks, corrections and --model belong to a scan")
        solution, select = Solution.load(path), used.select
        if correction is not None and not solution.has_scan:
            raise ValueError(f"{path}: holds no scan that could correct the fit: name the scan, with --model")
    else:
        data, select = used.read(path), {}
        solution = fitted(data, chosen_models(model)) if model else fitted(data)
    of = solution if correction is None else Corrected.of(solution.scan, solution, correction)
    return of_solution(of, scale=export.scale, select=select, file=path)


def _of_model(source: str, export: ExportOptions, values: ValueOptions, used: ScanOptions) -> Subject:
    """A model with the values of the command line and of a paper."""
    if used != ScanOptions(select=used.select) or used.select.keys() - {"theta_i"}:
        raise ValueError("masks, corrections and --select belong to a scan: leave them out")
    if not export.published:
        if used.select:
            raise ValueError("--select theta_i=ANGLE belongs to --published values: leave it out")
        return of_model(catalogue[source], values.values(), scale=export.scale)
    paper = surfaces[export.published]
    if paper.model != source:
        raise ValueError(f"the constants of {paper.name} belong to {paper.model}, not to {source}")
    tabulated = [n for n, v in paper.values.items() if not isinstance(v, int | float)]
    if tabulated and not used.select:
        raise ValueError(
            f"{paper.cite} has {tabulated[0]} of {paper.name} for some incidence angles: "
            "choose one by --select theta_i=40"
        )
    theta_i = number(used.select.get("theta_i", "0"), "--select theta_i")
    at = f", at theta_i {theta_i:g} deg" if tabulated else ""
    return of_model(
        catalogue[source],
        paper.at(theta_i) | values.values(),
        unit=paper.unit,
        scale=export.scale,
        origin=f"{paper.title}: {paper.cite}, {paper.where}{at}",
        wavelength=paper.wavelength_nm,
    )


def _file_of(source: str) -> Path:
    """The file of a fit or of a scan; FileNotFoundError where there is none, nor a model of that name."""
    path = Path(source)
    if (path / SOLUTION_FILE).is_file():
        return path / SOLUTION_FILE
    if not path.exists():
        raise FileNotFoundError(
            f"{source}: there is no such file, and no model of that name; {nearest(source, catalogue)}"
        )
    return path
