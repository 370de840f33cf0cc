"""Workbooks with sheets of rows of numbers and texts, as small as each program's format allows."""

import struct
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from samples.rt300s import END, FREE, TABLE, _entry, record

Sheets = Mapping[str, Sequence[Sequence[float | str | None]]]


def write(path: Path, sheets: Sheets) -> Path:
    """A workbook of the kind that the suffix names: .xlsx, .ods or .xls; None is an empty cell."""
    {".xlsx": _xlsx, ".ods": _ods, ".xls": _xls}[path.suffix](path, sheets)
    return path


def _place(row: int, column: int) -> str:
    letters = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        letters = chr(65 + rest) + letters
    return f"{letters}{row + 1}"


def _xlsx(path: Path, sheets: Sheets) -> None:
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    relations = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    packages = "http://schemas.openxmlformats.org/package/2006"
    listed, related, types = "", "", ""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as book:
        sheet_type = "application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"
        for n in range(1, len(sheets) + 1):
            types += f'<Override PartName="/xl/worksheets/sheet{n}.xml" ContentType="{sheet_type}"/>'
        book.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{packages}/content-types"><Default Extension="xml" ContentType="application/xml"/>'
            '<Default Extension="rels" '
            'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            '<Override PartName="/xl/workbook.xml" ContentType="'
            f'application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>{types}</Types>',
        )
        for n, (name, rows) in enumerate(sheets.items(), start=1):
            lines = "".join(f'<row r="{i + 1}">{"".join(_cells(i, row))}</row>' for i, row in enumerate(rows))
            book.writestr(
                f"xl/worksheets/sheet{n}.xml", f'<worksheet xmlns="{main}"><sheetData>{lines}</sheetData></worksheet>'
            )
            listed += f'<sheet name="{escape(name)}" sheetId="{n}" r:id="r{n}"/>'
            related += f'<Relationship Id="r{n}" Type="{relations}/worksheet" Target="worksheets/sheet{n}.xml"/>'
        book.writestr(
            "xl/workbook.xml", f'<workbook xmlns="{main}" xmlns:r="{relations}"><sheets>{listed}</sheets></workbook>'
        )
        ends = f'<Relationships xmlns="{packages}/relationships">'
        book.writestr("xl/_rels/workbook.xml.rels", f"{ends}{related}</Relationships>")
        first = f'<Relationship Id="r1" Type="{relations}/officeDocument" Target="xl/workbook.xml"/>'
        book.writestr("_rels/.rels", f"{ends}{first}</Relationships>")


def _cells(i: int, row: Sequence[float | str | None]) -> list[str]:
    cells = []
    for k, cell in enumerate(row):
        if isinstance(cell, str):
            cells.append(f'<c r="{_place(i, k)}" t="inlineStr"><is><t>{escape(cell)}</t></is></c>')
        elif cell is not None:
            cells.append(f'<c r="{_place(i, k)}"><v>{float(cell)!r}</v></c>')
    return cells


def _ods(path: Path, sheets: Sheets) -> None:
    names = "urn:oasis:names:tc:opendocument:xmlns"
    tables = ""
    for name, rows in sheets.items():
        lines = "".join(f"<table:table-row>{''.join(map(_ods_cell, row))}</table:table-row>" for row in rows)
        tables += f'<table:table table:name="{escape(name)}">{lines}</table:table>'
    content = (
        f'<office:document-content xmlns:office="{names}:office:1.0" xmlns:table="{names}:table:1.0" '
        f'xmlns:text="{names}:text:1.0"><office:body><office:spreadsheet>{tables}</office:spreadsheet></office:body>'
        "</office:document-content>"
    )
    with zipfile.ZipFile(path, "w") as book:
        book.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        book.writestr("content.xml", content)
        listed = f'<manifest:file-entry xmlns:manifest="{names}:manifest:1.0" manifest:full-path="content.xml"/>'
        book.writestr(
            "META-INF/manifest.xml",
            f'<manifest:manifest xmlns:manifest="{names}:manifest:1.0">{listed}</manifest:manifest>',
        )


def _ods_cell(cell: float | str | None) -> str:
    if cell is None:
        return "<table:table-cell/>"
    if isinstance(cell, str):
        return f'<table:table-cell office:value-type="string"><text:p>{escape(cell)}</text:p></table:table-cell>'
    value = f'office:value-type="float" office:value="{float(cell)!r}"'
    return f"<table:table-cell {value}><text:p>{cell}</text:p></table:table-cell>"


def _xls(path: Path, sheets: Sheets) -> None:
    bodies = []
    for rows in sheets.values():
        cells = [record(0x0809, struct.pack("<HHHHII", 0x0600, 0x10, 0, 0, 0, 0))]
        for i, row in enumerate(rows):
            for k, cell in enumerate(row):
                if isinstance(cell, str):
                    text = struct.pack("<HB", len(cell), 1) + cell.encode("utf-16-le")
                    cells.append(record(0x0204, struct.pack("<HHH", i, k, 0) + text))
                elif cell is not None:
                    cells.append(record(0x0203, struct.pack("<HHHd", i, k, 0, cell)))
        bodies.append(b"".join([*cells, record(0x000A, b"")]))
    names = [name.encode("latin-1") for name in sheets]
    begin = record(0x0809, struct.pack("<HHHHII", 0x0600, 0x05, 0, 0, 0, 0))
    length = len(begin) + 4 + sum(4 + 8 + len(name) for name in names)
    listed = b""
    for name, body in zip(names, bodies, strict=True):
        listed += record(0x0085, struct.pack("<IHBB", length, 0, len(name), 0) + name)
        length += len(body)
    stream = begin + listed + record(0x000A, b"") + b"".join(bodies)
    stream = stream.ljust(max(4096, -(-len(stream) // 512) * 512), b"\0")
    sectors = len(stream) // 512
    table = [TABLE, END, *range(3, 2 + sectors), END]
    assert len(table) <= 128, "one sector of the allocation table holds no larger workbook"
    entries = _entry("Root Entry", 5, END, 0) + _entry("Workbook", 2, 2, len(stream)) + 2 * _entry("", 0, 0, 0)
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16) + struct.pack("<HHHHH", 0x3E, 3, 0xFFFE, 9, 6) + bytes(10)
    header += struct.pack("<IIIIIIIII", 1, 1, 0, 4096, END, 0, END, 0, 0) + struct.pack("<108I", *[FREE] * 108)
    path.write_bytes(header + struct.pack("<128I", *table, *[FREE] * (128 - len(table))) + entries + stream)
