"""1173 observed magnitudes of a satellite from the BRDFs of its two surfaces; without the data they are skipped."""

import numpy as np
import pytest

import starlink


@pytest.fixture(scope="module")
def facets(shared_scans):
    """Fits of a model of few values, a dielectric, which takes a second."""
    if not starlink.OBSERVATIONS.exists():
        pytest.skip(f"no observations at {starlink.OBSERVATIONS}")
    return starlink.body("ggx", held={"index": 1.5, "extinction": 0.0})


def test_computed_and_observed_magnitudes(facets):
    """The bias has a known part: 0.29 mag of the zero point of the authors' sun, which made theirs brighter.

    What is left of it is light of the Earth and whatever faces the observer besides the two surfaces.
    """
    found, curve = starlink.compared(facets)
    assert found["count"] == 1173
    assert found["correlation"] > 0.65
    assert found["scatter"] < 0.85
    assert 0.29 < found["bias"] < 1.3
    assert (curve["phase_angle"].values > 10).all()
    assert (curve["phase_angle"].values < 146).all()
    assert curve["distance"].values.min() / 1e3 == pytest.approx(472, abs=1)
    assert curve["distance"].values.max() / 1e3 == pytest.approx(1317, abs=1)
    assert (curve["uncertainty"].values > 0).all()
    assert np.median(curve["uncertainty"].values) < 0.1


def test_earthshine_makes_it_brighter(facets):
    """By about a hundredth of a magnitude in the mean, over every tenth observation; one of 1173 is in the shadow."""
    plain, curve = (starlink.compared(facets, albedo, every=10)[1] for albedo in (0.0, 0.3))
    lit = np.isfinite(curve["magnitude"].values)
    assert (~lit).sum() <= 1
    gained = (plain["magnitude"] - curve["magnitude"]).values[lit]
    assert (gained >= 0).all()
    assert 0.003 < gained.mean() < 0.1


def test_the_sun_is_where_astropy_has_it():
    """Three positions by get_sun of Astropy 8.0.2 for Mount Lemmon, to what the formulas are good for."""
    utc = np.array(["2022-01-25T13:28:39", "2022-01-25T12:53:02", "2021-06-21T19:30:00"], dtype="datetime64[s]")
    altitude, azimuth = starlink.sun_from(utc, *starlink.SITE)
    assert altitude == pytest.approx([-11.3812, -18.7002, 80.9269], abs=0.01)
    assert azimuth == pytest.approx([105.2630, 100.9438, 187.1785], abs=0.01 / np.cos(np.radians(81)))
