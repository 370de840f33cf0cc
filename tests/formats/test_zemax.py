"""Zemax tables: the real files, each symmetry, the geometry by vectors, what is written, and every error's place."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read
from gonio.files import FormatError
from gonio.formats import recognise, writer
from gonio.formats.zemax import FORMAT
from gonio.measured.check import Severity, check
from gonio.measured.dataset import HORIZON, flatten, make_scan
from places import FILES
from samples.zemax import ASYMMETRICAL, PLANE, TURNED, samples

REAL = sorted((FILES / "zemax").glob("*.bsdf")) or [
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


def test_plane_symmetrical_table(tmp_path):
    scan = read(saved(tmp_path, PLANE))
    assert scan["brdf"].dims == ("theta_i", "phi_s", "theta_s")
    assert scan["brdf"].attrs["units"] == "sr-1"
    assert scan.attrs["symmetry"] == "plane-symmetrical"
    assert scan.attrs["provenance"] == "made by hand"
    assert "mode" not in scan.coords
    np.testing.assert_array_equal(scan["tis"].values, [0.25, 0.5])
    np.testing.assert_array_equal(scan["brdf"].sel(theta_i=10, phi_s=90).values, [0.5, 0.41, 0.31, 0.21])
    np.testing.assert_array_equal(scan["brdf"].sel(theta_i=60, phi_s=180).values, [1.5, 1.4, 0.125, np.nan])
    # in the plane the angles add: azimuth 0 leads to the normal and beyond it, 180 to the horizon
    assert scan["theta_r"].sel(theta_i=60, phi_s=0, theta_s=5) == pytest.approx(55)
    assert scan["phi"].sel(theta_i=60, phi_s=0, theta_s=5) == pytest.approx(180)
    assert scan["theta_r"].sel(theta_i=10, phi_s=0, theta_s=30) == pytest.approx(20)
    assert scan["phi"].sel(theta_i=10, phi_s=0, theta_s=30) % 360 == pytest.approx(0)
    assert scan["theta_r"].sel(theta_i=60, phi_s=180, theta_s=30) == pytest.approx(90)


def test_channels_and_transmission_in_any_case(tmp_path):
    scan = read(saved(tmp_path, ASYMMETRICAL))
    assert scan["brdf"].dims == ("channel", "theta_i", "phi_s", "theta_s")
    assert scan["channel"].values.tolist() == ["X", "Y", "Z"]
    assert scan["mode"] == "transmission"
    assert scan.attrs["symmetry"] == "anisotropic"
    np.testing.assert_array_equal(scan["tis"].sel(theta_i=30).values, [0.1, 0.2, 0.3])
    assert scan["brdf"].sel(channel="Z", theta_i=30, phi_s=270, theta_s=20) == 7


def test_rotations_are_the_outermost_loop(tmp_path):
    scan = read(saved(tmp_path, TURNED))
    assert scan["brdf"].dims == ("phi_i", "theta_i", "phi_s", "theta_s")
    np.testing.assert_array_equal(scan["brdf"].values.ravel(), np.arange(1, 17))
    np.testing.assert_array_equal(scan["tis"].values, [[0.1, 0.2], [0.3, 0.4]])
    assert sorted(set(flatten(scan)["phi_i"].values)) == [0, 45]


@pytest.mark.parametrize(("phi_s", "theta_s", "theta_i"), [(90, 20, 30), (270, 20, 30), (45, 50, 60), (200, 10, 10)])
def test_directions_by_vectors(tmp_path, phi_s, theta_s, theta_i):
    """The light comes from azimuth 0; azimuth 0 about the mirror direction leads to the normal, 90 to +y."""
    text = PLANE.replace("PlaneSymmetrical", "Asymmetrical").replace("0\t90\t180\n", f"0\t{phi_s}\t300\n")
    text = text.replace("10\t60", f"{theta_i}\t85").replace("0\t5\t30\t90", f"0\t{theta_s}\t80\t90")
    scan = read(saved(tmp_path, text.replace("\t0\n", "\t0.125\n").replace("\n0.125\n", "\n0\n")))
    i, s, p = (math.radians(a) for a in (theta_i, theta_s, phi_s))
    mirror, towards = np.array([-math.sin(i), 0, math.cos(i)]), np.array([math.cos(i), 0, math.sin(i)])
    w = math.cos(s) * mirror + math.sin(s) * (math.cos(p) * towards + math.sin(p) * np.array([0, 1, 0]))
    node = {"theta_i": theta_i, "phi_s": phi_s, "theta_s": theta_s}
    assert float(scan["theta_r"].sel(node)) == pytest.approx(math.degrees(math.acos(w[2])), abs=1e-9)
    assert float(scan["phi"].sel(node)) == pytest.approx(math.degrees(math.atan2(w[1], w[0])) % 360, abs=1e-9)


@pytest.mark.parametrize("path", REAL, ids=lambda p: p.stem if p else "absent")
def test_real_files(path, tmp_path):
    scan = read(path)
    assert recognise(path) is FORMAT
    text = path.read_text()
    rows = text.split("DataBegin")[1].split("DataEnd")[0].split("TIS")[1:]
    for block, tis, row in zip(scan["brdf"], scan["tis"], rows, strict=True):
        numbers = np.array(row.split(), dtype=float)
        assert float(tis) == numbers[0]
        expected = numbers[1:].reshape(block.shape)
        above = block["theta_r"].values <= HORIZON
        np.testing.assert_array_equal(block.values[above], expected[above])
        assert not expected[~above].any()  # nothing is lost: the file is zero below the horizon
        assert np.isnan(block.values[~above]).all()
    assert not [f for f in check(scan) if f.severity is Severity.ERROR]
    again = rewritten(scan, tmp_path / "again.bsdf")
    xr.testing.assert_identical(again, scan)


def test_samples_are_written_as_they_are_read(tmp_path):
    for path in samples(tmp_path):
        scan = FORMAT.read(path)
        xr.testing.assert_identical(rewritten(scan, tmp_path / "again"), scan)


def test_what_is_written_is_what_zemax_asks(tmp_path):
    """Tabs and none at the end, the keywords in the order of the specification."""
    path = tmp_path / "x.bsdf"
    rewritten(FORMAT.read(saved(tmp_path, PLANE)), path)
    lines = path.read_text().splitlines()
    assert lines[1:] == PLANE.splitlines()[2:]  # below the comments
    assert not any(line.endswith(("\t", " ")) for line in lines)


@pytest.mark.parametrize("ends", ["\r\n", "\r"])
def test_line_ends_and_bom(tmp_path, ends):
    plain = FORMAT.read(saved(tmp_path, PLANE))
    other = read(saved(tmp_path, PLANE.replace("\n", ends), "utf-8-sig"))
    xr.testing.assert_equal(other, plain)


def test_total_integrated_scatter_of_a_perfect_diffuser(tmp_path):
    """TIS is the integral of f cos(theta_r): the albedo, to the error of the trapezoidal rule on these steps."""
    flat = make_scan([0.0, 30, 60], [0.0, 0, 0], [1, 1, 1], [0, 0, 0])
    assert FORMAT.layout is not None
    grid = FORMAT.layout(flat)
    f = np.where(grid["theta_r"].values <= HORIZON, 0.3 / np.pi, np.nan)
    scan = grid.assign(brdf=(("theta_i", "phi_s", "theta_s"), f, {"units": "sr-1"}))
    found = _tis_written(scan, tmp_path)
    assert found == pytest.approx([0.3, 0.3, 0.3], rel=0.015)
    whole = FORMAT.layout(flat.assign_attrs(symmetry="anisotropic"))
    f = np.where(whole["theta_r"].values <= HORIZON, 0.3 / np.pi, np.nan)
    scan = whole.assign(brdf=(("theta_i", "phi_s", "theta_s"), f, {"units": "sr-1"})).assign_attrs(
        symmetry="anisotropic"
    )
    assert _tis_written(scan, tmp_path) == pytest.approx(found, rel=1e-9)  # the same integral, once around


def _tis_written(scan: xr.Dataset, folder: Path) -> list[float]:
    return rewritten(scan, folder / "x.bsdf")["tis"].values.tolist()


def test_total_integrated_scatter_by_hand(tmp_path):
    """Two radial steps at normal incidence, f = 1 and then 2: 2 pi times the trapezoids of f cos(theta) sin(theta)."""
    text = PLANE.replace("AngleOfIncidence\t2\n10\t60", "AngleOfIncidence\t1\n0").replace("0\t5\t30\t90", "0\t30\t60")
    text = text.replace("ScatterRadial\t4", "ScatterRadial\t3").split("DataBegin")[0]
    scan = FORMAT.read(saved(tmp_path, text + "DataBegin\nTIS 9\n" + "1 1 2\n" * 3 + "DataEnd\n"))
    again = rewritten(scan.drop_vars("tis"), tmp_path / "x.bsdf")
    at_30, at_60 = math.sqrt(3) / 4, 2 * math.sqrt(3) / 4
    assert float(again["tis"][0]) == pytest.approx(2 * math.pi * math.pi / 6 * (at_30 / 2 + (at_30 + at_60) / 2))


def test_layout_keeps_a_specular_grid_and_makes_one_of_others(tmp_path):
    assert FORMAT.layout is not None
    scan = FORMAT.read(saved(tmp_path, TURNED))
    xr.testing.assert_equal(FORMAT.layout(scan), scan.drop_vars(["brdf", "tis"]))
    flat = make_scan([30, 10, 30], [5, 10, 20], [1, 2, 3], [0, 180, 90])
    grid = FORMAT.layout(flat)
    assert grid["theta_i"].values.tolist() == [10, 30]
    assert grid["phi_s"].values.tolist() == list(range(0, 181, 10))
    assert grid["theta_s"].values[[0, 1, -1]].tolist() == [0, 0.5, 120]
    turned = FORMAT.layout(flat.assign_coords(phi_i=("direction", [0.0, 0.0, 90.0])))
    assert turned["phi_i"].values.tolist() == [0, 90]
    assert turned["phi_s"].values[[-1]].tolist() == [350]
    many = make_scan(np.linspace(1, 80, 500), np.zeros(500), np.ones(500), np.zeros(500))
    assert FORMAT.layout(many)["theta_i"].values.tolist() == list(range(5, 81, 5))


def test_a_value_below_the_horizon_is_told_of(tmp_path):
    scan = read(saved(tmp_path, PLANE.replace("0.32\t0", "0.32\t0.1")))
    assert "left out 1 values below the horizon" in scan.attrs["history"]


def test_all_zero_is_read_and_flagged(tmp_path):
    head = PLANE.split("DataBegin")[0]
    scan = read(saved(tmp_path, head + "DataBegin\n" + "TIS 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n" * 2 + "DataEnd\n"))
    assert "every value is zero" in scan.attrs["history"]
    assert any("zero" in f.what for f in check(scan) if f.severity is Severity.ERROR)


@pytest.mark.parametrize(
    ("old", "new", "place", "what"),
    [
        ("PlaneSymmetrical", "Round", "line 4", "'Round' where PlaneSymmetrical or Asymmetrical or"),
        ("Monochrome\nScatter", "RGB\nScatter", "line 5", "'RGB' where Monochrome or XYZ"),
        ("BRDF", "BSDF", "line 6", "BRDF or BTDF"),
        ("SampleRotation\t1", "SampleRotation\t4611686018427387904", "line 7", "outside 1 to"),
        ("AngleOfIncidence\t2", "AngleOfIncidence\t-2", "line 9", "not a count"),
        ("AngleOfIncidence\t2", "AngleOfIncidence\t3", "line 11", "not a finite number"),
        ("10\t60", "10\t91", "line 10", "outside 0 to 90"),
        ("10\t60", "60\t10", "line 10", "must ascend"),
        ("0\t90\t180", "0\t90\t90", "line 12", "must ascend"),
        ("0\t5\t30\t90", "0\t5\t30\tnan", "line 14", "not a finite number"),
        ("ScatterRadial\t4", "Symmetry\tAsymmetrical\nScatterRadial\t4", "line 13", "twice"),
        ("ScatterRadial\t4\n0\t5\t30\t90\n", "", "line 14", "ScatterRadial should have come before"),
        ("DataBegin", "DataStart", "line 17", "DataBegin"),
        ("TIS\t0.25", "TIS\tx", "line 18", "TIS is 'x'"),
        ("TIS\t0.5", "0.5", "line 22", "where TIS was expected"),
        ("0.5\t0.41\t0.31\t0.21", "0.5\t0.41\t0.31", "line 20", "3 values where a row has 4"),
        ("0.5\t0.41\t0.31\t0.21", "0.5\t0,41\t0.31\t0.21", "line 20", "decimal points"),
        ("0.5\t0.41\t0.31\t0.21", "0.5\t1e999\t0.31\t0.21", "line 20", "not a finite number"),
        ("0.5\t0.41\t0.31\t0.21", "0.5\t1_0\t0.31\t0.21", "line 20", "not a finite number"),
        ("DataEnd\n", "", "line 26", "ends where DataEnd"),
        ("DataEnd\n", "DataEnd\n1\n", "line 27", "after the last DataEnd"),
    ],
)
def test_errors_name_their_line(tmp_path, old, new, place, what):
    assert old in PLANE
    with pytest.raises(FormatError) as error:
        FORMAT.read(saved(tmp_path, PLANE.replace(old, new, 1)))
    assert error.value.where == place
    assert what in error.value.what


def test_a_promise_beyond_the_file_is_refused_at_once(tmp_path):
    """10 000 azimuths and as many radial angles are listed, and then there is nothing."""
    listed = " ".join(f"{i / 100:g}" for i in range(9_000))
    text = PLANE.replace("ScatterAzimuth\t3\n0\t90\t180", f"ScatterAzimuth\t9000\n{listed}")
    text = text.replace("ScatterRadial\t4\n0\t5\t30\t90", f"ScatterRadial\t9000\n{listed}")
    with pytest.raises(FormatError, match="promises 162000000 values") as error:
        FORMAT.read(saved(tmp_path, text))
    assert error.value.where == "line 16"


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda s: s.assign(brdf=s["brdf"].assign_attrs(units="a.u.")), "calibrate"),
        (lambda s: s.assign(brdf=s["brdf"].where(s["phi_s"] > 0)), "missing"),
        (lambda s: flatten(s), "convert"),
        (lambda s: s.isel(phi_s=0, drop=True), "phi_s is not there"),
        (lambda s: s.expand_dims(channel=["R", "G"]), "X, Y and Z"),
        (lambda s: s.expand_dims(wavelength=[500.0, 600.0]), "wavelength"),
        (lambda s: s.expand_dims(mode=["reflection", "transmission"]), "one mode"),
        (lambda s: s.isel(theta_s=slice(None, None, -1)), "theta_s must ascend"),
        (lambda s: s.assign(brdf=s["brdf"].copy(data=s["brdf"].values / 0.0)), "infinite"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, change, what):
    scan = FORMAT.read(saved(tmp_path, PLANE)).drop_vars("tis")
    with np.errstate(divide="ignore"), pytest.raises(ValueError, match=what):
        rewritten(change(scan), tmp_path / "x.bsdf")


def test_one_set_of_each_kind_fits(tmp_path):
    scan = FORMAT.read(saved(tmp_path, PLANE))
    several = scan.expand_dims(wavelength=[650.0], mode=["reflection"]).assign(tis=scan["tis"])
    xr.testing.assert_equal(rewritten(several, tmp_path / "x.bsdf"), scan)


def test_named_as_such():
    assert writer("x.bsdf", "zemax") is FORMAT
