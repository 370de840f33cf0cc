"""Resampling: exact where measured, second order between, nothing outside, symmetries, fillings."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gonio import catalogue, read
from gonio.measured import dataset
from gonio.measured.coordinates import grid
from gonio.measured.dataset import flatten, make_scan
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling, resample
from gonio.resampling.solid_angle import solid_angles

GGX = {"rho_s": 0.8, "rho_d": 0.3, "width": 0.4, "index": 1.5, "extinction": 0.0}


def surface(directions, model="ggx", values=GGX):
    """A model's BRDF on a Dataset of directions, NaN below the horizon."""
    shape = tuple(directions.sizes.values())
    empty = directions.assign(brdf=(tuple(directions.sizes), np.zeros(shape), {"units": "sr-1"}))
    flat = empty if empty["brdf"].dims == ("direction",) else None
    angles = {n: empty[n].broadcast_like(empty["brdf"]).transpose(*directions.sizes) for n in dataset.ANGLES}
    if flat is None:
        flat = make_scan(
            *(angles[n].values.ravel() for n in ("theta_i", "theta_r")),
            np.zeros(np.prod(shape)),
            angles["phi"].values.ravel(),
        )
    found = catalogue[model](dataset.geometry(flat), values)
    below = (flat["theta_r"].values > 90) | (flat["theta_i"].values > 90)
    return empty.assign(
        brdf=(tuple(directions.sizes), np.where(below, np.nan, found).reshape(shape), {"units": "sr-1"})
    )


def random_directions(n=300, most=60, seed=1):
    rng = np.random.default_rng(seed)
    theta_i, theta_r = rng.uniform(12, most, (2, n))
    return make_scan(theta_i, theta_r, np.zeros(n), rng.uniform(0, 360, n)).drop_vars("brdf")


GRIDS = {
    "spherical": lambda k: grid(
        "spherical", theta_i=np.arange(0, 81, 10 / k), theta_r=np.arange(0, 86, 5 / k), phi=np.arange(0, 360, 10 / k)
    ),
    "specular": lambda k: grid(
        "specular",
        theta_i=np.arange(0, 81, 10 / k),
        phi_s=np.arange(0, 181, 15 / k),
        theta_s=np.arange(0, 141, 5 / k),
    ),
    "half-difference": lambda k: grid(
        "half-difference",
        theta_h=90 * (np.arange(30 * k) / (30 * k)) ** 2,
        theta_d=np.arange(0, 90, 5 / k),
        phi_d=np.arange(0, 180, 10 / k),
    ),
}
every_grid = pytest.mark.parametrize("system", GRIDS)


@every_grid
@pytest.mark.parametrize("flat", [False, True], ids=["grid", "scattered"])
def test_own_directions_come_back_to_the_last_bit(system, flat):
    dense = surface(GRIDS[system](1))
    scan = flatten(dense) if flat else dense
    back = resample(scan, scan)
    np.testing.assert_array_equal(back["brdf"].values, scan["brdf"].values)
    assert "values as measured" in back.attrs["history"]
    assert "interpolated" not in back.attrs["history"]


@every_grid
def test_a_finer_grid_is_better_by_the_square_of_its_step(system):
    """Linear interpolation is of second order: half the step, a quarter of the error (allowed: 2.5 to 6)."""
    wanted = random_directions()
    truth = surface(wanted)["brdf"].values
    errors = []
    for fineness in (1, 2):
        found = resample(surface(GRIDS[system](fineness)), wanted)["brdf"].values
        assert np.isfinite(found).all()
        errors.append(np.median(np.abs(found / truth - 1)))
    assert errors[0] < 0.02
    assert 2.5 < errors[0] / errors[1] < 6


def test_slices_of_an_unordered_scan_follow_the_lobe():
    """A scan with its rows shuffled: between incidence angles a lobe of 5 deg moves with the mirror direction."""
    lobe = GGX | {"width": 0.08}
    dense = surface(grid("specular", theta_i=np.arange(10, 71, 10), phi_s=np.arange(0, 360, 15),
                         theta_s=[0, 1, 2, 4, 6, 8, 10, 15, 20, 30]), values=lobe)  # fmt: skip
    flat = flatten(dense)
    shuffled = flat.isel(direction=np.random.default_rng(0).permutation(flat.sizes["direction"]))
    at_mirror = make_scan([15.0, 25, 35], [15.0, 25, 35], np.zeros(3)).drop_vars("brdf")
    truth = surface(at_mirror, values=lobe)["brdf"].values
    np.testing.assert_allclose(resample(shuffled, at_mirror)["brdf"], truth, rtol=0.05)  # 40 % off without following


def test_in_plane_a_straight_line_is_exact_and_holes_stay():
    theta_r = np.r_[np.arange(-80, -34, 5.0), np.arange(-20, 81, 5.0)]  # the arm stood in the beam about -30
    scan = make_scan(np.full(len(theta_r), 30.0), theta_r, 2 + theta_r / 100)
    wanted = np.array([-81, -77.5, -32, -27, -20, 0, 12.5, 80, 80.5])
    out = resample(scan, make_scan(np.full(9, 30.0), wanted, np.zeros(9)).drop_vars("brdf"))["brdf"].values
    inside = np.array([0, 1, 0, 0, 1, 1, 1, 1, 0], dtype=bool)
    np.testing.assert_allclose(out[inside], 2 + wanted[inside] / 100, rtol=1e-14)
    assert np.isnan(out[~inside]).all()


def test_out_of_the_plane_an_in_plane_scan_says_nothing():
    scan = make_scan(np.repeat([10.0, 30.0], 5), np.tile([-40.0, -20, 0, 20, 40], 2), np.ones(10))
    beside = make_scan([10.0, 20, 10], [20.0, 20, 20], np.zeros(3), [170.0, 180, 180]).drop_vars("brdf")
    np.testing.assert_array_equal(resample(scan, beside)["brdf"].values, [np.nan, 1, 1])


def test_at_the_normal_all_azimuths_are_one_direction():
    scan = make_scan(np.full(4, 20.0), [0.0, 0, 30, 30], [1.0, 3, 5, 5], [0.0, 90, 0, 90])
    wanted = make_scan(np.full(3, 20.0), np.zeros(3), np.zeros(3), [0.0, 90, 200]).drop_vars("brdf")
    out = resample(scan, wanted)
    np.testing.assert_array_equal(out["brdf"], [1, 3, 2])
    assert "3 values as measured" in out.attrs["history"]


def test_masked_and_missing_values_are_gaps():
    scan = make_scan(np.full(6, 20.0), np.arange(0, 60, 10.0), np.r_[1, 1, np.nan, 1, 1, 1])
    scan["mask"] = ("direction", np.array([0, 0, 0, 0, 1, 0], dtype=np.int8))
    wanted = np.array([5.0, 15, 25, 35, 45])
    out = resample(scan, make_scan(np.full(5, 20.0), wanted, np.zeros(5)).drop_vars("brdf"))
    np.testing.assert_array_equal(out["brdf"].values, [1, np.nan, np.nan, np.nan, np.nan])
    assert "4 missing" in out.attrs["history"]


def test_triangles_across_a_hole_are_none():
    theta_r, phi = np.meshgrid(np.arange(0, 81, 5.0), np.arange(0, 360, 10.0), indexing="ij")
    kept = ~((theta_r > 20) & (theta_r < 60) & (phi > 60) & (phi < 120))
    scan = make_scan(np.full(kept.sum(), 30.0), theta_r[kept], np.ones(kept.sum()), phi[kept])
    wanted = make_scan([30.0, 30, 30], [40.0, 40, 70], np.zeros(3), [90.0, 180, 95]).drop_vars("brdf")
    np.testing.assert_array_equal(resample(scan, wanted)["brdf"].values, [np.nan, 1, 1])


def test_a_cloud_of_directions_is_interpolated_and_not_beyond_its_hull():
    cloud = surface(random_directions(4000, 70, seed=2))
    wanted = random_directions(100, 55, seed=3)
    found, truth = resample(cloud, wanted)["brdf"].values, surface(wanted)["brdf"].values
    assert np.nanmedian(np.abs(found / truth - 1)) < 0.05  # 4000 directions in three dimensions lie 4 deg apart
    outside = make_scan([85.0], [85.0], [0.0]).drop_vars("brdf")
    assert np.isnan(resample(cloud, outside)["brdf"]).all()


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(12, 60), st.floats(12, 60), st.floats(1, 179))
def test_imposed_symmetries_hold(theta_i, theta_r, phi):
    """Whatever the data: four images of a direction have one value."""
    scan = _lopsided()
    images = make_scan([theta_i, theta_r, theta_i, theta_r], [theta_r, theta_i, theta_r, theta_i], np.zeros(4),
                       [phi, -phi, -phi, phi]).drop_vars("brdf")  # fmt: skip
    out = resample(scan, images, impose=("reciprocity", "bilateral"))["brdf"].values
    np.testing.assert_allclose(out, out[0], rtol=1e-9)
    free = resample(scan, images)["brdf"].values
    np.testing.assert_allclose(out[0], free.mean(), rtol=1e-9)


def _lopsided():
    dense = surface(GRIDS["spherical"](1))
    tilt = 1 + 0.3 * np.sin(np.radians(dense["phi"])) + 0.2 * dense["theta_i"] / 90
    return dense.assign(brdf=(dense["brdf"].dims, (dense["brdf"] * tilt).values, {"units": "sr-1"}))


def test_gaps_are_filled_by_symmetry_only_where_there_are_gaps():
    half = surface(grid("spherical", theta_i=[20, 40], theta_r=np.arange(0, 81, 10), phi=np.arange(0, 181, 10)))
    half = flatten(half).isel(direction=slice(None))
    wanted = make_scan([20.0, 20, 20], [40.0, 40, 85], np.zeros(3), [100.0, 260, 100]).drop_vars("brdf")
    bare = resample(half, wanted)
    np.testing.assert_array_equal(np.isnan(bare["brdf"]), [False, True, True])
    filled = resample(half, wanted, filling=Filling(("bilateral",)))
    np.testing.assert_array_equal(filled["origin"], [1, 3, 0])
    assert filled["brdf"].values[1] == filled["brdf"].values[0]
    assert "1 filled by bilateral" in filled.attrs["history"]
    modelled = resample(half, wanted, filling=Filling(("bilateral",), lambda points: np.full(1, 7.0), "a model"))
    np.testing.assert_array_equal(modelled["origin"], [1, 3, 4])
    assert modelled["brdf"].values[2] == 7
    assert "1 filled by a model, not measured" in modelled.attrs["history"]


def test_sets_and_uncertainties_come_along():
    scan = make_scan(
        np.full(6, 20.0), np.tile([0.0, 10, 20], 2), [1, 2, 3, 4, 5, 6.0],
        uncertainty=[0.1, 0.3, 0.1, 0.2, 0.2, 0.2], coordinates={"wavelength": np.repeat([500.0, 600.0], 3)},
    )  # fmt: skip
    out = resample(scan, grid("spherical", theta_i=[20], theta_r=[5, 10, 30], phi=[180]))
    assert out["brdf"].dims == ("wavelength", "theta_i", "theta_r", "phi")
    np.testing.assert_allclose(out["brdf"].values[:, 0, :, 0], [[1.5, 2, np.nan], [4.5, 5, np.nan]], rtol=1e-14)
    np.testing.assert_allclose(out["uncertainty"].values[:, 0, :2, 0], [[0.2, 0.3], [0.2, 0.2]])
    assert out["wavelength"].attrs["units"] == "nm"


def test_a_turned_surface_is_interpolated_round_the_circle():
    pieces = [make_scan(np.full(5, 20.0), [0.0, 10, 20, 30, 40], np.full(5, value), phi_i=np.full(5, turn))
              for turn, value in ((0.0, 1.0), (120.0, 5.0), (160.0, 3.0), (330.0, 2.0))]  # fmt: skip
    import xarray as xr

    scan = xr.concat(pieces, dim="direction")
    wanted = make_scan(np.full(4, 20.0), np.full(4, 15.0), np.zeros(4), phi_i=[345.0, 140, 60, 0]).drop_vars("brdf")
    np.testing.assert_allclose(resample(scan, wanted)["brdf"], [1.5, 4, np.nan, 1])  # 0 and 120 deg are no neighbours


def test_an_unknown_symmetry_names_the_known():
    scan = make_scan([20.0, 20], [0.0, 10], [1.0, 1])
    with pytest.raises(ValueError, match="'mirror': there are reciprocity, bilateral"):
        resample(scan, scan, impose=("mirror",))


def test_real_scans_come_back_exactly(real_scan):
    scan = read(real_scan)
    found = difference(scan, scan)
    assert found.exact == found.count == dataset.points(scan).sizes["direction"]
    assert found.rms == 0
    assert found.missing == 0


def test_solid_angles_fill_the_hemisphere():
    rings = make_scan(np.full(181, 30.0), np.arange(-90, 91, 1.0), np.ones(181))
    # The last rings reach half a step below the horizon: sin(0.5 deg) more.
    assert solid_angles(rings).sum() == pytest.approx(2 * np.pi, rel=0.01)
    full = surface(grid("spherical", theta_i=[30], theta_r=np.arange(0, 90, 5), phi=np.arange(0, 360, 10)))
    assert solid_angles(full).sum() == pytest.approx(2 * np.pi, rel=1e-9)
    cells = solid_angles(full).reshape(18, 36)
    expected = np.radians(10) * (np.cos(np.radians(42.5)) - np.cos(np.radians(47.5)))
    np.testing.assert_allclose(cells[9], expected, rtol=0.01)  # Voronoi edges are great circles, not circles of theta


def test_difference_is_weighted_by_solid_angle():
    """A Lambertian of 1 against one of 1.1 beyond 60 deg, where half of the hemisphere's solid angle lies."""
    theta_r = np.arange(0.5, 90)
    reference = make_scan(np.full(90, 0.0), theta_r, np.ones(90))
    other = make_scan(np.full(90, 0.0), theta_r, np.where(theta_r > 60, 1.1, 1.0))
    found = difference(other, reference)
    assert found.bias == pytest.approx(0.05, rel=1e-6)
    assert found.rms == pytest.approx(0.1 * np.sqrt(0.5), rel=1e-6)
    assert found.largest == pytest.approx(0.1)
    assert found.where["theta_r"] > 60


def test_difference_refuses_what_cannot_be_compared():
    scan = make_scan([20.0, 20], [0.0, 10], [1.0, 1])
    with pytest.raises(ValueError, match="relative data cannot be compared with absolute"):
        difference(make_scan([20.0, 20], [0.0, 10], [1.0, 1], unit="a.u."), scan)
    coloured = make_scan(np.full(4, 20.0), [0.0, 10, 0, 10], np.ones(4), coordinates={"channel": ["R", "R", "G", "G"]})
    with pytest.raises(ValueError, match="2 sets that match the only set of the reference: select one"):
        difference(coloured, scan)
    blue = make_scan([20.0, 20], [0.0, 10], [1.0, 1], coordinates={"channel": ["B", "B"]})
    with pytest.raises(ValueError, match="no set that matches channel B"):
        difference(coloured, blue)
