"""`gonio topography`: numbers, figure, prediction and comparison, and what is refused."""

import json

import numpy as np
import pytest

import height_files as made
from gonio import Problem, catalogue, read, simulate
from gonio.fitting import fit
from gonio.topography import simulate_heights

ROUGH = {"scale": 1.0, "sigma": 0.142, "length": 1.414, "index": 1.37, "extinction": 7.62, "wavelength": 0.6328}


@pytest.fixture
def map_file(tmp_path):
    return made.sdf_text(tmp_path / "map.sdf", simulate_heights(0.142, 1.414, points=(96, 96), pitch=0.5)["z"].values)


def test_numbers_as_json_and_for_people(run, map_file):
    code, out, err = run("topography", map_file, "--json", "-", "--theta-i", "0,40")
    assert (code, err) == (0, "")
    record = json.loads(out)
    assert record["points"] == [96, 96]
    assert record["pitch_um"] == pytest.approx([0.5, 0.4])
    assert record["parameters"]["Sq"]["value"] == pytest.approx(0.142, rel=0.1)
    assert record["parameters"]["Sq"]["spread"] > 0
    assert record["slopes"]["operator"] == "seven-point"
    assert [one["theta_i"] for one in record["light"]["at"]] == [0, 40]
    assert any("resolves frequencies" in warning for warning in record["light"]["warnings"])
    code, out, _ = run("topography", map_file)
    for words in (
        "96 x 96 points of 0.5 x 0.4 um",
        "no point is missing",
        "Sdq",
        "seven-point",
        "Sal",
        "s_eff",
        "note:",
    ):
        assert words in out, words
    assert all(len(line) <= 80 for line in out.splitlines())


def test_a_small_map_is_told_too(run, tmp_path):
    """As the standard's own example, 7 x 4 points: no spread, and the forward operator."""
    path = made.sdf_text(tmp_path / "small.sdf", made.HEIGHTS[:4, :7])
    code, out, err = run("topography", path, "--out", tmp_path / "small.png")
    assert (code, err) == (0, "")
    assert "forward operator" in out
    assert (tmp_path / "small.png").stat().st_size > 1000


def test_filters_and_operators_change_what_they_should(run, map_file):
    def slope(*options):
        return json.loads(run("topography", map_file, "--json", "-", *options)[1])["parameters"]["Sdq"]["value"]

    assert slope("--s-filter", 2) < 0.8 * slope()
    assert slope("--operator", "central") < slope("--operator", "seven-point")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--pitch", "1"), "says pitch and unit itself"),
        (("--s-filter", "0.1"), "two pixels"),
        (("--operator", "sobel"), "is no operator of slopes: choose forward, central, seven-point"),
        (("--theta-i", "95"), "give incidence angles from 0 to below 90 deg"),
        (("--font", "7"), "the options of figures need --out"),
        (("--predict", "x.exe"), "no format is written to .exe"),
        (("--compare", "map.sdf"), "holds no fit"),
        (("--obliquity", "mine", "--predict", "x.csv"), "choose auto, harvey-shack, kirchhoff"),
    ],
)
def test_what_is_wrong_is_one_line(run, map_file, monkeypatch, options, said):
    monkeypatch.chdir(map_file.parent)
    code, out, err = run("topography", "map.sdf", *options)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert said in err


def test_a_prediction_is_not_written_over_the_map(run, map_file):
    before = map_file.read_bytes()
    code, _, err = run("topography", map_file, "--predict", map_file, "--force")
    assert code == 1
    assert "which is read: choose another name" in err
    assert map_file.read_bytes() == before


def test_the_predicted_scan_and_the_comparison_with_a_fit(run, map_file, tmp_path):
    model = catalogue["generalised-harvey-shack"]
    scan = simulate(model, ROUGH, [20.0, 40.0], np.arange(-60, 61, 5.0), wavelength=632.8)
    fit(Problem(catalogue["torrance-sparrow"], scan, weighting="uniform")).save(tmp_path / "fit.nc")
    options = (
        "--predict",
        tmp_path / "lobe.csv",
        "--theta-i",
        "20",
        "--theta-r=-40:60:5",
        "--compare",
        tmp_path / "fit.nc",
    )
    code, out, err = run("topography", map_file, *options)
    assert (code, err) == (0, "")
    assert "verdict: the fit has a slope of" in out
    assert "they need not agree (g is below 50" in " ".join(out.split())
    lobe = read(tmp_path / "lobe.csv")
    assert lobe.attrs["simulated"].startswith("simulated from the")
    assert {"brdf", "uncertainty"} <= set(lobe.data_vars)
    assert lobe.sizes["direction"] == 21
    assert run("topography", map_file, *options)[0] == 1  # it is there


def test_a_model_without_facets_is_refused(run, map_file, tmp_path):
    scan = simulate(catalogue["lambert"], {"rho": 0.5}, [20.0], np.arange(-60, 61, 20.0))
    fit(Problem(catalogue["lambert"], scan)).save(tmp_path / "flat.nc")
    code, _, err = run("topography", map_file, "--compare", tmp_path / "flat.nc")
    assert code == 1
    assert "lambert has no slope of facets to compare with a map" in err
