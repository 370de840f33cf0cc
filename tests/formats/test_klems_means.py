"""Means over Klems patches: trees exactly, functions by quadrature, and what Radiance makes of the same tree."""

import json
from pathlib import Path

import numpy as np
import pytest

from gonio import catalogue, convert, read
from gonio.formats.radiance import klems, patch_means, tensor_tree, tree_means
from gonio.formats.radiance.klems import Basis
from gonio.formats.radiance.window import LEVEL, _bases_of, evaluate
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.resampling.sources import sets_of

FULL, QUARTER = klems.FULL, klems.QUARTER
PEER = Path(__file__).parents[1] / "reference" / "peers" / "radiance.json"


def projected(basis: Basis) -> np.ndarray:
    """The projected solid angle [sr] of every patch."""
    squares = np.sin(np.radians(basis.bounds)) ** 2
    return np.repeat(np.pi * np.diff(squares) / basis.counts, basis.counts)


def every_cell(level: int) -> np.ndarray:
    return np.stack(np.meshgrid(*[np.arange(2**level)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("basis", [*klems.BASES, Basis("odd", (0, 7, 33), (3, 5, 11), 80)], ids=str)
@pytest.mark.parametrize("level", [0, 1, 2, 5])
def test_shares_of_a_patch_and_of_a_cell_add_up(basis, level):
    """A patch lies in the cells whole; a cell that the basis covers is divided among patches whole."""
    shares = tree_means.shares(basis, level, every_cell(level)).toarray()
    assert shares.min() > -1e-14
    np.testing.assert_allclose(shares.sum(axis=1), 1, atol=1e-12)
    if basis.upper == 90:
        cell = np.pi / 4**level
        np.testing.assert_allclose(projected(basis) @ shares, cell, rtol=1e-12)


def test_shares_are_those_of_random_points():
    """2 million points, uniform in projected solid angle: each share is a binomial of those in its patch."""
    random = np.random.default_rng(0)
    radius, azimuth = np.sqrt(random.random(2_000_000)), 2 * np.pi * random.random(2_000_000)
    patch = FULL.index(np.degrees(np.arcsin(radius)), np.degrees(azimuth))
    x, y = tensor_tree.to_square(radius, azimuth)
    counts = np.zeros((FULL.size, 64))
    np.add.at(counts, (patch, (np.floor(8 * x) * 8 + np.floor(8 * y)).astype(int)), 1)
    total = counts.sum(axis=1, keepdims=True)
    exact = tree_means.shares(FULL, 3, every_cell(3)).toarray()
    sigma = np.sqrt(exact * (1 - exact) / total)
    assert np.abs(counts / total - exact).max() < 0.02
    assert (np.abs(counts / total - exact) < 5 * sigma + 1e-12).all()


def test_radiance_makes_the_same_matrix_of_a_tree(tmp_path):
    """bsdf2klems takes 1 024 random samples a pair: 2 % of a value, and 1e-3 of the energy of a column."""
    surfaces = json.loads(PEER.read_text(encoding="utf-8"))["surfaces"]
    for name in ("bsdf2ttree", "tree2klems"):
        (tmp_path / f"{name}.xml").write_text(surfaces[name]["file"], encoding="utf-8")
    tree, matrix = read(tmp_path / "bsdf2ttree.xml"), read(tmp_path / "tree2klems.xml")
    incident, outgoing = _bases_of(matrix)
    weights = projected(outgoing)
    for key, part in sets_of(tree):
        ours = patch_means.of_tree(part, LEVEL, incident, outgoing)
        theirs = matrix["brdf"].sel(key).squeeze().transpose("incident", "outgoing").values
        assert np.abs(theirs / ours - 1).max() < 0.02
        assert np.abs((theirs @ weights) / (ours @ weights) - 1).max() < 1e-3


@pytest.mark.parametrize("turned", [False, True])
def test_a_constant_is_its_own_mean(turned):
    means = patch_means.of_function(QUARTER, QUARTER, lambda *a: np.full(len(a[0]), 0.25), turned)
    np.testing.assert_allclose(means.values, 0.25, rtol=1e-12)
    assert means.partial == 0


@pytest.mark.parametrize(
    ("name", "values"),
    [("ggx", {"rho_s": 0.5, "rho_d": 0.1, "width": 0.3}), ("ggx", {"rho_s": 0.5, "rho_d": 0, "width": 0.05})],
)
def test_energy_of_a_model_is_kept(name, values):
    """The sum over outgoing patches is the directional-hemispherical reflectance, a mean over the incident patch."""
    model = catalogue[name]

    def brdf(*angles):
        return model(Geometry.from_degrees(*angles), values)

    means = patch_means.of_function(FULL, FULL, brdf, turned=False)
    random = np.random.default_rng(1)
    u, count = random.random((3, 200_000)), 200_000
    for band in (0, 4, 7):
        low, high = np.sin(np.radians(FULL.bounds[band : band + 2])) ** 2
        theta_i = np.degrees(np.arcsin(np.sqrt(low + (high - low) * u[0])))
        theta_r = np.degrees(np.arcsin(np.sqrt(u[1])))
        f = brdf(theta_i, theta_r, 360 * u[2], np.zeros(count))
        expected, sigma = np.pi * f.mean(), np.pi * f.std() / np.sqrt(count)
        first = sum(FULL.counts[:band])
        found = means.values[first] @ projected(FULL)
        assert abs(found - expected) < 4 * sigma + 1e-3 * expected


def test_quadrature_agrees_with_the_exact_sums_of_a_tree():
    """A tree of steps is the worst that quadrature meets: each mean to 10 %, the energy to 1 %."""
    random = np.random.default_rng(2)
    count = 2 ** (3 * 2)
    level, cell = np.full(count, 2), np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3)
    used = cell[:, 0] < 2
    level, cell, values = level[used], cell[used], random.lognormal(0, 1, used.sum())
    theta_i, column, theta_r, row = tensor_tree.centres(level, cell)
    phi_i = (180.0 - column) % 360.0
    tree = make_scan(theta_i, theta_r, values, (-row - phi_i) % 360.0, variables={LEVEL: (level.astype(np.int8), "1")})
    exact = patch_means.of_tree(tree, LEVEL, QUARTER, QUARTER)

    def looked_up(*angles):
        t_i, t_r, phi, turn = angles
        return tensor_tree.look_up(level, cell, values, (t_i, 180.0 - turn, t_r, -(turn + phi)))

    means = patch_means.of_function(QUARTER, QUARTER, looked_up, turned=False)
    assert np.abs(means.values / exact - 1).max() < 0.1
    weights = projected(QUARTER)
    assert np.abs((means.values @ weights) / (exact @ weights) - 1).max() < 0.01


def test_both_quadratures_agree_on_a_lobe():
    """The one over rings and sectors, and the one over both patches, of a lobe of 6 deg."""

    def lobe(theta_i, theta_r, phi, phi_i):
        a, b, p = map(np.radians, (theta_i, theta_r, phi))
        square = (np.sin(a) + np.sin(b) * np.cos(p)) ** 2 + (np.sin(b) * np.sin(p)) ** 2
        return 0.01 + np.exp(-square / 0.02)

    one, other = (patch_means.of_function(QUARTER, QUARTER, lobe, turned) for turned in (False, True))
    assert np.abs(one.values / other.values - 1).max() < 0.01


def test_a_pair_that_is_half_seen_is_a_mean_of_what_is_seen():
    """Of the last ring (63 to 90 deg), theta_r up to 80 deg is 0.85 of the projected solid angle, up to 69 deg 0.38."""
    for limit, is_gap in ((80.0, False), (69.0, True)):
        means = patch_means.of_function(
            QUARTER, QUARTER, lambda i, r, *_, limit=limit: np.where(r <= limit, 1.0, np.nan), turned=False
        )
        last = means.values[:, -QUARTER.counts[-1] :]
        assert np.isnan(last).all() if is_gap else np.allclose(last, 1)
        assert means.partial == (0 if is_gap else last.size)


def test_a_scan_keeps_its_energy_on_the_way_into_a_file(tmp_path):
    """A constant over the hemisphere, but for incidence beyond its last angle."""
    theta_i = np.repeat(np.arange(0, 90, 5.0), 37 * 24)
    theta_r = np.tile(np.repeat(np.linspace(0, 90, 37), 24), 18)
    phi = np.tile(np.arange(0, 360, 15.0), 18 * 37)
    scan = make_scan(theta_i, theta_r, np.full(len(phi), 0.2) / np.pi, phi)
    done = convert(scan, tmp_path / "k.xml", "radiance")
    reflectance = read(tmp_path / "k.xml")["brdf"].squeeze().values @ projected(FULL)
    np.testing.assert_allclose(reflectance[: -FULL.counts[-1]], 0.2, rtol=1e-6)
    assert "means over 21025 pairs of patches, quadrature over" in done.scan.attrs["history"]
    assert "against the means over their patches" in done.scan.attrs["history"]


def test_a_tree_is_converted_exactly(tmp_path):
    surfaces = json.loads(PEER.read_text(encoding="utf-8"))["surfaces"]
    (tmp_path / "tree.xml").write_text(surfaces["bsdf2ttree"]["file"], encoding="utf-8")
    tree = read(tmp_path / "tree.xml")
    done = convert(tree, tmp_path / "k.xml", "radiance")
    assert "exact sums over the cells of the tree" in done.scan.attrs["history"]
    written = read(tmp_path / "k.xml")
    for key, part in sets_of(tree):
        exact = patch_means.of_tree(part, LEVEL, FULL, FULL)
        np.testing.assert_allclose(written["brdf"].sel(key).squeeze().values, exact, rtol=1e-9)
    # the values of the file hold for every direction of a patch
    assert np.isfinite(evaluate(written, 33.0, 44.0, 100.0, 5.0)).all()
