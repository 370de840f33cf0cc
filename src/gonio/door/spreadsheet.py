"""The cells of a workbook (.xlsx, .xlsm, .xls, .ods), read by python-calamine in a process of its own.

On some damaged files calamine ends its process, or takes more memory than there is. In a process of its own that is an
error of one line. Run as a program, this file is that process: it writes the cells as JSON.
"""

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

MAGIC = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")  # a ZIP archive, a compound file
MOST_BYTES = 64 * 2**20
MOST_UNPACKED = 512 * 2**20  # bytes of a ZIP archive
MOST_CELLS = 5_000_000
PATIENCE = 60.0  # s for one workbook


class Sheet(NamedTuple):
    """A sheet: its name, and its rows of numbers and texts, an empty text for an empty cell."""

    name: str
    rows: list[list[float | str]]


def sheets(path: Path) -> list[Sheet]:
    """Every sheet of a workbook that has cells. Raises FormatError for what is no whole workbook."""
    from gonio.files import FormatError

    if path.stat().st_size > MOST_BYTES:
        raise FormatError(path, f"is larger than {MOST_BYTES // 2**20} MB: save the table alone", f"byte {MOST_BYTES}")
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        if unpacked > MOST_UNPACKED:
            raise FormatError(path, f"unpacks to {unpacked // 2**20} MB: save the table alone", "byte 0")
    except (zipfile.BadZipFile, NotImplementedError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
    try:
        # -P: no module of this folder stands in the way of one of the standard library.
        done = subprocess.run(
            [sys.executable, "-P", __file__, str(path)], capture_output=True, timeout=PATIENCE, check=False
        )
        answer = json.loads(done.stdout) if done.returncode == 0 else "it is damaged"
    except (subprocess.TimeoutExpired, ValueError):
        answer = f"it took more than {PATIENCE:g} s, or gave no cells"
    if isinstance(answer, str):
        what = f"cannot be read as a workbook ({answer}): save it again, or its table as CSV"
        raise FormatError(path, " ".join(what.split()), "byte 0")
    return [Sheet(name, rows) for name, rows in answer]


def _cells(path: str) -> Any:
    """The sheets as plain data, or in words why there are none."""
    import python_calamine

    try:
        book = python_calamine.CalamineWorkbook.from_path(path)
        found, count = [], 0
        for name in book.sheet_names:
            sheet = book.get_sheet_by_name(name)
            count += sheet.total_height * sheet.total_width
            if count > MOST_CELLS:
                return f"it has more than {MOST_CELLS} cells"
            rows = sheet.to_python(skip_empty_area=False)
            found.append((name, [[_plain(cell) for cell in row] for row in rows]))
    except python_calamine.PasswordError:
        return "it is locked by a password"
    except Exception as error:
        return str(error)[:200] or type(error).__name__
    return [(name, rows) for name, rows in found if any(cell != "" for row in rows for cell in row)]


def _plain(cell: Any) -> float | str:
    if isinstance(cell, int | float) and not isinstance(cell, bool):
        return float(cell)
    return cell if isinstance(cell, str) else str(cell)  # a date, a time or a truth is no number


if __name__ == "__main__":
    json.dump(_cells(sys.argv[1]), sys.stdout)
