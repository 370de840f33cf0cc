"""Files that a model fills: their reflectance towards grazing incidence is the model's, and what was measured stays."""

from functools import partial

import numpy as np
import pytest

from gonio import catalogue, convert, read
from gonio.formats import formats
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.resampling.hemisphere import projected_nodes
from gonio.resampling.lobes import Lobe, half_width, last_incidence, reflectance
from gonio.resampling.resample import Filling, resample

GRIDS = [f.name for f in formats().values() if f.write and f.layout and "reflection" in f.holds.modes]
WHOLE = [n for n in GRIDS if n not in ("merl", "utia", "radiance")]  # 33 MB; ends at 75 deg; means over patches
VALUES = {"rho_s": 1.0, "rho_d": 0.02, "width": 0.22, "index": 1.5, "extinction": 0.0}
STEEP = (75.0, 85.0)


def of(name, values):
    return lambda *angles: np.asarray(catalogue[name](Geometry.from_degrees(*angles), values))


ggx = of("ggx", VALUES)


def filling():
    def function(points):
        return ggx(*(points[n].values for n in ("theta_i", "theta_r", "phi")))

    return Filling(("bilateral",), function, "ggx exact")


def in_plane():
    """A scan of the plane of incidence that ends at theta_i 70 deg, of half of what the model says there."""
    theta_i, signed = (v.ravel() for v in np.meshgrid([10.0, 30, 50, 70], np.arange(-80, 81, 4.0), indexing="ij"))
    angles = theta_i, np.abs(signed), np.where(signed < 0, 0.0, 180.0)
    return make_scan(*angles[:2], ggx(*angles), angles[2])


def albedo(scan, theta_i):
    targets, weights = projected_nodes(theta_i)
    onto = make_scan(targets.theta_i, np.minimum(targets.theta_r, 89.5), np.zeros(len(weights)), targets.phi)
    part = scan.isel({d: 0 for d in scan["brdf"].dims if d in ("channel", "mode", "wavelength")})
    return float(np.nansum(weights * resample(part, onto)["brdf"].values))


@pytest.mark.parametrize("name", WHOLE)
def test_the_rim_is_as_bright_as_the_model_says(name, tmp_path):
    """3 %: between the nodes of a table, which are two half widths of the lobe's narrow side apart at 85 deg."""
    done = convert(in_plane(), tmp_path / f"x{formats()[name].suffix}", name, filling=filling())
    assert done.last_incidence == pytest.approx(90.0, abs=1e-3)
    again = read(done.path)
    for theta_i in STEEP:
        assert albedo(again, theta_i) == pytest.approx(reflectance(ggx, theta_i), rel=0.03)
    assert "incidence is measured at 10 to 70 deg alone" in done.scan.attrs["history"]
    assert done.error.rms < 0.01  # of what was measured


@pytest.mark.parametrize("name", ["zemax", "speos-brdf", "lighttools"])
def test_measured_values_are_kept_where_the_grid_meets_them(name, tmp_path):
    scan = in_plane()
    scan["brdf"] = (scan["brdf"] / 2).assign_attrs(scan["brdf"].attrs)  # not what the model says
    done = convert(scan, tmp_path / "x", name, filling=filling())
    again = resample(read(done.path), scan)["brdf"].values
    assert done.error.rms < 0.02
    near = np.abs(scan["theta_r"].values - scan["theta_i"].values) < 1
    np.testing.assert_allclose(again[near], scan["brdf"].values[near], rtol=0.02)  # the top of each lobe


def test_a_table_that_was_read_goes_on_with_its_own_nodes(tmp_path):
    """An RGL file with slices of its own warp: they keep their values, and get further ones."""
    full = convert(in_plane(), tmp_path / "a.bsdf", "rgl", filling=filling())
    short = read(full.path)
    kept = short["theta_i"].values < 71
    short = short.isel(theta_i=kept, tensor_incidence=kept)
    done = convert(short, tmp_path / "b.bsdf", "rgl", filling=filling())
    again = read(done.path)
    assert again["theta_i"].values[-1] == pytest.approx(90, abs=1e-3)
    assert albedo(again, 85.0) == pytest.approx(reflectance(ggx, 85.0), rel=0.03)
    assert done.error.rms < 1e-6


def test_a_scan_that_is_not_filled_by_a_model_keeps_its_incidence_angles(tmp_path):
    angles = np.meshgrid([20.0, 40], np.arange(0, 91, 10.0), np.arange(0, 360, 10.0), indexing="ij")
    theta_i, theta_r, phi = (v.ravel() for v in angles)
    scan = make_scan(theta_i, theta_r, 0.1 + 0 * phi, phi)
    done = convert(scan, tmp_path / "x", "lighttools", filling=Filling(("bilateral",)))
    assert done.last_incidence == 40
    assert "alone: at all other angles" not in done.scan.attrs["history"]


@pytest.mark.parametrize(
    ("name", "values", "last"),
    [
        ("lambert", {"rho": 0.5}, 90.0),
        ("ggx", VALUES, 90.0),
        ("priest", {"rho_s": 0.3, "rho_d": 0.3}, 89.0),
        ("maxwell-beard", {}, 85.0),
    ],
)
def test_a_model_without_bound_ends_before(name, values, last):
    model = catalogue[name]
    weights = dict.fromkeys(model.weights, 0.3)
    known = {n: p.default for n, p in model.shape.items()} | weights | {n: v for n, v in values.items() if n in weights}
    assert last_incidence(of(name, known | {k: v for k, v in values.items() if k in model.shape})) == last


def test_the_half_width_is_that_of_the_lobe_above_what_is_under_it():
    assert half_width(of("lambert", {catalogue["lambert"].weights[0]: 0.5})) == 45.0
    # f = cos^n of the angle from the mirror direction falls to half at arccos(2^(-1/n)).
    lobe = partial(_lobe, exponent=200.0, floor=0.0)
    assert half_width(lobe) == pytest.approx(np.degrees(np.arccos(0.5 ** (1 / 200))), abs=0.06)
    assert half_width(partial(_lobe, exponent=200.0, floor=0.9)) == pytest.approx(half_width(lobe), abs=0.06)


def _lobe(theta_i, theta_r, phi, exponent, floor):
    ti, tr, p = (np.radians(v) for v in (theta_i, theta_r, phi))
    cosine = np.cos(ti) * np.cos(tr) - np.sin(ti) * np.sin(tr) * np.cos(p)
    return floor + np.maximum(cosine, 0) ** exponent


def test_steps_are_smaller_for_a_narrow_lobe():
    wide, narrow = (Lobe(w, 90.0).specular(1.0, True)["theta_s"] for w in (20.0, 2.0))
    assert narrow[1] < wide[1]
    assert np.diff(narrow).max() <= 7.5  # 5 deg, and half of that more before the last one
    finer = Lobe(2.0, 90.0).spherical(2.0, False)
    coarse = Lobe(2.0, 90.0).spherical(1.0, False)
    assert all(len(finer[n]) > len(coarse[n]) for n in finer)
