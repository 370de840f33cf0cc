"""ASTM columns: numbers worked out by hand, a second reading in a few lines, and bad files."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.measured.dataset import make_scan
from samples import astm

GOOD = """MATERIAL blue paint, 2 coats
NUM_POINTS 4
VARS theta_i,phi_i,theta_s,phi_s,R,G,B
0.5235987755982988,0,0.5235987755982988,3.141592653589793,0.11,0.12,0.31
0.5235987755982988,0,0.7853981633974483,-1.5707963267948966,0.05,0.06,-0.001

0.5235987755982988,0,0.7853981633974483,0,0.04,0.05,0.2
1.0471975511965976,0,0,0,0.03,0.04,0.1
"""


def saved(folder: Path, text: str, name: str = "file.astm") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def test_directions_and_values_by_hand(tmp_path):
    scan = read(saved(tmp_path, GOOD))
    green = scan.isel(direction=scan["channel"].values == "G")
    assert green["theta_i"].values.tolist() == [30, 30, 30, 60]
    assert green["theta_r"].values.tolist() == [30, 45, 45, 0]
    assert green["phi"].values.tolist() == [180, 270, 0, 0]  # forward, aside, back towards the light
    assert green["brdf"].values.tolist() == [0.12, 0.06, 0.05, 0.04]
    assert scan["channel"].values.tolist() == ["R"] * 4 + ["G"] * 4 + ["B"] * 4
    assert scan["brdf"].values.min() == -0.001
    assert scan.attrs["provenance"] == "MATERIAL blue paint, 2 coats"
    assert "phi_i" not in scan.coords
    assert scan["brdf"].attrs["units"] == "sr-1"


@pytest.mark.parametrize("name", astm.VARIANTS)
def test_as_a_second_reading_takes_it(name, tmp_path):
    """Rows as numbers, azimuths by difference: what the public readers do with them."""
    names, *rows = astm.VARIANTS[name].replace("\r\n", "\n").partition("VARS ")[2].split("\n")
    names = [n.strip() for n in names.split(",")]
    table = [dict(zip(names, map(float, row.split(",")), strict=True)) for row in rows if row]
    scan = read(saved(tmp_path, astm.VARIANTS[name]))
    columns = names[3:] if "phi_i" not in names else names[4:]
    assert scan.sizes["direction"] == len(table) * len(columns)
    for c, column in enumerate(columns):
        for k, row in enumerate(table):
            at = scan.isel(direction=c * len(table) + k)
            assert at["brdf"].item() == row[column]
            azimuth = row["phi_s"] - row.get("phi_i", 0.0)
            assert math.cos(math.radians(at["phi"].item())) == pytest.approx(math.cos(azimuth), abs=1e-12)
            assert math.sin(math.radians(at["phi"].item())) == pytest.approx(math.sin(azimuth), abs=1e-12)
            assert at["theta_i"].item() == pytest.approx(math.degrees(row["theta_i"]), abs=1e-11)
            assert at["theta_r"].item() == pytest.approx(math.degrees(row["theta_s"]), abs=1e-11)
            if "phi_i" in scan.coords:
                assert at["phi_i"].item() == pytest.approx(math.degrees(row["phi_i"]), abs=1e-11)


def test_names_of_columns(tmp_path):
    def coordinate(columns):
        rows = ",".join(["0.5"] * (4 + len(columns.split(","))))
        scan = read(saved(tmp_path, f"VARS theta_i,phi_i,theta_s,phi_s,{columns}\n{rows}\n"))
        return {n: scan[n].values.tolist() for n in ("wavelength", "channel") if n in scan.coords}

    assert coordinate("450nm,650.5 nm") == {"wavelength": [450, 650.5]}
    assert coordinate("Integrated 380-780") == {}
    assert coordinate("450nm,total") == {"channel": ["450nm", "total"]}
    assert coordinate("luminance") == {"channel": ["luminance"]}


@pytest.mark.parametrize("name", astm.VARIANTS)
def test_round_trip_is_exact(name, tmp_path):
    scan = read(saved(tmp_path, astm.VARIANTS[name]))
    kind = write(scan, tmp_path / "again.astm")
    assert recognise(tmp_path / "again.astm") is kind
    found = read((tmp_path / "again.astm").rename(tmp_path / "again.whatever"))
    xr.testing.assert_equal(found, scan)
    assert found.attrs["provenance"] == scan.attrs["provenance"]


def test_degrees_survive_radians(tmp_path):
    rng = np.random.default_rng(3)
    angles = rng.uniform(0, 90, (2, 500)).round(3)
    phi, phi_i = np.r_[rng.uniform(0, 360, 498).round(3), 0.0, 360.0], rng.uniform(0, 359, 500).round(3)
    values = rng.uniform(0, 1, 500)
    scan = make_scan(*angles, values, phi, phi_i=phi_i, coordinates={"wavelength": np.full(500, 632.8)})
    write(scan, tmp_path / "a.astm")
    xr.testing.assert_equal(read(tmp_path / "a.astm"), scan)


def test_channels_in_any_order_of_rows(tmp_path):
    scan = make_scan(
        [10, 10, 20, 20], [5, 5, 6, 6], [1.0, 2.0, 3.0, 4.0], [0, 0, 90, 90], coordinates={"channel": list("ABBA")}
    )
    write(scan, tmp_path / "a.astm")
    found = read(tmp_path / "a.astm")
    assert found["channel"].values.tolist() == list("AABB")
    assert found["theta_i"].values.tolist() == [10, 20, 10, 20]
    assert found["brdf"].values.tolist() == [1, 4, 2, 3]


def test_what_a_file_cannot_say_is_refused(tmp_path):
    scan = make_scan([10, 20], [5, 6], [1.0, 2.0])
    for given, what in [
        (make_scan([10], [5], [1.0], unit="a.u."), "calibrate"),
        (make_scan([10, 20], [5, 6], [1.0, np.nan]), "gaps"),
        (scan.assign_coords(channel=("direction", ["A", "B"])), "different directions"),
        (scan.assign_coords(channel="a,b"), "no name"),
        (scan.assign_coords(channel="650nm"), "wavelengths: rename"),
        (scan.assign_coords(channel="A", wavelength=500.0), "not both"),
        (scan.assign_coords(mode="transmission"), "of transmission, and ASTM columns of reflection alone"),
    ]:
        with pytest.raises(ValueError, match=what):
            write(given, tmp_path / "a.astm")
    assert not (tmp_path / "a.astm").exists()


def test_a_quarter_circle_rounded_up_is_90_degrees(tmp_path):
    scan = read(saved(tmp_path, "VARS theta_i,theta_s,phi_s,R\n1.5708,0.5,0,1\n"))
    assert scan["theta_i"].values.tolist() == [90]
    assert "rounded up" in scan.attrs["history"]


DEFECTS = [
    ("NUM_POINTS 4", "NUM_POINTS 5", "line 8", "promises 5 rows, and the file has 4"),
    ("NUM_POINTS 4", "NUM_POINTS 4611686018427387904", "line 2", "not a count"),
    ("NUM_POINTS 4", "NUM_POINTS -4", "line 2", "not a count"),
    ("VARS", "VARIABLES", "line 9", "before VARS"),
    (",theta_s", ",theta_o", "line 3", "no theta_s"),
    (",R,G,B", "", "line 3", "no column of values"),
    (",R,G,B", ",R,G,G", "line 3", "one twice"),
    ("0.05,0.06,", "0.05,", "line 5", "6 cells where VARS names 7"),
    ("0.05,0.06", "0.05,nan", "line 5", "G is 'nan'"),
    ("0.05,0.06", "0.05,1e999", "line 5", "G is '1e999'"),
    ("0.05,0.06", "0.05,x", "line 5", "G is 'x'"),
    ("1.0471975511965976", "60", "line 8", "theta_i is 60 rad"),
    ("1.0471975511965976", "-0.1", "line 8", "theta_i is -0.1 rad"),
    ("3.141592653589793", "180", "line 4", "phi_s is 180 rad"),
]


@pytest.mark.parametrize(("old", "new", "where", "what"), DEFECTS, ids=[d[3][:24] for d in DEFECTS])
def test_defects_are_named_with_their_line(old, new, where, what, tmp_path):
    assert old in GOOD
    with pytest.raises(FormatError, match=what) as error:
        formats()["astm"].read(saved(tmp_path, GOOD.replace(old, new, 1)))
    assert error.value.where == where
    assert "\n" not in str(error.value)


def test_no_rows_and_no_light(tmp_path):
    head = "VARS theta_i,theta_s,phi_s,R\n"
    for text, what in [(head, "no rows"), (head + "0,0,0,0\n0,1,0,0\n", "every value is zero"), ("A\n", "before VARS")]:
        with pytest.raises(FormatError, match=what) as error:
            formats()["astm"].read(saved(tmp_path, text))
        assert error.value.where.startswith("line")


def test_found_by_content(tmp_path):
    for line_end in ("\n", "\r\n", "\r"):
        path = saved(tmp_path, ("\ufeff" + GOOD).replace("\n", line_end), "file.txt")
        assert recognise(path).name == "astm"
        assert read(path).sizes["direction"] == 12
    assert formats()["astm"].recognises(b"KEYWORD a\nNUM_POINTS 1255\n")
    for head in (b"theta_i_deg,theta_r_deg,brdf_sr-1\n", b"VARS a,b\n", b"num_points 3\n"):
        assert not formats()["astm"].recognises(head)
