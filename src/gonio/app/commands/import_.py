"""`gonio import`: any table as a scan."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import typer

from gonio import write
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.output import Plain, show, strong, warn
from gonio.app.output import table as grid
from gonio.files import refuse_existing
from gonio.formats import writer
from gonio.measured.dataset import ANGLES, SETS, unit
from gonio.options import Option, Panel
from gonio.tables.read import Table, understood
from gonio.tables.request import Request, request
from gonio.units import unit_label

PREVIEW = 5  # rows of a scan that is not written


EXAMPLES = (
    Example("gonio import table.csv", "What the columns of a table are taken for, before it is used"),
    Example("gonio import table.csv --out scan.csv", "Write the scan"),
    Example("gonio import lab.csv --columns AOI=theta_i,AOS=theta_r --out scan.csv", "Say what columns are"),
)


@dataclass(frozen=True, kw_only=True)
class TableOptions:
    """What the user says of a table that its headings do not."""

    PANEL: ClassVar = Panel.DATA
    columns: Annotated[
        tuple[str, ...],
        Option(
            "what columns hold, with a unit where needed: AOI=theta_i,AOS=theta_r:rad,BSDF=brdf",
            metavar="HEADING=NAME,..",
        ),
    ] = ()
    layout: Annotated[
        str,
        Option(
            "how the table lies: long (one value a row), matrix, blocks or sheets",
            metavar="NAME",
            names=("long", "matrix", "blocks", "sheets"),
        ),
    ] = ""
    rows: Annotated[
        str, Option("the angle that the rows of a matrix hold", metavar="theta_i|theta_r", names=("theta_i", "theta_r"))
    ] = ""
    values: Annotated[str, Option("the columns of values, one for each wavelength: '*nm'", metavar="PATTERN")] = ""
    quantity: Annotated[
        str,
        Option(
            "what the values are: brdf, ccbsdf, reflectance-factor, radiant-intensity, log10-brdf, signal or percent; "
            "reflectance-factor:percent where they are in per cent",
            metavar="NAME",
        ),
    ] = ""
    sheet: Annotated[str, Option("the sheet of a workbook with several", metavar="NAME")] = ""
    flip: Annotated[bool, Option("take directions as counted to the other side of the normal")] = False

    def request(self) -> Request:
        """The same, checked."""
        return request(
            columns=",".join(self.columns) or None,
            layout=self.layout,
            rows=self.rows,
            values=self.values,
            quantity=self.quantity,
            flip=self.flip,
            sheet=self.sheet,
        )


def command(
    table: Annotated[
        Path,
        typer.Argument(
            metavar="TABLE", help="a table: CSV or other text, or a workbook (.xlsx, .xls, .ods)", show_default=False
        ),
    ],
    how: TableOptions,
    output: OutputOptions,
    out: Annotated[Path | None, Option("the scan to write", metavar="SCAN.csv", panel=Panel.OUTPUT)] = None,
) -> None:
    """Read any table as a scan.

    What its columns are is found, shown, and asked for where it is not certain.
    """
    if out is not None:
        refuse_existing(out, output.force)
        writer(out)
    asked = how.request()
    found = understood(table, asked)
    for warning in found.warnings:
        warn(table, f"warning: {warning}")
    output.show(record(table, found, out), lines(table, found, asked, out is not None))
    if out is not None:
        chosen = write(found.scan, out, output.force)
        if output.json != "-":
            show(f"wrote {out} as {chosen.title}, {found.scan['brdf'].size} values")


def record(path: Path, found: Table, out: Path | None) -> dict[str, Any]:
    """The mapping and the first values as plain data."""
    return {
        "file": str(path),
        "layout": found.layout,
        "how": found.how,
        "mapping": found.mapping,
        "notes": found.notes,
        "warnings": found.warnings,
        "unit": unit(found.scan),
        "values": int(found.scan["brdf"].size),
        "first": [dict(zip(_names(found), row, strict=True)) for row in _rows(found)],
        "written": None if out is None else str(out),
    }


def _names(found: Table) -> list[str]:
    names = [n for n in (*ANGLES, "phi_i", *SETS) if n in found.scan.coords]
    return [*names, "brdf", *(["uncertainty"] if "uncertainty" in found.scan else [])]


def _rows(found: Table) -> list[list[Any]]:
    first = found.scan.isel(direction=slice(PREVIEW))
    return [list(row) for row in zip(*(first[n].values.tolist() for n in _names(found)), strict=True)]


def lines(path: Path, found: Table, asked: Request, is_written: bool) -> Iterator[Any]:
    """The mapping for people; where nothing is written the first values, and what to add."""
    layout, *mapping = found.lines
    yield strong(str(path), f": {layout}")
    yield Plain("\n".join(f"  {line}" for line in mapping))
    if is_written:
        return
    names = _names(found)
    shown = grid(
        *names, title=f"the first of {found.scan['brdf'].size} values [{unit_label(unit(found.scan))}]", left=0
    )
    for row in _rows(found):
        shown.add_row(*(f"{cell:.6g}" if isinstance(cell, float) else str(cell) for cell in row))
    yield shown
    yield Plain(f"nothing is written yet: {asked.command(path)}")
