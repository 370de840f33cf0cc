"""Scans computed from a model: for studies, demos and tests, and always called simulated."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import ABSOLUTE, DEGREE, make_scan
from gonio.measured.instrument import IDEAL, Acceptance, Instrument
from gonio.measured.masking import mask
from gonio.measured.polarisers import POLARISATION, is_of_degree
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
    polarisation: str | Sequence[str] = (),
    phi_i: npt.ArrayLike | None = None,
) -> xr.Dataset:
    """Simulate a scan of the plane of incidence: a model at every pair of `theta_i` and signed `theta_r`, with noise.

    Parameters
    ----------
    model : Model
        The surface.
    values : mapping
        Its weights and shape parameters. A value that is a mapping from theta_i [deg] to a number changes with the
        incidence angle.
    theta_i, theta_r : array_like
        Angles [deg]; `theta_r` is positive on the forward side.
    noise, offset_noise : float
        Standard deviations of the noise, relative to each value and absolute. Both are normal and seeded, and their
        combined standard uncertainty is stated in the scan.
    blocked : float
        Angle [deg] about the incident beam that is masked, as `gonio.measured.masking.mask` does.
    seed : int
        Of the random numbers.
    unit : str
        "sr-1", or "a.u." for relative values.
    wavelength : float, optional
        The wavelength [nm] of every value.
    instrument : Instrument
        Half-angles of source and detector, folded in by a finer rule than that of a fit.
    polarisation : str or sequence of str
        The states in which every direction is read, such as ("s", "p"), of a model with a Mueller matrix; one that
        names a degree of polarisation, ">q" or ">dolp", gives values with the unit 1.
    phi_i : array_like, optional
        Azimuths [deg] of the source from the surface's own x axis: the surface is turned, and measured at each.

    Returns
    -------
    xarray.Dataset
        A scan as `gonio.read` gives it, marked as simulated.

    Raises
    ------
    KeyError
        A mapping has no value for an incidence angle.

    """
    labels = [polarisation] if isinstance(polarisation, str) else list(polarisation)
    mesh = np.meshgrid(theta_i, theta_r, labels or [""], 0.0 if phi_i is None else phi_i, indexing="ij")
    incidence, reflection, state, turn = (a.ravel() for a in mesh)
    said = {} if wavelength is None else {"wavelength": np.full(incidence.shape, float(wavelength))}
    said |= {POLARISATION: state} if labels else {}
    unit = DEGREE if any(map(is_of_degree, labels)) else unit
    zero = np.zeros(incidence.shape)
    scan = make_scan(incidence, reflection, zero, phi_i=None if phi_i is None else turn, unit=unit, coordinates=said)
    at_points = {
        name: np.array([value[angle] for angle in incidence]) if isinstance(value, Mapping) else value
        for name, value in values.items()
    }
    true = np.asarray(Acceptance.of(instrument.finer(), scan, model).brdf(model, at_points))
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
