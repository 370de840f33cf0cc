"""A fitted slope beside that of a map: which parameter it is, when both should agree, and what is compared else."""

import math

import numpy as np
import pytest

from gonio import Problem, catalogue, simulate
from gonio.fitting import fit
from gonio.topography import Light, agreement, level, simulate_heights
from gonio.topography.light.agreement import fitted_slope, slope_parameter

INDEX = {"index": 1.37, "extinction": 7.62}


def fitted(model, rms, length, theory, wavelength=632.8):
    values = {"scale": 1.0, "sigma": rms, "length": length, "wavelength": wavelength / 1000} | INDEX
    scan = simulate(catalogue[theory], values, [20.0, 40.0], np.arange(-60, 61, 4.0), wavelength=wavelength)
    held = INDEX if "index" in catalogue[model].shape else {}
    return fit(Problem(catalogue[model], scan, held=held, weighting="uniform"))


@pytest.mark.parametrize(
    ("model", "parameter", "factor", "is_rms"),
    [
        ("torrance-sparrow", "sigma", 1.0, True),
        ("beckmann", "m", math.sqrt(0.5), True),
        ("cook-torrance", "m", math.sqrt(0.5), True),
        ("ggx", "width", math.sqrt(0.5), False),
        ("student-t", "width", math.sqrt(0.5), False),
        ("gonio-best", "m", math.sqrt(0.5), True),
    ],
)
def test_which_parameter_is_a_slope(model, parameter, factor, is_rms):
    assert slope_parameter(catalogue[model]) == (parameter, factor, is_rms)


def test_a_model_without_facets_has_no_slope():
    with pytest.raises(ValueError, match="lambert has no slope of facets"):
        slope_parameter(catalogue["lambert"])


def test_a_rough_surface_and_gaussian_facets_should_agree_and_do():
    solution = fitted("beckmann", 1.5, 10.0, "beckmann-kirchhoff")
    heights = level(simulate_heights(1.5, 10.0, points=(200, 200), pitch=1.0, seed=2))
    found = agreement(heights, solution)
    assert found.should_agree
    assert found.agrees
    assert found.measured == pytest.approx(math.sqrt(2) * 0.15, rel=0.08)
    assert found.wavelength == 632.8
    assert "the fit should find the slope of the surface, and it does" in found.verdict


def test_a_smoother_surface_is_compared_with_what_its_map_predicts():
    """Of the aluminium of the paper the fit finds 0.11 where the surface has 0.142, and the map says so."""
    solution = fitted("torrance-sparrow", 0.142, math.sqrt(2), "generalised-harvey-shack")
    heights = level(simulate_heights(0.142, math.sqrt(2), points=(200, 200), pitch=0.25, seed=2))
    found = agreement(heights, solution, Light(wavelength=632.8, **INDEX))
    assert not found.should_agree
    assert found.fitted.value < 0.85 * found.measured
    assert found.expected == pytest.approx(found.fitted.value, rel=0.12)
    assert found.agrees
    other = fitted("torrance-sparrow", 0.05, 0.2, "generalised-harvey-shack")
    assert agreement(heights, other, Light(wavelength=632.8, **INDEX)).agrees is False


def test_a_fit_without_one_wavelength_needs_a_light():
    values = {"ks": 0.4, "kd": 0.1, "sigma": 0.2}
    scan = simulate(catalogue["torrance-sparrow"], values, [20.0, 40.0], np.arange(-60, 61, 10.0))
    solution = fit(Problem(catalogue["torrance-sparrow"], scan))
    assert fitted_slope(solution).value == pytest.approx(0.2, rel=1e-3)
    with pytest.raises(
        ValueError, match=r"has no wavelength, and one is compared with a map: name it \(--wavelength NM\)"
    ):
        agreement(level(simulate_heights(0.1, 1.0, points=(40, 40))), solution)
