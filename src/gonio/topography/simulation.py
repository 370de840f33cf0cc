"""Height maps that nobody measured: for tests, studies and a first try, and always called simulated."""

import math

import numpy as np
import xarray as xr
from scipy.fft import fft2, fftfreq, ifft2

from gonio.topography.heights import make_heights


def simulate_heights(
    rms: float, length: float, *, points: tuple[int, int] = (512, 512), pitch: float = 0.2, seed: int = 0
) -> xr.Dataset:
    """Simulate a surface with Gaussian heights and Gaussian autocovariance rms^2 exp(-(r/length)^2).

    Parameters
    ----------
    rms, length : float
        Rms height and 1/e length of the autocovariance [um]. The rms slope per axis is sqrt(2) rms/length.
    points : tuple of int
        Points along y and x.
    pitch : float
        Distance of neighbouring points [um].
    seed : int
        Of the random numbers.

    Returns
    -------
    xarray.Dataset
        The map, which continues itself at its edges.

    Raises
    ------
    ValueError
        A length is not above 0.

    """
    if not (rms > 0 and length > 0 and pitch > 0):
        raise ValueError(f"rms {rms:g}, length {length:g} and pitch {pitch:g} are lengths: give numbers above 0")
    fy, fx = (fftfreq(n, pitch) for n in points)
    squared = fy[:, None] ** 2 + fx[None, :] ** 2
    # White noise times the root of the spectrum pi length^2 rms^2 exp(-(pi length f)^2).
    shape = np.exp(-((math.pi * length) ** 2) * squared / 2) * (math.sqrt(math.pi) * length * rms / pitch)
    noise = np.random.default_rng(seed).standard_normal(points)
    z = ifft2(fft2(noise) * shape).real
    said = f"simulated with rms height {rms:g} um, correlation length {length:g} um, seed {seed}"
    return make_heights(z, pitch, history=said, provenance="simulated: nothing in it was measured")
