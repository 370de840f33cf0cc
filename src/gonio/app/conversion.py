"""The commands about files: the formats, conversion from one to another, the difference of two."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import Blocked, Floor, Force, Json, Scan, Scans, Select, Weigh
from gonio.app.terminal import app

if TYPE_CHECKING:
    import xarray as xr

    from gonio.resampling.difference import Difference
    from gonio.resampling.resample import Filling

To = Annotated[str, typer.Option("--to", metavar="FORMAT", help="a format of `gonio formats`; else by the suffix")]
Impose = Annotated[str, typer.Option("--impose", metavar="A,B", help="reciprocity, bilateral: means over images")]
Fill = Annotated[
    str, typer.Option("--fill", metavar="symmetry|MODEL", help="what may stand in gaps; several by commas")
]

Onto = Annotated[
    Path | None, typer.Option("--onto", metavar="FILE", help="resample onto the directions of this file first")
]


@app.command("formats")
def list_formats(json: Json = "") -> None:
    """List the file formats: what is read and written, and what each can hold."""
    from gonio.app import format_table, present

    if json:
        present.emit_json(format_table.records(), json)
    if json != "-":
        present.console().print(format_table.table())
        present.console().print(format_table.LEGEND)


@app.command("convert")
def convert_file(
    scan: Scan,
    out: Annotated[Path, typer.Argument(help="the file to write", show_default=False)],
    to: To = "",
    onto: Onto = None,
    select: Select = [],  # noqa: B006 - typer reads the default and never changes it
    blocked: Blocked = 0.0,
    floor: Floor = "",
    impose: Impose = "",
    fill: Fill = "",
    weighting: Weigh = "uniform",
    json: Json = "",
    force: Force = False,
) -> None:
    """Write a file in another format; the error that this cost is printed and kept in the history."""
    from gonio.app import present
    from gonio.app.options import read_scan
    from gonio.resampling.conversion import convert, in_words

    data = read_scan(scan, blocked, floor, select, findings=False)
    steps: dict[str, Any] = {"impose": _listed(impose), "filling": _filling(fill, data, weighting)}
    ready = data
    if onto is not None:
        ready, steps = _onto(data, onto, steps), {}
    done = convert(ready, out, to, force=force, **steps)
    if json:
        present.emit_json(_record(done.path, done.format.name, done.left_out, done.scan, done.error), json, force)
    if json != "-":
        terminal = present.console()
        terminal.print(f"wrote {done.path} as {done.format.title}, {done.scan['brdf'].size} values")
        for line in done.left_out:
            terminal.print(f"left out: {line}")
        for line in done.scan.attrs["history"].splitlines()[len(data.attrs["history"].splitlines()) :]:
            terminal.print(line, markup=False)
        terminal.print(f"as the file reads now: {in_words(done.error)}")


@app.command("reduce")
def reduce_files(
    scans: Scans,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the file to write", show_default=False)],
    blank: Annotated[
        Path | None, typer.Option("--blank", metavar="FILE", help="a scan without sample, to subtract")
    ] = None,
    keep_floor: Annotated[
        bool, typer.Option("--keep-floor", help="do not subtract the least signal, the detector's zero")
    ] = False,
    keep_shadow: Annotated[
        bool, typer.Option("--keep-shadow", help="keep directions where the receiver stands in the beam")
    ] = False,
    to: To = "",
    force: Force = False,
) -> None:
    """Raw sheets of one sample into a BRDF: blank subtracted, repeats and mirror images averaged, with uncertainty."""
    from gonio import read
    from gonio.app import present
    from gonio.measured.reduction import Shadow, reduce
    from gonio.resampling.conversion import convert, in_words

    found = reduce(
        [read(path) for path in scans],
        None if blank is None else read(blank),
        floor=not keep_floor,
        shadow=None if keep_shadow else Shadow(),
    )
    done = convert(found, out, to, force=force)
    terminal = present.console()
    for line in found.attrs["history"].splitlines():
        terminal.print(line, markup=False)
    terminal.print(f"wrote {done.path} as {done.format.title}, {found.sizes['direction']} directions")
    for line in done.left_out:
        terminal.print(f"left out: {line}")
    terminal.print(f"as the file reads now: {in_words(done.error)}")


@app.command("diff")
def compare_files(
    a: Annotated[Path, typer.Argument(help="the file that is compared", show_default=False)],
    b: Annotated[Path, typer.Argument(help="the reference, at whose directions both are taken", show_default=False)],
    select: Select = [],  # noqa: B006
    out: Annotated[str, typer.Option("--out", metavar="FILE", help="a figure too: .png, .svg, or both")] = "",
    json: Json = "",
    force: Force = False,
) -> None:
    """The difference of two files at the directions of the second: a table, and a figure with --out."""
    from gonio.app import arguments, differences, present
    from gonio.app.options import read_scan
    from gonio.resampling.difference import difference

    first, second = (read_scan(path, 0.0, "", select, findings=False) for path in (a, b))
    found = difference(first, second)
    if json:
        present.emit_json(differences.record(found, str(a), str(b)), json, force)
    if json != "-":
        for part in differences.tables(found, a.name, b.name):
            present.console().print(part)
    if out:
        from gonio.plot.difference import difference_figure
        from gonio.plot.style import save

        target, suffixes = arguments.figure_target(out)
        for path in save(difference_figure(found, a.name, b.name), target, suffixes, force):
            if json != "-":
                present.console().print(f"wrote {path}")


def _onto(data: "xr.Dataset", path: Path, steps: dict[str, Any]) -> "xr.Dataset":
    """The data at the directions of another file, the error of that in the history."""
    from gonio import read, resample
    from gonio.measured.dataset import add_history, directions
    from gonio.resampling.conversion import in_words
    from gonio.resampling.difference import difference

    found = resample(data, directions(read(path)), **steps)
    return add_history(found, f"at the directions of {path.name}: {in_words(difference(found, data))}")


def _listed(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _filling(text: str, data: "xr.Dataset", weighting: str) -> "Filling | None":
    """What may stand in gaps: `symmetry` or the name of one, and a model, which is fitted to the data first."""
    from gonio.resampling.resample import SYMMETRIES, Filling

    named = _listed(text)
    if not named:
        return None
    symmetries = tuple(s for s in SYMMETRIES if s in named or "symmetry" in named)
    models = [n for n in named if n not in (*SYMMETRIES, "symmetry")]
    if len(models) > 1:
        raise ValueError(f"--fill names {len(models)} models, {' and '.join(models)}: one fills the gaps")
    if not models:
        return Filling(symmetries)
    function, name = _fitted(models[0], data, weighting)
    return Filling(symmetries, function, name)


def _fitted(name: str, data: "xr.Dataset", weighting: str) -> tuple[Any, str]:
    from functools import partial

    from gonio import catalogue
    from gonio.compare import predict
    from gonio.fitting import Problem, fit

    model = catalogue[name]
    solution = fit(Problem(model, data, weighting=weighting))
    values = ", ".join(f"{k} {v:.6g}" for k, v in solution.values.items())
    return partial(predict, model, solution), f"{name} fitted with {weighting} weighting ({values}; {solution.status})"


def _record(path: Path, name: str, left_out: Any, scan: "xr.Dataset", error: "Difference") -> dict[str, Any]:
    return {
        "file": str(path),
        "format": name,
        "values": int(scan["brdf"].size),
        "left_out": list(left_out),
        "history": scan.attrs["history"].splitlines(),
        "error": {
            "rms": error.rms,
            "rms_steep": error.rms_steep,
            "bias": error.bias,
            "largest": error.largest,
            "where": error.where,
            "lost": error.missing,
        },
    }
