"""The cases from the field beside the project: each gives what its README says that it should."""

import numpy as np
import pytest

from gonio import Problem, catalogue, compare, convert, fit, read, write
from gonio.app.views.file import describe
from gonio.files import FormatError
from gonio.plausibility import of_scan
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


def test_08_the_patches_of_a_matrix_are_the_directions_of_one_scan(shared_cases, tmp_path):
    done = convert(read(shared_cases / "08-rgl-klems-not-fitted" / "lambert.csv"), tmp_path / "k.xml", "radiance")
    matrix = read(done.path)
    assert fit(Problem(catalogue["lambert"], matrix)).values["rho"] == pytest.approx(0.5, rel=1e-6)
    rows = compare(matrix, [catalogue["lambert"], catalogue["ggx"]])
    assert {row.model.name for row in rows} == {"lambert", "ggx"}
    write(matrix, tmp_path / "k.nc")
    assert fit(Problem(catalogue["lambert"], read(tmp_path / "k.nc"))).values["rho"] == pytest.approx(0.5, rel=1e-6)
