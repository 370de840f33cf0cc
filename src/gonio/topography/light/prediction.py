"""The BRDF that a height map predicts, as a scan with the spread over sub-areas as its uncertainty."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.geometry import Geometry
from gonio.measured.dataset import DIRECTIONS, make_scan, points
from gonio.optics.fresnel import unpolarised
from gonio.optics.masking import beckmann_lambda, smith
from gonio.topography.correlation import correlation_lengths, lags, structure
from gonio.topography.heights import Values, name_of
from gonio.topography.levelling import level
from gonio.topography.light.band import phase_variance
from gonio.topography.light.characteristic import diffracted_by_heights
from gonio.topography.light.diffraction import HARVEY, KIRCHHOFF, ROUGH, diffracted, diffracted_along, obliquity
from gonio.topography.light.facets import facets_brdf
from gonio.topography.slopes import AUTO, slopes
from gonio.topography.subareas import spread

WAVES, CHARACTERISTIC, FACETS = "waves", "characteristic", "slopes"
AUTOMATIC = "auto"
OBLIQUITIES = (AUTOMATIC, HARVEY, KIRCHHOFF)
ANISOTROPIC = 0.5  # Str below which a surface has a direction
GRAZING = 60.0  # deg: beyond, wave optics is multiplied by the shadowing of slopes


@dataclass(frozen=True, kw_only=True)
class Light:
    """The light of a prediction, and the surface's substance.

    Parameters
    ----------
    wavelength : float
        Wavelength [nm].
    index, extinction : float or None
        Refractive index; without an index every facet reflects all light.
    half_angle : float
        Half-angle [deg] of the detector's cone, in which the light is seen that stays in the mirror direction; 0 leaves
        that light out, which has no finite BRDF.

    Raises
    ------
    ValueError
        The wavelength is not above 0, or an extinction has no index.

    """

    wavelength: float
    index: float | None = None
    extinction: float = 0.0
    half_angle: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.wavelength) and self.wavelength > 0):
            raise ValueError(f"a wavelength of {self.wavelength:g} nm is none: give a number above 0")
        if self.index is None and self.extinction:
            raise ValueError("an extinction belongs to an index: give both, or neither")

    @property
    def micrometres(self) -> float:
        """The wavelength [um]."""
        return self.wavelength / 1000

    def reflectance(self, g: Geometry) -> Values:
        """Of a smooth surface, at the local incidence of each pair of directions."""
        if self.index is None:
            return np.ones(np.shape(g.x_r))
        return np.asarray(unpolarised(g.cos_beta, self.index, self.extinction))


class _Values(NamedTuple):
    """Values of a prediction, and how they were found, in words."""

    brdf: Values
    how: str


class _Theory(NamedTuple):
    """The obliquity by name, the rms height [um] by which `auto` chooses, and whether the surface has a direction.

    characteristic: whether differences of height may have any statistics, not Gaussian ones alone.
    """

    factor: str
    rms: float
    has_direction: bool
    characteristic: bool

    def obliquity(self, theta_i: float, wavelength: float) -> str:
        """The obliquity at an incidence angle [deg]."""
        if self.factor != AUTOMATIC:
            return self.factor
        return KIRCHHOFF if phase_variance(self.rms, theta_i, wavelength) > ROUGH else HARVEY


def predict(
    heights: xr.Dataset,
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    light: Light,
    *,
    by: str = WAVES,
    factor: str = AUTOMATIC,
    operator: str = AUTO,
) -> xr.Dataset:
    """Predict the BRDF in the plane of incidence from a height map alone.

    Parameters
    ----------
    heights : xarray.Dataset
        The levelled map, whose x axis lies in the plane of incidence.
    theta_i, theta_r : array_like
        Angles [deg]; every pair of them is predicted, and `theta_r` is positive on the forward side.
    light : Light
        Wavelength, index and the detector's cone.
    by : str
        "waves": diffraction by the structure function, for any roughness; "characteristic": the same by the
        characteristic function, for heights of any statistics, such as steps and pits; "slopes": mirrors by the slopes
        of the map.
    factor : str
        Obliquity of the first two: "harvey-shack", "kirchhoff", or "auto", which is "kirchhoff" at angles of a phase
        variance g > 10.
    operator : str
        That of the slopes: forward, central or seven-point; without it seven-point where the map has room for it.

    Returns
    -------
    xarray.Dataset
        A scan as `gonio.read` gives it, marked as simulated. Its uncertainty is the standard deviation over the four
        quarters of the map, each levelled by a plane; a map with quarters below 16 points a side has none. Values may
        be below zero where they are smaller than the uncertainty.

    Raises
    ------
    ValueError
        An angle is beyond the horizon, a name is not known, or by "characteristic" the points are too far apart.

    """
    mesh = np.meshgrid(np.atleast_1d(theta_i), np.atleast_1d(theta_r), indexing="ij")
    incidence, reflection = (part.astype(float).ravel() for part in mesh)
    if not ((incidence >= 0) & (incidence < 90) & (np.abs(reflection) < 90)).all():
        raise ValueError("a prediction has incidence angles from 0 to below 90 deg, and theta_r between -90 and 90 deg")
    forward = np.where(reflection >= 0, 180.0, 0.0)
    return _predicted(
        heights, (incidence, np.abs(reflection), forward), light, _by(heights, by, light, factor, operator)
    )


def predict_like(
    heights: xr.Dataset, scan: xr.Dataset, light: Light, *, by: str = WAVES, factor: str = AUTOMATIC
) -> xr.Dataset:
    """Predict the BRDF at the directions of another scan.

    Parameters
    ----------
    heights : xarray.Dataset
        The levelled map; its x axis is that of the sample, from which phi_i is counted.
    scan : xarray.Dataset
        The scan; of several wavelengths or channels, each value is predicted for the one light.
    light : Light
        Wavelength, index and the detector's cone.
    by, factor : str
        As `predict` has them.

    Returns
    -------
    xarray.Dataset
        A scan as `predict` gives it.

    Raises
    ------
    ValueError
        A name is not known, or by "characteristic" the points are too far apart.

    """
    flat = points(scan)
    columns = tuple(flat[name].values.astype(float) for name in DIRECTIONS if name in flat.coords)
    return _predicted(heights, columns, light, _by(heights, by, light, factor, AUTO))


def _predicted(
    heights: xr.Dataset, angles: tuple[Values, ...], light: Light, compute: Callable[[xr.Dataset, Geometry], _Values]
) -> xr.Dataset:
    """The scan at directions theta_i, theta_r, phi and, where the sample was turned, phi_i [deg]."""
    g = Geometry.from_degrees(*angles)
    whole = compute(heights, g)
    deviation = spread(heights, lambda part: compute(level(part), g).brdf)
    scan = make_scan(
        angles[0],
        angles[1],
        whole.brdf,
        angles[2],
        phi_i=angles[3] if len(angles) > 3 else None,
        uncertainty=deviation,
        coordinates={"wavelength": np.full(angles[0].shape, light.wavelength)},
        provenance=f"predicted from {name_of(heights)}, nothing in it was measured by a goniometer",
        history=_history(heights, light, whole.how, deviation is not None),
    )
    return scan.assign_attrs(simulated=f"simulated from the heights of {name_of(heights)}")


def _by(
    heights: xr.Dataset, by: str, light: Light, factor: str, operator: str
) -> Callable[[xr.Dataset, Geometry], _Values]:
    """How a map and its quarters are predicted; whether it has a direction, and how rough it is, the whole decides."""
    if factor not in OBLIQUITIES:
        raise ValueError(f"{factor!r} is no obliquity: choose {', '.join(OBLIQUITIES)}")
    if by in (WAVES, CHARACTERISTIC):
        found = lags(heights)
        has_direction = correlation_lengths(heights, found).Str < ANISOTROPIC
        rms = structure(heights, found).rms if factor == AUTOMATIC else math.nan
        theory = _Theory(factor, rms, has_direction, by == CHARACTERISTIC)
        return lambda part, g: _waves(part, g, light, theory)
    if by == FACETS:
        return lambda part, g: _slopes(part, g, light, operator)
    raise ValueError(f"a prediction is by {WAVES}, by {CHARACTERISTIC} or by {FACETS}, not by {by!r}")


def _history(heights: xr.Dataset, light: Light, how: str, has_spread: bool) -> str:
    substance = "reflectance 1" if light.index is None else f"index {light.index:g} + {light.extinction:g}i"
    said = f"simulated from the heights of {name_of(heights)}: {how}; {light.wavelength:g} nm, {substance}"
    uncertain = "standard deviation over four sub-areas" if has_spread else "none: the map is too small to divide"
    return "\n".join([*str(heights.attrs.get("history", "")).splitlines(), said, f"uncertainty: {uncertain}"])


def _waves(heights: xr.Dataset, g: Geometry, light: Light, theory: _Theory) -> _Values:
    kernel, in_phase = _kernel(heights, g, light, theory)
    angles = np.round(np.asarray(g.theta_i_deg), 9)
    named = {a: theory.obliquity(a, light.micrometres) for a in np.unique(angles).tolist()}
    x = np.ones(angles.shape)
    for name in set(named.values()):
        at = np.isin(angles, [a for a, n in named.items() if n == name])
        x = np.where(at, obliquity(g, name), x)
    values = light.reflectance(g) * x * kernel
    function = "characteristic function" if theory.characteristic else "structure function"
    how = f"wave optics, {'two-dimensional' if theory.has_direction else 'isotropic'} {function}, {_words(named)}"
    steep = (g.theta_i_deg > GRAZING) | (g.theta_r_deg > GRAZING)
    if steep.any():
        m = slopes(heights).rms
        shadowed = np.asarray(smith(beckmann_lambda(g.cos_i, m), beckmann_lambda(g.cos_r, m)))
        values, how = np.where(steep, values * shadowed, values), f"{how}, Smith's masking beyond {GRAZING:g} deg"
    if light.half_angle:
        values = values + _coherent(g, in_phase, light)
        how += f", with the mirror's light in a cone of {light.half_angle:g} deg"
    return _Values(values, how)


def _kernel(heights: xr.Dataset, g: Geometry, light: Light, theory: _Theory) -> tuple[Values, Values]:
    """The light that is diffracted without R and X [1/sr], and the share that stays in the mirror direction."""
    wavelength = light.micrometres
    if theory.characteristic:
        return diffracted_by_heights(g, heights, wavelength, theory.has_direction)
    found = lags(heights)
    surface = structure(heights, found)
    if theory.has_direction:
        kernel = diffracted_along(g, found, surface.variance, wavelength)
    else:
        kernel = diffracted(g, surface, wavelength)
    return kernel, np.exp(-((4 * math.pi * surface.rms * np.asarray(g.cos_i) / wavelength) ** 2))


def _words(named: dict[float, str]) -> str:
    """The obliquity of each incidence angle, those that share one together."""
    names = sorted(set(named.values()))
    if len(names) == 1:
        return f"{names[0]} obliquity"
    return ", ".join(
        f"{n} obliquity at theta_i {', '.join(f'{a:g}' for a, m in named.items() if m == n)}" for n in names
    )


def _coherent(g: Geometry, in_phase: Values, light: Light) -> Values:
    """The share in phase that stays in the mirror direction, times R, over the solid angle of the cone."""
    cosine = -g.x_i * g.x_r - g.y_i * g.y_r + g.z_i * g.z_r
    inside = cosine >= math.cos(math.radians(light.half_angle)) - 1e-12
    solid = 2 * math.pi * (1 - math.cos(math.radians(light.half_angle)))
    return np.where(inside, in_phase * light.reflectance(g) / (solid * g.cos_r), 0.0)


def _slopes(heights: xr.Dataset, g: Geometry, light: Light, operator: str) -> _Values:
    found = slopes(heights, operator)
    return _Values(light.reflectance(g) * facets_brdf(g, found), f"slopes as facets, {found.operator} operator")
