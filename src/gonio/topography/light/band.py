"""The band of spatial frequencies that light sees: Sq_rel, the phase variance g, and what stays in the mirror.

Light from theta_i scattered to (theta_r, phi) measures the spatial frequency f = shift/wavelength, shift being the
distance of the direction from that of the mirror in direction cosines. Only heights of frequencies up to 1/wavelength
scatter at normal incidence; larger ones than the spot are no roughness.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import xarray as xr

from gonio.topography.correlation import Structure, effective_slope, structure
from gonio.topography.heights import pitch, sides
from gonio.topography.spectrum import Spectrum, spectrum

FIELDS = 10.0  # periods of the smallest frequency that a map should hold


def phase_variance(rms: float, theta_i: float, wavelength: float) -> float:
    """The g of scatter theory, (4 pi rms cos(theta_i)/wavelength)^2 [rad^2], of rms height and wavelength in um."""
    return (4 * math.pi * rms * math.cos(math.radians(theta_i)) / wavelength) ** 2


def scattered_share(g: float) -> float:
    """The total integrated scatter 1 - exp(-g): the share of the reflected light that leaves the mirror direction."""
    return -math.expm1(-g)


class AtAngle(NamedTuple):
    """What light of one incidence angle [deg] sees: g, the scattered share, and the slope it sees of facets.

    g: from the relevant rms height Sq_rel. distance: r* [um], over which the heights turn the phase by 1 rad.
    s_eff: the slope per axis over it; both NaN where the surface is too smooth for facets.
    """

    theta_i: float
    g: float
    scattered: float
    distance: float
    s_eff: float


class Seen(NamedTuple):
    """The band of a wavelength [um]: its ends [1/um], the rms height in it [um], each angle, and what a map misses."""

    wavelength: float
    least: float
    most: float
    Sq_rel: float
    at: tuple[AtAngle, ...]
    warnings: tuple[str, ...]


def seen_by_light(
    heights: xr.Dataset,
    wavelength: float,
    theta_i: Iterable[float],
    least: float = 0.0,
    known: tuple[Spectrum, Structure] | None = None,
) -> Seen:
    """Tell what light sees of a levelled map.

    Parameters
    ----------
    heights : xarray.Dataset
        The levelled map.
    wavelength : float
        Of the light [um].
    theta_i : iterable of float
        Incidence angles [deg].
    least : float
        The least frequency that counts [1/um]: 1/spot, or the instrument's acceptance over the wavelength; 0 takes
        that of the map, one period over its shorter side.
    known : tuple, optional
        Spectrum and structure function of the map, where they are known already.

    Returns
    -------
    Seen
        The band, the rms height in it, and g, the scattered share and the effective slope at each angle.

    Raises
    ------
    ValueError
        The wavelength is not above 0, or the band is empty.

    """
    if not wavelength > 0:
        raise ValueError(f"a wavelength of {wavelength:g} um is none: give a number above 0")
    of_map = 1 / min(sides(heights))
    first, most = least or of_map, 1 / wavelength
    if not 0 < first < most:
        what = f"light of {wavelength:g} um sees frequencies below {most:.4g}/um"
        raise ValueError(f"{what}, and {first:.4g}/um is the least of this map or spot: there is nothing between")
    found, surface = known or (spectrum(heights), structure(heights))
    rms = found.rms(first * (1 - 1e-9), most)
    at = []
    for angle in theta_i:
        g = phase_variance(rms, angle, wavelength)
        at.append(AtAngle(float(angle), g, scattered_share(g), *effective_slope(surface, angle, wavelength)))
    return Seen(wavelength, first, most, rms, tuple(at), tuple(_missed(heights, wavelength, least)))


def _missed(heights: xr.Dataset, wavelength: float, least: float) -> Iterable[str]:
    """What of the band the map cannot see, in words with the remedy."""
    step, shortest = max(pitch(heights)), min(sides(heights))
    if 1 / (2 * step) < 1 / wavelength:
        yield (
            f"the map resolves frequencies up to {1 / (2 * step):.4g}/um, and light of {1000 * wavelength:.4g} nm "
            f"sees up to {1 / wavelength:.4g}/um: what is finer is not in these numbers; measure at a pitch below "
            f"{wavelength / 2:.3g} um"
        )
    if least and shortest < FIELDS / least:
        yield (
            f"the map is {shortest:.4g} um wide, less than {FIELDS:g} periods of the least frequency {least:.4g}/um: "
            "long waves are told badly; measure a larger field, or several places"
        )
