"""FRED's tables: angles, both kinds of angles and values, the layouts of rows, and every error's place."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read
from gonio.files import FormatError
from gonio.formats import recognise
from gonio.formats.fred import FORMAT
from gonio.measured.check import Severity, check
from gonio.measured.dataset import make_scan
from places import FILES
from samples.fred import AROUND, COSINES, IN_PLANE, samples

REAL = sorted((FILES / "fred").glob("*.txt")) or [
    pytest.param(None, marks=pytest.mark.skip(reason=f"no measured files at {FILES}"))
]


def saved(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "table.anything"
    path.write_bytes(text.encode(encoding))
    return path


def rewritten(scan: xr.Dataset, path: Path) -> xr.Dataset:
    assert FORMAT.write is not None
    FORMAT.write(scan, path)
    return FORMAT.read(path)


def columns(scan: xr.Dataset) -> list[tuple[float, ...]]:
    return list(zip(*(scan[n].values.tolist() for n in ("theta_i", "theta_r", "phi", "brdf")), strict=True))


def test_azimuth_zero_is_forward(tmp_path):
    scan = read(saved(tmp_path, AROUND))
    assert columns(scan) == [
        (10, 0, 180, 0.031984),
        (10, 5, 180, 0.034271),
        (10, 5, 10, 0.033),
        (50, 0, 180, 0.0119),
        (50, 60, 190, 0.5),
    ]
    assert scan["brdf"].attrs["units"] == "sr-1"
    assert scan.attrs["symmetry"] == "isotropic"
    assert scan["line"].values.tolist() == [4, 5, 6, 8, 9]


def test_negative_angles_are_the_other_side_and_the_scale_multiplies(tmp_path):
    scan = read(saved(tmp_path, IN_PLANE))
    assert columns(scan) == [
        (0, 30, 0, 0.0006),
        (0, 0, 180, 0.2),
        (0, 30, 180, 0.0006),
        (15, 30, 0, 0.0008),
        (15, 15, 180, 0.4),
    ]
    assert "scale, 2.0" in scan.attrs["history"]


def test_direction_cosines_and_logarithms(tmp_path):
    scan = read(saved(tmp_path, COSINES))
    np.testing.assert_allclose(scan["theta_i"], 30, rtol=1e-14)
    np.testing.assert_allclose(scan["theta_r"], np.degrees(np.arcsin([0.5, 0.6, 0.8])), rtol=1e-14)
    assert scan["phi"].values.tolist() == [180, 90, 0]
    np.testing.assert_allclose(scan["brdf"], [0.1, 0.01, 0.001], rtol=1e-14)
    assert "direction cosines" in scan.attrs["history"]
    assert "10 to the power" in scan.attrs["history"]


def test_azimuths_are_those_from_the_specular_direction(tmp_path):
    scan = read(saved(tmp_path, AROUND.replace("50\t0\n", "50\t30\n").replace("60\t350", "60\t20")))
    assert scan["phi"].values[-1] == 190
    assert scan["phi_i"].values.tolist() == [180, 180, 180, 150, 150]


@pytest.mark.parametrize("path", REAL, ids=lambda p: p.stem if p else "absent")
def test_real_files(path, tmp_path):
    scan = read(path)
    assert recognise(path) is FORMAT
    rows = [line.split() for line in path.read_text().splitlines()[2:]]
    assert scan["brdf"].values.tolist() == [float(row[2]) for row in rows if len(row) == 3]
    assert sorted(set(scan["theta_i"].values)) == [10, 30, 50, 70]
    assert not [f for f in check(scan) if f.severity is Severity.ERROR]
    # read again after writing: all but the places and the name of the file
    again = rewritten(scan, tmp_path / "again.txt")
    xr.testing.assert_equal(again, scan)


def test_samples_are_written_as_they_are_read(tmp_path):
    for path in samples(tmp_path):
        scan = FORMAT.read(path)
        xr.testing.assert_equal(rewritten(scan, tmp_path / "again").drop_vars("line"), scan.drop_vars("line"))


def test_azimuths_of_any_digits_survive(tmp_path):
    phi = [0.0, 0.1, 59.0625, 90.3, 123.4567, 180.0, 180.7, 271.15, 359.9]
    scan = make_scan([12.3] * 9, np.linspace(0.1, 89.9, 9), 1 / np.arange(1.0, 10), phi)
    xr.testing.assert_equal(rewritten(scan, tmp_path / "x.txt").drop_vars("line"), scan)


def test_line_ends_commas_and_bom(tmp_path):
    plain = FORMAT.read(saved(tmp_path, AROUND))
    for text in (AROUND.replace("\n", "\r\n"), AROUND.replace("\n", "\r"), AROUND.replace("\t", ",")):
        xr.testing.assert_equal(read(saved(tmp_path, text, "utf-8-sig")), plain)


def test_all_zero_is_read_and_flagged(tmp_path):
    scan = read(saved(tmp_path, "type bsdf_data\nformat\n10 0\n5 0 0\n6 0 0\n"))
    assert "every value is zero" in scan.attrs["history"]
    assert any("zero" in f.what for f in check(scan) if f.severity is Severity.ERROR)


@pytest.mark.parametrize(
    ("old", "new", "place", "what"),
    [
        ("type bsdf_data", "type psd_data", "line 1", "where 'type bsdf_data' was expected"),
        ("format angles", "angles", "line 2", "where a line like"),
        ("angles=deg", "angles=rad", "line 2", "'angles=rad' is none of"),
        ("scale=1", "scale=0", "line 2", "not positive"),
        ("scale=1", "scale=nan", "line 2", "the scale is 'nan'"),
        ("10\t0\n", "", "line 3", "before any specular direction"),
        ("10\t0\n", "91\t0\n", "line 3", "specular direction is outside"),
        ("5\t170\t0.033", "95\t170\t0.033", "line 6", "scattered direction is outside"),
        ("5\t170\t0.033", "5\t720\t0.033", "line 6", "azimuth"),
        ("5\t170\t0.033", "5\t170\t0.033\t1", "line 6", "4 numbers where a row has 2"),
        ("5\t170\t0.033", "5\t170\t1e999", "line 6", "not a finite number"),
        ("5\t170\t0.033", "5\t170\t3_3", "line 6", "not a finite number"),
        ("5\t170\t0.033", "5\t170\tx", "line 6", "'x'"),
        ("bsdf=value", "bsdf=log", "line 6", "beyond the largest number"),
        ("angles=deg", "angles=sin", "line 3", "direction cosines of a specular direction"),
    ],
)
def test_errors_name_their_line(tmp_path, old, new, place, what):
    text = AROUND.replace("0.033\n", "400\n") if "log" in new else AROUND
    assert old in text
    with pytest.raises(FormatError) as error:
        FORMAT.read(saved(tmp_path, text.replace(old, new, 1)))
    assert error.value.where == place
    assert what in error.value.what


@pytest.mark.parametrize("text", ["type bsdf_data\n", "type bsdf_data\nformat\n", "type bsdf_data\nformat\n10 0\n", ""])
def test_a_file_that_ends_early_is_refused(tmp_path, text):
    with pytest.raises(FormatError) as error:
        FORMAT.read(saved(tmp_path, text))
    assert error.value.where.startswith("line ")


@pytest.mark.parametrize("value", [0.0, -0.1, np.nan])
def test_values_that_are_not_positive_are_not_written(tmp_path, value):
    with pytest.raises(ValueError, match="1 values are missing, zero or negative, and FRED takes positive ones only"):
        rewritten(make_scan([10, 10], [0, 5], [0.1, value]), tmp_path / "x.txt")


def test_what_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(ValueError, match="calibrate"):
        rewritten(make_scan([10], [0], [0.1], unit="a.u."), tmp_path / "x.txt")
    with pytest.raises(ValueError, match="isotropic"):
        rewritten(make_scan([10, 10], [0, 0], [0.1, 0.2], phi_i=[0, 90]), tmp_path / "x.txt")
    with pytest.raises(ValueError, match="no values"):
        rewritten(make_scan([], [], []), tmp_path / "x.txt")
