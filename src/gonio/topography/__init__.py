"""Height maps of surfaces: read, levelled and filtered, told by numbers, and made into the light that they scatter.

    heights = level(gonio.read_heights("map.sdf"))
    statistics(heights).Sq
    scan = predict(heights, [30], range(-60, 61), Light(wavelength=633, index=1.4, extinction=7.6))

`heights` declares the Dataset, `files` reads it, `light` predicts and compares. Lengths are in micrometres; wavelengths
of scans and of `Light` are in nanometres, as everywhere in gonio.
"""

from gonio.topography.correlation import (
    correlation_lengths,
    effective_slope,
    exponential_structure,
    gaussian_structure,
    structure,
)
from gonio.topography.files import read_heights
from gonio.topography.filters import mask_outliers, outliers, roughness, smooth
from gonio.topography.heights import make_heights
from gonio.topography.levelling import level
from gonio.topography.light.agreement import Agreement, agreement
from gonio.topography.light.band import phase_variance, scattered_share, seen_by_light
from gonio.topography.light.characteristic import characteristic
from gonio.topography.light.diffraction import diffracted
from gonio.topography.light.facets import facet_widths
from gonio.topography.light.prediction import Light, predict, predict_like
from gonio.topography.simulation import simulate_heights
from gonio.topography.slopes import noise_slope, slopes
from gonio.topography.spectrum import AbcSpectrum, spectrum
from gonio.topography.statistics import statistics
from gonio.topography.summary import Summary, summarise

__all__ = [
    "AbcSpectrum",
    "Agreement",
    "Light",
    "Summary",
    "agreement",
    "characteristic",
    "correlation_lengths",
    "diffracted",
    "effective_slope",
    "exponential_structure",
    "facet_widths",
    "gaussian_structure",
    "level",
    "make_heights",
    "mask_outliers",
    "noise_slope",
    "outliers",
    "phase_variance",
    "predict",
    "predict_like",
    "read_heights",
    "roughness",
    "scattered_share",
    "seen_by_light",
    "simulate_heights",
    "slopes",
    "smooth",
    "spectrum",
    "statistics",
    "structure",
    "summarise",
]
