"""The height parameters of ISO 25178-2, of the points of a map that are in use."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr

from gonio.topography.heights import values
from gonio.topography.slopes import AUTO, slopes


class Statistics(NamedTuple):
    """Parameters of a levelled map: lengths in um, the others without a unit.

    Sa, Sq: mean and root mean squared distance from the mean; Ssk, Sku: skewness and kurtosis (3 for Gaussian heights);
    Sz: highest minus lowest; Sdq: rms slope, both axes together; Sdr: the area more than the projected one, as a share.
    """

    Sa: float
    Sq: float
    Ssk: float
    Sku: float
    Sz: float
    Sdq: float
    Sdr: float


UNITS = {"Sa": "um", "Sq": "um", "Ssk": "", "Sku": "", "Sz": "um", "Sdq": "", "Sdr": ""}


def statistics(heights: xr.Dataset, operator: str = AUTO) -> Statistics:
    """The height parameters of a map, about its mean; level it first.

    Parameters
    ----------
    heights : xarray.Dataset
        The levelled map.
    operator : str
        That of Sdq and Sdr: forward, central or seven-point; without it seven-point where the map has room for it.

    Returns
    -------
    Statistics
        The parameters; NaN for a slope that no point has all neighbours for.

    Raises
    ------
    ValueError
        The operator is not known, or wider than the map.

    """
    z = values(heights)
    z = z[np.isfinite(z)]
    z = z - z.mean()
    rms = math.sqrt(float(np.mean(z**2)))
    third, fourth = (float(np.mean((z / rms) ** n)) if rms else math.nan for n in (3, 4))
    gradient = slopes(heights, operator)
    squared = gradient.length**2
    area = float(np.mean(np.sqrt(1 + squared) - 1)) if squared.size else math.nan
    return Statistics(float(np.abs(z).mean()), rms, third, fourth, float(np.ptp(z)), gradient.rms, area)
