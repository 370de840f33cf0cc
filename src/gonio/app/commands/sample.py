"""`gonio sample`: the bundled scans, written as files to learn with."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from gonio.app import names
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.output import Plain, table
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio sample", "List the bundled scans, and what each is simulated from"),
    Example("gonio sample coating --out coating.csv", "Write one, and then try gonio fit coating.csv"),
    Example("gonio sample metal --out metal.nc", "Another, as NetCDF; gonio formats lists what can be written"),
)


def command(
    output: OutputOptions,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="which one; without it they are listed",
            show_default=False,
            autocompletion=Option("", names=names.samples).completed,
        ),
    ] = "",
    out: Annotated[Path | None, Option("the file to write", metavar="FILE", panel=Panel.OUTPUT)] = None,
) -> None:
    """Write a bundled, simulated scan to learn with.

    Nothing in these scans was measured: each is computed from a model of the catalogue with known values and seeded
    noise, and says so. gonio fetch has measured ones.
    """
    from gonio import write
    from gonio.samples import samples

    if not name:
        listed = table("sample", "what it is", "simulated from", left=3)
        for one, made in samples().items():
            listed.add_row(one, made.title, made.model)
        output.show([{"name": one, **asdict(made)} for one, made in samples().items()], [listed])
        return
    made = samples()[name]
    if out is None:
        raise ValueError(f"say where to write it: gonio sample {name} --out {name}.csv")
    write(made.scan(), out, force=output.force)
    record = {"name": name, **asdict(made), "out": str(out)}
    output.show(record, [Plain(f"wrote {out}, simulated from {made.model}")])
