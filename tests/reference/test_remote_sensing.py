"""What the models of land surfaces and paints normalise themselves by, and where they are known exactly."""

import functools
import tomllib
from pathlib import Path

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.models.sandford1985 import grazing_mean, lobe_integral
from gonio.plausibility import hemispherical_reflectance

FOLDER = Path(__file__).parent
TABLE = tomllib.loads((FOLDER / "remote_sensing.toml").read_text(encoding="utf-8"))


def _evaluate(model, values, geometry):
    return model(geometry, values)


def test_normalisers_of_sandford_and_robertson():
    row = TABLE["paint"]
    np.testing.assert_allclose(grazing_mean(np.asarray(row["b"])), row["mean"], rtol=0, atol=0.5e-8)
    np.testing.assert_allclose(lobe_integral(np.cos(row["at"]), row["e"]), row["integral"], rtol=0, atol=0.5e-5)


@pytest.mark.parametrize("theta_i", [0.0, 40.0, 75.0])
def test_paint_reflects_what_it_does_not_absorb(theta_i):
    """The diffuse part and the lobe add up to 1 - eps g(theta_i)/G, whatever their shares."""
    values = {"scale": 1.0, "rho_d": 0.3, "eps": 0.4, "b": 0.2, "e": 0.3}
    found = hemispherical_reflectance(functools.partial(_evaluate, catalogue["sandford-robertson"], values), theta_i)
    fall = 1 / (1 + 0.2**2 * np.tan(np.radians(theta_i)) ** 2)
    assert found == pytest.approx(1 - 0.4 * fall / grazing_mean(np.asarray(0.2)), abs=2e-5)


def test_land_surface_kernels_vanish_at_the_nadir():
    """Both kernels are measured from light and view at the nadir."""
    basis = catalogue["ross-li"].basis(Geometry.from_degrees(0.0, 0.0), {})
    np.testing.assert_allclose([basis["fvol"], basis["fgeo"]], 0.0, atol=1e-12)


def test_minnaert_has_unit_reflectance_at_normal_incidence():
    values = {"rho": 1.0, "k": 0.7}
    found = hemispherical_reflectance(functools.partial(_evaluate, catalogue["minnaert"], values), 0.0)
    assert found == pytest.approx(1.0, abs=1e-4)
