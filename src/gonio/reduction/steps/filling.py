"""What a detector sees of the light on a sample: solid angle, and the part of the beam within its field of view.

The power that reaches the detector is P = Phi kappa Omega cos(theta_r) f, with Phi the power of the beam, Omega the
solid angle of the aperture, and kappa the part of the beam within the field of view on the sample. Two limits are:

    under    the whole spot is seen, kappa = 1:                         P = Phi Omega cos(theta_r) f
    over     an area A normal to the detector's axis is seen of a
             wide uniform beam of irradiance E0 normal to itself:       P = E0 A Omega cos(theta_i) f

So a reading is divided by the cosine of theta_r in one, of theta_i in the other (NIST SP 250-48). Which one holds only
the user knows. `beam:W,R` lies between: a Gaussian beam and a circular field of view, both centred on the axis.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
UNDER, OVER, BEAM = "under", "over", "beam"
CHOICES = (
    "under where the detector sees the whole spot (readings are divided by cos theta_r), over where it sees a part of "
    "a wide uniform beam (divided by cos theta_i), or beam:W,R with the beam's 1/e^2 radius W and the radius R of the "
    "field of view, in one unit"
)
NODES = 200  # of the rule for the integral over the field of view: errors below 1e-12


@dataclass(frozen=True)
class Filling:
    """How the beam fills the field of view. For `beam`: radius (1/e^2) and view in one unit of length."""

    kind: str
    radius: float = math.nan
    view: float = math.nan

    @classmethod
    def parsed(cls, text: str) -> "Filling":
        """`under`, `over`, or `beam:W,R`; ValueError with the choices for anything else, and for no text."""
        kind, colon, sizes = text.strip().partition(":")
        if not text.strip():
            raise ValueError(f"the filling is not stated, and no reading tells it: say {CHOICES}")
        if kind in (UNDER, OVER) and not colon:
            return cls(kind)
        try:
            radius, view = (float(size) for size in sizes.split(","))
        except ValueError:
            raise ValueError(f"the filling {text!r} is none: say {CHOICES}") from None
        if kind != BEAM or not (0 < radius < math.inf and 0 < view < math.inf):
            raise ValueError(f"the filling {text!r} is none: say {CHOICES}")
        return cls(BEAM, radius, view)

    def __str__(self) -> str:
        return f"beam:{self.radius:g},{self.view:g}" if self.kind == BEAM else self.kind

    def weight(self, theta_i: npt.ArrayLike, theta_r: npt.ArrayLike) -> Values:
        """What a reading is proportional to beside f, at angles (n,) [deg]: a cosine, with kappa where it varies."""
        cos_i, cos_r = (np.cos(np.radians(np.asarray(a, dtype=float))) for a in (theta_i, theta_r))
        if self.kind == OVER:
            return cos_i
        if self.kind == UNDER:
            return cos_r
        return cos_r * kappa(theta_i, theta_r, self.radius, self.view)


def kappa(theta_i: npt.ArrayLike, theta_r: npt.ArrayLike, radius: float, view: float) -> Values:
    """The part of a Gaussian beam's power within a circular field of view, at angles (n,) [deg].

    radius: of the beam at 1/e^2 of its irradiance. view: radius of the field of view, in the same unit. The beam's
    footprint has the standard deviations s_x = radius/(2 cos theta_i) in the plane and s_y = radius/2 across; the field
    of view is an ellipse of half axes a = view/cos theta_r and b = view, and

        kappa = Int_-a^a N(x; s_x) erf(b sqrt(1 - x^2/a^2)/(sqrt(2) s_y)) dx.
    """
    from scipy.special import erf

    angles = np.broadcast_arrays(np.radians(np.asarray(theta_i, float)), np.radians(np.asarray(theta_r, float)))
    sigma_x, sigma_y = radius / (2 * np.cos(angles[0]))[..., None], radius / 2
    half = (view / np.cos(angles[1]))[..., None]
    # x = reach sin(t): no root at the ends of the integral; beyond eight standard deviations there is no power
    reach = np.minimum(half, 8 * sigma_x)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    t = nodes * math.pi / 2
    x = reach * np.sin(t)
    across = erf(view * np.sqrt(np.maximum(1 - (x / half) ** 2, 0)) / (math.sqrt(2) * sigma_y))
    density = np.exp(-0.5 * (x / sigma_x) ** 2) / (math.sqrt(2 * math.pi) * sigma_x)
    found: Values = (weights * math.pi / 2 * density * across * reach * np.cos(t)).sum(axis=-1)
    return found


def solid_angle(radius: float, distance: float) -> float:
    """The solid angle [sr] of a circular aperture of a radius at a distance on its axis, both in one unit.

    Omega = 2 pi (1 - D/sqrt(D^2 + r^2)), of which A/D^2 is the limit for a small aperture. D is to the spot on the
    sample; with a lens before it, the aperture is the entrance pupil of the lens.
    """
    slant = math.hypot(distance, radius)
    return 2 * math.pi * radius**2 / (slant * (slant + distance))  # without the difference of nearly equal numbers


def half_angle(radius: float, distance: float) -> float:
    """The half angle [deg] that the aperture subtends at the spot, which the fit's `--detector-half-angle` takes."""
    return math.degrees(math.atan2(radius, distance))


def noise_equivalent(power: float, beam: float, omega: float, theta_r: npt.ArrayLike) -> Values:
    """The BRDF [1/sr] whose signal equals the detector's noise, NEP/(Phi Omega cos theta_r), at theta_r [deg].

    power: the noise-equivalent power; beam: the power of the beam, in the same unit; omega: solid angle [sr].
    """
    return power / (beam * omega * np.cos(np.radians(np.asarray(theta_r, dtype=float))))
