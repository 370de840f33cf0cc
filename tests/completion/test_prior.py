"""The table of what models miss of public materials."""

import hashlib

import numpy as np
import pytest

from gonio.completion import prior
from gonio.completion.coordinates import coordinates, half_angles
from gonio.completion.process import Process, Where
from gonio.measured.dataset import make_scan

SHA256 = "0960ecd05daf7c8f562a3a8612288fcaae06a17ac163739836ff089dccfc72d8"
MOST = 300_000  # bytes


def some(count=200, seed=5):
    rng = np.random.default_rng(seed)
    theta_i, theta_r = rng.uniform(0, 85, (2, count))
    return make_scan(theta_i, theta_r, np.ones(count), rng.uniform(0, 360, count))


def seen(places, *names, phi):
    one, other = (places[name].values for name in names)
    return make_scan(one, other, np.ones(len(one)), phi % 360)


def test_it_is_the_table_that_make_prior_made():
    data = prior.TABLE.read_bytes()
    assert hashlib.sha256(data).hexdigest() == SHA256
    assert len(data) <= MOST
    assert len(prior.materials()) == 48


def test_its_covariance_is_positive_semi_definite():
    residuals = prior.residuals(some())
    eigenvalues = np.linalg.eigvalsh(residuals @ residuals.T)
    assert eigenvalues.min() >= -1e-12 * eigenvalues.max()
    assert eigenvalues.max() > 0.1


@pytest.mark.parametrize("function", [prior.residuals, coordinates, half_angles])
def test_it_is_reciprocal_and_the_same_in_a_mirror(function):
    places = some()
    phi = places["phi"].values
    for other in (seen(places, "theta_r", "theta_i", phi=-phi), seen(places, "theta_i", "theta_r", phi=-phi)):
        np.testing.assert_allclose(function(other), function(places), atol=2e-6)


def test_at_a_node_it_is_the_table():
    """theta_h 12 deg and theta_d 40 deg, in the plane: theta_i 52 deg, theta_r 28 deg on the forward side."""
    names, grid = prior._table()
    node = grid[prior.HALVES.index(12.0), prior.DIFFERENCES.index(40.0), 0]
    found = prior.residuals(make_scan([52.0], [28.0], [1.0], [180.0]))
    np.testing.assert_allclose(found[0] * np.sqrt(len(names)), node, atol=1e-6)


def test_a_material_is_left_out():
    places = some(3)
    every, fewer = prior.residuals(places), prior.residuals(places, ["paper_red"])
    place = prior.materials().index("paper_red")
    np.testing.assert_allclose(np.delete(every, place, axis=1) * np.sqrt(48), fewer * np.sqrt(47))


def test_the_process_knows_a_sample_of_itself():
    """Intervals of 95 % hold a sample of the smooth part alone; that they hold fewer than 85 of 100 would be chance."""
    rng = np.random.default_rng(2)
    places = some(300)
    where = Where(coordinates(places), np.zeros(300, int), np.arange(300), prior.residuals(places))
    far = np.sqrt(5 * np.sum(((where.coordinates[:, None] - where.coordinates) / [0.7, 0.8, 0.5]) ** 2, axis=-1))
    drawn = np.linalg.cholesky(
        (1 + far + far**2 / 3) * np.exp(-far) * 0.1**2 + 1e-10 * np.eye(300)
    ) @ rng.standard_normal(300)
    known, asked = where.part(np.arange(200)), where.part(np.arange(200, 300))
    noisy = drawn[:200] + 0.01 * rng.standard_normal(200)
    process = Process.learned(known, noisy, float(np.std(noisy)))
    mean, deviation, before = process.at(asked)
    held = np.abs(mean - drawn[200:]) <= 1.96 * deviation
    assert held.mean() >= 0.85
    assert np.sqrt(np.mean((mean - drawn[200:]) ** 2)) < 0.3 * np.std(drawn)
    assert (deviation <= before).all()
    assert process.noise == pytest.approx(0.01, rel=0.5)
