"""Tables of models: each format that is written is a target, its error stated, and a table too far off refused."""

import re

import numpy as np
import pytest

import gonio
from gonio import catalogue, read
from gonio.exporting.registry import targets
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.tabulating import Error, error_of, pairs
from gonio.exporting.target import Target
from gonio.exporting.targets import tables
from gonio.formats import formats
from gonio.formats.radiance import klems
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.plausibility import hemispherical_reflectance
from gonio.resampling.hemisphere import projected_nodes
from gonio.resampling.resample import resample

WRITTEN = [f for f in formats().values() if f.write is not None]
REFUSED = ("integra-specular", "integra-specular-transmission", "integra-transmission", "zarr")
ALL = [f for f in WRITTEN if f.name not in REFUSED]
QUICK = [f for f in ALL if f.name != "merl"]  # 35 MB
GGX = {"rho_s": 0.8, "rho_d": 0.1, "width": 0.2}


@pytest.fixture(autouse=True)
def few_pairs(monkeypatch):
    """A tenth of the random pairs that a table is compared at: a root mean square of 2000 is known to some percent."""
    monkeypatch.setattr("gonio.exporting.tabulating.PAIRS", 2000)
    monkeypatch.setattr("gonio.exporting.tabulating.FEWER", 200)


@pytest.fixture
def short_lists(monkeypatch):
    """A quarter of the directions of a list: text takes long to write and to read, and a list to triangulate."""
    monkeypatch.setattr("gonio.exporting.tabulating.FLAT_LARGEST", 25_000)


@pytest.fixture
def small_tables(short_lists, monkeypatch):
    """And grids of few values, which are enough for a constant."""
    monkeypatch.setattr("gonio.exporting.tabulating.LARGEST", 12_000)


def export(tmp_path, name, values, model="ggx", **more):
    target = targets()[name]
    return gonio.export(catalogue[model], tmp_path / f"x{target.suffixes[0]}", to=name, values=values, **more)


def at(scan, theta_i, theta_r, phi):
    onto = make_scan(theta_i, theta_r, np.zeros(len(theta_i)), phi)
    if "phi_i" in scan.coords:
        onto = onto.assign_coords(phi_i=("direction", np.zeros(len(theta_i)), {"units": "degree"}))
    return resample(scan, onto)["brdf"].values


def test_every_written_format_is_a_target_of_its_name():
    for target in WRITTEN:
        name = tables.name_of(target)
        assert isinstance(targets()[name], Target)
        assert targets()[name].title == target.title
        assert targets()[name].suffixes == (target.suffix,)
    assert {tables.name_of(f) for f in WRITTEN} - {f.name for f in WRITTEN} == {"fred-table", "radiance-xml"}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_hold_a_model_says_what_can(name, tmp_path):
    with pytest.raises(ValueError, match=r"use --to (integra|netcdf)"):
        export(tmp_path, name, GGX)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("target", QUICK, ids=lambda f: f.name)
def test_a_lambertian_of_a_half_comes_back_as_that_over_pi(target, tmp_path, small_tables):
    done = export(tmp_path, tables.name_of(target), {catalogue["lambert"].weights[0]: 0.5}, "lambert")
    theta_i, theta_r, phi = pairs(3)
    some = slice(0, None, 40)
    again = read(done.files[0])
    found = at(again, theta_i[some], theta_r[some], phi[some])
    has = np.isfinite(found)
    # of 50 pairs: a short list lacks those that are close to the horizon
    assert has.mean() > (0.7 if target.name == "utia" else 0.93 if again["brdf"].dims == ("direction",) else 0.97)
    # Files hold decimal or single-precision numbers. RGL's are f cos(theta_r), linear between 64 samples of a cosine.
    limit = 6e-3 if target.name == "rgl" else 1e-5
    np.testing.assert_allclose(found[has], 0.5 / np.pi, rtol=limit)
    assert done.numbers["relative_rms_error"] < limit
    stated = f"{again.attrs['provenance']}{again.attrs['history']}"
    beside = done.files[1].read_text() if len(done.files) > 1 else ""
    assert "rho_d = 0.5" in stated + beside or "= 0.5" in stated + beside
    assert ("simulated from lambert" in again.attrs["history"]) == (target.name in tables_with_history())
    assert done.prove().holds


def tables_with_history():
    return {"alta", "alta-binary", "bird", "columns", "netcdf", "tidy-csv", "zemax"}


@pytest.mark.parametrize("name", ["rgl", "zemax", "ssdd", "integra", "speos-brdf", "lighttools", "netcdf"])
def test_a_lobe_is_met_by_a_grid_from_its_own_width(name, tmp_path):
    done = export(tmp_path, name, GGX)
    assert done.numbers["relative_rms_error"] < 0.06
    assert done.numbers["half_width_deg"] == pytest.approx(15, abs=0.5)
    proof = done.prove()
    assert proof.holds
    assert proof.error == done.numbers["relative_rms_error"]
    again = read(done.files[0])
    assert error_of(done.subject, again, seed=5).rms < 0.08  # at other pairs: a few hundred of them are at the lobe
    model = done.subject
    for theta_i in (0.0, 45.0, 75.0, 85.0):
        targets_, weights = projected_nodes(theta_i)
        part = again.isel({d: 0 for d in again["brdf"].dims if d in ("channel", "mode", "wavelength")})
        found = np.nansum(weights * at(part, targets_.theta_i, np.minimum(targets_.theta_r, 89.5), targets_.phi))
        expected = hemispherical_reflectance(lambda g: np.asarray(model.brdf(g)), theta_i, 96)
        # RGL's samples are of f cos(theta_r) at half vectors, dense about the lobe at every incidence
        assert found == pytest.approx(expected, rel=0.01 if name == "rgl" else 0.03)


def test_means_over_patches_keep_the_energy(tmp_path):
    """The sum over outgoing patches is the model's reflectance, averaged over the incident patch."""
    done = export(tmp_path, "radiance-xml", GGX, worst=10.0)
    scan = read(done.files[0])
    matrix = scan["brdf"].squeeze().transpose("incident", "outgoing").values
    found = matrix @ klems.FULL.projected()
    nodes, weights = np.polynomial.legendre.leggauss(6)
    for band in range(len(klems.FULL.counts)):
        low, high = np.sin(np.radians(klems.FULL.bounds[band : band + 2])) ** 2
        angles = np.degrees(np.arcsin(np.sqrt((low + high) / 2 + (high - low) / 2 * nodes)))
        each = [hemispherical_reflectance(lambda g: np.asarray(done.subject.brdf(g)), t, 200) for t in angles]
        patch = int(np.sum(klems.FULL.counts[:band]))
        assert found[patch] == pytest.approx(np.dot(weights, each) / 2, rel=0.01)


def test_radiance_xml_is_written_for_both_sides(tmp_path):
    done = export(tmp_path, "radiance-xml", {catalogue["lambert"].weights[0]: 0.5}, "lambert")
    directions = re.findall("<WavelengthDataDirection>(.*?)<", done.files[0].read_text())
    assert directions == ["Reflection Front", "Reflection Back"]
    assert any("back of a polygon" in line for line in done.remarks)


def test_a_table_too_far_off_is_refused_with_the_remedy_and_nothing_is_written(tmp_path, coarse_grids):
    with pytest.raises(
        ValueError, match=r"would differ from ggx by \d+.* --worst allows 10 %.*145 incident x 145"
    ) as e:
        export(tmp_path, "radiance-xml", GGX | {"width": 0.03})
    assert "--to mitsuba" in str(e.value)
    assert not list(tmp_path.iterdir())
    done = export(tmp_path, "radiance-xml", GGX | {"width": 0.03}, worst=5.0)
    assert done.numbers["relative_rms_error"] > 0.1


def test_a_finer_grid_is_tried_before_a_refusal(tmp_path):
    first = export(tmp_path, "zemax", GGX)
    finer = export(tmp_path, "zemax", GGX, force=True, worst=0.8 * first.numbers["relative_rms_error"])
    assert finer.numbers["values"] > first.numbers["values"]
    assert finer.numbers["relative_rms_error"] < 0.8 * first.numbers["relative_rms_error"]


def several(by, labels):
    one = of_model(catalogue["ggx"], GGX | {"width": 0.5}).values
    return Subject(catalogue["ggx"], {v: dict(one) | {"rho_d": 0.1 * (k + 1)} for k, v in enumerate(labels)}, by)


@pytest.mark.parametrize(
    ("name", "by", "labels"),
    [
        ("rgl", "channel", ("B", "G", "R")),
        ("rgl", "wavelength", ("450", "550.0")),
        ("ssdd", "channel", ("R", "G", "B")),
        ("zemax", "channel", ("X", "Y", "Z")),
        ("astm", "wavelength", ("450", "650")),
        ("netcdf", "channel", ("any", "other")),
        ("tidy-csv", "wavelength", ("450", "650")),
        ("speos-brdf", "wavelength", ("450", "650")),
        ("radiance-xml", "channel", ("X", "Y", "Z")),
    ],
)
def test_sets_are_kept_where_the_format_has_them(name, by, labels, tmp_path, monkeypatch, coarse_grids, short_lists):
    monkeypatch.setattr("gonio.formats.rgl.layout.SIZE", 32)
    subject = several(by, labels)
    target = targets()[name]
    path = tmp_path / f"x{target.suffixes[0]}"
    from gonio.exporting.entry import write

    done = write(subject, path, name, worst=5.0)
    again = gonio.read(path)
    for label in labels:
        part = gonio.measured.dataset.select(again, {by: label})
        if name == "radiance-xml":
            continue
        found = at(part, np.array([30.0]), np.array([60.0]), np.array([60.0]))[0]
        expected = float(np.asarray(subject.brdf(Geometry.from_degrees(30.0, 60.0, 60.0), label)))
        assert found == pytest.approx(expected, rel=0.03)
    assert done.numbers["relative_rms_error"] < 0.1 or name == "radiance-xml"


@pytest.mark.parametrize("name", ["fred-table", "columns", "integra-specular", "lighttools"])
def test_several_sets_are_refused_where_the_format_has_one(name, tmp_path):
    from gonio.exporting.entry import write

    subject = several("wavelength", ("450", "650"))
    if name == "lighttools":
        subject = several("channel", ("B", "Q"))
    with pytest.raises(ValueError, match=r"--select (wavelength|channel)=|use --to integra"):
        write(subject, tmp_path / f"x{targets()[name].suffixes[0]}", name)
    assert not list(tmp_path.iterdir())


def test_a_grey_model_stands_in_every_channel_of_a_format_of_colours(tmp_path):
    done = export(tmp_path, "utia", GGX | {"width": 0.5}, worst=0.5)
    again = read(done.files[0])["brdf"]
    assert again["channel"].values.tolist() == ["R", "G", "B"]
    assert (again.sel(channel="R") == again.sel(channel="B")).all()
    assert done.files[1].name == "x.bin.txt"
    assert "ggx" in done.files[1].read_text()
    assert any("ends at 75 deg" in line for line in done.remarks)


def test_a_table_that_was_changed_is_no_proof(tmp_path, short_lists):
    done = export(tmp_path, "tidy-csv", GGX | {"width": 0.4})
    text = done.files[0].read_text().splitlines()
    head = next(k for k, line in enumerate(text) if line.startswith("theta_i"))
    column = text[head].split(",").index("brdf_sr-1")
    for k in range(head + 1, len(text)):
        cells = text[k].split(",")
        cells[column] = str(1.5 * float(cells[column]))
        text[k] = ",".join(cells)
    done.files[0].write_text("\n".join(text) + "\n")
    with pytest.raises(ValueError, match=r"differs from the model by 0\.5"):
        done.prove()


def test_the_error_is_of_what_was_read(tmp_path):
    """A table of twice the model is off by 1, and one without values by nothing, but all pairs are lost."""
    subject = of_model(catalogue["lambert"], {catalogue["lambert"].weights[0]: 0.5})
    axes = {"theta_i": np.arange(0, 91, 10.0), "theta_r": np.arange(0, 91, 10.0), "phi": np.arange(0, 360, 30.0)}
    grid = gonio.measured.coordinates.grid("spherical", **axes)
    twice = grid.assign(brdf=(("theta_i", "theta_r", "phi"), np.full((10, 10, 12), 1 / np.pi), {"units": "sr-1"}))
    found = error_of(subject, twice)
    assert found.rms == pytest.approx(1.0)
    assert found.log10_rmse == pytest.approx(np.log10(2))
    assert found.albedo == pytest.approx(1.0)
    assert found.lost == 0
    assert "pairs_without_a_value" not in found.numbers
    assert error_of(subject, twice.where(twice["theta_i"] < 50)).lost == pytest.approx(0.5, abs=0.1)
    assert Error(0.1, float("nan"), 0.2, float("nan")).numbers == {
        "relative_rms_error": 0.1,
        "pairs_without_a_value": 0.2,
    }


def test_half_of_the_pairs_are_at_the_lobe():
    theta_i, theta_r, phi = (np.radians(v) for v in pairs(1))
    cosine = np.cos(theta_i) * np.cos(theta_r) - np.sin(theta_i) * np.sin(theta_r) * np.cos(phi)
    near = np.degrees(np.arccos(np.clip(cosine, -1, 1))) <= 10.0
    assert 0.5 <= near.mean() < 0.55
    assert np.degrees(max(theta_i.max(), theta_r.max())) <= 85.0
