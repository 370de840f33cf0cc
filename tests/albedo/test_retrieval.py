"""Weights of kernels and albedos of many pixels: against fits one by one and fit_many, and how often intervals hold."""

import numpy as np
import pytest
import xarray as xr

import gonio
from gonio.albedo import albedo_maps, as_stack, black_sky, nbar, retrieve, white_sky
from gonio.fitting import fit
from gonio.fitting.certainty.band import propagate
from gonio.measured.dataset import make_scan

KERNELS = gonio.catalogue["ross-li"]
LOOKS = 16


def image(pixels=10_000, seed=1, noise=0.01, own=False, names=("theta_i", "theta_r", "phi")):
    """Reflectances over pixels and looks, their angles, and the true weights (pixels, 3)."""
    rng = np.random.default_rng(seed)
    shape = (pixels, LOOKS) if own else (LOOKS,)
    sun, view, azimuth = rng.uniform(20, 60, shape), rng.uniform(0, 60, shape), rng.uniform(0, 360, shape)
    weights = np.stack(
        [rng.uniform(0.1, 0.5, pixels), rng.uniform(0.1, 0.3, pixels), rng.uniform(0.03, 0.08, pixels)], 1
    )
    basis = KERNELS.basis(gonio.Geometry.from_degrees(sun, view, azimuth), {})
    exact = np.pi * sum(w[:, None] * basis[n] for w, n in zip(weights.T, KERNELS.weights, strict=True))
    dims = ("pixel", "look")
    angles = {n: (dims if own else "look", v) for n, v in zip(names, (sun, view, azimuth), strict=True)}
    return xr.DataArray(exact + noise * rng.normal(size=exact.shape), dims=dims, coords=angles), weights


@pytest.mark.parametrize("own", [False, True], ids=["shared angles", "angles of every pixel"])
def test_intervals_of_ten_thousand_pixels_hold_the_truth(own):
    """95 % intervals of the three albedos hold it in 93 to 97 % of the pixels; of NBAR and the weights too."""
    reflectance, weights = image(own=own)
    fits = retrieve(reflectance, KERNELS)
    maps = albedo_maps(fits, KERNELS, [45.0], 0.2)
    truth = {name: np.zeros(len(weights)) for name in ("black_sky", "white_sky", "nbar")}
    for weight, column in zip(KERNELS.weights, weights.T, strict=True):
        truth["black_sky"] += column * black_sky(KERNELS, 45.0, {weight: 1.0}).value
        truth["white_sky"] += column * white_sky(KERNELS, {weight: 1.0}).value
        truth["nbar"] += column * nbar(KERNELS, 45.0, {weight: 1.0}).value
    truth["blue_sky"] = 0.8 * truth["black_sky"] + 0.2 * truth["white_sky"]
    k = maps["coverage_factor"].values
    for name, exact in truth.items():
        error = np.abs(maps[name].values.reshape(-1) - exact)
        held = error <= k * maps[f"{name}_uncertainty"].values.reshape(-1)
        assert 0.93 < held.mean() < 0.97, name
    held = np.abs(fits["value"].values - weights) <= k[:, None] * fits["uncertainty"].values
    assert ((held.mean(axis=0) > 0.93) & (held.mean(axis=0) < 0.97)).all()


def test_stated_uncertainties_make_absolute_ones():
    reflectance, weights = image(2000)
    rng = np.random.default_rng(5)
    sigma = xr.DataArray(rng.uniform(0.005, 0.05, reflectance.shape), dims=reflectance.dims)
    noisy = reflectance + sigma * rng.normal(size=reflectance.shape)
    fits = retrieve(noisy, KERNELS, uncertainty=np.sqrt(sigma**2 + 0.01**2))
    maps = albedo_maps(fits, KERNELS, 45.0)
    held = np.abs(fits["value"].values - weights) <= 1.959964 * fits["uncertainty"].values
    assert maps["coverage_factor"].values == pytest.approx(1.959964)
    assert 0.93 < held.mean() < 0.97
    assert "blue_sky" not in maps


def test_a_pixel_is_fitted_as_a_scan_is():
    """Value, covariance and the uncertainty of the albedo of one pixel, by the fit of a scan; with gaps and a bound."""
    reflectance, _ = image(6)
    reflectance = reflectance.copy()
    reflectance[1, 3:7] = np.nan
    reflectance[2] = 0.2 - 0.02 * reflectance[2]  # its weights leave the bounds
    fits = retrieve(reflectance, KERNELS)
    maps = albedo_maps(fits, KERNELS, [30.0, 60.0], 0.3)
    assert fits["at_bound"].values[2].any()
    for pixel in (0, 1, 2):
        seen = np.isfinite(reflectance[pixel].values)
        angles = [reflectance[n].values[seen] for n in ("theta_i", "theta_r", "phi")]
        scan = make_scan(angles[0], angles[1], reflectance[pixel].values[seen] / np.pi, angles[2])
        one = fit(gonio.Problem(KERNELS, scan, weighting="uniform"), covariance="scaled")
        assert fits["value"].values[pixel] == pytest.approx(one.vector(KERNELS.weights), rel=1e-8, abs=1e-12)
        covariance = one.dataset["covariance"].values
        assert fits["covariance"].values[pixel] == pytest.approx(covariance, rel=1e-6, abs=1e-12)
        found = black_sky(one, [30.0, 60.0])
        assert maps["black_sky"].values[pixel] == pytest.approx(found.value, rel=1e-8)
        assert maps["black_sky_uncertainty"].values[pixel] == pytest.approx(found.uncertainty, rel=1e-5)
        assert fits["points"].values[pixel] == seen.sum()
        left = reflectance[pixel].values[seen] - np.pi * one.predict(scan)
        assert fits["rmse"].values[pixel] == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-8)
        assert propagate(one, lambda v: v).value == pytest.approx(fits["value"].values[pixel])


def test_shared_angles_are_a_stack_of_fit_many():
    """With the names of remote sensing and two dimensions of pixels; the maps of both are one."""
    names = ("solar_zenith", "view_zenith", "relative_azimuth")
    reflectance, _ = image(12, names=names)
    grid = reflectance.rename(pixel="cell").assign_coords(cell=np.arange(12)).assign_attrs(units="1")
    grid = xr.DataArray(
        grid.values.reshape(3, 4, LOOKS),
        dims=("y", "x", "look"),
        coords={**{n: ("look", grid[n].values) for n in names}, "y": [1.0, 2.0, 3.0], "x": [5.0, 6.0, 7.0, 8.0]},
    )
    fits = retrieve(grid, KERNELS)
    stack = as_stack(grid)
    problem = gonio.Problem(KERNELS, gonio.fitting.many.fit_many.one_scan(stack, ("y", "x")), weighting="uniform")
    many = gonio.fit_many(problem, stack, covariance="scaled")
    assert many["value"].values == pytest.approx(fits["value"].values, rel=1e-8)
    assert many["covariance"].values == pytest.approx(fits["covariance"].values, rel=1e-6, abs=1e-12)
    one, other = (albedo_maps(f, KERNELS, [40.0], 0.1, method="modis") for f in (fits, many))
    assert list(one["x"].values) == list(other["x"].values) == [5.0, 6.0, 7.0, 8.0]
    for name in one.data_vars:
        assert other[name].values == pytest.approx(one[name].values, rel=1e-6), name
    with pytest.raises(ValueError, match="theta_i differs from pixel to pixel"):
        as_stack(image(3, own=True)[0])


def test_few_looks_have_no_values_or_those_of_a_prior():
    reflectance, weights = image(4)
    reflectance = reflectance.copy()
    reflectance[1, 5:] = np.nan
    reflectance[2] = np.nan
    fits = retrieve(reflectance, KERNELS)
    assert fits["full"].values.tolist() == [True, False, False, True]
    assert np.isnan(fits["value"].values[1:3]).all()
    assert np.isnan(albedo_maps(fits, KERNELS, 30.0)["white_sky"].values[1:3]).all()
    prior = dict(zip(KERNELS.weights, weights[1] / 2, strict=True))
    scaled = retrieve(reflectance, KERNELS, prior=prior)
    assert scaled["value"].values[1] == pytest.approx(weights[1], rel=0.1)
    ratio = scaled["value"].values[1] / weights[1]
    assert ratio == pytest.approx([ratio[0]] * 3)
    assert abs(ratio[0] - 1) < 4 * scaled["uncertainty"].values[1, 0] / weights[1, 0]
    assert scaled["freedom"].values[1] == 4
    assert np.isnan(scaled["value"].values[2]).all()
    assert scaled["value"].values[0] == pytest.approx(fits["value"].values[0])


def test_looks_from_one_direction_determine_nothing():
    reflectance, _ = image(2)
    same = reflectance.assign_coords({n: ("look", np.full(LOOKS, 30.0)) for n in ("theta_i", "theta_r", "phi")})
    maps = albedo_maps(retrieve(same, KERNELS), KERNELS, 30.0)
    assert np.isinf(maps["white_sky_uncertainty"].values).all()


def refused(change):
    reflectance, _ = image(3)
    return change(reflectance)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: retrieve(r.rename(look="time"), KERNELS), "no dimension 'look'"),
        (lambda r: retrieve(r.drop_vars("phi"), KERNELS), "no coordinate 'phi' or 'relative_azimuth'"),
        (lambda r: retrieve(r.assign_coords(theta_r=("look", np.full(LOOKS, 95.0))), KERNELS), "theta_r is outside 0"),
        (lambda r: retrieve(r.assign_coords(phi=("look", np.full(LOOKS, np.nan))), KERNELS), "phi is no number"),
        (lambda r: retrieve(r, gonio.catalogue["ggx"]), "has shape parameters"),
        (lambda r: retrieve(r, KERNELS, covariance="absolute"), "needs the uncertainty"),
        (lambda r: retrieve(r, KERNELS, covariance="robust"), "scaled or absolute"),
        (lambda r: retrieve(r, KERNELS, least=3), "needs more looks"),
        (lambda r: retrieve(r, KERNELS, prior={"fiso": 1.0}), "one number for each weight"),
        (lambda r: retrieve(r, KERNELS, uncertainty=0 * r), "not above 0"),
        (lambda r: albedo_maps(retrieve(r, KERNELS), gonio.catalogue["lambert"], 30.0), "fits of ross-li"),
        (lambda r: albedo_maps(retrieve(r, KERNELS), KERNELS, 30.0, 2.0), "outside 0 to 1"),
        (lambda r: albedo_maps(retrieve(r, KERNELS), KERNELS, 99.0), "outside 0 to below 90"),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        refused(call)
