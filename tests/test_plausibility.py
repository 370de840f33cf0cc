"""Positivity, reciprocity and energy: each law is seen to hold and seen to fail, at the right place."""

import functools
import json

import numpy as np
import pytest

from gonio import Problem, catalogue, read, simulate
from gonio.app.views.physics import check
from gonio.fitting import fit
from gonio.measured.dataset import make_scan
from gonio.plausibility import energy, hemispherical_reflectance, of_scan, positivity, reciprocity

THETA_R = np.arange(-80, 81, 5.0)


def lambert(g, rho=1.0):
    return rho / np.pi + 0 * (g.z_i + g.z_r)


def test_lambert_keeps_every_law():
    assert positivity(lambert).holds
    assert reciprocity(lambert).figures["worst ln ratio"] == 0
    verdict = energy(lambert, "sr-1")
    assert verdict.holds
    np.testing.assert_allclose(list(verdict.figures.values()), 1.0, rtol=1e-12)
    bright = functools.partial(lambert, rho=1.01)
    assert energy(bright, "sr-1").holds is False


def test_violations_are_found_where_they_are():
    dark = positivity(lambda g: g.z_r - 0.5)
    assert dark.holds is False
    # the least z_r is that of the steepest quasi-random direction, which is within a thousandth of 85 deg
    assert dark.figures["least"] == pytest.approx(np.cos(np.radians(85)) - 0.5, abs=1e-3)
    one_way = reciprocity(lambda g: np.exp(2 * g.z_i))
    assert one_way.holds is False
    assert abs(one_way.figures["worst ln ratio"]) == pytest.approx(2 * (1 - np.cos(np.radians(85))), abs=0.02)
    peaked = energy(lambda g: 1 / (np.pi * g.z_i), "sr-1")
    assert peaked.where == "theta_i 85 deg"
    assert peaked.figures["DHR(60)"] == pytest.approx(2.0, rel=1e-12)


def test_relative_data_have_no_energy():
    verdict = energy(lambert, "a.u.")
    assert verdict.holds is None
    assert "relative" in verdict.why


def test_quadrature_against_the_closed_form():
    """cos^n about the normal: DHR = 2 pi/(n + 2)."""
    for n in (0, 1, 5, 40):
        assert hemispherical_reflectance(lambda g, n=n: g.z_r**n, 30.0) == pytest.approx(2 * np.pi / (n + 2), rel=1e-10)


def test_a_scan_uses_its_own_pairs():
    scan = make_scan([30, 60, 30, 60], [60, 30, -60, -30], [1.0, 2.0, 3.0, 3.0])
    positive, exchanged, refused = of_scan(scan)
    assert positive.holds
    assert exchanged.holds is None
    assert exchanged.figures == {"pairs": 2, "rms ln ratio": np.log(2) / np.sqrt(2), "worst ln ratio": -np.log(2)}
    assert exchanged.where == "theta_i 30, theta_r 60, phi 180 deg"
    assert refused.holds is None
    coloured = scan.assign_coords(channel=("direction", ["R", "G", "R", "R"]))
    assert of_scan(coloured)[1].figures["pairs"] == 1
    lone = make_scan([30, 30], [10, 20], [-1.0, 2.0], unit="a.u.")
    verdicts = of_scan(lone)
    assert verdicts[0].holds is False
    assert "no pair" in verdicts[1].why
    assert "relative" in verdicts[2].why


def test_directions_that_cannot_be_interpolated_leave_the_other_laws(monkeypatch):
    """Too many scattered ones: energy has no verdict, with the reason, and the scan is checked all the same."""
    monkeypatch.setattr("gonio.resampling.interpolation.LARGEST_CLOUD", 20)
    random = np.random.default_rng(0)
    scan = make_scan(*random.uniform(0, 80, (2, 40)), np.full(40, -0.1), random.uniform(0, 360, 40))
    positive, _, energetic = of_scan(scan)
    assert positive.holds is False
    assert energetic.holds is None
    assert "40 directions without a grid are more than the 20 that can be interpolated" in energetic.why


def test_real_scan_as_its_header_says(shared_scans):
    """Sandblasted aluminium: the authors' reciprocal form has an rms ln ratio of a few hundredths."""
    verdict = of_scan(read(shared_scans / "jsss_mwir_aluminium_sandblasted.csv"))[1]
    assert verdict.figures["pairs"] == 45
    assert verdict.figures["rms ln ratio"] == pytest.approx(0.04, abs=0.01)


@pytest.mark.parametrize("name", list(catalogue))
def test_models_as_declared(name):
    """Each term of the catalogue keeps what its model does not declare as violated."""
    model = catalogue[name]
    found = {v.law for verdicts in check(name, {}).values() for v in verdicts if v.holds is False}
    assert found - {"energy"} == set(model.violates) - {"energy"}
    assert found <= set(model.violates)


def test_fits_by_incidence_and_channel(tmp_path):
    model = catalogue["torrance-sparrow"]
    values = {"ks": {20.0: 0.2, 50.0: 0.6}, "kd": 0.05, "sigma": 0.2}
    scan = simulate(model, values, [20.0, 50.0], THETA_R)
    coloured = scan.assign_coords(channel=("direction", np.where(np.arange(len(THETA_R) * 2) % 2, "R", "G")))
    fit(Problem(model, coloured, grouped={"ks": "theta_i"})).save(tmp_path / "solution.nc")
    checked = check(str(tmp_path / "solution.nc"), {})
    assert list(checked) == ["solution.nc, channel G", "solution.nc, channel R"]
    for positive, exchanged, reflected in checked.values():
        assert positive.holds
        assert exchanged.holds is False
        # ln 3 where ks is alone; the constant term, which is reciprocal, makes it less everywhere
        assert 0.8 < abs(exchanged.figures["worst ln ratio"]) < np.log(3)
        assert set(reflected.figures) == {"DHR(20)", "DHR(50)"}
    fit(Problem(model, simulate(model, values, [20.0, 50.0], THETA_R, unit="a.u."))).save(tmp_path / "relative.nc")
    verdicts = check(str(tmp_path / "relative.nc"), {})["relative.nc"]
    assert verdicts[1].holds
    assert "relative" in verdicts[2].why
    with pytest.raises(ValueError, match="--set, --material and --samples belong to a model"):
        check(str(tmp_path / "relative.nc"), {"ks": 1.0})


def test_whole_model_with_values():
    (verdicts,) = check("cauchy-lorentz-reciprocal", {"rho_s": 0.9, "rho_dd": 0.4, "sigma": 0.3}).values()
    assert [v.holds for v in verdicts] == [True, True, False]
    json.dumps([v.figures for v in verdicts])
