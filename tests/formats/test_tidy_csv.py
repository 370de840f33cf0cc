"""Tidy CSV: what is read, and every way in which a file can be wrong."""

import numpy as np
import pytest

from gonio import read, write
from gonio.door.text import LONGEST_LINE
from gonio.files import FormatError

GOOD = "# material: test\ntheta_i_deg,theta_r_deg,brdf_sr-1\n30,-10,0.5\n30,20,0.7\n"


def written(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "scan.csv"
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return path


def test_signed_angle_becomes_an_azimuth(tmp_path):
    scan = read(written(tmp_path, GOOD))
    np.testing.assert_array_equal(scan["theta_r"], [10, 20])
    np.testing.assert_array_equal(scan["phi"], [0, 180])
    assert scan.attrs["provenance"] == "material: test"


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + GOOD,
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("\n", "\r"),
        GOOD.replace("test\n", "test\r\n").replace("0.5\n", "0.5\r"),
        GOOD.replace("30,20", "\n# a remark\n30 , 20"),
        "theta_r_rad,brdf_sr-1,theta_i_rad\n-0.17453292519943295,0.5,0.5235987755982988\n0.3490658503988659,0.7,0.5235987755982988\n",
        "theta_i_deg,theta_r_deg,phi_deg,brdf_sr-1\n30,10,0,0.5\n30,20,180,0.7\n",
    ],
    ids=["bom", "windows", "carriage-returns", "mixed", "blank-and-remark", "radians", "azimuth"],
)
def test_the_same_scan_in_other_words(tmp_path, text):
    found, expected = read(written(tmp_path, text)), read(written(tmp_path, GOOD))
    for name in ("theta_i", "theta_r", "phi", "brdf"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-14)


def test_units_and_aliases(tmp_path):
    text = "theta_i_deg,theta_r_deg,wavelength_um,brdf_a.u.,std_a.u.,note\n30,10,0.633,5,0.1,first\n"
    scan = read(written(tmp_path, text))
    assert scan["wavelength"].values[0] == pytest.approx(633)
    assert scan["brdf"].attrs["units"] == scan["uncertainty"].attrs["units"] == "a.u."
    assert scan["note"].values[0] == "first"


ROUND = "30,0,20,0,0.1\n30,90,30,135,0.2\n30,350,40,80,0.3\n"


@pytest.mark.parametrize("name", ["phi_r_deg", "azimuth_deg", "phi_o_deg", "PHI_S_deg", "view_azimuth_deg"])
def test_the_azimuth_of_the_detector_becomes_that_from_the_source(tmp_path, name):
    scan = read(written(tmp_path, f"theta_i_deg,phi_i_deg,theta_r_deg,{name},brdf_sr-1\n{ROUND}"))
    assert scan["phi"].values.tolist() == [0, 45, 90]
    assert scan["phi_i"].values.tolist() == [0, 90, 350]
    assert "took phi as the azimuth of the detector less phi_i" in scan.attrs["history"]


@pytest.mark.parametrize("name", ["dphi_deg", "delta_phi_deg", "relative_azimuth_deg", "rel_azimuth_deg"])
def test_an_azimuth_from_the_source_is_taken_as_it_is(tmp_path, name):
    scan = read(
        written(tmp_path, f"aoi_deg,view_zenith_deg,{name},bsdf_sr-1,u_sr-1,polarization\n30,20,45,0.1,0.01,s\n")
    )
    assert (scan["theta_i"].item(), scan["theta_r"].item(), scan["phi"].item()) == (30, 20, 45)
    assert scan["uncertainty"].item() == 0.01
    assert scan["polarisation"].item() == "s"


def test_a_detector_alone_has_the_source_at_azimuth_zero(tmp_path):
    scan = read(written(tmp_path, "theta_i_deg,theta_r_deg,azimuth_deg,brdf_sr-1\n30,20,-90,0.1\n"))
    assert scan["phi"].item() == 270
    assert "azimuth of the source, 0" in scan.attrs["history"]


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("phy_deg", "phi_deg"),
        ("azimuht_rad", "phi_r_rad"),
        ("wavelenght_nm", "wavelength_nm"),
        ("theta_rr_deg", "theta_r_deg"),
    ],
)
def test_an_angle_or_a_length_that_is_not_understood_is_refused_with_the_nearest_name(tmp_path, name, nearest):
    with pytest.raises(
        FormatError, match=f"line 1: column '{name}' is not understood, the nearest is {nearest}: rename"
    ):
        read(written(tmp_path, f"theta_i_deg,theta_r_deg,{name},brdf_sr-1\n30,20,45,0.1\n"))


def test_a_further_column_in_degrees_is_kept_where_the_file_says_so(tmp_path):
    text = "# further columns: tilt_deg\ntheta_i_deg,theta_r_deg,tilt_deg,brdf_sr-1\n30,20,4.5,0.1\n"
    scan = read(written(tmp_path, text))
    assert (scan["tilt"].item(), scan["tilt"].attrs["units"]) == (4.5, "degree")
    write(scan, tmp_path / "again.csv")
    assert "# further columns: tilt_deg\n" in (tmp_path / "again.csv").read_text()
    assert read(tmp_path / "again.csv")["tilt"].item() == 4.5


def test_two_names_of_one_column_are_refused(tmp_path):
    for names in ("phi_r_deg,phi_deg", "dphi_deg,phi_deg"):
        with pytest.raises(FormatError, match="keep one"):
            read(written(tmp_path, f"theta_i_deg,theta_r_deg,{names},brdf_sr-1\n30,20,4,5,0.1\n"))


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("angle,value\n1,2\n", "line 1", "no column theta_i and theta_r and brdf"),
        ("theta_i;theta_r;brdf\n30;10;1\n", "line 1", "commas, not semicolons"),
        ("theta_i,theta_r_deg,brdf_sr-1\n30,10,1\n", "line 1", "names no unit: write theta_i_deg or theta_i_rad"),
        ("theta_i_grad,theta_r_deg,brdf_sr-1\n30,10,1\n", "line 1", "unit 'grad'"),
        ("theta_i_deg,theta_r_deg,brdf\n30,10,1\n", "line 1", "brdf_sr-1 or brdf_a.u."),
        ("theta_i_deg,theta_i_rad,theta_r_deg,brdf_sr-1\n", "line 1", "occurs twice"),
        ("theta_i_deg,theta_r_deg,brdf_sr-1,std_a.u.\n", "line 1", "one unit for both"),
        (GOOD + "30,30,bright\n", "line 5", "brdf is 'bright', not a number"),
        (GOOD + "30,30,0,5\n", "line 5", "4 cells where the header has 3"),
        (GOOD + "95,30,1\n", "line 5", "theta_i is 95 deg, outside 0 to 90"),
        (GOOD + "30,-91,1\n", "line 5", "theta_r is -91 deg, outside -90 to 90"),
        (GOOD + "30,nan,1\n", "line 5", "theta_r is nan"),
        (GOOD + "30,,1\n", "line 5", "theta_r is empty"),
        (GOOD + "30,30,inf\n", "line 5", "brdf is inf"),
        (GOOD + "30,30,1_0\n", "line 5", "brdf is '1_0', not a number"),
        ("theta_i_deg,theta_r_deg,wavelength_nm,brdf_sr-1\n30,10,-5,1\n", "line 2", "wavelength is -5 nm"),
        ("theta_i_deg,theta_r_deg,mask,brdf_sr-1\n30,10,300,1\n", "line 2", "mask is 300, outside 0 to 127"),
        (GOOD + "30,x,1\n30,y,1\n", "line 5", "line 6: theta_r is 'y'"),
        (GOOD + "30,x,1\n" * 8, "line 5", "and 3 more bad rows"),
        (GOOD + "30,x,1\n" * 2000, "line 5", "at least; and 995 more bad rows"),
        ("theta_i_deg,theta_r_deg,brdf_sr-1\n30,10,0\n30,20,0\n", "line 2", "every brdf value is zero"),
        ("theta_i_deg,theta_r_deg,brdf_sr-1\n", "line 1", "a header and no rows"),
        ("# only remarks\n# and more\n", "line 2", "holds no header"),
        (b"theta_i_deg,theta_r_deg,brdf_sr-1\n# stra\xdfe\n", "line 2, byte 7", "save the file as UTF-8"),
        (b"PK\x03\x04\0\0", "byte 0", "is a ZIP archive"),
        (b"theta_i_deg\0", "line 1", "zero bytes"),
        ("x" * (LONGEST_LINE + 10), "line 1", "longer than 65536 bytes"),
    ],
)
def test_bad_files_name_file_line_and_remedy(tmp_path, text, where, what):
    path = written(tmp_path, text)
    with pytest.raises(FormatError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith(f"{path}, {where}: " if where else f"{path}: ")
    assert what in message
    assert "\n" not in message


def test_no_file_a_directory_an_empty_file(tmp_path):
    with pytest.raises(FormatError, match="no such file"):
        read(tmp_path / "missing.csv")
    with pytest.raises(FormatError, match="is a directory"):
        read(tmp_path)
    with pytest.raises(FormatError, match="is empty"):
        read(written(tmp_path, ""))


@pytest.mark.parametrize("filler", [b"\0", b"a", b"1\n", b"\xff"], ids=["zeros", "letters", "numbers", "bytes"])
def test_two_gigabytes_of_garbage_are_refused_at_once(tmp_path, filler):
    """A sparse file of 2 GB: the reader stops at the first thing that is no scan, long before it has read it all."""
    path = tmp_path / "garbage.csv"
    with path.open("wb") as file:
        file.write(filler * 100_000)
        file.truncate(2 * 1024**3)
    with pytest.raises(FormatError, match="line 1"):
        read(path)


def test_a_dataset_that_could_not_be_read_again_is_not_written(tmp_path):
    """As somebody makes one by hand: without units of the coordinates, without phi, without a unit of the BRDF."""
    scan = read(written(tmp_path, GOOD))
    cases = {
        "theta_i does not say its unit: give degrees": scan.assign_coords(theta_i=("direction", [30.0, 30.0])),
        "has no phi: a scan needs": scan.drop_vars("phi"),
        "theta_r is in 'radian'": scan.assign_coords(theta_r=("direction", [0.1, 0.2], {"units": "radian"})),
        "the BRDF's unit is None": scan.assign(brdf=("direction", [0.1, 0.2])),
    }
    for message, case in cases.items():
        for name in ("again.csv", "again.nc", "again.zarr"):
            with pytest.raises(ValueError, match=message):
                write(case, tmp_path / name)
            assert not (tmp_path / name).exists()


@pytest.mark.parametrize("name", [" R", "R ", "R\nG", "R\0G", "R\rG"])
def test_a_name_that_would_read_as_another_is_not_written(tmp_path, name):
    scan = read(written(tmp_path, GOOD)).assign_coords(channel=("direction", np.array(["R", name])))
    with pytest.raises(ValueError, match="cannot be a cell of a CSV file"):
        write(scan, tmp_path / "again.csv")
    assert not (tmp_path / "again.csv").exists()
