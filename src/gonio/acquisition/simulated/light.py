"""The light of the simulated bench: the beam, what surfaces make of it, and what reaches the detector's aperture."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from gonio.acquisition.device import BEAM
from gonio.geometry import Geometry
from gonio.measured.instrument import Acceptance, Instrument
from gonio.model import Model
from gonio.optics.fresnel import reflectances

BELOW = 90.0  # deg from the normal, where the surface's other side begins
FAR = 10  # standard deviations of a Gaussian, beyond which nothing is left
FAINT = 1e-6  # of a beam: less is none
WARM_UP = 20 * 60.0  # s, of a laser
Value = float | Mapping[float, float]


@dataclass(frozen=True, kw_only=True)
class Optics:
    """What a simulated bench is, of which the bench itself states some to the reduction.

    power: of the beam [W]. beam_radius: at 1/e^2 of its irradiance. view_radius: of the detector's field of view on
    the sample, infinite where it sees the whole spot. arm_half_width: half of what stands in the beam near the source.
    All lengths in mm. stray: light that reaches the detector at every angle, as a BRDF [1/sr]. halo, halo_width: that
    about a specular or direct beam, halo exp(-angle/halo_width) [1/sr, deg]. background: other light [W]. arm_zero,
    table_zero: errors of the zeros [deg], which the positions read back do not show. speckle: whether the light is
    coherent and the surface rough; depolarising: whether it depolarises.
    """

    wavelength: float = 632.8
    power: float = 1e-3
    beam_radius: float = 1.0
    view_radius: float = math.inf
    aperture_radius: float = 4.75
    distance: float = 500.0
    arm_half_width: float = 20.0
    filter_transmittance: float = 1e-3
    stray: float = 0.0
    halo: float = 0.0
    halo_width: float = 1.0
    background: float = 1e-13
    arm_zero: float = 0.0
    table_zero: float = 0.0
    speckle: bool = False
    depolarising: bool = False

    @property
    def solid_angle(self) -> float:
        """Of the aperture [sr]: 2 pi (1 - D/sqrt(D^2 + r^2)), written without a difference of equal numbers."""
        slant = math.hypot(self.distance, self.aperture_radius)
        return 2 * math.pi * self.aperture_radius**2 / (slant * (slant + self.distance))

    @property
    def half_angle(self) -> float:
        """That the aperture subtends [deg]."""
        return math.degrees(math.atan2(self.aperture_radius, self.distance))


@dataclass(frozen=True, kw_only=True)
class Laser:
    """How the power of the source changes: a warm-up that dies away in 20 minutes, and slow noise (AR(1)).

    warm_up: by how much the power is too high at the start, relative. noise: standard deviation, relative, with the
    correlation time [s].
    """

    warm_up: float = 0.02
    noise: float = 0.002
    correlation: float = 600.0


STEADY = Laser(warm_up=0.0, noise=0.0)


class Surface(Protocol):
    """What lies in the sample's place."""

    def brdf(self, theta_i: float, theta_r: float, phi: float, half_angle: float) -> float:
        """The BRDF [1/sr] over a detector's cone, at angles in degrees."""
        ...

    def specular(self, theta_i: float) -> float:
        """The part of the power that it mirrors."""
        ...


@dataclass(frozen=True)
class Scattering:
    """A surface of a model; a value that is a mapping changes with theta_i [deg], the nearest key counts."""

    model: Model
    values: Mapping[str, Value]

    def __post_init__(self) -> None:
        self.brdf(30.0, 30.0, 180.0, 0.0)  # values that the model has not are refused now, and not in a measurement

    def brdf(self, theta_i: float, theta_r: float, phi: float, half_angle: float) -> float:
        """The model's, over the cone by a finer rule than that of a fit."""
        at = {
            name: value[min(value, key=lambda angle: abs(angle - theta_i))] if isinstance(value, Mapping) else value
            for name, value in self.values.items()
        }
        geometry = Geometry.from_degrees(*(np.array([angle]) for angle in (theta_i, theta_r, phi)))
        instrument = Instrument(detector_half_angle=half_angle) if half_angle else Instrument()
        return float(np.asarray(Acceptance(instrument.finer(), geometry).brdf(self.model, at))[0])

    def specular(self, theta_i: float) -> float:
        """Nothing: what the model mirrors is in its BRDF."""
        return 0.0 * theta_i


@dataclass(frozen=True)
class Diffuse:
    """A standard that reflects as a Lambert surface of this reflectance."""

    reflectance: float

    def brdf(self, theta_i: float, theta_r: float, phi: float, half_angle: float) -> float:
        """reflectance/pi at every angle above the horizon."""
        above = max(abs(theta_i), abs(theta_r)) < BELOW and half_angle >= 0 and math.isfinite(phi)
        return self.reflectance / math.pi * above

    def specular(self, theta_i: float) -> float:
        """Nothing."""
        return 0.0 * theta_i


@dataclass(frozen=True)
class Mirror:
    """A smooth surface of complex index n + ik, in light of a polarisation: s, p, or both alike."""

    n: float
    k: float
    polarisation: str = "unpolarised"

    def brdf(self, theta_i: float, theta_r: float, phi: float, half_angle: float) -> float:
        """Nothing: all of its light is in the mirrored beam."""
        return 0.0 * (theta_i + theta_r + phi + half_angle)

    def specular(self, theta_i: float) -> float:
        """Fresnel's reflectance."""
        s, p, *_ = reflectances(np.cos(np.radians(theta_i)), self.n, self.k)
        return float({"s": s, "p": p}.get(self.polarisation, (s + p) / 2))


@lru_cache(maxsize=4096)
def kappa(theta_i: float, theta_r: float, beam_radius: float, view_radius: float) -> float:
    """The part of a Gaussian beam's power within a circular field of view, at angles [deg]; radii in one unit.

    The footprint has standard deviations w/(2 cos theta_i) in the plane and w/2 across; the field of view is an ellipse
    of half axes r_v/cos theta_r and r_v. Integrated across first, which is an error function, then in the plane.
    """
    from scipy.integrate import quad

    if math.isinf(view_radius):
        return 1.0
    s_x, s_y = beam_radius / (2 * math.cos(math.radians(theta_i))), beam_radius / 2
    a = view_radius / math.cos(math.radians(theta_r))

    def strip(x: float) -> float:
        across = view_radius * math.sqrt(max(1 - (x / a) ** 2, 0.0))
        return math.exp(-0.5 * (x / s_x) ** 2) * math.erf(across / (math.sqrt(2) * s_y))

    half, _ = quad(strip, 0, min(a, 10 * s_x), epsabs=0, epsrel=1e-10)
    return float(2 * half / (s_x * math.sqrt(2 * math.pi)))


def speckles(spot_diameter: float, aperture_diameter: float, distance: float, wavelength: float) -> float:
    """How many speckles the aperture collects: M = A_spot A_aperture/(lambda D)^2; lengths in mm, wavelength in nm.

    The contrast of their sum is 1/sqrt(M), by sqrt(2) less where the surface depolarises (Goodman, Speckle Phenomena in
    Optics).
    """
    areas = (math.pi / 4) ** 2 * spot_diameter**2 * aperture_diameter**2
    return max(areas / (wavelength * 1e-6 * distance) ** 2, 1.0)


@dataclass
class Light:
    """What reaches the aperture, as a part of the beam's power, for a target and positions of the stage."""

    optics: Optics
    targets: Mapping[str, Surface | None]  # None lets the beam through
    seed: int = 0

    def part(self, target: str, table: float, arm: float, filtered: float = 1.0) -> float:
        """Detected power over that of the beam; `table` and `arm` [deg] from the source, `filtered` a transmittance."""
        o = self.optics
        table, arm = table + o.table_zero, arm + o.arm_zero
        return filtered * self._passing(arm) * self._reaching(target, table, arm)

    def _reaching(self, target: str, table: float, arm: float) -> float:
        o, omega = self.optics, self.optics.solid_angle
        surface = self.targets[target]
        if surface is None:
            off = abs(math.remainder(arm - BEAM, 360.0))
            return self._caught(off) + omega * (o.stray + o.halo * math.exp(-off / o.halo_width))
        theta_i, theta_r = table, arm - table
        if abs(theta_i) >= BELOW or abs(theta_r) >= BELOW:
            return 0.0
        mirrored = surface.specular(theta_i)
        off = abs(theta_r - theta_i)
        beam = mirrored * (self._caught(off) + omega * o.halo * math.exp(-off / o.halo_width)) if mirrored else 0.0
        phi, incidence = (180.0 if theta_r * (theta_i or 1.0) >= 0 else 0.0), abs(theta_i)
        f = surface.brdf(incidence, abs(theta_r), phi, o.half_angle) if mirrored < 1 else 0.0
        seen = kappa(incidence, abs(theta_r), o.beam_radius, o.view_radius)
        scattered = seen * omega * math.cos(math.radians(theta_r)) * f * self._grain(target, theta_i, theta_r)
        return scattered + beam + omega * o.stray

    def _caught(self, off: float) -> float:
        """The part of a Gaussian beam that falls into the aperture, `off` [deg] from its middle.

        Squared distances from the middle of the aperture, over the variance (w/2)^2, follow the noncentral chi-squared
        distribution of two degrees of freedom.
        """
        from scipy.special import chndtr

        o = self.optics
        away, sigma = o.distance * math.tan(math.radians(min(off, BELOW - 1))), o.beam_radius / 2
        if away > o.aperture_radius + FAR * sigma:
            return 0.0
        return float(chndtr((o.aperture_radius / sigma) ** 2, 2, (away / sigma) ** 2))

    def _passing(self, arm: float) -> float:
        """The part of the beam that passes by the arm, on its way to the sample: less than 1 near the source."""
        from_source = abs(math.remainder(arm, 360.0))
        if from_source >= BELOW or not self.optics.arm_half_width:
            return 1.0
        beside = self.optics.distance * math.sin(math.radians(from_source)) - self.optics.arm_half_width
        passing = (1 + math.erf(beside * math.sqrt(2) / self.optics.beam_radius)) / 2
        return passing if passing > FAINT else 0.0

    def _grain(self, target: str, theta_i: float, theta_r: float) -> float:
        """Speckle: frozen, so that it is the same whenever the same place is looked at from the same direction."""
        o = self.optics
        if not o.speckle:
            return 1.0
        count = speckles(2 * o.beam_radius, 2 * o.aperture_radius, o.distance, o.wavelength) * (1 + o.depolarising)
        name = f"{self.seed} {target} {theta_i:.2f} {theta_r:.2f}"
        place = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8])
        return float(np.random.default_rng(place).gamma(count, 1 / count))
