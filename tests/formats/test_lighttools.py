"""LightTools files against a reading of their words by hand, integrals worked out on paper, and refusals."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio.files import FormatError
from gonio.formats import formats, hemispheres, read, recognise
from gonio.measured.coordinates import grid
from gonio.measured.dataset import flatten
from samples.lighttools import HEADER, block, samples

FORMAT = formats()["lighttools"]


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    return {path.stem: path for path in samples(tmp_path)}


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "file.bsdf"
    path.write_text(text, encoding="utf-8")
    return path


def by_hand(text: str) -> dict[tuple, float]:
    """Value by mode, side, wavelength or channel, AOI, azimuth and radial angle: the words as they stand."""
    lines = [line.split("#")[0].split() for line in re.split(r"[\r\n]+", text)]
    words = [word for line in lines for word in line]
    azimuths = list(map(float, words[words.index("ScatterAzimuth") + 2 :][:5]))
    radials = list(map(float, words[words.index("ScatterRadial") + 2 :][:3]))
    found, told = {}, {}
    at = words.index("DataBegin") + 1
    while words[at] != "DataEnd":
        told[words[at]], at = words[at + 1], at + 2
        if "TIS" in told:
            key = (told["ScatterType"], told["Side"], told.get("TristimulusValue") or told["Wavelength"], told["AOI"])
            for azimuth in azimuths:
                for radial in radials:
                    found[*key, azimuth, radial], at = float(words[at]), at + 1
            told = {}
    return found


@pytest.mark.parametrize("name", ["plain", "carriage_returns", "both_sides", "flat", "wavelengths", "colours"])
def test_every_value_is_where_the_words_put_it(name, files):
    """The azimuth is counted from the incident light, which comes from 90 deg: libbsdf turns by that."""
    flat = flatten(FORMAT.read(files[name]))
    modes, sides = {"reflection": "BRDF", "transmission": "BTDF"}, {"front": "Front", "back": "Back"}
    wave = [f"Tris{c}" for c in flat["channel"].values] if name == "colours" else flat["wavelength"].values
    found = {}
    columns = [flat[n].values.tolist() for n in ("mode", "side", "theta_i", "phi", "theta_r", "brdf")]
    for w, mode, side, theta_i, phi, theta_r, value in zip(wave, *columns, strict=True):
        spectral = w if isinstance(w, str) else f"{w:g}"
        found[modes[mode], sides[side], spectral, f"{theta_i:g}", (phi + 90) % 360, theta_r] = value
    expected = by_hand(files[name].read_bytes().decode())
    assert found == {key: value for key, value in expected.items() if key[4] != 360}


def test_forward_is_opposite_to_the_light():
    """A direction across from the light, at an azimuth of 270 deg, is forward: phi = 180 deg, by unit vectors."""
    light, forward, left = (np.array([math.cos(a), math.sin(a)]) for a in np.radians([90, 270, 180]))
    assert forward @ light == pytest.approx(-1)
    assert light[0] * left[1] - light[1] * left[0] > 0  # counterclockwise from the light: phi = 90, not 270


def test_forward_and_left_of_a_file(files):
    scan = FORMAT.read(files["plain"]).isel(mode=0, side=0, wavelength=0)
    at = scan["brdf"].sel(theta_i=30, theta_r=45)
    assert at.sel(phi=180).item() == 11  # azimuth 270
    assert at.sel(phi=90).item() == 8  # azimuth 180
    assert scan.attrs["provenance"] == "a remark"
    assert scan["tis"].values.tolist() == [0.5, 0.5]


def test_dense_and_flat(files):
    dense = FORMAT.read(files["both_sides"])
    assert dense["brdf"].dims == ("mode", "side", "wavelength", "theta_i", "theta_r", "phi")
    assert dense["mode"].values.tolist() == ["reflection", "transmission"]
    assert dense["side"].values.tolist() == ["front", "back"]
    assert FORMAT.read(files["flat"])["brdf"].dims == ("direction",)
    assert FORMAT.read(files["colours"])["channel"].values.tolist() == ["X", "Y", "Z"]


def test_an_unclosed_circle_that_differs_is_kept(tmp_path):
    text = HEADER.format("Monochrome") + block(0).removesuffix("1 2 3\n") + "1 2.5 3\nDataEnd\n"
    scan = FORMAT.read(written(tmp_path, text))
    assert scan["brdf"].dims == ("direction",)
    at = (scan["phi"].values == 270) & (scan["theta_r"].values == 45)
    assert scan["brdf"].values[at].tolist() == [2, 2.5]


@pytest.mark.parametrize("name", ["plain", "both_sides", "wavelengths", "colours"])
def test_round_trip_is_exact(name, files, tmp_path):
    scan = FORMAT.read(files[name])
    FORMAT.write(scan, tmp_path / "out")
    again = FORMAT.read(tmp_path / "out")
    xr.testing.assert_equal(again, scan)
    assert {n: v.attrs for n, v in again.variables.items()} == {n: v.attrs for n, v in scan.variables.items()}
    assert again.attrs == scan.attrs


def lambertian(value: float, **more: np.ndarray) -> xr.Dataset:
    scan = grid(
        "spherical", theta_i=[5.0, 60.0], theta_r=np.linspace(0, 90, 7), phi=np.arange(0, 360, 33.3).round(1), **more
    )
    shape = tuple(scan.sizes.values())
    return scan.assign(brdf=(tuple(scan.sizes), np.full(shape, value), {"units": "sr-1"}))


def test_tis_is_computed_where_the_scan_has_none(tmp_path):
    """A white Lambertian surface, 1/pi, scatters everything; read again, such a TIS says nothing new."""
    FORMAT.write(lambertian(1 / math.pi), tmp_path / "out")
    found = [float(x) for x in re.findall(r"TIS (\S+)", (tmp_path / "out").read_text())]
    assert found == pytest.approx([1, 1], rel=1e-13)
    again = FORMAT.read(tmp_path / "out")
    assert "tis" not in again
    np.testing.assert_array_equal(again["phi"].values, np.arange(0, 360, 33.3).round(1))


def test_tis_that_is_another_is_kept(tmp_path):
    scan = lambertian(0.25).assign(tis=("theta_i", [0.5, 0.75], {"units": "1"}))
    FORMAT.write(scan, tmp_path / "out")
    assert FORMAT.read(tmp_path / "out")["tis"].values.ravel().tolist() == [0.5, 0.75]


@pytest.mark.parametrize(("power", "expected"), [(0, math.pi), (1, 2 * math.pi / 3), (2, math.pi / 2)])
def test_integral_of_powers_of_the_cosine(power, expected):
    """cos^n over the hemisphere, cosine-weighted: 2 pi/(n + 2). Steps of half a degree: error below h^2/12 = 6e-6."""
    theta = np.linspace(0, 90, 181)
    values = np.repeat(np.cos(np.radians(theta))[:, None] ** power, 8, axis=1)
    assert hemispheres.integral(theta, np.arange(0, 360, 45.0), values) == pytest.approx(expected, rel=1e-5)


def test_integral_is_that_of_the_surface_between_the_nodes():
    """Against brute force over a fine grid, bilinear in theta and azimuth (NumPy's interpolation)."""
    theta, phi = np.array([0, 20, 50, 90.0]), np.array([10, 100, 220, 300.0])
    values = np.random.default_rng(3).uniform(0, 1, (4, 4))
    fine_t, fine_p = (np.arange(4000) + 0.5) * 90 / 4000, (np.arange(3600) + 0.5) / 10
    along = np.array([np.interp(fine_p, phi, row, period=360).mean() for row in values])
    for cosine in (True, False):
        weight = np.sin(np.radians(fine_t)) * (np.cos(np.radians(fine_t)) if cosine else 1)
        brute = (np.interp(fine_t, theta, along) * weight).sum() * math.pi / 2 / 4000 * 2 * math.pi
        assert hemispheres.integral(theta, phi, values, cosine) == pytest.approx(brute, rel=1e-6)  # 4000 midpoints


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (("Asymmetric", "PlaneSymmetric"), "line 1", "Asymmetric was expected"),
        (("Monochrome", "RGB"), "line 2", "Monochrome or XYZ"),
        (("ScatterRadial 3\n0 45 90\n", ""), "line 5", "DataBegin before ScatterRadial"),
        (("0 45 90\nD", "0 45 95\nD"), "line 6", "outside 0 to 90"),
        (("0 45 90\nD", "0 45 45\nD"), "line 6", "neither ascends nor descends"),
        (("ScatterAzimuth 5", "ScatterAzimuth 4611686018427387904"), "line 3", "outside 1 to"),
        (("0 90 180 270 360", "0 90 180 270 370"), "line 4", "outside -360 to 360"),
        (("AOI 0", "AOI -1"), "line 8", "outside 0 to 90"),
        (("AOI 30", "AOI 0"), "line 19", "there already, in line 8"),
        (("AOI 0\n", ""), "line 12", "no AOI"),
        (("POI 90", "POI 0"), "line 9", "POI is 0"),
        (("Side Front", "Side Top"), "line 10", "Front or Back"),
        (("Side Front\n", ""), "line 12", "no Side"),
        (("Wavelength 550", "Wavelength -550"), "line 11", "-550 nm"),
        (("Wavelength 550\n", ""), "line 30", "state it in all, or in none"),
        (("TIS 0.5\n1 2 3", "TIS 0.5\n1 nan 3"), "line 14", "not a finite number"),
        (("1 5 6", "1 5,5 6"), "line 15", "decimal points"),
        (("1 5 6", "1 1_0 6"), "line 15", "not a finite number"),
        (("1 5 6", "1 1e200 6"), "line 15", "no instrument"),
        (("1 5 6", "1 5 6 7"), "line 18", "where there should be 15"),
        (("1 5 6\n", ""), "line 18", "'AOI', not a finite number"),
        (("DataEnd\n", ""), "line 30", "the file ends where AOI"),
        (("DataEnd\n", "DataEnd\n1 2 3\n"), "line 31", "after DataEnd"),
        (("POI 90\n", "POI 90\nPOI 90\n"), "line 10", "twice in the block"),
        (("POI 90\n", "TristimulusValue TrisX\n"), "line 13", "Monochrome file"),
        (("SpectralContent Monochrome", "SpectralContent XYZ"), "line 13", "no TristimulusValue"),
    ],
)
def test_refusals_have_a_place(change, where, what, tmp_path):
    text = HEADER.format("Monochrome") + block(0) + block(30) + "DataEnd\n"
    assert change[0] in text
    path = written(tmp_path, text.replace(*change, 1))
    with pytest.raises(FormatError, match=re.escape(what)) as refusal:
        FORMAT.read(path)
    assert refusal.value.where == where


def test_no_blocks(tmp_path):
    with pytest.raises(FormatError, match="no block"):
        FORMAT.read(written(tmp_path, HEADER.format("Monochrome") + "DataEnd\n"))


def test_writing_refuses_what_the_format_has_not(files, tmp_path):
    scan = FORMAT.read(files["colours"])
    for changed, what in [
        (scan.assign_coords(channel=["R", "G", "B"]), "X, Y and Z"),
        (scan.isel(channel=[0]), "select one channel"),
        (flatten(scan), "resample"),
        (scan.where(scan["theta_r"] < 60), "gaps"),
        (lambertian(0.1, phi_i=[0.0, 45.0]), "one phi_i"),
        (lambertian(0.1).assign(brdf=lambda s: s["brdf"].assign_attrs(units="a.u.")), "calibrate"),
    ]:
        with pytest.raises(ValueError, match=what):
            FORMAT.write(changed, tmp_path / "out")


def test_layout_is_the_own_grid_or_one_near_it(files):
    scan = FORMAT.read(files["plain"])
    own = FORMAT.layout(scan)
    assert dict(own.sizes) == {"theta_i": 2, "theta_r": 3, "phi": 4}
    np.testing.assert_array_equal(own["phi"].values, scan["phi"].values)
    near = FORMAT.layout(flatten(scan))
    assert near["theta_i"].values.tolist() == [0, 30]
    assert near["theta_r"].values.tolist() == list(range(0, 91, 10))
    assert near["phi"].values.tolist() == list(range(0, 360, 10))


def test_recognised_by_content_and_nothing_else_is(files, shared_files):
    for path in files.values():
        assert recognise(path) is FORMAT
    assert not any(FORMAT.recognises(path.read_bytes()[:4096]) for path in shared_files)
    assert not FORMAT.recognises(b"theta_i_deg,theta_r_deg,brdf_sr-1\n0,0,1\n")
    assert FORMAT.recognises(b"\xef\xbb\xbf# remark\r\n\r\nsymmetry Asymmetric\r\n")


def test_no_wavelength(tmp_path):
    path = written(tmp_path, HEADER.format("Monochrome") + block(0, more="") + block(30, more="") + "DataEnd\n")
    scan = read(path)
    assert "wavelength" not in scan.coords
    FORMAT.write(scan, tmp_path / "out")
    xr.testing.assert_equal(FORMAT.read(tmp_path / "out"), FORMAT.read(path))
