"""Speos's text files against numbers that Ansys published, values worked out on paper, and a reading by hand."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio.files import FormatError
from gonio.formats import formats, hemispheres, recognise
from gonio.measured.coordinates import grid
from gonio.measured.dataset import flatten
from samples import speos_anisotropic, speos_brdf
from samples.speos_anisotropic import REFLECTED, TRANSMITTED, table

ANISOTROPIC, SPECTRAL = formats()["speos-anisotropic"], formats()["speos-brdf"]
FOURTHS = "0 90 180 270 360"


def anisotropic(tmp_path: Path, **parts: object) -> xr.Dataset:
    path = tmp_path / "file.anisotropicbsdf"
    path.write_text(speos_anisotropic.text(**parts), encoding="utf-8")  # type: ignore[arg-type]
    return ANISOTROPIC.read(path)


def constant(value: float) -> str:
    """A table of one value over the whole hemisphere: it holds pi times that."""
    return table([f"{theta} {' '.join([repr(value)] * 5)}" for theta in (0, 45, 90)], FOURTHS)


def test_published_twins_of_a_brdf_and_its_intensity(tmp_path):
    """Optical-automation's reference files of one measurement: a BRDF (kind 1), and a BTDF made of it (kind 0).

    The nodes are theta 0, 45, 85 and azimuths 0, 20, 180 of their first incidence. Published to 17 digits, so that the
    quotient is the cosine to rounding.
    """
    reflected = [
        "0 0.17944232155258916 0.17944232155258916 0.17944232155258916 0.17944232155258916",
        "45 0.17525565859721132 0.1685346056628973 0.11239080476335979 0.17525565859721132",
        "85 0 0.014841049474914466 0 0",
    ]
    transmitted = [
        "95 0 0.001293482690140912 0 0",
        "135 0.12392446463540259 0.1191719625288354 0.07947230019118504 0.12392446463540259",
        "180 0.17944232155258916 0.17944232155258916 0.17944232155258916 0.17944232155258916",
    ]
    azimuths = "0 20 180 360"
    brdf = anisotropic(tmp_path, tables=[table(reflected, azimuths)] * 2)
    btdf = anisotropic(tmp_path, kind=0, flags="0 1", tables=[table(transmitted, azimuths)] * 2)
    assert btdf["mode"].values.tolist() == ["transmission"]
    for name in ("theta_i", "theta_r", "phi"):
        np.testing.assert_array_equal(btdf[name].values, brdf[name].values)
    one, other = (scan["brdf"].values.ravel() for scan in (brdf, btdf))
    lit = one > 0
    assert lit.sum() == 2 * 7  # two incidences of three, three and one
    np.testing.assert_array_equal(other > 0, lit)
    quotients = other[lit] / one[lit]
    np.testing.assert_allclose(quotients, quotients[0], rtol=1e-14)


def gaussian(mirror: list[float], theta: float, azimuth: float) -> float:
    """The lobe of pyspeos's tutorial about a direction of its frame: x forward, z the normal."""
    t, p = math.radians(theta), math.radians(azimuth)
    direction = (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
    cosine = sum(a * b for a, b in zip(mirror, direction, strict=True))
    return math.exp(-0.5 * (math.degrees(math.acos(min(1.0, cosine))) / 10) ** 2)


@pytest.mark.parametrize("mode", ["reflection", "transmission"])
def test_light_goes_on_in_the_forward_direction(mode, tmp_path):
    """Mirrored light and light that passes unbent are at azimuth 0 of Speos: phi = 180 deg at theta_r = theta_i."""
    through = mode == "transmission"
    mirror = [math.sin(math.radians(30)), 0.0, math.cos(math.radians(30)) * (-1 if through else 1)]
    azimuths = list(range(0, 361, 10))
    thetas = range(90, 181, 10) if through else range(0, 91, 10)
    rows = [" ".join(map(repr, [t, *(gaussian(mirror, t, p) for p in azimuths)])) for t in thetas]
    one = table(rows, " ".join(map(str, azimuths)))
    scan = anisotropic(tmp_path, flags="0 1" if through else "1 0", incidences="30", at="30 0", tables=[one])
    top = flatten(scan)
    top = top.isel(direction=int(top["brdf"].values.argmax()))
    assert (top["theta_r"].item(), top["phi"].item()) == (30, 180)
    assert scan["mode"].values.tolist() == [mode]


def test_azimuths_run_counterclockwise(tmp_path):
    scan = anisotropic(tmp_path)
    at = scan["brdf"].isel(mode=0, theta_i=0).sel(theta_r=45)
    quotients = at / at.sel(phi=180)
    assert quotients.sel(phi=[180, 270, 0, 90]).values == pytest.approx([2 / 2, 3 / 2, 4 / 2, 5 / 2], rel=1e-15)


def test_a_lambertian_of_80_percent(tmp_path):
    """The tutorial's own: intensities cos(theta)/pi, a spectrum of 80 %. The BRDF is 0.8/pi everywhere.

    Between steps of 1 deg a cosine is flatter than itself by h^2/12 = 2.5e-5, which the scale makes up for.
    """
    thetas = np.arange(91.0)
    rows = [" ".join(map(repr, [t, *[math.cos(math.radians(t)) / math.pi] * 5])) for t in thetas.tolist()]
    scan = anisotropic(tmp_path, kind=0, spectrum=("380 80", "780 80"), tables=[table(rows, FOURTHS)] * 2)
    values = scan["brdf"].values
    assert scan["brdf"].attrs["units"] == "sr-1"
    np.testing.assert_allclose(values, values.ravel()[0], rtol=1e-11)  # cos(89 deg) is known to 1e-14 of itself
    np.testing.assert_allclose(values, 0.8 / math.pi, rtol=3e-5)
    assert scan["theta_r"].values.max() == 89
    assert "divided by cos(theta_r); at 90 deg" in scan.attrs["history"]


def test_a_constant_table_is_scaled_on_paper(tmp_path):
    """Whatever the constant, the spectrum's 50 % make it 0.5/pi at the spectrum's incidence."""
    scan = anisotropic(tmp_path, tables=[constant(7.0), constant(14.0)])
    np.testing.assert_allclose(scan["brdf"].sel(theta_i=0).values, 0.5 / math.pi, rtol=1e-14)
    np.testing.assert_allclose(scan["brdf"].sel(theta_i=30).values, 1.0 / math.pi, rtol=1e-14)


@pytest.mark.parametrize(
    ("at", "scale"),
    [
        (0, 1 / (2 * math.pi)),
        (30, 1 / (8 * math.pi)),
        (10, (2 / 3) / (2 * math.pi) + (1 / 3) / (8 * math.pi)),  # the help: the two around it, weighted by distance
        (50, 1 / (8 * math.pi)),
    ],
)
def test_the_incidence_of_the_spectrum(at, scale, tmp_path):
    scan = anisotropic(tmp_path, at=f"{at} 0", tables=[constant(2.0), constant(8.0)])
    np.testing.assert_allclose(scan["brdf"].sel(theta_i=0).values, 2.0 * 0.5 * scale, rtol=1e-13)
    np.testing.assert_allclose(scan["brdf"].sel(theta_i=30).values, 8.0 * 0.5 * scale, rtol=1e-13)


def test_below_the_first_incidence_the_first_holds(tmp_path):
    scan = anisotropic(tmp_path, incidences="20 60", at="0 0", tables=[constant(2.0), constant(8.0)])
    np.testing.assert_allclose(scan["brdf"].sel(theta_i=20).values, 0.5 / math.pi, rtol=1e-13)


def test_each_wavelength_is_the_table_times_the_spectrum(tmp_path):
    scan = anisotropic(tmp_path, spectrum=("400 10", "500 30", "600 20"), tables=[constant(2.0)] * 2)
    assert scan["wavelength"].values.tolist() == [400, 500, 600]
    assert scan["wavelength"].attrs["units"] == "nm"
    for nm, percent in ((400, 10), (500, 30), (600, 20)):
        np.testing.assert_allclose(scan["brdf"].sel(wavelength=nm).values, percent / 100 / math.pi, rtol=1e-12)
    assert "one reflection table times the spectrum, not as many measurements" in scan.attrs["history"]


def test_a_flat_spectrum_gives_no_wavelength(tmp_path):
    scan = anisotropic(tmp_path)
    assert "wavelength" not in scan.coords
    assert "flat from 350 to 850 nm: no wavelength" in scan.attrs["history"]
    assert anisotropic(tmp_path, spectrum=("633 5",))["wavelength"].values.tolist() == [633]


def test_orientations_become_phi_i(tmp_path):
    """The vector is `orientation` counterclockwise from forward, so that the light comes from 180 deg less that."""
    tables = [constant(value) for value in (1.0, 1.0, 2.0, 2.0, 3.0, 3.0)]
    scan = anisotropic(tmp_path, orientations="0 45 90", at="0 45", tables=tables)
    assert scan.attrs["symmetry"] == "anisotropic"
    assert scan["brdf"].dims == ("mode", "theta_i", "theta_r", "phi", "phi_i")
    assert scan["phi_i"].values.tolist() == [90, 135, 180]
    at = scan["brdf"].isel(mode=0, theta_i=0, theta_r=0, phi=0)
    np.testing.assert_allclose(at.sel(phi_i=[180, 135, 90]).values * math.pi, [0.25, 0.5, 0.75], rtol=1e-13)
    assert anisotropic(tmp_path, orientations="30")["phi_i"].values.tolist() == [150]


def test_what_cannot_be_scaled_is_relative(tmp_path):
    for parts in (
        {"tables": [table(REFLECTED, "0 10 20 30 40")] * 2},  # no circle
        {"tables": [table(["0 0 0 0 0 0", "45 0 0 0 0 0"]), table(REFLECTED[:2])]},  # no light where it is measured
        {"tables": [table(REFLECTED[:1])] * 2},  # no solid angle
    ):
        scan = anisotropic(tmp_path, **parts)
        assert scan["brdf"].attrs["units"] == "a.u."
        assert "relative" in scan.attrs["history"]
    assert scan["brdf"].values.ravel().tolist() == [1] * 8


def test_every_value_zero(tmp_path):
    dark = [table(["0 0 0 0 0 0", "90 0 0 0 0 0"])] * 2
    scan = anisotropic(tmp_path, tables=dark, spectrum=("350 0", "850 0"))
    assert scan.attrs["history"].endswith("every value is zero")
    assert not scan["brdf"].values.any()


def test_tables_that_differ_are_a_flat_scan(tmp_path):
    scan = anisotropic(tmp_path, tables=[table(REFLECTED), table(REFLECTED[:2])])
    assert scan["brdf"].dims == ("direction",)
    assert scan.sizes["direction"] == 12 + 8
    assert "tables differ" in scan.attrs["history"]


def test_provenance(tmp_path):
    scan = anisotropic(tmp_path)
    assert scan.attrs["provenance"] == "comment: Comment\nDescription\nanisotropy vector: 0 1 0"


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("counts_two", [False, True])
def test_a_description_of_several_lines(line_end, counts_two, tmp_path):
    """Its length counts the line ends: as one character each, or under Windows as two."""
    length = len("one\ntwo 3\nthree") + (2 if counts_two and line_end == "\r\n" else 0)
    text = speos_anisotropic.text().replace("11\nDescription\n", f"{length}\none\ntwo 3\nthree\n")
    path = tmp_path / "file"
    path.write_bytes(text.replace("\n", line_end).encode())
    assert ANISOTROPIC.read(path).attrs["provenance"].splitlines()[1:4] == ["one", "two 3", "three"]


def test_percentages_of_a_brdf_file(tmp_path):
    """The integral of every table is its percentage; the wavelength runs faster than the incidence."""
    path = tmp_path / "file"
    path.write_text(speos_brdf.text(flags="1\t1"), encoding="utf-8")
    scan = SPECTRAL.read(path)
    assert scan["brdf"].dims == ("mode", "wavelength", "theta_i", "theta_r", "phi")
    for mode in ("reflection", "transmission"):
        for nm in (450, 550):
            for theta_i in (0, 30):
                part = scan["brdf"].sel(mode=mode, wavelength=nm, theta_i=theta_i)
                found = hemispheres.integral(scan["theta_r"].values, scan["phi"].values, part.values)
                assert found == pytest.approx((10 + theta_i / 10 + nm / 100) / 100, rel=1e-13)
                forward, back = (part.sel(theta_r=45, phi=phi).item() for phi in (180, 0))
                assert back == pytest.approx(2 * forward, rel=1e-14)
    assert "scaled by" in scan.attrs["history"]


def test_equal_tables_of_a_brdf_file_give_no_wavelength(tmp_path):
    path = tmp_path / "file"
    path.write_text(speos_brdf.text(same=True), encoding="utf-8")
    scan = SPECTRAL.read(path)
    assert "wavelength" not in scan.coords
    assert "the same from 450 to 550 nm" in scan.attrs["history"]


@pytest.mark.parametrize("kind", [ANISOTROPIC, SPECTRAL], ids=lambda kind: kind.name)
def test_round_trips_are_exact(kind, tmp_path):
    samples = speos_anisotropic.samples if kind is ANISOTROPIC else speos_brdf.samples
    count = 0
    for path in samples(tmp_path):
        scan = kind.read(path)
        assert recognise(path) is kind
        if scan["brdf"].dims == ("direction",) or scan["brdf"].attrs["units"] != "sr-1":
            continue
        count += 1
        kind.write(scan, tmp_path / "out")
        again = kind.read(tmp_path / "out")
        xr.testing.assert_equal(again, scan)
        for name in scan.variables:
            assert again[name].attrs == scan[name].attrs, name
        assert again.attrs["provenance"] == scan.attrs["provenance"]
        assert again.attrs["symmetry"] == scan.attrs["symmetry"]
        assert recognise(tmp_path / "out") is kind
    assert count == (8 if kind is ANISOTROPIC else 5)


def made(value: Callable[..., np.ndarray] | None = None, **more: object) -> xr.Dataset:
    axes = {"theta_i": [5.0, 60.0], "theta_r": np.linspace(0, 90, 7), "phi": np.arange(0.0, 360, 30)}
    scan = grid("spherical", **axes, **more)
    values = np.random.default_rng(5).uniform(0.1, 1, tuple(scan.sizes.values()))
    return scan.assign(brdf=(tuple(scan.sizes), values, {"units": "sr-1"}))


@pytest.mark.parametrize("kind", [ANISOTROPIC, SPECTRAL], ids=lambda kind: kind.name)
def test_a_scan_from_elsewhere(kind, tmp_path):
    for scan in (made(), made().expand_dims(wavelength=[633.0]), made().expand_dims(mode=["transmission"])):
        kind.write(scan, tmp_path / "out")
        again = kind.read(tmp_path / "out")
        expected = scan if "mode" in scan.dims else scan.expand_dims(mode=["reflection"])
        np.testing.assert_array_equal(again["brdf"].transpose(*expected["brdf"].dims).values, expected["brdf"].values)
        for name in expected.dims:
            np.testing.assert_array_equal(again[name].values, expected[name].values)


def test_a_turned_scan_from_elsewhere(tmp_path):
    scan = made(phi_i=[0.0, 33.3, 200.0])
    ANISOTROPIC.write(scan, tmp_path / "out")
    again = ANISOTROPIC.read(tmp_path / "out")
    xr.testing.assert_equal(again["brdf"].isel(mode=0, drop=True), scan["brdf"])


def test_layout_keeps_phi_i_where_the_format_does():
    scan = made(phi_i=[0.0, 45.0])
    assert "phi_i" in ANISOTROPIC.layout(scan).dims
    assert "phi_i" not in SPECTRAL.layout(scan).dims
    assert ANISOTROPIC.layout(flatten(scan))["phi_i"].values.tolist() == [0, 45]
    assert SPECTRAL.layout(flatten(scan))["theta_i"].values.tolist() == [5, 60]


def test_layout_goes_all_round():
    half = made().sel(phi=slice(0, 180))
    assert ANISOTROPIC.layout(half)["phi"].values.tolist() == list(range(0, 360, 30))
    assert ANISOTROPIC.layout(made())["phi"].values.tolist() == list(range(0, 360, 30))


def test_writing_refuses_what_speos_does_not_take(tmp_path):
    scan = made()
    waves = xr.concat([scan, made() * 2 + 0.1], "wavelength").assign_coords(wavelength=[450.0, 550.0])
    waves["brdf"].attrs["units"] = "sr-1"
    for kind, changed, what in [
        (ANISOTROPIC, waves, "one table times a spectrum"),
        (ANISOTROPIC, scan.assign(brdf=-scan["brdf"].assign_attrs(units="sr-1")), "negative"),
        (ANISOTROPIC, scan.sel(phi=slice(0, 90)), "over the full circle"),
        (ANISOTROPIC, flatten(scan), "resample"),
        (SPECTRAL, made(phi_i=[0.0, 90.0]), "no turned surfaces"),
        (SPECTRAL, scan.isel(theta_i=[0]), "two incidences"),
    ]:
        changed["brdf"].attrs["units"] = "sr-1"
        with pytest.raises(ValueError, match=what):
            kind.write(changed, tmp_path / "out")


PLAIN = speos_anisotropic.text(flags="1 1")
REFUSALS = [
    (("v8.0", "v6.0"), "line 1", "is version '6.0': gonio reads 7.0 and 8.0"),
    (("8.0\n0\n", "8.0\n1\n"), "line 2", "binary mode"),
    (("11\nD", "-1\nD"), "line 4", "not a whole number"),
    (("11\nD", "4611686018427387904\nD"), "line 4", "not a whole number"),
    (("11\nD", "99999\nD"), "line 47", "the file ends where the description"),
    (("0\t1\t0", "0\t1"), "line 7", "where there should be 3"),
    (("1 1\n1\n1", "0 0\n1\n1"), "line 7", "neither reflection nor transmission"),
    (("1 1\n1\n1", "2 1\n1\n1"), "line 7", "0 or 1"),
    (("1 1\n1\n1", "1 1\n2\n1"), "line 8", "0 or 1"),
    (("2\n0 30", "2\n0 130"), "line 12", "outside 0 to 90"),
    (("2\n0 30", "2\n0 0"), "line 12", "neither ascends nor descends"),
    (("2\n0 30", "999999999\n0 30"), "line 47", "the file ends"),
    (("0 0\n\n2", "-5 0\n\n2"), "line 17", "outside 0 to 90"),
    (("350 50", "0 50"), "line 20", "neither may be negative"),
    (("350 50", "350 -50"), "line 20", "neither may be negative"),
    (("850 50", "350 50"), "line 21", "neither ascends nor descends"),
    (("850 50", "850 50 50"), "line 21", "where there should be 2"),
    (("3 5\n", "3 5 1\n"), "line 27", "the number of thetas and the number of azimuths"),
    (("90\t180", "90\t80"), "line 28", "neither ascends nor descends"),
    (("90\t180\t270\t360", "90\t180\t270\t460"), "line 28", "outside -360 to 360"),
    (("0 1 1 1 1 1", "0 1 1 1 1"), "line 30", "where there should be 6"),
    (("45 2 3", "45 nan 3"), "line 30", "not a finite number"),
    (("45 2 3", "45 2,5 3"), "line 30", "decimal points"),
    (("45 2 3", "45 1e300 3"), "line 30", "no instrument"),
    (("90 2 3 4 3 2", "100 2 3 4 3 2"), "line 31", "outside 0 to 90"),
    (("180 1 1 1 1 1\n", "180 1 1 1 1 1\nEnd of file\n7\n"), "line 42", "where"),
    (("180 1 1 1 1 1\n", "80 1 1 1 1 1\n"), "line 41", "outside 90 to 180"),
]


@pytest.mark.parametrize(("change", "where", "what"), REFUSALS)
def test_refusals_have_a_place(change, where, what, tmp_path):
    assert change[0] in PLAIN
    path = tmp_path / "file"
    path.write_text(PLAIN.replace(*change, 1), encoding="utf-8")
    with pytest.raises(FormatError, match=re.escape(what)) as refusal:
        ANISOTROPIC.read(path)
    assert refusal.value.where == where


def test_more_after_the_last_table(tmp_path):
    path = tmp_path / "file"
    path.write_text(PLAIN + "End of file\n7 7\n", encoding="utf-8")
    with pytest.raises(FormatError, match="after the last table"):
        ANISOTROPIC.read(path)


def test_blank_lines_are_skipped_up_to_a_limit(tmp_path):
    path = tmp_path / "file"
    for count in (9_000, 11_000):
        path.write_text(PLAIN.replace("45 2 3", "\n" * count + "45 2 3", 1), encoding="utf-8")
        if count < 10_000:
            assert ANISOTROPIC.read(path)["mode"].values.tolist() == ["reflection", "transmission"]
            continue
        with pytest.raises(FormatError, match="10000 blank lines") as refusal:
            ANISOTROPIC.read(path)
        assert refusal.value.where == f"line {29 + 10_000}"


def test_too_many_values(tmp_path):
    """A spectrum of thousands of wavelengths times a table of thousands of directions, from a small file."""
    azimuths = " ".join(f"{k * 0.1:g}" for k in range(3600))
    rows = [f"{theta} {'1 ' * 3600}" for theta in (0, 45, 90)]
    spectrum = [f"{400 + k} {k}" for k in range(1, 1000)]
    with pytest.raises(FormatError, match="thin out the spectrum"):
        anisotropic(tmp_path, incidences="0", tables=[table(rows, azimuths)], spectrum=spectrum)


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (("v8.0", "v7.0"), "line 1", "is version '7.0': gonio reads 9.0 and 8.0"),
        (("450\t550", "450\t450"), "line 10", "neither ascends nor descends"),
        (("450\t550", "0\t550"), "line 10", "outside"),
        (("14.5\n", "-14.5\n"), "line 11", "below zero"),
        (("14.5\n", "14.5 1\n"), "line 11", "where there should be 1"),
        (("0\t30\n", "0\t91\n"), "line 9", "outside 0 to 90"),
    ],
)
def test_refusals_of_a_brdf_file_have_a_place(change, where, what, tmp_path):
    text = speos_brdf.text()
    assert change[0] in text
    path = tmp_path / "file"
    path.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(FormatError, match=re.escape(what)) as refusal:
        SPECTRAL.read(path)
    assert refusal.value.where == where


def test_recognised_by_content_and_nothing_else_is(shared_files):
    for kind in (ANISOTROPIC, SPECTRAL):
        assert not any(kind.recognises(path.read_bytes()[:4096]) for path in shared_files)
    assert ANISOTROPIC.recognises(b"\xef\xbb\xbfOptis - Anisotropic bsdf surface file v6.0\r")
    assert not ANISOTROPIC.recognises(b"OPTIS - Anisotropic BSDF surface file v1.0\t\r")
    assert SPECTRAL.recognises(b"OPTIS - Brdf surface file v9.0\n")
    assert not SPECTRAL.recognises(b"OPTIS - Anisotropic BSDF surface file v8.0\n")


def test_transmitted_tables_are_the_same_as_reflected_ones(tmp_path):
    """Rows from 90 to 180 deg in transmission are those from 0 to 90 in reflection, upside down."""
    turned = [f"{180 - float(row.split()[0]):g} {row.split(' ', 1)[1]}" for row in reversed(REFLECTED)]
    assert turned == TRANSMITTED
    scan = anisotropic(tmp_path, flags="1 1")
    values = scan["brdf"].sel(mode="transmission").values
    np.testing.assert_array_equal(values, scan["brdf"].sel(mode="reflection").values)
