"""What an instrument takes in, against random directions drawn by another route and against closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gonio import Geometry, catalogue, simulate
from gonio.measured.instrument import Acceptance, Instrument

GGX = {"rho_s": 0.8, "rho_d": 0.1, "width": 0.03, "index": 1.5, "extinction": 0.0}
LORENTZ = {"ks": 0.02, "kdd": 30.0, "kid": 0.02, "sigma": 0.01, "gamma": 40.0}


def drawn(theta_i, theta_r, phi, instrument, model, values, draws=60_000):
    """Mean and standard error of what the instrument reads, from rotated random directions in its cones."""
    random = np.random.default_rng(7)
    cones = []
    for theta, azimuth, angle in (
        (theta_i, 0.0, instrument.source_half_angle),
        (theta_r, phi, instrument.detector_half_angle),
    ):
        z = 1 - random.random(draws) * (1 - np.cos(np.radians(angle)))
        turn = 2 * np.pi * random.random(draws)
        about = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=-1)
        cones.append(Rotation.from_euler("yz", [theta, azimuth], degrees=True).apply(about))
    (x_i, y_i, z_i), (x_r, y_r, z_r) = (c.T for c in cones)
    f = np.where((z_i > 0) & (z_r > 0), model(Geometry(x_i, y_i, z_i, x_r, y_r, z_r), values), 0.0)
    read = f * z_i * z_r / np.cos(np.radians(theta_i)) / np.cos(np.radians(theta_r))
    return read.mean(), read.std() / np.sqrt(draws)


@pytest.mark.parametrize(
    ("theta_i", "theta_r", "phi"),
    [(30.0, 30.0, 180.0), (30.0, 33.0, 180.0), (0.0, 1.5, 40.0), (50.0, 49.0, 177.0), (20.0, 88.5, 180.0)],
    ids=["peak", "flank", "normal", "out of plane", "half below the horizon"],
)
@pytest.mark.parametrize("instrument", [Instrument(0.0, 2.0), Instrument(1.5, 0.0), Instrument(0.9, 0.6)], ids=str)
@pytest.mark.parametrize(("name", "values"), [("ggx", GGX), ("cauchy-lorentz", LORENTZ)])
def test_against_random_directions(theta_i, theta_r, phi, instrument, name, values):
    model = catalogue[name]
    expected, error = drawn(theta_i, theta_r, phi, instrument, model, values)
    geometry = Geometry.from_degrees(*(np.array([a]) for a in (theta_i, theta_r, phi)))
    (found,) = Acceptance(instrument, geometry).brdf(model, values)
    # five standard errors of the draws, and 5e-3 for the rule: a horizon through a cone is no smooth function
    assert found == pytest.approx(expected, abs=5 * error, rel=5e-3)


def test_the_rule_converges_as_its_docstring_says():
    """Lobes whose standard deviation in theta_r is one step and two: twice the slope's, for facets turn by half."""
    model, theta_r = catalogue["torrance-sparrow"], np.arange(25.0, 35.0, 0.25)
    geometry = Geometry.in_plane(np.full_like(theta_r, 30.0), theta_r)
    for steps, bar in ((1.0, 2e-2), (2.0, 5e-4)):
        values = {"ks": 1.0, "sigma": np.radians(0.5 * steps) / 2}
        for half_angle in (0.9, 2.0, 4.0):
            found = Acceptance(Instrument(0.0, half_angle), geometry).brdf(model, values)
            exact = Acceptance(Instrument(0.0, half_angle, 0.1), geometry).brdf(model, values)
            assert np.abs(found - exact).max() < bar * exact.max()


def test_a_uniform_surface_reads_the_mean_cosine():
    """Over a cone of half-angle a the cosine at the centre, times (1 + cos a)/2; whatever the direction."""
    geometry = Geometry.from_degrees(*(a.ravel() for a in np.meshgrid([0.0, 30, 60], [0.0, 45, 75], [0.0, 100, 180])))
    found = Acceptance(Instrument(3.0, 5.0), geometry).brdf(catalogue["lambert"], {"rho": np.pi})
    expected = (1 + np.cos(np.radians(3))) / 2 * (1 + np.cos(np.radians(5))) / 2
    # the lambert term is 1/pi; the rule is exact for a cosine, so only rounding is left
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_exchanging_source_and_detector_changes_nothing():
    g = Geometry.from_degrees(np.array([40.0, 10]), np.array([42.0, 60]), np.array([178.0, 30]))
    exchanged = Geometry(*g[3:], *g[:3])
    one = Acceptance(Instrument(1.0, 2.0, 0.2), g).brdf(catalogue["ggx"], GGX)
    two = Acceptance(Instrument(2.0, 1.0, 0.2), exchanged).brdf(catalogue["ggx"], GGX)
    np.testing.assert_allclose(one, two, rtol=1e-3)  # the rule of the source is turned by half a step


def test_blocks_do_not_show(monkeypatch):
    geometry = Geometry.in_plane(np.full(7, 30.0), np.linspace(25, 35, 7))
    whole = Acceptance(Instrument(0.9, 0.9), geometry).brdf(catalogue["ggx"], GGX)
    monkeypatch.setattr("gonio.measured.instrument.BLOCK", 50)
    np.testing.assert_allclose(
        Acceptance(Instrument(0.9, 0.9), geometry).brdf(catalogue["ggx"], GGX), whole, rtol=1e-12
    )


def test_refusals():
    with pytest.raises(ValueError, match="detector_half_angle is -1: give degrees from 0 to 30"):
        Instrument(detector_half_angle=-1.0)
    with pytest.raises(ValueError, match="step is 0: give degrees"):
        Instrument(step=0.0)
    with pytest.raises(ValueError, match="2 directions lie on the horizon"):
        simulate(catalogue["lambert"], {"rho": 1.0}, [10.0], [-90.0, 0, 90], instrument=Instrument(1.0))
    with pytest.raises(ValueError, match="no parameter 'k'"):
        simulate(catalogue["lambert"], {"k": 1.0}, [10.0], [0.0], instrument=Instrument(1.0))
