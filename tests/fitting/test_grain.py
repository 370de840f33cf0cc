"""Surfaces with a grain: their models, the scans that show one, and the values that come back."""

import json
from itertools import chain

import numpy as np
import pytest

import grain as brushed
from gonio import Geometry, catalogue, check, simulate
from gonio.app.views.fit import provisos
from gonio.comparison.answer import everything, tried
from gonio.findings.grain import CHANGE, REMEDY, change_by_turning
from gonio.optics.grain import LEAST, MOST, grain_azimuth
from places import ROOT

GRAINED = [model for model in catalogue.values() if model.for_turned]
WIDTHS = {"beckmann": "m", "ggx": "width", "student-t": "width", "gonio-best": "m"}
TURNS = (0.0, 30.0, 60.0, 90.0)
every_grained = pytest.mark.parametrize("model", GRAINED, ids=lambda model: model.name)


def directions() -> tuple[np.ndarray, ...]:
    random = np.random.default_rng(7)
    return random.uniform(1, 80, 60), random.uniform(1, 80, 60), random.uniform(0, 360, 60), random.uniform(0, 360, 60)


def widths(model) -> tuple[str, str]:
    first, second = (name for name in model.shape if name in ("w_x", "w_y", "m_x", "m_y"))
    return first, second


def shape(model, along: float, across: float, psi: float) -> dict[str, float]:
    return dict(zip(widths(model), (along, across), strict=True)) | {"psi": psi}


def assert_equal(found, expected, rtol: float = 1e-9) -> None:
    for weight, value in expected.items():
        np.testing.assert_allclose(found[weight], value, rtol=rtol, atol=1e-290, err_msg=weight)


def test_each_facet_model_has_one():
    assert {model.name.removesuffix("-grain") for model in GRAINED} == WIDTHS.keys()


@every_grained
def test_equal_widths_are_the_isotropic_model(model):
    """Whatever the azimuth is."""
    plain = catalogue[model.name.removesuffix("-grain")]
    g = Geometry.from_degrees(*directions())
    isotropic = plain.basis(g, {WIDTHS[plain.name]: 0.3})
    assert_equal(model.basis(g, shape(model, 0.3, 0.3, 37.0)), isotropic)


@every_grained
def test_the_azimuth_counts_as_phi_i_does(model):
    """A surface whose grain is turned by 25 deg reflects as one from whose grain the light is turned back by 25 deg."""
    theta_i, theta_r, phi, phi_i = directions()
    turned = model.basis(Geometry.from_degrees(theta_i, theta_r, phi, phi_i), shape(model, 0.1, 0.4, 30.0))
    assert_equal(
        turned, model.basis(Geometry.from_degrees(theta_i, theta_r, phi, phi_i - 25), shape(model, 0.1, 0.4, 5))
    )


@every_grained
def test_exchanged_widths_are_the_same_surface_a_quarter_turn_away(model):
    """And half a turn changes nothing: so 90 deg of azimuth hold every surface once."""
    g = Geometry.from_degrees(*directions())
    there = model.basis(g, shape(model, 0.1, 0.4, -20.0))
    assert_equal(model.basis(g, shape(model, 0.4, 0.1, 70.0)), there)
    assert_equal(model.basis(g, shape(model, 0.1, 0.4, 160.0)), there)
    assert MOST - LEAST == 90.0


@every_grained
def test_turned_and_exchanged_directions_keep_reciprocity(model):
    theta_i, theta_r, phi, phi_i = directions()
    there = Geometry.from_degrees(theta_i, theta_r, phi, phi_i)
    back = Geometry.from_degrees(theta_r, theta_i, -phi, phi_i + phi)
    assert_equal(model.basis(back, shape(model, 0.1, 0.4, 30.0)), model.basis(there, shape(model, 0.1, 0.4, 30.0)))


def test_the_azimuth_of_the_grain_is_that_of_the_narrow_axis():
    azimuth = grain_azimuth("w_x", "w_y")
    assert azimuth({"w_x": 0.1, "w_y": 0.3, "psi": 20.0}) == 20.0
    assert azimuth({"w_x": 0.3, "w_y": 0.1, "psi": 20.0}) == -70.0
    assert azimuth({"w_x": 0.3, "w_y": 0.1, "psi": -20.0}) == 70.0


def test_searches_try_them_where_the_surface_was_turned():
    """At several phi_i, and not at one, at none, or at one that is told as 0 and 360."""
    ggx = catalogue["ggx"]
    angles = [20.0, 40.0], np.arange(-40.0, 41.0, 20.0)
    names = {model.name for model in GRAINED}
    assert names <= {m.name for m in tried(simulate(ggx, {"rho_s": 1.0}, *angles, phi_i=TURNS), everything())}
    for phi_i in (None, [30.0], [0.0, 360.0]):
        assert not names & {m.name for m in tried(simulate(ggx, {"rho_s": 1.0}, *angles, phi_i=phi_i), everything())}
    some = [catalogue["ggx"], catalogue["beckmann"]]
    assert tried(simulate(ggx, {"rho_s": 1.0}, *angles, phi_i=TURNS), some) == some


def test_a_scan_of_a_grain_is_told_and_others_are_not():
    """Brushed metal changes by more than noise of a tenth; an isotropic surface and one that was not turned do not."""
    found = next(one for one in check(brushed.scan("ggx-grain", 0)) if one.name == "grain")
    assert found.remedy == REMEDY
    assert all(name in REMEDY for name in (model.name for model in GRAINED))
    isotropic = simulate(catalogue["ggx"], {"rho_s": 1.0, "rho_d": 0.1}, brushed.THETA_I, brushed.THETA_R, noise=0.1,
                         phi_i=np.arange(0.0, 180.0, 15.0))  # fmt: skip
    assert 1.0 < change_by_turning(isotropic) < CHANGE
    one_azimuth = brushed.scan("ggx-grain", 0)
    one_azimuth = one_azimuth.isel(direction=np.flatnonzero(one_azimuth["phi_i"].values == 45.0))
    for scan in (isotropic, one_azimuth):
        assert "grain" not in {one.name for one in check(scan)}


def test_a_fit_without_a_grain_names_models_that_have_one():
    solution, points = brushed.fitted("ggx-grain", 0), brushed.scan("ggx-grain", 0)
    assert not list(provisos.grain_lines(solution, points))
    isotropic = type(solution)(solution.dataset, catalogue["ggx"])
    said = " ".join(map(str, chain(provisos.grain_lines(isotropic, points))))
    assert "has a grain" in said
    assert "ggx-grain" in said


def test_a_brushed_metal_comes_back():
    """Both widths and the azimuth within two standard uncertainties: 14 of 18, which chance misses once in 1500."""
    off = np.array([brushed.errors("ggx-grain", seed) for seed in range(6)])
    assert (np.abs(off) < 2).sum() >= 14


@pytest.mark.parametrize("psi", [-30.0, 0.0, 45.0])
def test_grains_that_stand_at_usual_azimuths_come_back(psi):
    """No end of the azimuth's bounds is near, whichever axis is the narrow one."""
    values, held, asked = brushed.BRUSHED["beckmann-grain"]
    for along, across in ((0.08, 0.3), (0.3, 0.08)):
        known = values | held | {"m_x": along, "m_y": across, "psi": psi}
        scan = simulate(catalogue["beckmann-grain"], known, brushed.THETA_I, brushed.THETA_R, noise=0.01, phi_i=TURNS)
        solution = brushed.solved("beckmann-grain", scan)
        assert all(abs(solution.values[n] - known[n]) < 4 * solution.uncertainties[n] for n in asked)


def test_the_record_of_many_repetitions():
    """Normal errors lie within two standard uncertainties in 95.4 of 100, of 400 by chance in 92.2 (three sigmas)."""
    record = json.loads((ROOT / "benchmarks" / "grain.json").read_text(encoding="utf-8"))
    assert record["models"].keys() == {model.name for model in GRAINED}
    for name, found in record["models"].items():
        counts = [found[value] for value in brushed.BRUSHED[name][2]]
        assert record["repeats"] >= 400
        assert min(counts) >= 92.2
