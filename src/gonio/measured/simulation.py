"""Scans computed from a model: for studies, demos and tests, and always called simulated."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import ABSOLUTE, make_scan
from gonio.measured.instrument import IDEAL, Acceptance, Instrument
from gonio.measured.masking import mask
from gonio.model import Model

Value = float | Mapping[float, float]


def simulate(
    model: Model,
    values: Mapping[str, Value],
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    *,
    noise: float = 0.0,
    offset_noise: float = 0.0,
    blocked: float = 0.0,
    seed: int = 0,
    unit: str = ABSOLUTE,
    wavelength: float | None = None,
    instrument: Instrument = IDEAL,
) -> xr.Dataset:
    """An in-plane scan of `model` at every pair of theta_i and signed theta_r [deg].

    A value that is a mapping from theta_i to a number changes with the incidence angle. `noise` is the standard
    deviation relative to each value, `offset_noise` the absolute one; both are normal and seeded, and their
    combined standard uncertainty is stated in the scan. `blocked` [deg] masks the beam, as `mask` does;
    `wavelength` [nm] labels every value. `instrument` is folded in by a finer rule than that of a fit.
    Raises KeyError where a mapping has no value for an incidence angle.
    """
    incidence, reflection = (a.ravel() for a in np.meshgrid(theta_i, theta_r, indexing="ij"))
    colour = {} if wavelength is None else {"wavelength": np.full(incidence.shape, float(wavelength))}
    scan = make_scan(incidence, reflection, np.zeros(incidence.shape), unit=unit, coordinates=colour)
    at_points = {
        name: np.array([value[angle] for angle in incidence]) if isinstance(value, Mapping) else value
        for name, value in values.items()
    }
    true = np.asarray(Acceptance.of(instrument.finer(), scan).brdf(model, at_points))
    spread = np.sqrt((noise * true) ** 2 + offset_noise**2)
    measured = true + spread * np.random.default_rng(seed).standard_normal(true.shape)
    scan["brdf"].values[:] = measured
    if spread.any():
        scan["uncertainty"] = ("direction", spread, {"units": unit})
    scan.attrs["simulated"] = f"simulated from {model.name}"
    scan.attrs["history"] = (
        f"simulated from {model.name} with {noise:.3g} relative and {offset_noise:.3g} absolute noise, seed {seed}"
    )
    return mask(scan, blocked=blocked) if blocked else scan
