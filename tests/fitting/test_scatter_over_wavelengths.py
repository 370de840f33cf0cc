"""First-order scatter of one height spectrum at several wavelengths: A = S2(0)/wavelength^4, B and C shared (E.1)."""

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, simulate
from gonio.fitting import fit

MODEL = catalogue["rayleigh-rice"]
S2, B, C = 2e-3, 8.0, 3.0  # um^4, um
WAVELENGTHS = (0.4, 0.6328, 1.0)
GLASS = {"index": 1.5, "extinction": 0.0}


def scan(noise=0.01):
    parts = [
        simulate(
            MODEL, {"A": S2 / w**4, "B": B, "C": C, "wavelength": w} | GLASS, [20.0, 45.0], np.arange(-70.0, 71.0, 5.0),
            noise=noise, seed=k, wavelength=1000 * w,
        )
        for k, w in enumerate(WAVELENGTHS)
    ]  # fmt: skip
    return xr.concat(parts, "direction")


def test_one_spectrum_comes_back_from_several_wavelengths():
    """A weight for each wavelength, whose product with wavelength^4 is one number; B and C are one value for all."""
    solution = fit(Problem(MODEL, scan(), weighting="relative", held=GLASS))
    assert abs(solution.values["B"] - B) < 3 * solution.uncertainties["B"]
    assert abs(solution.values["C"] - C) < 3 * solution.uncertainties["C"]
    found = {name: value for name, value in solution.values.items() if name.startswith("A")}
    assert len(found) == len(WAVELENGTHS)
    for (name, value), w in zip(found.items(), WAVELENGTHS, strict=True):
        assert abs(value * w**4 - S2) < 3 * solution.uncertainties[name] * w**4, name
        assert value * w**4 == pytest.approx(S2, rel=0.02)
