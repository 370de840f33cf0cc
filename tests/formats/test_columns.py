"""Five columns: the real files against their twins, the sense of the angles, round trips, and damage."""

from math import cos, radians, sin

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.measured.dataset import geometry, make_scan, signed_theta_r
from samples.columns import samples

FORMAT = formats()["columns"]
ROW = "10 0 20 180 0.5\n"


@pytest.fixture
def files(shared_scans):
    return shared_scans.parent / "files" / "columns"


def written(tmp_path, text):
    path = tmp_path / "scan.dat"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize(
    ("name", "twin", "digits"),
    [
        ("chassis_brdf", "starlink15_chassis", 0),
        ("solar_array_brdf", "starlink15_solar_array", 0),
        ("merl_aluminium_slice", "merl_aluminium_lumos", 5e-6),  # the twin has six digits, half of the last: 5e-6
    ],
)
def test_real_files_are_their_twins(files, shared_scans, name, twin, digits):
    """Angles with their side of the normal, and values; the twins leave out grazing directions."""
    found, expected = read(files / f"{name}.csv"), read(shared_scans / f"{twin}.csv")
    by_angle = {
        (round(i, 3), round(r, 3)): v
        for i, r, v in zip(found["theta_i"].values, signed_theta_r(found), found["brdf"].values, strict=True)
    }
    angles = zip(expected["theta_i"].values, signed_theta_r(expected), strict=True)
    same = [by_angle[round(i, 3), round(r, 3)] for i, r in angles]
    np.testing.assert_allclose(same, expected["brdf"].values, rtol=digits)
    assert expected.sizes["direction"] > 0.9 * found.sizes["direction"]
    assert recognise(files / f"{name}.csv") is FORMAT


@pytest.mark.parametrize(
    ("comment", "what"),
    [
        ("theta_i theta_r phi wavelength_nm brdf", "names the columns 'theta_i theta_r phi wavelength_nm brdf'"),
        ("rel_azimuth, view_zenith, source_zenith, wavelength_nm, BRF", "names the columns"),
        ("polar_in azimuth_in polar_out azimuth_out BRF", "names the columns"),
        ("theta_i phi_i theta_r phi_r", "names the columns"),
        ("theta_r phi_r theta_i phi_i brdf", "names the columns"),
        ("theta_in [rad], phi_in [rad], theta_out [rad], phi_out [rad], brdf", "speaks of radians"),
        ("angles in radians", "speaks of radians"),
        ("theta phi X Y Z", "names the columns"),
        ("written by pgII", "speaks of pgII"),
    ],
)
def test_a_comment_that_names_other_columns_is_believed(tmp_path, comment, what):
    with pytest.raises(FormatError, match=f"line 1: the comment {what}.*tidy CSV"):
        read(written(tmp_path, f"# {comment}\n{ROW}"))


@pytest.mark.parametrize(
    "comment",
    [
        "polar_in azimuth_in polar_out azimuth_out brdf",
        "phi_i     theta_i     phi_o     theta_o     brdf",
        "theta_in [deg], phi_in [deg], theta_out [deg], phi_out [deg], BSDF [1/sr]",
        "theta_i_deg phi_i_deg theta_s_deg phi_s_deg brdf_sr-1",
        "This file contains the BRDF of a theta stage",
        "BRDF",
    ],
)
def test_a_comment_that_names_these_or_none_is_no_fault(tmp_path, comment):
    assert read(written(tmp_path, f"# {comment}\n{ROW}"))["brdf"].item() == 0.5


def test_a_wavelength_in_the_comments_is_taken_and_said(files):
    scan = read(files / "chassis_brdf.csv")
    assert set(scan["wavelength"].values) == {532.0}
    assert "took the wavelength 532 nm from the comments" in scan.attrs["history"]
    assert scan.attrs["provenance"].startswith("This file contains the BRDF of the chassis\n")
    assert "wavelength" not in read(files / "merl_aluminium_slice.csv").coords


@pytest.mark.parametrize(
    ("comment", "wavelength"),
    [
        ("Wavelength: 1.55 um", 1550.0),
        ("lambda=632.8nm", 632.8),
        ("at 532 nm", None),
        ("lambda = 532 nm, wavelength 633 nm", None),
    ],
)
def test_only_one_named_wavelength_is_taken(tmp_path, comment, wavelength):
    scan = read(written(tmp_path, f"# {comment}\n{ROW}"))
    found = scan["wavelength"].values[0] if "wavelength" in scan.coords else None
    assert found == wavelength
    assert ("which name 2" in scan.attrs["history"]) is ("633" in comment)


def vectors(polar_in, azimuth_in, polar_out, azimuth_out):
    """Unit vectors of one row, by the definition of spherical coordinates: negative polar angles need no rule."""
    return [
        np.array([sin(radians(t)) * cos(radians(p)), sin(radians(t)) * sin(radians(p)), cos(radians(t))])
        for t, p in ((polar_in, azimuth_in), (polar_out, azimuth_out))
    ]


def test_directions_are_the_vectors_of_the_row(tmp_path):
    rng = np.random.default_rng(8)
    rows = rng.uniform([-89, -360, -89, -360], [89, 360, 89, 360], (200, 4))
    text = "".join(" ".join(map(repr, row)) + " 0.5\n" for row in rows.tolist())
    g = geometry(read(written(tmp_path, text)))
    for k, row in enumerate(rows):
        light, view = vectors(*row)
        np.testing.assert_allclose([g.x_i[k], g.y_i[k], g.z_i[k]], light, atol=1e-13)  # rounding of azimuths in degrees
        np.testing.assert_allclose([g.x_r[k], g.y_r[k], g.z_r[k]], view, atol=1e-13)


@pytest.mark.parametrize("path", ["in_plane", "all_round", "turned"])
def test_a_file_written_again_is_read_as_before(tmp_path, path):
    scan = read(next(p for p in samples(tmp_path) if p.stem == path))
    again = tmp_path / "again.dat"
    write(scan, again)
    found = read(again)
    xr.testing.assert_equal(found.drop_vars("line"), scan.drop_vars("line"))
    assert found.attrs["provenance"].startswith(scan.attrs["provenance"])
    assert recognise(again) is FORMAT


def test_in_plane_scans_come_back_exactly_also_at_the_normal(tmp_path):
    scan = make_scan([10, 10, 10, 10], [0, 0, 5.5, 5.5], [0.1, np.nan, 1 / 3, 2e-7], [0, 180, 0, 180])
    scan = scan.assign_coords(wavelength=("direction", np.full(4, 632.8), {"units": "nm"}))
    path = tmp_path / "scan.dat"
    write(scan, path)
    found = read(path)
    xr.testing.assert_equal(found.drop_vars("line"), scan)
    assert "# wavelength = 632.8 nm\n" in path.read_text()


def test_lumos_reads_what_is_written(tmp_path):
    """lumos.brdf.tools.read_brdf is numpy's loadtxt without the first line."""
    scan = make_scan([10, 30], [-5, 45], [0.25, 0.5])
    path = tmp_path / "scan.dat"
    write(scan, path)
    table = np.loadtxt(path, skiprows=1)
    np.testing.assert_array_equal(table, [[10, 180, -5, 0, 0.25], [30, 180, 45, 0, 0.5]])


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("# only a remark\n" + ROW + "10 0 20 180\n", "line 3", "has 4 numbers, not 5: polar_in"),
        (ROW + "10,0 0,0 20,0 180,0 0,5\n", "line 2", "write decimal points, not commas"),
        (ROW + "10 0 20 180 1e999\n", "line 2", "brdf is '1e999', not a finite number"),
        (ROW + "10 0 20 180 1_0\n", "line 2", "brdf is '1_0', not a finite number"),
        (ROW + "10 nan 20 180 1\n", "line 2", "azimuth_in is 'nan', not a finite number"),
        (ROW + "10 0 -90.5 180 1\n", "line 2", "polar_out is -90.5 deg, outside -90 to 90"),
        (ROW + "10 0 20 1e7 1\n", "line 2", "azimuth_out is 1e\\+07 deg"),
        (ROW + "10 0 20 180 0.5x\n", "line 2", "brdf is '0.5x', not a finite number"),
        ("10 0 20 180 0\n10 0 30 180 nan\n", "line 1", "every brdf value is zero or missing"),
        (ROW + "10 0 20\0 180 0.5\n", "line 2", "zero bytes"),
    ],
)
def test_damage_is_named_with_its_line(tmp_path, text, where, what):
    with pytest.raises(FormatError, match=what) as error:
        read(written(tmp_path, text))
    assert error.value.where == where


def test_a_file_of_remarks_has_no_rows(tmp_path):
    with pytest.raises(FormatError, match="holds no rows of numbers") as error:
        FORMAT.read(written(tmp_path, "# nothing\n"))
    assert error.value.where == "line 1"


@pytest.mark.parametrize(
    ("head", "is_one"),
    [
        (b"\xef\xbb\xbf# a remark\r\n\r\n10,0,20,180,0.5\r\n", True),
        (b"# a remark\r10 0 20 180 0.5 # more", True),
        (b"10 0 20 180\n", False),
        (b"theta_i_deg,theta_r_deg,brdf_sr-1,a,b\n", False),
        (b"#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n1 2 3 4 5\n", False),
        (b"# nothing\n", False),
    ],
)
def test_recognised_by_the_first_row(head, is_one):
    assert FORMAT.recognises(head) is is_one


@pytest.mark.parametrize(
    ("scan", "what"),
    [
        (make_scan([10], [5], [0.1], unit="a.u."), "calibrate the scan first"),
        (make_scan([10, 10], [5, 5], [0.1, 0.2], coordinates={"channel": ["R", "G"]}), "select one channel"),
    ],
)
def test_what_cannot_be_written_is_refused_with_a_remedy(tmp_path, scan, what):
    with pytest.raises(ValueError, match=what):
        write(scan, tmp_path / "out.dat")
