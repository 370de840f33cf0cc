"""Integra's diffuse and specular files: against a second reading, lobes whose integrals are known, and bad files.

The grammar was taken from the public reader libbsdf, which is no Python package: what its code does with a value and a
direction is written here once more from scratch, in plain loops.
"""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.formats.integra.lobe_reflectance import lobe_reflectances
from gonio.measured.dataset import make_scan
from gonio.resampling.resample import resample
from places import FILES as SHARED
from samples import integra, integra_specular

MINIMAL = """;; a remark
Source Generated
TypeSym ASymmetrical
TypeColorModel BW
TypeData Luminance Absolute
sigma 2
 0 60
phi 4
 0 90 180 270
theta 2
 0 20
bw
 kbdf
  1 0.5
 def
 1 2 3 4 5 6 7 8
 ;; the second incidence
 9 10 11 12 13 14 15 16
 enddef
"""


def saved(folder: Path, text: str, name: str = "file.ddr") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def reflected(theta_i: float, phi: float, theta: float) -> tuple[float, float]:
    """theta_r and phi_r - phi_i [deg] by vectors: phi about the mirror ray, from the normal's side of it."""
    ti, p, t = map(math.radians, (theta_i, phi, theta))
    mirror = np.array([-math.sin(ti), 0.0, math.cos(ti)])
    to_normal = np.array([math.cos(ti), 0.0, math.sin(ti)])  # the light comes from +x, so this leads up and over it
    aside = np.array([0.0, 1.0, 0.0])
    w = math.cos(t) * mirror + math.sin(t) * (math.cos(p) * to_normal + math.sin(p) * aside)
    return math.degrees(math.acos(w[2])), math.degrees(math.atan2(w[1], w[0])) % 360


def test_values_and_directions_are_those_of_a_second_reading(tmp_path):
    scan = read(saved(tmp_path, MINIMAL))
    numbers = iter(range(1, 17))
    for theta_i, factor in ((0.0, 1.0), (60.0, 0.5)):
        for phi in (0.0, 90.0, 180.0, 270.0):
            for theta in (0.0, 20.0):
                node = scan.sel(theta_i=theta_i, phi_s=phi, theta_s=theta)
                assert node["brdf"].item() == pytest.approx(next(numbers) * factor / math.pi, rel=1e-15)
                theta_r, azimuth = reflected(theta_i, phi, theta)
                assert node["theta_r"].item() == pytest.approx(theta_r, abs=1e-6)  # arccos near 1 keeps half the digits
                if theta_r > 1e-5:
                    assert abs((node["phi"].item() - azimuth + 180) % 360 - 180) < 1e-6
    assert scan.attrs["provenance"] == "a remark\nSource Generated"
    assert "multiplied by the factors kbdf" in scan.attrs["history"]
    assert "symmetry" not in scan.attrs
    assert scan["brdf"].attrs["units"] == "sr-1"


def test_azimuth_zero_is_on_the_side_of_the_normal(tmp_path):
    scan = read(saved(tmp_path, MINIMAL))
    up, down = (scan["theta_r"].sel(theta_i=60, theta_s=20, phi_s=p).item() for p in (0, 180))
    assert (up, down) == (pytest.approx(40), pytest.approx(80))


def test_4d_runs_over_psi_last(tmp_path):
    text = MINIMAL.replace("ASymmetrical", "ASymmetrical 4D").replace("sigma 2\n 0 60", "psi 2\n 0 90\nsigma 1\n 60")
    scan = read(saved(tmp_path, text.replace("kbdf\n  1 0.5", "kbdf\n  2 4")))
    assert scan.sizes == {"theta_i": 1, "theta_s": 2, "phi_s": 4, "phi_i": 2}
    assert scan.attrs["symmetry"] == "anisotropic"
    at_zero = scan["brdf"].sel(phi_i=0, theta_i=60, phi_s=90).values
    at_right_angle = scan["brdf"].sel(phi_i=90, theta_i=60, phi_s=90).values
    np.testing.assert_allclose(at_zero, np.array([3, 4]) * 2 / np.pi, rtol=1e-15)
    np.testing.assert_allclose(at_right_angle, np.array([11, 12]) * 4 / np.pi, rtol=1e-15)
    np.testing.assert_array_equal(np.unique(scan["phi_i"]), [0, 90])


def lobes(kind: str, values, kbdf="") -> str:
    """A file whose value is `values(theta_i, phi, theta)`."""
    sigma, phi, theta = (0.0, 50.0), np.arange(0, 361, 10.0), np.arange(0, 181, 2.0)
    rows = "\n".join(" ".join(repr(float(values(i, p, t))) for t in theta) for i in sigma for p in phi)
    axes = [f"{k} {len(v)}\n {' '.join(map(str, v))}" for k, v in (("sigma", sigma), ("phi", phi), ("theta", theta))]
    head = "\n".join(["TypeSym ASymmetrical", "TypeColorModel BW", f"TypeData {kind}", *axes, "bw"])
    return f"{head}\n{kbdf}\n def\n{rows}\n enddef\n"


def test_intensity_of_a_white_surface_is_one_over_pi(tmp_path):
    def cosine(i, p, t):
        return max(math.cos(math.radians(reflected(i, p, t)[0])), 0.0) / math.pi

    scan = read(saved(tmp_path, lobes("Intensity Absolute", cosine)))
    inside = scan["brdf"].values[(scan["theta_r"] < 89.9).values]
    np.testing.assert_allclose(inside, 1 / np.pi, rtol=1e-9)  # the cosine keeps 1e-13 of the 1e-3 that it is at least
    assert np.isnan(scan["brdf"].values[(scan["theta_r"] > 90.001).values]).all()
    assert "cos(theta_r) divided out" in scan.attrs["history"]
    assert scan.attrs["stored"] == "intensity: BRDF x cos(theta_r)"


@pytest.mark.parametrize("kind", ["Luminance Relative", "Intensity Relative"])
def test_relative_data_are_scaled_to_the_reflectance_that_kbdf_states(kind, tmp_path):
    def white(i, p, t):
        return 7.0 if kind.startswith("L") else 7.0 * max(math.cos(math.radians(reflected(i, p, t)[0])), 0.0)

    scan = read(saved(tmp_path, lobes(kind, white, kbdf=" kbdf\n 0.5 0.25")))
    for theta_i, reflectance in ((0, 0.5), (50, 0.25)):
        part = scan.sel(theta_i=theta_i)
        inside = part["brdf"].values[(part["theta_r"] < 89).values]
        # steps of a degree: 1e-4; an intensity stops at the horizon within a step of 2 deg, where sin x cos is small
        np.testing.assert_allclose(inside, reflectance / np.pi, rtol=1e-4 if kind.startswith("L") else 2e-3)
    assert scan["brdf"].attrs["units"] == "sr-1"
    assert "scaled to the hemispherical reflectance" in scan.attrs["history"]


def test_relative_data_without_kbdf_stay_relative(tmp_path):
    scan = read(saved(tmp_path, lobes("Luminance Relative", lambda i, p, t: 3.0)))
    assert scan["brdf"].attrs["units"] == "a.u."
    assert np.nanmax(scan["brdf"].values) == 3.0


def test_reflectance_of_a_cosine_lobe():
    """F = cos(theta) about the normal: 2 pi times the integral of cos^2 sin, 2 pi/3; a half of azimuths is mirrored."""
    theta = np.arange(0, 91, 0.5)
    whole, half = np.arange(0, 361, 30.0), np.arange(0, 181, 30.0)
    for phi in (whole, half, whole[:-1]):
        lobe = np.broadcast_to(np.cos(np.radians(theta)), (1, len(phi), len(theta)))
        assert lobe_reflectances(np.zeros(1), phi, theta, lobe)[0] == pytest.approx(2 * np.pi / 3, rel=1e-4)
    with pytest.raises(ValueError, match="azimuths"):
        lobe_reflectances(np.zeros(1), half[:3], theta, np.ones((1, 3, len(theta))))
    with pytest.raises(ValueError, match="several angles"):
        lobe_reflectances(np.zeros(1), half, theta[:1], np.ones((1, 7, 1)))


def test_an_axially_symmetrical_lobe_is_the_same_all_round(tmp_path):
    folder = tmp_path / "samples"
    folder.mkdir()
    scan = read(next(p for p in integra.samples(folder) if p.name == "axial.ddr"))
    near = scan["brdf"].sel(theta_s=30, theta_i=0)
    np.testing.assert_array_equal(near, np.full(5, near.values[0]))
    found = resample(scan, make_scan([0.0, 0.0], [15.0, 15.0], [1.0, 1.0], [10.0, 250.0]))["brdf"].values
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    assert "one azimuth stands for all" in scan.attrs["history"]


def test_a_half_of_azimuths_is_mirrored_where_it_is_asked_for(tmp_path):
    scan = read(saved(tmp_path, integra.VARIANTS["plane.ddr"]))
    assert scan.attrs["symmetry"] == "plane-symmetrical"
    sides = resample(scan, make_scan([60.0, 60.0], [50.0, 50.0], [1.0, 1.0], [150.0, 210.0]))["brdf"].values
    assert np.isfinite(sides).all() or np.isnan(sides).all()
    assert sides[0] == pytest.approx(sides[1], rel=1e-12, nan_ok=True)


def test_refracted_directions_are_flat_and_about_sigmat(tmp_path):
    scan = read(saved(tmp_path, integra.VARIANTS["refracted.ddt"], "lens.ddt"))
    assert scan["brdf"].dims == ("direction",)
    assert set(scan["mode"].values.tolist()) == {"transmission"}
    centre = scan.isel(direction=(np.abs(scan["theta_r"].values - 35.2) < 1e-9) & (scan["theta_i"].values == 60))
    np.testing.assert_allclose(centre["brdf"], 2 / np.pi, rtol=1e-15)
    np.testing.assert_allclose(centre["phi"], 180, atol=1e-9)
    assert {90.0, 270.0} <= {round(float(p), 6) % 360 for p in scan["phi"].values[scan["theta_i"].values == 0]}
    with pytest.raises(ValueError, match=r"gonio\.convert"):
        write(scan, tmp_path / "again.ddt")


@pytest.mark.parametrize("name", [n for n in integra.VARIANTS if n != "refracted.ddt"])
def test_diffuse_round_trip_is_exact(name, tmp_path):
    scan = read(saved(tmp_path, integra.VARIANTS[name], name))
    found = _written(scan, tmp_path, Path(name).suffix)
    xr.testing.assert_equal(found, scan)
    assert found["brdf"].attrs == scan["brdf"].attrs
    assert found.attrs["provenance"] == scan.attrs["provenance"]


@pytest.mark.parametrize("name", integra_specular.VARIANTS)
def test_specular_round_trip_is_exact(name, tmp_path):
    scan = read(saved(tmp_path, integra_specular.VARIANTS[name], name))
    found = _written(scan, tmp_path, Path(name).suffix)
    xr.testing.assert_equal(found, scan)
    assert found.attrs["quantity"] == scan.attrs["quantity"]
    assert found.attrs["provenance"] == scan.attrs["provenance"]


def _written(scan, folder, suffix):
    """What is read of the scan after it was written, and its file renamed."""
    path = folder / f"written{suffix}"
    kind = write(scan, path)
    assert recognise(path) is kind
    return read(path.rename(folder / "renamed.whatever"))


def test_specular_reflectances_are_no_brdf(tmp_path):
    scan = read(saved(tmp_path, integra_specular.VARIANTS["rgb.sdr"], "mirror.sdr"))
    assert scan["brdf"].attrs["units"] == "a.u."
    np.testing.assert_array_equal(scan["theta_i"], [0, 60, 0, 60, 0, 60])
    np.testing.assert_array_equal(scan["theta_r"], scan["theta_i"])
    np.testing.assert_array_equal(scan["brdf"], [0.1, 0.2, 0.1, 0.3, 0, 0.125])
    assert scan["channel"].values.tolist() == ["R", "R", "G", "G", "B", "B"]
    write(scan, tmp_path / "mirror.csv")
    assert read(tmp_path / "mirror.csv")["brdf"].attrs["units"] == "a.u."
    with pytest.raises(ValueError, match="no specular reflectance"):
        write(make_scan([10.0], [10.0], [0.5], unit="a.u."), tmp_path / "a.sdr")
    with pytest.raises(ValueError, match="no specular transmittance"):
        write(scan.assign_coords(mode="transmission"), tmp_path / "a.sdt")
    with pytest.raises(ValueError, match=r"is of reflection, and .* of transmission alone"):
        write(scan, tmp_path / "a.sdt")


@pytest.mark.parametrize("suffix", [".ddr", ".ddt"])
def test_a_scan_is_written_on_the_layout(suffix, tmp_path):
    """An in-plane scan of a constant: it comes back to the last digit, which pi may cost."""
    theta_r = np.arange(-60, 61, 10.0)
    theta_i = np.repeat([0.0, 30.0], len(theta_r))
    scan = make_scan(theta_i, np.tile(theta_r, 2), np.full(len(theta_i), 1 / 3))
    if suffix == ".ddt":
        scan = scan.assign_coords(mode="transmission")
    kind = next(f for f in formats().values() if f.suffix == suffix)
    on_grid = resample(scan, kind.layout(scan))
    assert on_grid.sizes == {"theta_i": 2, "theta_s": 25, "phi_s": 37}  # every 5 deg to 90 + 30, and all round
    beside = ~on_grid["phi"].round(6).isin([0, 180, 360]) & (on_grid["theta_s"] > 0) & (on_grid["theta_r"] > 1e-6)
    assert on_grid["brdf"].where(beside).isnull().all()  # an in-plane scan says nothing beside its plane
    assert on_grid["brdf"].notnull().sum() > 50
    with pytest.raises(ValueError, match="gaps"):
        write(on_grid, tmp_path / f"gaps{suffix}")
    filled = on_grid.assign(brdf=on_grid["brdf"].fillna(1 / 3).assign_attrs(units="sr-1"))
    found = _written(filled, tmp_path, suffix)
    kept = ~np.isnan(found["brdf"].values)
    np.testing.assert_allclose(found["brdf"].values[kept], 1 / 3, rtol=2.3e-16)
    np.testing.assert_array_equal(kept, (found["theta_r"] <= 90 + 1e-9).values)


def test_out_of_plane_layout_goes_round_the_mirror_direction():
    scan = make_scan([20.0, 40.0, 40.0], [10.0, 12.0, 14.0], [1.0, 1.0, 1.0], [90.0, 180.0, 30.0])
    layout = formats()["integra"].layout(scan)
    assert layout["theta_i"].values.tolist() == [20, 40]
    assert (layout["phi_s"].values[0], layout["phi_s"].values[-1]) == (0, 360)
    assert np.diff(layout["theta_s"].values).max() <= 2 + 1e-9  # the scan's own step
    assert layout["theta_s"].values[-1] >= 128
    turned = formats()["integra"].layout(scan.assign_coords(phi_i=("direction", [0.0, 0.0, 90.0])))
    assert turned["phi_i"].values.tolist() == [0, 90]
    assert turned["theta_r"].dims == ("theta_i", "theta_s", "phi_s", "phi_i")


def test_what_a_file_cannot_say_is_refused(tmp_path):
    scan = read(saved(tmp_path, MINIMAL))
    with pytest.raises(ValueError, match="is of transmission, and Integra diffuse table of reflection alone"):
        write(scan.assign_coords(mode="transmission"), tmp_path / "a.ddr")
    with pytest.raises(ValueError, match="channels R, G, B"):
        write(scan.assign_coords(channel="vis"), tmp_path / "a.ddr")
    with pytest.raises(ValueError, match="sets along"):
        write(scan.expand_dims(side=["front", "back"]), tmp_path / "a.ddr")


DEFECTS = [
    ("sigma 2", "sigma 3", "line 8", "where the number of angles|a keyword|not a finite number"),
    ("sigma 2", "sigma 4611686018427387904", "line 6", "outside 1 to"),
    ("sigma 2", "sigma -2", "line 6", "not a count"),
    ("0 60", "60 0", "line 7", "do not ascend"),
    ("0 60", "0 95", "line 7", "outside 0 to 90"),
    ("0 60", "0 nan", "line 7", "not a finite number"),
    ("0 60", "0 6,5", "line 7", "decimal points"),
    ("theta 2\n 0 20\n", "", "line 10", "no theta"),
    ("phi 4", "sigma 4", "line 8", "occurs twice"),
    ("ASymmetrical", "PointSymmetrical", "line 3", "where AxiSymmetrical or"),
    ("TypeColorModel BW", "TypeColorModel RGB", "line 12", "TypeColorModel is rgb"),
    ("TypeColorModel BW", "TypeColorModel spectral 0", "line 4", "outside 1 to"),
    ("Luminance", "Radiance", "line 5", "Luminance or Intensity"),
    ("1 0.5\n", "1 -0.5\n", "line 14", "negative factor"),
    ("1 2 3 4", "1 2 3 inf", "line 16", "number 4 is 'inf'"),
    ("1 2 3 4", "1 2 3 1_0", "line 16", "number 4 is '1_0'"),
    (" 16\n enddef", "\n enddef", "line 19", "'enddef'"),
    (" 16\n enddef\n", "", "line 18", "ends after 15 of 16"),
    (" 16\n", " 16 17\n", "line 18", "after the last table"),
    (" def", " deff", "line 15", "where def was expected"),
    ("1 2 3 4 5 6 7 8\n ;; the second incidence\n 9 10 11 12 13 14 15 16", "0 " * 16, "line 16", "every value is zero"),
    ("ASymmetrical", "ASymmetrical 4D", "line 12", "psi"),
    ("ASymmetrical", "AxiSymmetrical", "line 12", "several azimuths"),
    ("1 0.5\n", "1 1e308\n", "line 16", "not finite"),
    ("Absolute", "Relative\nsigmat 1 2", "line 6", "sigmat before sigma"),
    ("0 90 180 270", "0 10 20 30", "line 16", "whole lobe"),
    ("TypeSym", "12 TypeSym", "line 3", "'12' where a keyword"),
]


@pytest.mark.parametrize(("old", "new", "where", "what"), DEFECTS, ids=[d[3][:20] for d in DEFECTS])
def test_defects_are_named_with_their_line(old, new, where, what, tmp_path):
    text = MINIMAL.replace("Absolute", "Relative") if what == "whole lobe" else MINIMAL
    assert old in text
    path = saved(tmp_path, text.replace(old, new, 1))
    with pytest.raises(FormatError, match=what) as error:
        formats()["integra"].read(path)
    assert error.value.where == where
    assert "\n" not in str(error.value)


def test_specular_defects_are_named_with_their_line(tmp_path):
    text = integra_specular.VARIANTS["grey.sdr"]
    for old, new, where, what in [
        ("0.04", "-0.04", "line 8", "below zero"),
        ("0.05 0.09 1", "", "line 9", "'enddef'"),
        ("bw\n", "red\n", "line 6", "TypeColorModel"),
        ("sigma 4\n", "", "line 4", "'0'"),
    ]:
        with pytest.raises(FormatError, match=what) as error:
            formats()["integra-specular"].read(saved(tmp_path, text.replace(old, new)))
        assert error.value.where == where, what


def test_found_by_content(tmp_path):
    for line_end in ("\n", "\r\n", "\r"):
        text = "\ufeff" + MINIMAL.replace("TypeSym", "TYPESYM").replace("\n", line_end)
        assert recognise(saved(tmp_path, text, "file.txt")).name == "integra"
    marked = saved(tmp_path, ";; transmission: no keyword says so\n" + MINIMAL, "file.txt")
    assert recognise(marked).name == "integra-transmission"
    assert read(marked)["mode"].item() == "transmission"
    assert recognise(saved(tmp_path, integra_specular.VARIANTS["rgb.sdr"], "file.ddr")).name == "integra-specular"
    without = saved(tmp_path, MINIMAL.replace("TypeSym ASymmetrical\n", ""), "file.txt")
    assert recognise(without).name == "integra"
    assert read(without)["brdf"].equals(read(saved(tmp_path, MINIMAL))["brdf"])
    one_line = saved(tmp_path, MINIMAL.replace("1 2 3 4", " " * 100_000 + "1 2 3 4"))
    assert read(one_line)["brdf"].equals(read(saved(tmp_path, MINIMAL, "b.ddr"))["brdf"])


OURS = ("integra", "integra-transmission", "integra-specular", "integra-specular-transmission", "ssdd", "astm")


@pytest.mark.skipif(not SHARED.is_dir(), reason=f"no real files at {SHARED}")
def test_no_real_file_of_another_format_is_taken():
    heads = [path.read_bytes()[:4096] for path in sorted(SHARED.rglob("*")) if path.is_file()]
    assert len(heads) > 20
    assert not [name for name in OURS for head in heads if formats()[name].recognises(head)]


def test_remarks_alone_are_no_file():
    for head in (b";; only remarks\n" * 100, b"", b"Source Measured\nSymmetry PlaneSymmetrical\n", b"\xff" * 4096):
        assert not any(formats()[name].recognises(head) for name in OURS)
