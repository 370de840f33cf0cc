"""Reflet exports: the two forms of one measurement against each other, and their own numbers read off the page."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio.files import FormatError
from gonio.formats import formats, read, recognise
from gonio.measured import check
from samples.reflet import RTD, TEXT, samples

FORMAT = formats()["reflet"]
ROOT3 = math.sqrt(3) / 2  # the cosine of 30 deg


@pytest.fixture
def real(shared_files: list[Path]) -> tuple[Path, Path]:
    by_name = {path.name: path for path in shared_files}
    return by_name["test_lighttools.txt"], by_name["test_speos.rtd"]


def at(scan: xr.Dataset, /, **where: object) -> list[float]:
    rows = np.logical_and.reduce([scan[name].values == value for name, value in where.items()])
    return scan["brdf"].values[rows].tolist()


def test_the_files_of_the_instrument(real):
    """Numbers as they stand in the text: rows of theta -30, 0 and 30, columns of azimuths -90 and -80."""
    scan = read(real[0])
    assert scan.sizes["direction"] == 4 * 6
    assert scan["brdf"].attrs["units"] == "a.u."
    first = {"scan": "1"}
    assert not any(at(scan, **first))  # its first two blocks are zeros, at 0 and 60 deg
    assert set(scan["theta_i"].values[scan["scan"].values == "1"]) == {0, 60}
    block = {"scan": "2", "theta_i": 0}
    assert at(scan, **block, theta_r=30, phi=180) == [pytest.approx(-48523.83 / ROOT3, rel=1e-14)]
    assert at(scan, **block, theta_r=30, phi=190) == [pytest.approx(-52595.04 / ROOT3, rel=1e-14)]
    assert at(scan, **block, theta_r=30, phi=0) == [pytest.approx(-26875.9 / ROOT3, rel=1e-14)]
    assert at(scan, **block, theta_r=30, phi=10) == [pytest.approx(-34382.23 / ROOT3, rel=1e-14)]
    assert at(scan, **block, theta_r=0, phi=180) == [-30410.93]
    assert at(scan, scan="2", theta_i=60, theta_r=30, phi=190) == [pytest.approx(-42487.36 / ROOT3, rel=1e-14)]
    assert "Name / Comment : OJN / ART-90-050B-87106_long" in scan.attrs["provenance"].splitlines()


def test_both_forms_hold_the_same(real):
    one, other = map(read, real)
    for name in ("theta_i", "theta_r", "phi", "brdf", "scan"):
        np.testing.assert_array_equal(one[name].values, other[name].values)
    assert [recognise(path).name for path in real] == ["reflet", "reflet"]


def test_the_exporters_own_turn_to_the_coordinates_of_speos(real):
    """The .rtd repeats its table regridded, azimuths about the forward direction: phi = azimuth + 180.

    Its row of theta 30 in the third block, at azimuths 0, 180 and 190. The last azimuth of the arm, here -80, it takes
    for 90 and averages with that of the other side, to two decimals.
    """
    text = real[1].read_bytes().decode().split("\r")
    starts = [k for k, line in enumerate(text) if line.startswith("OPTIS")]
    head = next(k for k in range(starts[2], starts[3]) if text[k].split() == ["0", "180", "190"])
    row = head + 2
    theta, *values = map(float, text[row].split())
    scan = read(real[1])
    block = {"scan": "2", "theta_i": 0, "theta_r": theta}
    assert values[0] == pytest.approx(at(scan, **block, phi=180)[0] * ROOT3, rel=1e-14)
    assert values[2] == pytest.approx(at(scan, **block, phi=10)[0] * ROOT3, rel=1e-14)
    mean = (at(scan, **block, phi=0)[0] + at(scan, **block, phi=190)[0]) / 2 * ROOT3
    assert values[1] == pytest.approx(mean, abs=0.0051)


def test_the_mirror_direction_is_where_the_instrument_calibrates(real):
    """`TM : 30.0 PM : -90.0 TL : 30.0` is the mirror direction: theta_r = theta_i, phi = 180 deg."""
    calibration = next(line for line in read(real[0]).attrs["provenance"].splitlines() if "Calibration Value" in line)
    arm, azimuth, light = map(float, re.findall(r"(?:TM|PM|TL) : (-?[\d.]+)", calibration))
    assert (arm, azimuth, light) == (30, -90, 30)
    low = re.search(r"Phi measure beginning :\t(\S+)", real[0].read_text())
    assert low is not None
    assert float(low[1]) == azimuth  # so the first column, and in it the row of theta 30
    value = -48523.83
    scan = read(real[0])
    where = np.flatnonzero(np.isclose(scan["brdf"].values * np.cos(np.radians(scan["theta_r"].values)), value))
    assert [(scan["theta_r"].values[k], scan["phi"].values[k]) for k in where] == [(arm, 180)]


def test_samples(tmp_path):
    files = samples(tmp_path)
    for path in files:
        assert recognise(path) is FORMAT
    scan = FORMAT.read(files[0])
    assert "scan" not in scan.coords
    assert set(scan["theta_i"].values) == {0, 60}
    seam = at(scan, theta_i=60, theta_r=30, phi=180)  # theta -30 at azimuth 90, and theta 30 at -90
    assert seam == [pytest.approx(3 / ROOT3), pytest.approx(7 / ROOT3)]
    assert at(scan, theta_i=60, theta_r=30, phi=90) == [pytest.approx(2 / ROOT3)]  # theta -30, azimuth 0
    assert at(scan, theta_i=60, theta_r=30, phi=270) == [pytest.approx(8 / ROOT3)]
    repeated = FORMAT.read(files[1])
    assert sorted(set(repeated["scan"].values)) == ["1", "2"]
    np.testing.assert_array_equal(FORMAT.read(files[2])["brdf"].values, scan["brdf"].values)


def test_every_value_zero_is_said_and_found(tmp_path):
    path = tmp_path / "dark.txt"
    path.write_text(re.sub(r"^(-?\d+)\t.*$", r"\1\t0\t0\t0", TEXT.format(0), flags=re.M))
    scan = read(path)
    assert "every value is zero" in scan.attrs["history"].splitlines()
    assert any("every brdf value is zero" in finding.what for finding in check.check(scan))


def test_grazing_directions_are_left_out(tmp_path):
    path = tmp_path / "grazing.txt"
    path.write_text(TEXT.format(0).replace("\n30\t", "\n90\t"))
    scan = FORMAT.read(path)
    assert scan["theta_r"].values.max() == 30
    assert "3 values at theta_r = 90 deg" in scan.attrs["history"]


@pytest.mark.parametrize(
    ("text", "change", "where", "what"),
    [
        (TEXT, ("Intensity BRDF", "Intensity BTDF"), "line 3", "gonio knows Intensity BRDF"),
        (TEXT, ("Theta sample :\t0", "Theta sample :\t5"), "line 4", "no tilt"),
        (TEXT, ("Spectral Mode :\t0", "Spectral Mode :\tx"), "line 5", "not a finite number"),
        (TEXT, ("Phi measure step :\t90\n", ""), "line 9", "before phi measure step"),
        (TEXT, ("Phi measure step :\t90", "Phi measure step :\t70"), "line 10", "no whole number of steps"),
        (TEXT, ("Phi measure step :\t90", "Phi measure step :\t1e-9"), "line 10", "no whole number of steps"),
        (TEXT, ("Phi measure step :\t90", "Phi measure step :\t-90"), "line 10", "no whole number of steps"),
        (TEXT, ("Phi measure step :\t90", "Phi measure step :\t45"), "line 11", "3 values where the header has 5"),
        (TEXT, ("Lighting\t0", "Lighting\t91"), "line 1", "outside 0 to 90"),
        (TEXT, ("Lighting\t0", "Lighting\tnan"), "line 10", "not a finite number"),
        (TEXT, ("0\t4\t5\t6", "0\t4\tx\t6"), "line 12", "not a finite number"),
        (TEXT, ("0\t4\t5\t6", "-40\t4\t5\t6"), "line 1", "neither ascends nor descends"),
        (TEXT, ("30\t7\t8\t9", "130\t7\t8\t9"), "line 1", "outside -90 to 90"),
        (TEXT, ("-30\t1\t2\t3\n0\t4\t5\t6\n30\t7\t8\t9\n", ""), "line 1", "no rows"),
        (RTD, ("Sample 0", "Paint"), "line 2", "SampleID: Sample 60"),
        (RTD, ("1\t0\t\t", "1\t1\t\t"), "line 4", "transmission"),
        (RTD, ("\n0\t\t\t\n1", "\n1\t\t\t\n1"), "line 5", "BSDF values"),
        (RTD, ("30\t7\t8\t9", "30\t7\t8"), "line 19", "where there should be 4"),
        (RTD, ("\t0\t90\t180\t270", "\t0\t90\t180"), "line 20", "4 values where the second table has 3"),
        (RTD, ("100 50", "100"), "line 13", "where there should be 2"),
    ],
)
def test_refusals_have_a_place(text, change, where, what, tmp_path):
    full = text.format(0)
    assert change[0] in full
    path = tmp_path / "file"
    path.write_text(full.replace(*change, 1))
    with pytest.raises(FormatError, match=re.escape(what)) as refusal:
        FORMAT.read(path)
    assert refusal.value.where == where


def test_recognised_by_content_and_nothing_else_is(shared_files):
    ours = {"test_lighttools.txt", "test_speos.rtd"}
    assert {path.name for path in shared_files if FORMAT.recognises(path.read_bytes()[:4096])} == ours
