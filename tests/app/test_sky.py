"""`gonio magnitude` and `gonio albedo`: what they print, write and refuse."""

import json

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import gonio
from gonio.albedo import albedo_maps, as_stack
from gonio.fitting import fit
from stacks import one_after_another, only_here

HEAD = "time,sun_altitude_deg,sun_azimuth_deg,altitude_deg,azimuth_deg,height_km,magnitude_mag,id"
ROWS = [
    f"2022-01-25T13:0{k // 4}:{k % 4 * 15:02d},-15,250,{30 + 5 * k},{180 - 20 * k},550,{6 - 0.1 * k},7"
    for k in range(8)
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = {"rho_s": 0.3, "rho_d": 0.02, "width": 0.25}
    scan = gonio.simulate(gonio.catalogue["ggx"], values, [10.0, 30.0, 50.0], np.arange(-70, 71, 10.0), noise=0.05)
    held = {"index": 1.5, "extinction": 0.0}
    fit(gonio.Problem(gonio.catalogue["ggx"], scan, held=held, weighting="log")).save(tmp_path / "solution.nc")
    (tmp_path / "body.toml").write_text(
        '[[facet]]\nname = "deck"\narea = 3.64\nnormal = [0, 0, -1]\nfit = "solution.nc"\n'
        '[[facet]]\nname = "array"\narea = 22.68\nnormal = [0, 1, 0]\nmodel = "lambert"\nvalues = {rho = 0.03}\n'
    )
    (tmp_path / "pass.csv").write_text("\n".join([HEAD, *ROWS]) + "\n")
    return tmp_path


def test_a_pass(run, here):
    code, out, err = run("magnitude", "body.toml", "pass.csv", "--out", "curve.png")
    assert code == 0
    assert err == "gonio: pass.csv: columns without a meaning here: id\n"
    assert "deck [%]" in out
    assert " ± 0.0" in out
    assert "the sun has -26.77 mag" in " ".join(out.split())
    assert "computed less observed at 8 times: mean" in " ".join(out.split())
    assert "wrote curve.png" in out
    with Image.open(here / "curve.png") as picture:
        assert picture.size[0] > 500


def test_the_record_is_that_of_the_library(run, here):
    given = ("--earthshine", 0.3, "--extinction", 0.12, "--band", "B", "--system", "Vega", "--json", "-")
    code, out, _ = run("magnitude", "body.toml", "pass.csv", *given)
    assert code == 0
    found = json.loads(out)
    from gonio.photometry import Air, Earth, light_curve, read_facets, read_pass

    seen = read_pass(here / "pass.csv")
    facets = read_facets(here / "body.toml", gonio.catalogue)
    expected = light_curve(
        facets, seen.sun, seen.observer, "B", "Vega",
        earth=Earth(seen.position, values={"rho": 0.3}), air=Air(0.12, seen.altitude),
    )  # fmt: skip
    assert found["magnitude"] == pytest.approx(expected["magnitude"].values.tolist())
    assert found["uncertainty"] == pytest.approx(expected["uncertainty"].values.tolist())
    assert (found["band"], found["system"], found["sun"]) == ("B", "Vega", -26.13)
    assert found["observed"]["count"] == 8
    assert found["uncertainty_systematic"] == [None] * 8
    assert set(found["share"]) == {"deck", "array"}


@pytest.mark.parametrize("more", [(), ("--over", "phase")])
def test_a_light_curve_for_a_column_of_a_journal(run, here, more):
    size = ("--size", "85x70mm", "--font", 8, "--dpi", 300, "--out", "curve.png")
    code, _, err = run("magnitude", "body.toml", "pass.csv", *size, *more)
    assert code == 0, err
    with Image.open(here / "curve.png") as picture:
        assert picture.size == (int(85 / 25.4 * 300), int(70 / 25.4 * 300))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("body.toml", "gone.csv"), "gone.csv: there is no such file"),
        (("gone.toml", "pass.csv"), "gone.toml: there is no such file"),
        (("body.toml", "pass.csv", "--size", "85x60mm"), "need --out"),
        (("body.toml", "pass.csv", "--extinction", "-1"), "--extinction is -1"),
        (("body.toml", "angles.csv", "--earthshine", "0.3"), "angles.csv: says nothing of the Earth"),
        (("body.toml", "angles.csv", "--extinction", "0.1"), "angles.csv: has no altitude over the horizon"),
        (("body.toml", "pass.csv", "--json", "solution.nc", "--force"), "solution.nc"),
        (("body.toml", "pass.csv", "--json", "body.toml", "--force"), "which is read"),
        (("body.toml", "night.csv", "--out", "x.png"), "there is no light curve to draw"),
    ],
)
def test_what_a_magnitude_refuses(run, here, arguments, message):
    (here / "angles.csv").write_text("theta_i_deg,theta_r_deg,phi_deg,distance_km\n30,30,180,500\n")
    (here / "night.csv").write_text("sun_x,sun_y,sun_z,observer_x_km,observer_y_km,observer_z_km\n0,-1,1,0,0,500\n")
    before = (here / "solution.nc").read_bytes()
    code, _, err = run("magnitude", *arguments)
    assert code == 1
    assert err.splitlines()[-1].startswith("gonio: ")
    assert message in err
    assert (here / "solution.nc").read_bytes() == before


def test_a_night_is_dark(run, here):
    (here / "night.csv").write_text("sun_x,sun_y,sun_z,observer_x_km,observer_y_km,observer_z_km\n0,-1,1,0,0,500\n")
    code, out, _ = run("magnitude", "body.toml", "night.csv")
    assert code == 0
    assert "dark" in out
    assert "no light at 1 of 1 times" in out
    assert json.loads(run("magnitude", "body.toml", "night.csv", "--json", "-")[1])["magnitude"] == [None]


def test_albedo_of_a_model(run):
    kernels = ("albedo", "ross-li", "--set", "fvol=1", "--theta-i", "40")
    code, out, err = run(*kernels)
    assert (code, err) == (0, "")
    assert "0.080874" in out
    assert "white-sky 0.1891" in out
    assert "0.062488" in run(*kernels, "--method", "modis")[1]
    found = json.loads(run(*kernels, "--diffuse", 0.25, "--json", "-")[1])
    mixed = 0.75 * found["black_sky"]["value"][0] + 0.25 * found["white_sky"]["value"]
    assert found["blue_sky"]["value"] == [pytest.approx(mixed)]


def test_albedo_of_a_fit(run, here):
    code, out, err = run("albedo", "solution.nc", "--theta-i", "30")
    assert (code, err) == (0, "")
    assert out.count("±") == 3
    assert json.loads(run("albedo", "solution.nc", "--json", "-")[1])["black_sky"]["uncertainty"][0] > 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("lambert", "--set", "rho=0.3", "--method", "modis"), "of the kernels of ross-li, and not of lambert"),
        (("lambert",), "at least one weight"),
        (("lambert", "--set", "rho=0.3", "--theta-i", "95"), "from 0 to below 90"),
        (("lambert", "--set", "rho=0.3", "--out", "x.nc"), "--out writes the maps of a stack"),
        (("lambert", "--set", "rho=0.3", "--select", "channel=R"), "this is a model"),
        (("solution.nc", "--set", "rho=0.3"), "a fit has its own values"),
        (("solution.nc", "--select", "channel=R"), "no channel to select"),
        (("gone.nc",), "gone.nc: there is no such file"),
        (("lambent",), "lambent"),
    ],
)
def test_what_an_albedo_refuses(run, here, arguments, message):
    code, out, err = run("albedo", *arguments)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert message in err


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """Two by three pixels of sixteen looks, fitted by gonio fit-stack."""
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    folder = tmp_path_factory.mktemp("pixels")
    rng = np.random.default_rng(7)
    angles = [rng.uniform(20, 60, 16), rng.uniform(0, 60, 16), rng.uniform(0, 360, 16)]
    basis = gonio.catalogue["ross-li"].basis(gonio.Geometry.from_degrees(*angles), {})
    exact = np.pi * (0.3 * basis["fiso"] + 0.1 * basis["fvol"] + 0.04 * basis["fgeo"])
    names = ("solar_zenith", "view_zenith", "relative_azimuth")
    reflectance = xr.DataArray(
        exact + 0.01 * rng.normal(size=(2, 3, 16)),
        dims=("y", "x", "look"),
        coords={**{n: ("look", a) for n, a in zip(names, angles, strict=True)}, "y": [1.0, 2.0], "x": [5.0, 6.0, 7.0]},
    )
    as_stack(reflectance).to_zarr(folder / "looks.zarr", zarr_format=3, consolidated=False)
    return folder, reflectance


def test_albedo_of_every_pixel_that_fit_stack_fitted(run, fits, tmp_path, monkeypatch):
    folder, reflectance = fits
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gonio.fitting.stack.cluster.connected", only_here)
    monkeypatch.setattr("gonio.fitting.stack.cluster.fit_blocks", one_after_another)
    given = ("--weighting", "uniform", "--covariance", "scaled")
    code, _, err = run("fit-stack", folder / "looks.zarr", "--model", "ross-li", "--out", "fits.zarr", *given)
    assert code == 0, err
    code, out, err = run("albedo", "fits.zarr", "--theta-i", "30,60", "--diffuse", 0.2, "--out", "maps.nc")
    assert (code, err) == (0, "")
    assert "wrote maps.nc" in out
    from gonio.albedo import retrieve

    kernels = gonio.catalogue["ross-li"]
    expected = albedo_maps(retrieve(reflectance, kernels), kernels, [30.0, 60.0], 0.2)
    with xr.open_dataset(tmp_path / "maps.nc", engine="scipy") as maps:
        assert maps["blue_sky"].dims == ("y", "x", "theta_i")
        assert maps["x"].values.tolist() == [5.0, 6.0, 7.0]
        for name in expected.data_vars:
            assert maps[name].values == pytest.approx(expected[name].values, rel=1e-6), name
    assert run("albedo", "fits.zarr", "--out", "maps.zarr", "-q")[0] == 0
    assert "black_sky" in xr.open_zarr(tmp_path / "maps.zarr", consolidated=False)
    code, out, err = run("albedo", "fits.zarr", "--out", "maps.txt")
    assert (code, err) == (1, "gonio: maps.txt: maps are written as NAME.nc or NAME.zarr: name one of these\n")
    record = json.loads(run("albedo", "fits.zarr", "--json", "-")[1])
    assert record["pixels"] == {"y": 2, "x": 3}
    assert run("albedo", "fits.zarr", "--set", "fiso=1")[0] == 1
