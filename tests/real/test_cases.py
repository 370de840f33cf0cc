"""The cases from the field beside the project: each gives what its README says that it should."""

import re

import numpy as np
import pytest

from gonio import Problem, catalogue, check, compare, convert, fit, read, read_table, write
from gonio.app.views.file import describe
from gonio.files import FormatError
from gonio.formats.radiance.klems import FULL
from gonio.plausibility import of_scan
from gonio.plotting.hemisphere import hemisphere
from gonio.plotting.style import save
from gonio.reduction.sheets import reduce
from gonio.resampling.conversion import in_words
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling, resample


def test_01_the_normal_seen_twice_is_described(shared_cases):
    for name, count in (("grid10", 216), ("repeat", 10)):
        record = describe(shared_cases / "01-info-crash-normal" / f"{name}.csv")
        assert record["points"] == count
        assert all(np.isnan(h["gamma"]) or h["gamma"] > 0 for h in record["half_widths"])


@pytest.mark.parametrize("name", ["scan.txt", "panel.txt"])
def test_02_a_comment_that_names_other_columns_is_believed(shared_cases, name):
    with pytest.raises(FormatError, match=r"line 1: the comment names the columns"):
        read(shared_cases / "02-five-columns-other-meaning" / name)


def test_03_the_azimuth_of_the_detector_is_read(shared_cases):
    scan = read(shared_cases / "03-phi_r-column-dropped" / "ring.csv")
    assert scan["phi"].values.tolist() == [0, 45, 90, 135, 90, 120, 180]


def test_04_reciprocal_data_of_a_turned_surface_score_zero(shared_cases):
    scan = read(shared_cases / "04-reciprocity-ignores-phi_i" / "reciprocal.csv")
    figures = next(v for v in of_scan(scan) if v.law == "reciprocity").figures
    assert figures["pairs"] > 50
    assert figures["rms ln ratio"] == figures["worst ln ratio"] == 0
    same = resample(scan, scan, impose=["reciprocity"])
    assert sorted(same["brdf"].values.tolist()) == pytest.approx(sorted(scan["brdf"].values.tolist()), rel=1e-12)


def test_05_transmission_of_one_side_fills_nothing_by_reciprocity(shared_cases):
    folder = shared_cases / "05-fill-symmetry-transmission"
    measured, wanted = read(folder / "measured.csv"), read(folder / "wanted.csv")
    filled = resample(measured, wanted, filling=Filling(("reciprocity", "bilateral")))
    gaps = (filled["theta_i"] == 10) & (filled["theta_r"] == 70)
    assert gaps.any()
    assert filled["brdf"].values[gaps.values] == pytest.approx(np.nan, nan_ok=True)


@pytest.mark.parametrize(("to", "suffix"), [("merl", ".binary"), ("utia", ".bin")])
def test_10_a_scan_without_channels_stands_in_all_three(shared_cases, tmp_path, to, suffix):
    mono = read(shared_cases / "10-monochrome-to-merl-utia" / "mono.csv")
    filling = Filling(
        ("reciprocity", "bilateral"), lambda points: np.full(points.sizes["direction"], 0.1), "a constant"
    )
    done = convert(mono, tmp_path / f"out{suffix}", to, filling=filling)
    again = read(done.path)
    assert again["channel"].values.tolist() == ["R", "G", "B"]
    values = again["brdf"].transpose("channel", ...).values
    np.testing.assert_allclose(values[1:], values[:1].repeat(2, 0), rtol=1e-12)
    assert "the values stand in R, G, B alike" in done.scan.attrs["history"]


@pytest.mark.parametrize(
    ("to", "suffix"), [("ssdd", ".ssdd"), ("rgl", ".bsdf"), ("integra", ".brs"), ("zemax", ".bsdf")]
)
def test_16_one_named_channel_is_monochrome(shared_cases, tmp_path, to, suffix):
    visible = read(shared_cases / "16-one-named-channel" / "visible.csv")
    filling = Filling((), lambda points: np.full(points.sizes["direction"], 0.1), "a constant")
    done = convert(visible, tmp_path / f"out{suffix}", to, filling=filling)
    assert "channel Visible" in done.left_out
    assert "channel" not in read(done.path).dims


def test_06_a_tree_becomes_a_matrix_of_means(shared_cases, tmp_path):
    """12.2231 in the cell of the incident one of 64, else 0.01: T = 12.2231 pi/64 + 0.01 x 63 pi/64 for every patch."""
    done = convert(read(shared_cases / "06-tensortree-to-klems" / "tree.xml"), tmp_path / "k.xml", "radiance")
    written = read(tmp_path / "k.xml")
    squares = np.sin(np.radians(FULL.bounds)) ** 2
    weights = np.repeat(np.pi * np.diff(squares) / FULL.counts, FULL.counts)
    transmittance = written["brdf"].squeeze().transpose("incident", "outgoing").values @ weights
    np.testing.assert_allclose(transmittance, (12.2231 + 0.63) * np.pi / 64, rtol=1e-9)
    assert "against the means over their patches" in in_words(done.error, done.format)


def test_07_the_energy_of_a_table_is_told(shared_cases):
    path = shared_cases / "07-energy-never-told" / "lambert15.csv"
    energy = next(v for v in of_scan(read(path)) if v.law == "energy")
    assert energy.holds is False
    assert energy.figures == pytest.approx({"DHR(0)": 1.5, "DHR(30)": 1.5, "DHR(60)": 1.5}, rel=1e-3)
    assert any("150 % of the light" in finding["what"] for finding in describe(path)["checks"])


def test_08_the_patches_of_a_matrix_are_the_directions_of_one_scan(shared_cases, tmp_path):
    done = convert(read(shared_cases / "08-rgl-klems-not-fitted" / "lambert.csv"), tmp_path / "k.xml", "radiance")
    matrix = read(done.path)
    assert fit(Problem(catalogue["lambert"], matrix)).values["rho"] == pytest.approx(0.5, rel=1e-6)
    rows = compare(matrix, [catalogue["lambert"], catalogue["ggx"]])
    assert {row.model.name for row in rows} == {"lambert", "ggx"}
    write(matrix, tmp_path / "k.nc")
    assert fit(Problem(catalogue["lambert"], read(tmp_path / "k.nc"))).values["rho"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize("name", ["brackets.csv", "caps.csv", "tabs.tsv", "excel_tail.csv"])
def test_12_a_heading_that_states_all_is_read(shared_cases, name):
    scan = read(shared_cases / "12-plain-lab-table" / name)
    assert scan["theta_i"].values.tolist() == [30, 30]
    assert (scan["phi"].values.tolist(), scan["theta_r"].values.tolist()) == ([0, 180], [20, 20])
    assert scan["brdf"].values.tolist() == [0.1, 0.2]


@pytest.mark.parametrize("name", ["brf_wide.txt", "wide.csv", "header_bare.txt"])
def test_12_a_heading_that_does_not_is_refused_with_the_command(shared_cases, name):
    path = shared_cases / "12-plain-lab-table" / name
    with pytest.raises(FormatError, match=f"gonio import {re.escape(str(path))}"):
        read(path)


def test_12_a_reflectance_factor_of_three_wavelengths(shared_cases):
    """Row 1: theta_i 15, theta_r 0, 450 nm, BRDF 1.030/pi; the last row is at the mirror direction, phi = 180."""
    scan = read_table(shared_cases / "12-plain-lab-table" / "brf_wide.txt")
    first = scan.isel(direction=0)
    assert [first[n].item() for n in ("theta_i", "theta_r", "wavelength")] == [15, 0, 450]
    assert first["brdf"].item() == pytest.approx(1.030 / np.pi, rel=1e-12)
    last = scan.isel(direction=-1)
    assert [last[n].item() for n in ("theta_i", "theta_r", "phi", "wavelength")] == [45, 45, 180, 650]


def test_12_one_column_a_wavelength(shared_cases):
    path = shared_cases / "12-plain-lab-table" / "wide.csv"
    for flags in ({}, {"values": "*nm"}):
        scan = read_table(path, **flags)
        assert scan["wavelength"].values.tolist() == [450] * 3 + [550] * 3 + [650] * 3
        assert scan["brdf"].values.tolist() == [0.1, 0.9, 1.1, 0.11, 0.95, 1.2, 0.12, 0.99, 1.3]
        assert scan["theta_r"].values[:3].tolist() == [20, 10, 40]
        assert scan["phi"].values[:3].tolist() == [0, 180, 180]


def test_12_angles_called_by_each_other_are_asked_about(shared_cases):
    """The polar angles are called phi: 5, -60 is on the side of the source, and 41.4, 41 is the mirror direction."""
    path = shared_cases / "12-plain-lab-table" / "header_bare.txt"
    with pytest.raises(FormatError, match="the polar angle phi and the azimuth theta"):
        read_table(path)
    scan = read_table(path, columns="theta_i=phi_i,phi_i=theta_i,theta_o=phi_r,phi_o=theta_r")
    assert scan["theta_i"].values.tolist() == [5, 5, 41.4]
    assert scan["theta_r"].values.tolist() == [60, 50, 41]
    assert scan["phi"].values.tolist() == [0, 0, 180]


def test_13_values_without_a_relative_difference_are_counted(shared_cases):
    folder = shared_cases / "13-diff-largest-zero"
    found = difference(read(folder / "a.csv"), read(folder / "b.csv"))
    assert found.without_ratio == 4
    assert found.largest == 0
    assert found.largest_absolute == 0.5
    assert (found.where_absolute["theta_i"], found.where_absolute["theta_r"]) == (30, 60)


def test_17_what_says_no_mode_is_reflection(shared_cases):
    folder = shared_cases / "17-diff-reflection-with-transmission"
    brdf, both = read(folder / "brdf.csv"), read(folder / "both.csv")
    for other, reference in ((brdf, both), (both, brdf)):
        found = difference(other, reference)
        assert (found.count, found.rms, found.largest) == (5, 0, 0)
    through = both.isel(direction=np.flatnonzero(both["mode"] == "transmission"))
    for other, reference in ((brdf, through), (through, brdf)):
        with pytest.raises(ValueError, match="one is of transmission"):
            difference(other, reference)


def test_11_a_later_version_with_the_same_rows_is_read(shared_cases):
    folder = shared_cases / "11-speos-v11"
    later, known = read(folder / "v11.anisotropicbsdf"), read(folder / "v8.anisotropicbsdf")
    np.testing.assert_array_equal(later["brdf"].values, known["brdf"].values)


def test_14_a_turned_surface_is_no_repeat(shared_cases):
    scans = [read(shared_cases / "14-reduce-drops-phi_i" / f"turned{angle}.csv") for angle in (0, 90)]
    reduced = reduce(scans)
    there = (reduced["theta_i"].values == 10) & (reduced["theta_r"].values == 5)
    values = set(zip(reduced["phi_i"].values[there].tolist(), reduced["brdf"].values[there].tolist(), strict=True))
    assert values == {(0, 0.0205), (90, 0.0615)}
    assert reduced["repeats"].values.max() == 1


def test_15_a_sign_that_may_be_turned_is_asked_about(shared_cases):
    scan = read(shared_cases / "15-sign-flipped-unnoticed" / "flipped.csv")
    assert any("backscatter direction" in f.what and "change the sign" in f.remedy for f in check(scan))
    right = scan.assign_coords(phi=("direction", (scan["phi"].values + 180) % 360, {"units": "degree"}))
    assert not any("backscatter" in f.what for f in check(right))


def test_18_text_before_the_xml_is_a_remark(shared_cases):
    scan = read(shared_cases / "18-xml-after-a-line-of-text" / "recover.xml")
    assert np.isfinite(scan["brdf"].values).any()
    assert "Recover using" in scan.attrs["provenance"]


def test_19_a_hemisphere_of_nothing_is_drawn(tmp_path):
    nothing = {"a": (30.0, lambda g: 0 * g.cos_r), "b": (30.0, lambda g: 0 * g.cos_r - 1.0)}
    for logarithmic in (True, False):
        save(hemisphere(nothing, unit="sr-1", logarithmic=logarithmic), tmp_path / f"h{logarithmic}", (".png",))


def test_09_one_wavelength_is_stored_as_the_block_that_radiance_reads(shared_cases, tmp_path):
    """Radiance itself sees 0.4998 in this file, and saw 0 in one with <Wavelength unit="nm">650.0</Wavelength>."""
    done = convert(read(shared_cases / "09-radiance-not-visible" / "red.csv"), tmp_path / "red.xml", "radiance")
    text = done.path.read_text(encoding="utf-8")
    assert (
        re.findall("<Wavelength .*?</Wavelength>", text) == ['<Wavelength unit="Integral">Visible</Wavelength>'] * 2
    )  # both sides
    assert any(line.endswith("stored as Visible") for line in done.left_out)


def test_31_a_matrix_has_what_pywincalc_requires(shared_cases, tmp_path):
    """PyWinCalc 3.3.1 reads this file; it raised without each of these four."""
    done = convert(read(shared_cases / "31-window-xml-pywincalc" / "lambert.csv"), tmp_path / "k.xml", "radiance")
    text = done.path.read_text(encoding="utf-8")
    for element in (
        "<Name>[^<]+</Name>",
        "<Manufacturer>[^<]+</Manufacturer>",
        '<Thickness unit="Meter">[^<]+</Thickness>',
    ):
        assert re.search(element, text)
    first = re.search(r"<ScatteringData>\s*([^\n]*)", text)
    assert first is not None
    assert first[1].count(",") == 145
