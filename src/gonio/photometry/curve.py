"""From facets to a magnitude: the light that they send to an observer, and how sure it is.

With facets of area A, BRDF f and normal n, the unit vectors u_s to the sun and u_o to the observer at the distance d,
the observer's irradiance over the sun's is

    E/E_sun = (1/d^2) sum of A f max(n u_s, 0) max(n u_o, 0),

and the magnitude m = m_sun - 2.5 lg(E/E_sun) + k X, with the extinction k of the atmosphere and the airmass X. The disk
of the sun and the light of the Earth are sums over directions of such terms. Facets hide nothing from each other.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.band import propagate
from gonio.geometry import GRAZING
from gonio.photometry.air import Air
from gonio.photometry.bands import Band, band_of
from gonio.photometry.facets import Facet
from gonio.photometry.lamps import SUN_HALF_ANGLE, Earth, Lamp, disk, frames, geometry
from gonio.photometry.vectors import dot, unit, vectors

Values = npt.NDArray[np.float64]
Flux = Callable[
    [Values], Values
]  # of all values of a fit: the ratio E/E_sun (facets, times) of the facets that have it

TOGETHER = 2**18  # directions that are evaluated at once: more take more memory and no less time
POGSON = 2.5 / math.log(10)  # magnitudes by a relative change
RINGS = 2  # of directions in the sun's disk, at first
FINER, SETTLED = 5, 1e-3  # how often the rings are doubled, and the relative change of the light that ends it


def magnitude(
    facets: Sequence[Facet],
    sun: Any,
    observer: Any,
    band: str | Band = "V",
    system: str = "AB",
    **light: Any,
) -> tuple[Values, Values]:
    """The apparent magnitude of a body of flat facets, and its standard uncertainty.

    As `light_curve`, whose arguments it takes; both are numbers where all vectors are single ones.

    Returns
    -------
    magnitude, uncertainty : ndarray (times,)
        The uncertainty has both parts, random and systematic, where the scans state the second.

    """
    curve = light_curve(facets, sun, observer, band, system, **light)
    systematic = np.nan_to_num(curve["uncertainty_systematic"].values, nan=0.0)
    found = curve["magnitude"].values, np.hypot(curve["uncertainty"].values, systematic)
    single = np.ndim(sun) == 1 and np.ndim(observer) == 1 and curve.sizes["time"] == 1
    return (found[0][0], found[1][0]) if single else found


def light_curve(
    facets: Sequence[Facet],
    sun: Any,
    observer: Any,
    band: str | Band = "V",
    system: str = "AB",
    *,
    sun_half_angle: float = SUN_HALF_ANGLE,
    earth: Earth | None = None,
    air: Air | None = None,
) -> xr.Dataset:
    """The apparent magnitude of a body of flat facets over time, with its standard uncertainty.

    Parameters
    ----------
    facets : sequence of Facet
        The surfaces. They hide nothing from each other, which holds for convex bodies.
    sun : array_like (3,) or (times, 3)
        From the body to the sun, of any length, in the frame of the normals.
    observer : array_like (3,) or (times, 3)
        From the body to the observer [m].
    band : str or Band
        U, B, V, R or I; the BRDF has to be that of the band's wavelength.
    system : str
        `AB` or `Vega`.
    sun_half_angle : float
        Half angle of the sun's disk [deg], over which the BRDF is averaged; 0 is a point, under which a narrow lobe is
        too bright and too short.
    earth : Earth, optional
        Where the Earth is. It adds its light, and takes the sun's within its shadow.
    air : Air, optional
        The atmosphere before the observer.

    Returns
    -------
    xarray.Dataset
        Over `time`: `magnitude`, infinite where no light comes, with its standard `uncertainty` from the covariance of
        the fits (delta rule: 1.0857 u_E/E) and `uncertainty_systematic` (NaN where no scan states it); `ratio`, the
        irradiance over the sun's; `phase_angle` [deg]; `distance` [m]. `share` of each name over `facet` too. Errors of
        different fits count as independent; areas and values of models as exact.

    Raises
    ------
    ValueError
        There is no facet, lengths differ, a BRDF is negative, or a lobe is too narrow for the sun's disk.

    """
    if not facets:
        raise ValueError("a body without facets has no magnitude: give at least one Facet")
    chosen, towards, sight = band_of(band), unit(sun, "sun"), vectors(observer, "observer")
    zero_point = chosen.sun(system)
    scene = _Scene.of(facets, towards, sight, earth)
    groups = _Group.all_of(scene)
    lamp = _settled(groups, scene, sun_half_angle)
    lamps = [lamp, *([earth.lamp(scene.sun)] if earth else [])]
    shares, variances = _summed(groups, scene, lamps)
    ratio = shares.sum(axis=0)
    if (ratio < 0).any():
        raise ValueError("the BRDF of a facet is negative at these angles, and light is not: choose another model")
    with np.errstate(divide="ignore", invalid="ignore"):
        magnitudes = zero_point - 2.5 * np.log10(ratio) + (air.dimming if air else 0.0)
        random, systematic = (np.where(ratio > 0, POGSON * np.sqrt(v) / ratio, np.nan) for v in variances)
        share = shares / ratio
    phase = np.degrees(np.arccos(np.clip(dot(scene.sun, scene.observer), -1, 1)))
    columns = {
        "magnitude": (magnitudes, "mag"),
        "uncertainty": (random, "mag"),
        "uncertainty_systematic": (systematic, "mag"),
        "ratio": (ratio, "1"),
        "phase_angle": (phase, "degree"),
        "distance": (scene.distance, "m"),
    }
    data: dict[str, Any] = {name: ("time", values, {"units": units}) for name, (values, units) in columns.items()}
    data["share"] = (("facet", "time"), share, {"units": "1"})
    attributes = {"band": chosen.name, "system": system, "sun": zero_point, "sun_half_angle": sun_half_angle}
    return xr.Dataset(data, coords={"facet": scene.names}, attrs=attributes)


@dataclass(frozen=True)
class _Scene:
    """Sun and observer as unit vectors (times, 3), how far the observer is [m], and the facets with their names."""

    facets: Sequence[Facet]
    sun: Values
    observer: Values
    distance: Values
    lit: npt.NDArray[np.bool_]
    called: list[str]

    @classmethod
    def of(cls, facets: Sequence[Facet], sun: Values, sight: Values, earth: Earth | None) -> "_Scene":
        """Everything at as many times as any of it has; ValueError where two differ."""
        normals = [np.atleast_2d(np.asarray(one.normal, dtype=float)) for one in facets]
        lit = np.ones(1, dtype=bool) if earth is None else earth.sunlit(sun)
        counts = {len(v) for v in (sun, sight, lit, *normals)} - {1}
        if len(counts) > 1:
            raise ValueError(f"sun, observer, normals and positions are at {sorted(counts)} times: give one number")
        times = max(counts, default=1)
        distance = np.linalg.norm(sight, axis=1)
        towards, seen = (np.broadcast_to(v, (times, 3)) for v in (sun, sight / distance[:, None]))
        called = [one.name or f"facet {k}" for k, one in enumerate(facets, start=1)]
        return cls(facets, towards, seen, np.broadcast_to(distance, times), np.broadcast_to(lit, times), called)

    @property
    def times(self) -> int:
        return len(self.sun)

    @property
    def names(self) -> list[str]:
        """The names of the facets, each once."""
        return list(dict.fromkeys(self.called))


class _Group:
    """Facets of one BRDF, evaluated together."""

    def __init__(self, scene: _Scene, places: Sequence[int]) -> None:
        first = scene.facets[places[0]]
        self.places, self.scene = places, scene
        self.solution, self.brdf = first.solution, first.evaluated()

    @classmethod
    def all_of(cls, scene: _Scene) -> "list[_Group]":
        """The facets of a scene by their BRDF; ValueError where one has a direction and does not say which."""
        places: dict[tuple[Any, ...], list[int]] = {}
        for k, one in enumerate(scene.facets):
            places.setdefault((*one.key, one.along is None), []).append(k)
        for some in places.values():
            scene.facets[some[0]].refuse_unturned()
        return [cls(scene, some) for some in places.values()]

    def alone(self, place: int) -> "_Group":
        """One of its facets."""
        return _Group(self.scene, [place])

    @property
    def fixed(self) -> Values:
        """The values of the fit; none for a model."""
        return np.empty(0) if self.solution is None else np.asarray(self.solution.dataset["value"].values)

    def flux(self, lamps: Sequence[Lamp]) -> Flux:
        """The ratio E/E_sun (facets, times) as a function of all values of the fit; geometry is computed once."""
        parts = [part for lamp in lamps for part in _parts(self, lamp)]
        shape = len(self.places), self.scene.times

        def flux(values: Values) -> Values:
            total = np.zeros(math.prod(shape))
            for cells, weights, directions in parts:
                total += np.bincount(cells, weights * self.brdf(values, directions), minlength=len(total))
            return total.reshape(shape)

        return flux


def _parts(group: _Group, lamp: Lamp) -> Iterator[tuple[npt.NDArray[np.intp], Values, Any]]:
    """What lights and shows some facets of a group: the cell (facet and time) of each direction, its weight, itself.

    The weight is everything but the BRDF: A cos cos/d^2 and the irradiance of the direction.
    """
    scene, nodes = group.scene, lamp.irradiance.shape[1]
    several = max(TOGETHER // (nodes * scene.times), 1)
    for start in range(0, len(group.places), several):
        some = [scene.facets[k] for k in group.places[start : start + several]]
        shape = (len(some), scene.times, nodes)
        normal = np.stack([np.broadcast_to(unit(one.normal, "normal"), (scene.times, 3)) for one in some])
        facing = dot(normal, scene.observer)
        cosines = np.einsum("fti,tki->ftk", normal, lamp.towards)
        irradiance = np.broadcast_to(lamp.irradiance, shape)
        seen = (cosines > GRAZING) & (facing[..., None] > GRAZING) & (irradiance > 0)
        facet, time, node = np.nonzero(seen)
        if not len(facet):
            continue
        area = np.array([one.area for one in some])
        weights = (area[:, None] * facing / scene.distance**2)[facet, time] * (cosines * irradiance)[seen]
        along = None
        if some[0].along is not None:
            turned = [np.broadcast_to(vectors(one.along, "along"), (scene.times, 3)) for one in some]
            along = np.stack(turned)[facet, time]
        axes = frames(normal[facet, time], along)
        yield (
            (start + facet) * scene.times + time,
            weights,
            geometry(*axes, lamp.towards[time, node], scene.observer[time]),
        )


def _settled(groups: Sequence[_Group], scene: _Scene, half_angle: float) -> Lamp:
    """The sun's disk by as many directions as the lobes need; ValueError for a lobe that needs more than there are.

    There are enough where twice the rings change nothing, and no glint can lie between them: a lobe that is as narrow
    as the distance of two rings passes its mean over the disk as often as there are such distances in the disk.
    """
    if not 0 <= half_angle <= 30:
        raise ValueError(f"sun_half_angle is {half_angle:g}: give degrees from 0 to 30")
    if half_angle == 0:
        return _eclipsed(disk(scene.sun, 0.0, 1.0), scene)
    peaks, before = [_glint(group, half_angle) for group in groups], None
    for rings in (RINGS * 2**finer for finer in range(FINER + 1)):
        lamp = _eclipsed(disk(scene.sun, half_angle, half_angle / rings), scene)
        found = [group.flux([lamp])(group.fixed) for group in groups]
        now = np.sum([one.sum(axis=0) for one in found], axis=0)
        between = any((np.abs(peak) > rings**2 * np.abs(one)).any() for peak, one in zip(peaks, found, strict=True))
        if before is not None and not between and (np.abs(now - before) <= SETTLED * np.abs(now)).all():
            return lamp
        before = now
    raise ValueError(
        "a lobe is too narrow for the sum over the sun's disk: fit it with the cones of the goniometer "
        "(--source-half-angle), or take the sun as a point by sun_half_angle=0"
    )


def _glint(group: _Group, half_angle: float) -> Values:
    """What (facets, times) the sun would send from the mirror direction alone; 0 where that is beside its disk."""
    scene = group.scene
    peaks = np.zeros((len(group.places), scene.times))
    for k, place in enumerate(group.places):
        normal = np.broadcast_to(unit(scene.facets[place].normal, "normal"), (scene.times, 3))
        mirror = 2 * dot(normal, scene.observer)[:, None] * normal - scene.observer
        inside = scene.lit & (dot(mirror, scene.sun) > np.cos(np.radians(half_angle)))
        if inside.any():
            lamp = Lamp(mirror[:, None], inside[:, None].astype(float))
            peaks[k] = group.alone(place).flux([lamp])(group.fixed)[0]
    return peaks


def _eclipsed(lamp: Lamp, scene: _Scene) -> Lamp:
    """The sun where it is not behind the Earth."""
    return Lamp(lamp.towards, lamp.irradiance * scene.lit[:, None])


def _summed(groups: Sequence[_Group], scene: _Scene, lamps: Sequence[Lamp]) -> tuple[Values, tuple[Values, Values]]:
    """The ratio (names, times), and the variance (times,) of its sum from random and from systematic errors."""
    rows = {name: k for k, name in enumerate(scene.names)}
    shares = np.zeros((len(rows), scene.times))
    random, systematic, stated = np.zeros(scene.times), np.zeros(scene.times), False
    fluxes = [(group, group.flux(lamps)) for group in groups]
    for group, flux in fluxes:
        np.add.at(shares, [rows[scene.called[k]] for k in group.places], flux(group.fixed))
    for solution in {id(group.solution): group.solution for group, _ in fluxes if group.solution is not None}.values():
        own = [flux for group, flux in fluxes if group.solution is solution]
        found = propagate(solution, lambda values, own=own: _total(own, values))  # type: ignore[misc]
        random += found.uncertainty**2
        if solution.has_systematic:
            stated = True
            systematic += found.systematic**2
    return shares, (random, systematic if stated else np.full(scene.times, np.nan))


def _total(fluxes: Sequence[Flux], values: Values) -> Values:
    return np.sum([flux(values).sum(axis=0) for flux in fluxes], axis=0)
