"""The commands about files: formats, info on whatever gonio reads, convert, diff."""

import json

import numpy as np
import pytest

from gonio import read, write
from gonio.formats import formats
from gonio.measured.dataset import make_scan
from places import SHARED


@pytest.fixture
def shared():
    if not SHARED.is_dir():
        pytest.skip(f"no files at {SHARED}")
    return SHARED


@pytest.fixture
def scan_file(tmp_path):
    theta_i, theta_r, phi = (
        a.ravel() for a in np.meshgrid([10.0, 40], np.arange(0, 81, 10.0), np.arange(0, 360, 30.0))
    )
    path = tmp_path / "scan.csv"
    write(make_scan(theta_i, theta_r, 0.1 + np.cos(np.radians(theta_r)), phi), path)
    return path


def as_json(run, *arguments):
    code, out, err = run(*arguments, "--json", "-")
    assert code == 0, err
    return json.loads(out)


def test_formats_are_listed_within_eighty_columns(run):
    code, out, _ = run("formats")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    assert all(name in out for name in formats())
    listed = as_json(run, "formats")
    assert [f["name"] for f in listed] == list(formats())
    assert {f["name"]: f["write"] for f in listed}["zemax"] is True


@pytest.mark.parametrize(
    "pattern", ["zemax/*.bsdf", "fred/*.txt", "columns/*.csv", "rgl/*white*", "bird/*.brdf", "rt300s/01*.xls"]
)
def test_info_says_what_a_file_holds(run, shared, pattern):
    keys = {"format", "quantity", "unit", "points", "wavelengths", "symmetry", "history"}
    for path in sorted((shared / "files").glob(pattern)):
        record = as_json(run, "info", path)
        assert keys <= set(record)
        assert record["points"] >= 8
        assert record["unit"] in ("sr-1", "a.u.")
        assert f"as {record['format']}" in record["history"][-1]
        code, out, _ = run("info", path)
        assert code == 0
        assert record["format"] in " ".join(out.split())


def test_convert_prints_the_error_and_keeps_it(run, scan_file, tmp_path):
    out = tmp_path / "scan.bsdf"
    code, _, err = run("convert", scan_file, out)
    assert code == 1
    assert "several formats are called .bsdf" in err
    code, _, err = run("convert", scan_file, out, "--to", "zemax")
    assert code == 1
    assert "--fill symmetry or --fill MODEL" in err
    code, _, err = run(
        "convert", scan_file, out, "--to", "zemax", "--fill", "symmetry,lambert", "--weighting", "uniform"
    )
    assert code == 1  # this scan, made of weights alone, has no physical size
    assert "the Zemax BSDF would scatter 285.1 % of the light that falls on it, at theta_i 0 deg" in err
    assert not out.exists()
    code, text, err = run(
        "convert", scan_file, out, "--to", "zemax", "--fill", "symmetry,lambert", "--force", "--weighting", "uniform"
    )
    assert code == 0, err
    text = " ".join(text.split())
    assert "filled by lambert fitted with uniform weighting" in text
    assert "as the file reads now: rms error" in text
    code, _, err = run("convert", scan_file, out, "--to", "zemax", "--fill", "lambert")
    assert code == 1
    assert "--force" in err
    record = as_json(run, "convert", scan_file, tmp_path / "again.nc", "--impose", "bilateral")
    assert record["error"]["rms"] < 1e-12
    assert "averaged over bilateral" in " ".join(read(tmp_path / "again.nc").attrs["history"].split())


def test_convert_onto_the_directions_of_another_file(run, scan_file, tmp_path):
    cut = tmp_path / "cut.csv"
    write(make_scan(np.full(5, 25.0), [-20.0, 0, 15, 30, 85], np.ones(5)), cut)
    record = as_json(run, "convert", scan_file, tmp_path / "at.csv", "--onto", cut)
    found = read(tmp_path / "at.csv")
    np.testing.assert_array_equal(found["theta_r"], [20, 0, 15, 30, 85])
    np.testing.assert_array_equal(np.isnan(found["brdf"]), [False] * 4 + [True])  # the scan ends at 80 deg
    assert any("at the directions of cut.csv: every value exact, at " in line for line in record["history"])


def test_convert_refuses_two_models(run, scan_file, tmp_path):
    code, _, err = run("convert", scan_file, tmp_path / "x.csv", "--fill", "ggx,lambert")
    assert code == 1
    assert "2 models, ggx and lambert" in err


def test_reduce_raw_sheets_into_the_published_table(run, shared, tmp_path):
    sheets = shared / "files" / "rt300s"
    out = tmp_path / "ec1.csv"
    code, text, err = run(
        "reduce", sheets / "ANOPLATE_AnoBlack_EC1_Alum6061_v1o0_20251115.xls",
        "--blank", sheets / "blank_v2o0_20250911.xls", "--subtract-floor", "--mirror", "--out", out,
    )  # fmt: skip
    assert code == 0, err
    assert "1144 directions" in " ".join(text.split())
    record = as_json(run, "diff", out, shared / "files/fred/AnoBlackEC1onAlum.txt")
    assert record["measured_in_both"] == 1144
    assert record["rms"] < 1e-4  # FRED's table has six decimals of values about 0.03


def test_reduce_says_how_each_sheet_lay(run, scan_file, tmp_path):
    out = tmp_path / "out.csv"
    code, _, err = run("reduce", scan_file, scan_file, "--phi-i", "0,90", "--keep-floor", "--out", out)
    assert code == 0, err
    assert set(read(out)["phi_i"].values.tolist()) == {0, 90}
    code, _, err = run("reduce", scan_file, scan_file, "--phi-i", "0", "--out", out, "--force")
    assert code == 1
    assert "--phi-i names 1 angles for 2 files: give one for each" in err


def test_diff_of_a_file_with_itself_and_with_another(run, scan_file, tmp_path):
    same = as_json(run, "diff", scan_file, scan_file)
    assert same["rms"] == 0
    assert same["measured_in_both"] == same["directions"] == 216
    other = tmp_path / "other.csv"
    scan = read(scan_file)
    write(scan.assign(brdf=(scan["brdf"] * 1.1).assign_attrs(units="sr-1")), other)
    figure = tmp_path / "figure.png"
    code, text, err = run("diff", other, scan_file, "--out", figure)
    assert code == 0, err
    assert "10 %" in text
    assert max(map(len, text.splitlines())) <= 80
    assert figure.stat().st_size > 10_000
    record = as_json(run, "diff", other, scan_file)
    assert record["bias"] == pytest.approx(0.1)
    assert [row["theta_i"] for row in record["by"]] == [10, 40]


def test_diff_of_what_has_nothing_in_common(run, tmp_path):
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    write(make_scan([10.0, 10], [0.0, 10], [1.0, 1]), a)
    write(make_scan([60.0, 60], [0.0, 10], [1.0, 1]), b)
    code, text, _ = run("diff", a, b)
    assert code == 0
    assert "nothing in common: 2 directions" in text


def test_compare_and_fit_take_any_readable_file(run, shared):
    for path in (shared / "files/zemax/AnoBlackEC1onAlum.bsdf", shared / "files/fred/AnoBlackEC1onAlum.txt"):
        record = as_json(run, "fit", path, "--model", "torrance-sparrow")
        assert record["parameters"]
    code, text, err = run("compare", shared / "files/fred/AnoBlackEC1onAlum.txt", "--models", "lambert,wang-2016")
    assert code == 0, err
    assert "wang-2016" in text


def test_models_of_reflection_are_not_fitted_to_transmission(run, tmp_path):
    path = tmp_path / "through.csv"
    scan = make_scan(
        np.full(9, 20.0), np.arange(0, 81, 10.0), np.ones(9), coordinates={"mode": np.full(9, "transmission")}
    )
    write(scan, path)
    code, _, err = run("fit", path, "--model", "lambert")
    assert code == 1
    assert "transmission" in err
