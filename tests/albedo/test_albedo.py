"""Albedos of surfaces: the printed digits of the specification, closed forms, and uncertainties."""

import numpy as np
import pytest

import gonio
from gonio.albedo import black_sky, blue_sky, nbar, white_sky
from gonio.fitting import fit

KERNELS = gonio.catalogue["ross-li"]
LAMBERT = gonio.catalogue["lambert"]
ANGLES = [0.0, 20.0, 40.0, 60.0, 70.0, 80.0]
EXACT = {
    "fvol": (-0.021079, 0.001237, 0.080874, 0.270482, 0.452267, 0.766613),
    "fgeo": (-1.288854, None, -1.353456, -1.425309, None, -1.489495),
}
MODIS = {
    "fvol": (-0.007574, -0.003141, 0.062488, 0.267808, 0.447382, 0.691315),
    "fgeo": (-1.284909, None, -1.351732, -1.419244, None, -1.495255),
}
WHITE = {"fvol": (0.189186, 0.189184), "fgeo": (-1.377658, -1.377622)}


@pytest.mark.parametrize("weight", EXACT)
def test_black_sky_to_the_printed_digits(weight):
    """By quadrature and by the polynomials; the specification prints another last digit of the crowns at 0 deg."""
    found = black_sky(KERNELS, ANGLES, {weight: 1.0}, nodes=500).value
    modis = black_sky(KERNELS, ANGLES, {weight: 1.0}, method="modis").value
    for value, polynomial, printed, other in zip(found, modis, EXACT[weight], MODIS[weight], strict=True):
        if printed is not None:
            assert f"{value:.6f}" == f"{printed:.6f}"
            assert f"{polynomial:.6f}" == f"{other:.6f}"
    default = black_sky(KERNELS, ANGLES, {weight: 1.0}).value
    assert default == pytest.approx(found, rel=1e-4, abs=1e-6)


def test_the_crowns_at_the_zenith_are_printed_by_a_quadrature():
    """The specification prints -1.288855, and the integral is -1.2888544: the last digit is one of 200 nodes.

    Shadows cease to overlap at 53.13 deg, where the kernel has a kink that no quadrature over it resolves. With the sun
    at the zenith it does not depend on the azimuth, so that the integral over theta_r alone, in two parts, is exact.
    """

    def part(theta_r):
        g = gonio.Geometry.from_degrees(0.0 * theta_r, theta_r, 0.0)
        return np.pi * np.asarray(KERNELS(g, {"fgeo": 1.0})) * np.sin(2 * np.radians(theta_r))

    def integral(first, last, nodes):
        x, w = np.polynomial.legendre.leggauss(nodes)
        half = np.radians(last - first) / 2
        return float(half * w @ part((first + last) / 2 + (last - first) / 2 * x))

    kink = np.degrees(np.arctan(4 / 3))
    exact = integral(0.0, kink, 200) + integral(kink, 90.0, 200)
    assert exact == pytest.approx(-1.28885438, abs=1e-8)
    assert f"{integral(0.0, 90.0, 200):.6f}" == "-1.288855"
    assert black_sky(KERNELS, 0.0, {"fgeo": 1.0}, nodes=500).value == pytest.approx(exact, abs=1e-7)
    assert black_sky(KERNELS, 0.0, {"fgeo": 1.0}).value == pytest.approx(exact, abs=1e-4)


@pytest.mark.parametrize("weight", WHITE)
def test_white_sky_to_the_printed_digits(weight):
    by_quadrature, by_modis = WHITE[weight]
    assert f"{white_sky(KERNELS, {weight: 1.0}, nodes=100).value:.6f}" == f"{by_quadrature:.6f}"
    assert white_sky(KERNELS, {weight: 1.0}).value == pytest.approx(by_quadrature, rel=1e-4)
    assert f"{white_sky(KERNELS, {weight: 1.0}, method='modis').value:.6f}" == f"{by_modis:.6f}"


def test_lambert_is_its_albedo():
    values = {"rho": 0.37}
    for found in (
        black_sky(LAMBERT, 50.0, values),
        white_sky(LAMBERT, values),
        blue_sky(LAMBERT, 50.0, 0.4, values),
        nbar(LAMBERT, 50.0, values),
    ):
        assert (found.value, found.uncertainty) == (pytest.approx(0.37, abs=1e-9), 0)
        assert isinstance(found.value, float)


def test_blue_sky_is_the_mixture():
    values = {"fiso": 0.3, "fvol": 0.1, "fgeo": 0.02}
    for method in ("quadrature", "modis"):
        black, white = (
            black_sky(KERNELS, [30.0, 60.0], values, method=method),
            white_sky(KERNELS, values, method=method),
        )
        found = blue_sky(KERNELS, [30.0, 60.0], [0.0, 0.25], values, method=method)
        assert found.value == pytest.approx([black.value[0], 0.75 * black.value[1] + 0.25 * white.value])
    assert nbar(KERNELS, [30.0], values).value == pytest.approx(
        np.pi * KERNELS(gonio.Geometry.from_degrees(30.0, 0.0, 0.0), values)
    )


def test_a_lobe_agrees_with_the_reflectance_of_a_check():
    from gonio.plausibility import bihemispherical_reflectance, hemispherical_reflectance

    model, values = gonio.catalogue["ggx"], {"rho_s": 0.6, "rho_d": 0.1, "width": 0.3}
    brdf = lambda g: np.asarray(model(g, values))  # noqa: E731
    assert black_sky(model, 60.0, values).value == pytest.approx(hemispherical_reflectance(brdf, 60.0), rel=2e-5)
    assert white_sky(model, values).value == pytest.approx(bihemispherical_reflectance(brdf), rel=1e-3)
    with pytest.raises(ValueError, match="too narrow"):
        black_sky(model, 60.0, {"rho_s": 0.6, "width": 1e-4})


@pytest.fixture(scope="module")
def fitted():
    values = {"fiso": 0.3, "fvol": 0.1, "fgeo": 0.03}
    scan = gonio.simulate(KERNELS, values, [20.0, 45.0], np.arange(-60, 61, 10.0), noise=0.02, seed=2)
    return fit(gonio.Problem(KERNELS, scan, weighting="uniform"))


def test_the_uncertainty_is_that_of_the_weights(fitted):
    """u^2 = g C g' with g the albedo of every kernel; the albedo of weights is their sum."""
    g = np.array([black_sky(KERNELS, 50.0, {name: 1.0}).value for name in KERNELS.weights])
    covariance = fitted.dataset["covariance"].values
    found = black_sky(fitted, 50.0)
    assert found.value == pytest.approx(g @ fitted.vector(KERNELS.weights))
    assert found.uncertainty == pytest.approx(np.sqrt(g @ covariance @ g), rel=1e-6)
    assert found.uncertainty > 1e-4
    assert np.isnan(found.systematic)


def test_a_shape_takes_part_in_the_uncertainty():
    model, values = gonio.catalogue["minnaert"], {"rho": 0.3, "k": 0.7}
    scan = gonio.simulate(model, values, [20.0, 45.0], np.arange(-60, 61, 10.0), noise=0.02, seed=2)
    solution = fit(gonio.Problem(model, scan, weighting="relative"))
    step, at = 1e-5, dict(solution.values)
    slopes = [
        (white_sky(model, at | {n: at[n] + step}).value - white_sky(model, at | {n: at[n] - step}).value) / (2 * step)
        for n in at
    ]
    found = white_sky(solution)
    expected = np.sqrt(np.array(slopes) @ solution.dataset["covariance"].values @ np.array(slopes))
    assert found.uncertainty == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: black_sky(LAMBERT, 30.0, {"rho": 0.3}, method="modis"),
            "of the kernels of ross-li, and not of lambert",
        ),
        (lambda: black_sky(LAMBERT, 30.0, {"rho": 0.3}, method="exact"), "choose quadrature or modis"),
        (lambda: black_sky(LAMBERT, 90.0, {"rho": 0.3}), "outside 0 to below 90"),
        (lambda: black_sky(LAMBERT, np.nan, {"rho": 0.3}), "outside 0 to below 90"),
        (lambda: blue_sky(LAMBERT, 30.0, 1.5, {"rho": 0.3}), "outside 0 to 1"),
        (lambda: black_sky(LAMBERT, 30.0), "at least one weight"),
        (lambda: black_sky(LAMBERT, 30.0, {"rho": 0.3, "x": 1.0}), "no parameter 'x'"),
        (lambda: nbar(LAMBERT, 30.0, {"rho": 0.3}, select={"channel": "R"}), "this is a model"),
    ],
)
def test_what_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
