"""Workbooks of the RT-300S and the cells of Excel 97: against another reader, by hand, and damaged."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read
from gonio.door.workbook import sheets
from gonio.files import FormatError
from gonio.formats import recognise
from gonio.formats.rt300s.sheet import FORMAT, direction
from gonio.measured.check import Severity, check
from places import FILES
from samples.rt300s import COLUMNS, LABELS, samples, workbook

REAL = sorted((FILES / "rt300s").glob("*.xls")) or [
    pytest.param(None, marks=pytest.mark.skip(reason=f"no measured files at {FILES}"))
]


def saved(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "sheet.anything"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("azimuth", "receive", "theta_r", "phi"),
    [(-90, 30, 30, 180), (-90, -30, 30, 0), (90, -30, 30, 180), (90, 30, 30, 0), (0, 30, 30, 90), (0, -30, 30, 270)],
)
def test_the_azimuth_turns_the_plane_of_the_receiver(azimuth, receive, theta_r, phi):
    """At -90 deg positive receive angles are forward; (A, R) and (-A, -R) mirror each other (krell2026)."""
    assert [float(a) for a in direction(azimuth, receive)] == [theta_r, phi]


def test_a_workbook_by_hand(tmp_path):
    scan = read(samples(tmp_path)[0])
    assert scan["theta_i"].values.tolist() == [10, 10, 10, 30]
    assert scan["theta_r"].values.tolist() == [80, 0, 10, 45]
    assert scan["phi"].values.tolist() == [0, 180, 180, 90]
    assert scan["rt"].values.tolist() == [0.0125, 0.25, 0.5, 0.3]
    cosines = np.cos(np.radians([80, 0, 10, 45]))
    np.testing.assert_allclose(scan["brdf"], np.array([0.0125, 0.25, 0.5, 0.3]) / math.pi / cosines, rtol=1e-15)
    assert scan["brdf"].attrs["units"] == "sr-1"
    assert scan.attrs["provenance"].splitlines() == ["instrument: J&C RT-300S", "method: BRDF_LD", "date: 2009-07-06"]
    assert "pi cos(theta_r); no blank is subtracted" in scan.attrs["history"]


@pytest.mark.parametrize("path", REAL, ids=lambda p: p.stem if p else "absent")
def test_every_cell_is_what_another_reader_finds(path):
    """python-calamine on files that are whole; on damaged ones it ends the process, so nothing is read with it."""
    import python_calamine

    book = python_calamine.CalamineWorkbook.from_path(path)
    found = sheets(path)
    assert list(found) == book.sheet_names
    compared = 0
    for name in book.sheet_names:
        rows = enumerate(book.get_sheet_by_name(name).to_python())
        theirs = {
            (r, c): v
            for r, row in rows
            for c, v in enumerate(row)
            if isinstance(v, float) or (v and isinstance(v, str))
        }
        ours = {place: cell.value for place, cell in found[name].items() if place in theirs}
        assert ours == theirs
        compared += len(theirs)
    assert compared > 5_000


@pytest.mark.parametrize("path", REAL, ids=lambda p: p.stem if p else "absent")
def test_real_workbooks(path):
    assert recognise(path) is FORMAT
    scan = read(path)
    assert scan.sizes["direction"] == (644 if "aeroglaze" in path.name or "final" in path.name else 19 * 4 * 33)
    assert sorted(set(scan["theta_i"].values)) == [10, 30, 50, 70]
    assert "method: BRDF_LD" in scan.attrs["provenance"]
    assert not [f for f in check(scan) if f.severity is Severity.ERROR]


def test_every_truncation_and_every_changed_byte_is_read_or_refused_with_a_byte(tmp_path):
    whole = workbook([COLUMNS[:2], COLUMNS[2:]])
    ends = [whole[:end] for end in range(1, len(whole), 211)]
    used = [*range(24, 80), *range(512, 560, 3), *range(1024, 1300, 5), *range(1536, 2400, 17)]
    changed = [whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :] for at in used for flip in (0xFF,)]
    refused = sum(_refused(saved(tmp_path, content)) for content in [*ends, *changed])
    assert refused > len(ends) / 2


def _refused(path: Path) -> bool:
    """Whether a file is refused, with a byte that it has; what is read must be sound."""
    try:
        scan = FORMAT.read(path)
    except FormatError as error:
        place, at = error.where.split()
        if place != "byte" or not 0 <= int(at) <= path.stat().st_size:
            raise AssertionError(f"{error} names no byte of the file") from error
        return True
    assert np.isfinite(scan["brdf"].values).all()
    assert ((scan["theta_r"].values >= 0) & (scan["theta_r"].values < 90)).all()
    return False


def patched(old: bytes, new: bytes) -> bytes:
    whole = workbook([COLUMNS[:2], COLUMNS[2:]])
    assert whole.count(old) >= 1
    return whole.replace(old, new, 1)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (lambda: patched(struct.pack("<d", 0.25), struct.pack("<d", math.nan)), "rt of column 3 in 'Sheet1' is nan"),
        (lambda: patched(struct.pack("<d", -80.0), struct.pack("<d", -90.0)), "receive of column 2 .* outside -89.99"),
        (lambda: patched(b" Receive", b" Deceive"), "no sheet has rows Azimuth, Incidence, Receive and RT"),
        (lambda: patched(b"BRDF_LD", b"BTDF_LD"), "the method is 'BTDF_LD'"),
        (lambda: patched(struct.pack("<HHHd", 5, 2, 0, 0.25), struct.pack("<HHHd", 6, 2, 0, 0.25)), "rt of column 3"),
        (lambda: patched(struct.pack("<HH", 0x0809, 16) + b"\0\6", struct.pack("<HH", 0x0809, 16) + b"\0\5"), "older"),
        (lambda: patched(b"\xd0\xcf\x11\xe0", b"\xd0\xcf\x11\xe1"), "no compound file"),
        (lambda: patched("Workbook".encode("utf-16-le"), "Wordbook".encode("utf-16-le")), "no Excel workbook"),
        (lambda: workbook([COLUMNS[:2], COLUMNS[2:]])[:-600], "leaves the file"),
    ],
)
def test_errors_say_what_and_where(tmp_path, content, what):
    with pytest.raises(FormatError, match=what) as error:
        FORMAT.read(saved(tmp_path, content()))
    assert error.value.where.startswith("byte ")


def test_an_error_names_the_byte_of_its_cell(tmp_path):
    content = patched(struct.pack("<d", 0.25), struct.pack("<d", math.inf))
    with pytest.raises(FormatError) as error:
        FORMAT.read(saved(tmp_path, content))
    at = int(error.value.where.removeprefix("byte "))
    assert content[at : at + 10] == struct.pack("<HHHHH", 0x0203, 14, 5, 2, 0)


def test_all_zero_is_read_and_flagged(tmp_path):
    scan = read(saved(tmp_path, workbook([[(-90.0, 10.0, 20.0, 0.0), (-90.0, 30.0, 20.0, 0.0)]])))
    assert "every value is zero" in scan.attrs["history"]
    assert any("zero" in f.what for f in check(scan) if f.severity is Severity.ERROR)


def test_texts_that_go_on_in_another_record_are_joined(tmp_path):
    """The shared texts are cut within ' Incidence', and go on with two bytes a character."""
    whole = workbook([COLUMNS[:2]])
    start = whole.index(
        struct.pack("<H", 0x00FC) + struct.pack("<H", 8 + sum(3 + len(t) for t in (*LABELS, "BRDF_LD")))
    )
    length = struct.unpack_from("<H", whole, start + 2)[0]
    body = whole[start + 4 : start + 4 + length]
    cut = body.index(b"Incidence") + 4
    rest = body[cut:]
    tail = b"\1" + rest[:5].decode().encode("utf-16-le") + rest[5:]
    again = struct.pack("<HH", 0xFC, cut) + body[:cut] + struct.pack("<HH", 0x3C, len(tail)) + tail
    grown = len(again) - length - 4
    old = whole[:start] + again + whole[start + 4 + length :]
    for at in (old.index(struct.pack("<H", 0x0085)) + 4,):  # the sheet lies further on by what was put in
        old = old[:at] + struct.pack("<I", struct.unpack_from("<I", old, at)[0] + grown) + old[at + 4 :]
    scan = FORMAT.read(saved(tmp_path, old[: len(whole)]))
    xr.testing.assert_equal(scan, FORMAT.read(saved(tmp_path, whole)))
