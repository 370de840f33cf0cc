"""A fit as people read it: reports, tables, predictions and residuals, whatever was fitted and called."""

import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr

import gonio
from conftest import SHARED_SCANS
from gonio import Geometry, Problem, catalogue, fit
from gonio.comparison import assess
from gonio.fitting import Solution, solution_of
from gonio.measured import dataset
from results.conftest import HOSTILE, surface

KINDS = ("single", "joint", "grouped", "spectral")


class Names(HTMLParser):
    """The elements of a page, and its text."""

    def __init__(self, page):
        super().__init__()
        self.elements, self.text = [], ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize("kind", KINDS)
def test_a_report_fits_on_a_screen_and_names_what_matters(fits, kind):
    solution = fits[kind]
    lines = str(solution).splitlines()
    assert len(lines) <= 30
    assert all(line.isprintable() for line in lines)
    assert lines[0].startswith(f"{solution.model.name} ({solution.model.title}) fitted to ")
    assert lines[1] == solution.status
    assert f"{solution.dataset.attrs['weighting']} weighting" in lines[2]
    for name in solution.model.parameters:
        assert any(line.startswith(name) for line in lines)
    first = {"joint": "lg RMSE"}.get(kind, "E")
    assert any(line.startswith(f"{first} ") for line in lines)
    assert len(repr(solution)) <= 300
    assert "\n" not in repr(solution)


@pytest.mark.parametrize("kind", KINDS)
def test_html_is_well_formed_and_small_and_says_the_same(fits, kind):
    page = fits[kind]._repr_html_()
    assert len(page.encode()) < 20_000
    ET.fromstring(page)
    found = Names(page)
    plain = {"div", "b", "table", "thead", "tbody", "tr", "th", "td", "ul", "li"}
    assert set(found.elements) <= plain | {"svg", "path", "polyline"}
    assert found.elements.count("svg") == 1
    assert "prefers-color-scheme" in page or "var(--jp-" in page
    words = " ".join(str(fits[kind]).replace("\n- ", " ").split())
    assert sorted("".join(found.text.split())) == sorted("".join(words.split()))


def test_names_of_a_file_are_escaped(fits):
    for text in (str(fits["joint"]), fits["joint"]._repr_html_(), repr(fits["joint"])):
        assert "\x1b" not in text
        assert "\\x1b[31m" in text
    assert "<script>" not in fits["joint"]._repr_html_()
    assert "<script>" in Names(fits["joint"]._repr_html_()).text


@pytest.mark.parametrize("name", ["escape", "markup", "polarisations"])
def test_files_with_hostile_names(name, tmp_path):
    path = SHARED_SCANS.parents[1] / "cases" / "attack" / "names" / f"{name}.csv"
    if not path.exists():
        pytest.skip("no cases of attacks beside the project")
    solution = fit(Problem(catalogue["lambert"], gonio.read(path)))
    assert all(line.isprintable() for line in str(solution).splitlines())
    ET.fromstring(solution._repr_html_())
    solution.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    ET.fromstring(page.partition("\n")[2])
    assert [element for element in Names(page).elements if element == "script"] == ["script"]  # which holds the data
    assert '<script type="application/json"' in page


@pytest.mark.parametrize("groups", [40, 400])
def test_a_report_of_many_values_says_their_range(groups):
    angles = np.linspace(5.0, 75.0, groups)
    values = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}
    scan = gonio.simulate(catalogue["ggx"], values, angles, [-30.0, 0.0, 20.0, 40.0], noise=0.01)
    held = {"index": 1.5, "extinction": 0.0, "width": 0.2}
    solution = fit(Problem(catalogue["ggx"], scan, held=held, grouped={"rho_d": "theta_i"}))
    assert len(str(solution).splitlines()) <= 30
    assert f"rho_d: {groups} values by theta_i" in str(solution)
    assert len(solution._repr_html_()) < 20_000
    assert len(solution.to_dataframe()) == groups + 4


def test_a_report_of_many_parameters_counts_the_rest():
    terms = {f"k{k}": gonio.Model.from_function(lambda g: g.cos_i, name=f"t{k}").terms["scale"] for k in range(40)}
    model = gonio.Model("many", "Many terms", "", terms)
    solution = fit(Problem(model, surface(), held={f"k{k}": 0.1 for k in range(1, 40)}))
    assert len(str(solution).splitlines()) <= 30
    assert "and 28 more: solution.to_dataframe()" in str(solution)


def test_intervals_end_at_the_bounds_of_the_fit():
    scan = gonio.simulate(catalogue["ggx"], {"rho_s": 0.001, "rho_d": 0.1, "width": 0.2}, [20.0], [-30.0, 10, 20, 30])
    scan["brdf"].values[:] = [0.030, 0.034, 0.033, 0.0335]
    solution = fit(
        Problem(catalogue["ggx"], scan, held={"index": 1.5, "extinction": 0.0}, bounds={"width": (0.1, 0.4)})
    )
    table = solution.to_dataframe().set_index("parameter")
    assert table.loc["width", "low"] >= 0.1
    assert table.loc["width", "high"] <= 0.4
    assert table.loc["rho_s", "low"] >= 0.0
    assert table.loc["index", ["low", "high"]].isna().all()
    assert solution.intervals()["rho_s"][0] < 0  # which is why the table cuts it


def test_a_value_at_its_bound_has_no_uncertainty():
    solution = fit(
        Problem(catalogue["ggx"], surface(), bounds={"width": (0.3, 0.9)}, held={"index": 1.5, "extinction": 0})
    )
    line = next(line for line in str(solution).splitlines() if line.startswith("width"))
    assert line.split()[:2] == ["width", "0.3"]
    assert line.endswith("at its bound")


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_has_a_row_a_value(fits, kind):
    table = fits[kind].to_dataframe()
    heads = ["parameter", "set", "value", "unit", "standard uncertainty", "low", "high", "status"]
    assert list(table.columns) == heads
    assert table["value"].tolist() == list(fits[kind].values.values())
    assert set(table["status"]) <= {"fitted", "at its bound", "not determined", "held"}
    sets = {"single": {""}, "grouped": {"", "theta_i=30", "theta_i=50"}, "joint": {"", f"scan={HOSTILE}", "scan=b"}}
    assert set(table["set"]) == sets.get(kind, {"", *(f"wavelength={400 + k}" for k in range(12))})


def test_a_table_without_pandas_says_so(single, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(ImportError, match="to_dataframe needs pandas"):
        single.to_dataframe()


@pytest.mark.parametrize("kind", KINDS)
def test_residuals_and_metrics_are_those_of_the_fit(fits, kind):
    solution = fits[kind]
    points = solution.scan
    assert solution.residuals.dims == ("direction",)
    assert solution.residuals.sizes["direction"] == solution.dataset.attrs["points"]
    np.testing.assert_array_equal(solution.residuals, solution.brdf(points) - points["brdf"])
    logarithmic = kind == "joint"
    problem = Problem(solution.model, points, weighting=solution.dataset.attrs["weighting"])
    expected = assess(problem, solution).metrics
    assert solution.metrics == expected
    if not logarithmic:
        assert solution.metrics["E"] == pytest.approx(solution.cost, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_solution_comes_back_with_its_scan(fits, kind, tmp_path):
    fits[kind].save(tmp_path / "solution.nc")
    loaded = Solution.load(tmp_path / "solution.nc")
    assert str(loaded) == str(fits[kind])
    assert loaded.metrics == fits[kind].metrics
    xr.testing.assert_identical(loaded.residuals, fits[kind].residuals)


def test_predictions_at_a_scan_are_on_its_dimensions():
    scan = surface().assign(mask=("direction", np.arange(30) % 3))
    solution = fit(Problem(catalogue["ggx"], scan, held={"index": 1.5, "extinction": 0.0}))
    found = solution.predict(scan)
    assert found.dims == ("direction",)
    assert found.sizes["direction"] == 30  # the masked ones as well
    assert found.attrs["units"] == "sr-1"
    np.testing.assert_allclose(found, solution.model(dataset.geometry(scan), solution.values), rtol=1e-12)


def test_predictions_on_a_grid_keep_its_axes(single):
    angles = np.array([0.0, 30.0, 60.0, 100.0])
    grid = xr.Dataset(
        {"brdf": (("theta_i", "theta_r", "phi"), np.ones((2, 4, 3)))},
        coords={"theta_i": [20.0, 50.0], "theta_r": angles, "phi": [0.0, 90.0, 180.0]},
    )
    found = single.predict(grid)
    assert found.dims == grid["brdf"].dims
    assert np.isnan(found.sel(theta_r=100.0)).all()
    one = Geometry.from_degrees(50.0, 60.0, 90.0)
    assert float(found.sel(theta_i=50.0, theta_r=60.0, phi=90.0)) == pytest.approx(
        float(single.model(one, single.values)), rel=1e-12
    )


def test_predictions_at_a_geometry(fits):
    single, grouped, spectral = fits["single"], fits["grouped"], fits["spectral"]
    geometry = Geometry.from_degrees(np.array([[20.0], [50.0]]), np.array([0.0, 33.0, 66.0]), 75.0)
    found = single.predict(geometry)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found, single.model(geometry, single.values), rtol=1e-9)
    assert single.predict(Geometry.from_degrees(20.0, 33.0, 75.0)).shape == ()
    at_30 = grouped.predict(Geometry.in_plane(30.0, 30.0))
    values = {n.partition("[")[0]: v for n, v in grouped.values.items() if n != "ks[50]"}
    assert float(at_30) == pytest.approx(float(grouped.model(Geometry.in_plane(30.0, 30.0), values)), rel=1e-9)
    with pytest.raises(ValueError, match="for theta_i = 30, 50; there is none for 40"):
        grouped.predict(Geometry.in_plane(40.0, 30.0))
    with pytest.raises(ValueError, match=r"have no wavelength: add it, as in predict\(.., wavelength=..\)"):
        spectral.predict(geometry)
    assert float(spectral.predict(geometry, wavelength=405)[0, 1]) != float(
        spectral.predict(geometry, wavelength=406)[0, 1]
    )
    with pytest.raises(ValueError, match="there is none for 999"):
        spectral.predict(geometry, wavelength=999)
    with pytest.raises(ValueError, match="coordinate 'wavelength' of their own"):
        spectral.predict(spectral.scan, wavelength=405)


def test_predictions_are_per_set(fits):
    found = fits["joint"].predict(fits["joint"].scan)
    assert set(found["scan"].values.tolist()) == {HOSTILE, "b"}
    parts = [found.values[found["scan"].values == name] for name in (HOSTILE, "b")]
    assert (parts[1] > parts[0]).all()  # the second is brighter everywhere


def test_a_lane_of_many_gets_its_scan_by_hand(single):
    scan = surface()
    bare = Solution(single.dataset.drop_dims("direction"), single.model)
    assert "E " in str(bare)
    with pytest.raises(ValueError, match=r"solution.with_scan\(scan\) has them"):
        _ = bare.residuals
    assert bare.with_scan(scan).metrics == single.metrics
    with pytest.raises(ValueError, match="the fit is of 30 points in sr-1, and this scan has 29"):
        bare.with_scan(scan.isel(direction=slice(1, None)))


def test_many_fits_hold_no_points():
    pytest.importorskip("jax")
    scans = {str(k): surface(0.1 + 0.01 * k) for k in range(2)}
    stack = scans["0"].drop_vars(["brdf", "uncertainty"])
    stack["brdf"] = (("sample", "direction"), np.stack([s["brdf"].values for s in scans.values()]), {"units": "sr-1"})
    fits = gonio.fit_many(Problem(catalogue["lambert"], scans["0"]), stack, covariance="")
    assert "direction" not in fits.dims
    assert not [name for name in fits.attrs if name == "problem"]
    lane = solution_of(fits.isel(sample=1))
    assert "with_scan" in str(lane)
    assert lane.with_scan(scans["1"]).metrics["E"] == pytest.approx(lane.cost, rel=1e-6)


def test_very_many_points_are_not_kept(monkeypatch):
    monkeypatch.setattr("gonio.fitting.schema.MOST_KEPT", 29)
    solution = fit(Problem(catalogue["ggx"], surface(), held={"index": 1.5, "extinction": 0.0}))
    assert "direction" not in solution.dataset.dims
    assert solution.to_dataframe()["high"].notna().any()
    assert solution.with_scan(surface()).metrics["E"] == pytest.approx(solution.cost, rel=1e-9)
