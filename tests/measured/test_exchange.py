"""Source and detector exchanged: turned surfaces, both sides of a transmission, and what has no partner."""

import numpy as np
import pytest

from gonio import resample
from gonio.measured.coordinates import grid
from gonio.measured.dataset import flatten, make_scan
from gonio.measured.exchange import pairs, partner
from gonio.plausibility import of_scan
from gonio.resampling.resample import Filling


def turned(theta_i, theta_r, phi, phi_i):
    """A reciprocal BRDF of a turned surface: exchanging the directions exchanges the azimuths."""
    in_, out = np.radians(phi_i), np.radians(phi_i + phi)
    return 0.1 * (1 + 0.4 * np.cos(2 * in_) + 0.4 * np.cos(2 * out) + 0.1 * np.cos(in_) * np.cos(out)) + 0 * theta_i


def through(side, theta_i, theta_r):
    """Transmission whose front depends on the way in alone, and whose back is its exchange."""
    way = theta_i if side == "front" else theta_r
    return 0.02 + 0.1 * np.cos(np.radians(way)) ** 3


def turned_scan():
    axes = (
        np.array([10.0, 30.0, 50.0]),
        np.array([0.0, 10.0, 30.0, 50.0]),
        np.arange(0, 360, 45.0),
        np.arange(0, 360, 45.0),
    )
    theta_i, theta_r, phi, phi_i = (a.ravel() for a in np.meshgrid(*axes))
    return make_scan(theta_i, theta_r, turned(theta_i, theta_r, phi, phi_i), phi, phi_i=phi_i)


def transmission(sides=("front", "back")):
    rows = [
        (s, i, r, p) for s in sides for i in (10.0, 40.0, 70.0) for r in (10.0, 40.0, 70.0) for p in (0.0, 90.0, 180.0)
    ]
    side, theta_i, theta_r, phi = (np.array(column) for column in zip(*rows, strict=True))
    values = np.array([through(*row[:3]) for row in rows])
    labels = {"mode": np.full(len(rows), "transmission"), "side": side}
    return make_scan(theta_i, theta_r, values, phi, coordinates=labels)


RECIPROCAL = {"turned": turned_scan, "transmission": transmission}


@pytest.mark.parametrize("name", RECIPROCAL)
def test_exactly_reciprocal_data_score_zero(name):
    verdict = next(v for v in of_scan(RECIPROCAL[name]()) if v.law == "reciprocity")
    assert verdict.figures["pairs"] >= 9
    assert verdict.figures["rms ln ratio"] < 1e-12


@pytest.mark.parametrize("name", RECIPROCAL)
def test_imposed_on_reciprocal_data_reciprocity_changes_nothing(name):
    scan = RECIPROCAL[name]()
    done = resample(scan, scan, impose=["reciprocity"])
    order = [n for n in ("side", "theta_i", "theta_r", "phi", "phi_i") if n in done.coords]
    there = {tuple(row): v for *row, v in zip(*(done[n].values for n in order), done["brdf"].values, strict=True)}
    for *row, value in zip(*(scan[n].values for n in order), scan["brdf"].values, strict=True):
        assert there[tuple(row)] == pytest.approx(value, rel=1e-12)


def test_a_dense_grid_of_a_turned_surface_scores_zero_too():
    onto = grid(
        "spherical",
        theta_i=[20.0, 40.0],
        theta_r=[20.0, 40.0],
        phi=np.arange(0, 360, 30.0),
        phi_i=np.arange(0, 360, 30.0),
    )
    dims = ("theta_i", "theta_r", "phi", "phi_i")
    angles = np.meshgrid(*(onto[d].values for d in dims), indexing="ij")
    dense = onto.assign(brdf=(dims, turned(*angles), {"units": "sr-1"}))
    assert next(v for v in of_scan(dense) if v.law == "reciprocity").figures["rms ln ratio"] < 1e-12


def test_what_breaks_reciprocity_is_seen_on_turned_surfaces_and_in_transmission():
    for make in RECIPROCAL.values():
        scan = make()
        factor = np.where(scan["theta_i"] < scan["theta_r"], 1.2, 1.0)
        broken = scan.assign(brdf=("direction", scan["brdf"].values * factor, {"units": "sr-1"}))
        figures = next(v for v in of_scan(broken) if v.law == "reciprocity").figures
        assert abs(figures["worst ln ratio"]) == pytest.approx(np.log(1.2))


def test_one_side_of_a_transmission_has_no_partner():
    front = transmission(["front"])
    assert next(v for v in of_scan(front) if v.law == "reciprocity").figures == {}
    unsided = front.drop_vars("side")
    assert len(pairs(flatten(unsided))[0]) == 0
    holes = front.isel(direction=np.flatnonzero((front["theta_i"] != 10) | (front["theta_r"] != 70)))
    filled = resample(holes, front, filling=Filling(("reciprocity", "bilateral")))
    assert int(filled["brdf"].isnull().sum()) == 3
    assert "not the transmission by reciprocity" in filled.attrs["history"]


def test_the_back_fills_the_front():
    both = transmission()
    hole = (both["side"] == "front") & (both["theta_i"] == 10) & (both["theta_r"] == 70)
    directions = transmission(["front"]).drop_vars(["mode", "side"])
    filled = resample(
        both.isel(direction=np.flatnonzero(~hole)), directions, filling=Filling(("reciprocity", "bilateral"))
    )
    at = (filled["side"] == "front") & (filled["theta_i"] == 10) & (filled["theta_r"] == 70)
    np.testing.assert_allclose(filled["brdf"].values[at.values], through("front", 10.0, 70.0), rtol=1e-12)


def test_partners():
    assert partner({"wavelength": 500.0}) == {"wavelength": 500.0}
    assert partner({"mode": "reflection", "side": "back"}) == {"mode": "reflection", "side": "back"}
    assert partner({"mode": "transmission", "side": "back"}) == {"mode": "transmission", "side": "front"}
    assert partner({"mode": "transmission"}) is None
