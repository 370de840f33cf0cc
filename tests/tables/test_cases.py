"""The tables from the field beside the project: one scan in seventeen layouts, read with at most the flags allowed."""

import numpy as np
import pytest

from gonio import read, read_table, write
from gonio.files import FormatError
from gonio.measured.dataset import signed_theta_r

# The flags that the README of the tables allows; where several ways are allowed, each of them.
NONE: dict[str, object] = {}
FLAGS = {
    "01_semicolon_decimal_comma.csv": [NONE],
    "02_aoi_aos_bsdf.csv": [NONE, {"columns": {"AOI": "theta_i", "AOS": "theta_r", "BSDF": "brdf"}}],
    "03_matrix_detector_rows.csv": [NONE, {"layout": "matrix"}],
    "04_matrix_incidence_rows_semicolon.csv": [NONE, {"layout": "matrix", "rows": "theta_i"}],
    "05_tabs_units_in_brackets.tsv": [NONE],
    "06_bom_title_comment.csv": [NONE],
    "07_radians_elevation.csv": [
        NONE,
        {"columns": "elev_in_rad=elevation_i:rad,elev_out_rad=elevation_r:rad,azimuth_rad=phi:rad"},
    ],
    "08_ccbrdf.csv": [NONE, {"quantity": "ccbrdf"}, {"quantity": "ccbsdf"}],
    "09_reflectance_factor_percent.csv": [NONE, {"quantity": "reflectance-factor:percent"}, {"quantity": "percent"}],
    "10_log10.csv": [NONE, {"quantity": "log10-brdf"}],
    "11_from_specular.csv": [NONE, {"columns": {"angle_from_specular": "specular_offset"}}],
    "12_backscatter_positive.csv": [{"flip": True}],
    "13_blocks.txt": [NONE, {"layout": "blocks"}],
    "14_wide_wavelengths.csv": [NONE, {"values": "*nm"}],
    "15_micrometres_radiant_intensity.csv": [NONE, {"quantity": "radiant-intensity"}],
    "16_workbook.xlsx": [NONE],
    "17_sheet_per_incidence.xlsx": [NONE, {"layout": "sheets"}],
}
DIGITS = 5e-6  # of the tables with the fewest digits, relative: 3.88489 percent


def table(scan):
    rows = np.column_stack([scan["theta_i"].values, signed_theta_r(scan), scan["brdf"].values])
    return rows[np.lexsort(rows[:, 1::-1].T)]


@pytest.fixture
def tables(shared_cases):
    return shared_cases.parent / "tables"


@pytest.mark.parametrize(("name", "flags"), [(n, f) for n, ways in FLAGS.items() for f in ways])
def test_every_layout_is_the_one_scan(tables, tmp_path, name, flags):
    expected = read(tables / "expected.csv")
    scan = read_table(tables / name, **flags)
    if name.startswith("14"):
        assert set(scan["wavelength"].values.tolist()) == {450, 550, 650}
        scan = scan.isel(direction=np.flatnonzero(scan["wavelength"].values == 650))
    np.testing.assert_allclose(table(scan), table(expected), rtol=DIGITS, atol=1e-9)
    assert scan["brdf"].attrs["units"] == "sr-1"
    if name.startswith(("05", "16")):
        np.testing.assert_allclose(scan["uncertainty"].values, expected["uncertainty"].values, rtol=1e-12)
    assert "theta_i: " in scan.attrs["history"] or "elevation_i: " in scan.attrs["history"]
    write(scan, tmp_path / "scan.csv")
    np.testing.assert_allclose(table(read(tmp_path / "scan.csv")), table(scan), rtol=1e-12)


def test_a_lobe_on_the_source_side_is_warned_of(tables):
    from gonio.tables.read import understood
    from gonio.tables.request import request

    path = tables / "12_backscatter_positive.csv"
    (warning,) = understood(path, request()).warnings
    assert "--flip" in warning
    assert understood(path, request(flip=True)).warnings == []


# What `gonio read` takes as it is, because the headings state all; every other is refused with the command.
STATED = ("05", "06", "08", "10", "12", "15")


@pytest.mark.parametrize("name", FLAGS)
def test_read_takes_what_is_stated_and_shows_the_command_for_the_rest(tables, name):
    path = tables / name
    if name.startswith(STATED):
        expected = read_table(path)
        np.testing.assert_array_equal(table(read(path)), table(expected))
        return
    with pytest.raises(FormatError) as caught:
        read(path)
    assert f"gonio import {path} --out scan.csv" in str(caught.value)
