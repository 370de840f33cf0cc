"""What lights a body, as directions with the irradiance from each: the sun as a disk, and the Earth that it lights."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.solution import Solution
from gonio.geometry import GRAZING, Geometry
from gonio.measured.instrument import cone
from gonio.model import Model
from gonio.models.lambert import lambert
from gonio.photometry.facets import Facet
from gonio.photometry.vectors import EARTH_RADIUS, dot, unit, vectors

Values = npt.NDArray[np.float64]

SUN_HALF_ANGLE = 0.267  # deg: of the disk of the sun from 1 au
EARTH_STEP = 5.0  # deg: about how far apart the directions to the Earth are
EARTH_RINGS = 8  # at least, of directions from its middle to its limb


class Lamp(NamedTuple):
    """Directions (times, nodes, 3) towards the light, unit vectors, and the irradiance from each (times, nodes).

    The irradiance is that of a surface which faces the direction, over the sun's whole irradiance.
    """

    towards: Values
    irradiance: Values


def disk(centre: Values, half_angle: float, step: float) -> Lamp:
    """A disk of even radiance about unit vectors (times, 3), of irradiance 1; a point for a half angle [deg] of 0."""
    nodes, portions = cone(tuple(centre.T), half_angle, step)
    towards = np.stack(nodes, axis=-1).swapaxes(0, 1)
    return Lamp(towards, np.broadcast_to(portions, towards.shape[:2]))


@dataclass(frozen=True, eq=False)
class Earth:
    """The Earth as a second source, and as what hides the sun from a body in its shadow.

    Parameters
    ----------
    position : array_like (3,) or (times, 3)
        From the centre of the Earth to the body [m], in the frame of the sun and the observer.
    brdf : Model or Solution
        The ground that the sun lights, everywhere the same; by default Lambert's with `values`.
    values : mapping
        Of the model, by default an albedo of 0.3.

    """

    position: Any
    brdf: Model | Solution = lambert
    values: Mapping[str, float] = field(default_factory=lambda: {"rho": 0.3})

    def sunlit(self, sun: Values) -> npt.NDArray[np.bool_]:
        """Whether the body (times,) sees the middle of the sun beside the Earth, for unit vectors (times, 3)."""
        away, down, limb = self._seen()
        return np.asarray(~((dot(sun, down) > np.cos(limb)) & (away > 0)))

    def lamp(self, sun: Values, step: float = EARTH_STEP) -> Lamp:
        """The light of the Earth's sunlit side as the body sees it, for unit vectors towards the sun (times, 3).

        A direction meets the ground at a point with the normal n. From there the body gets the radiance f cos(theta_s)
        for an irradiance of the sun of 1, with theta_s the sun's angle from n, whatever the distance.
        """
        _, down, limb = self._seen()
        position = vectors(self.position, "the position over the Earth")
        count = max(len(sun), len(position))
        suns, positions, downs = (np.broadcast_to(v, (count, 3)) for v in (sun, position, down))
        limbs = np.broadcast_to(limb, count)
        lamps = [self._lamp_of(suns[k], positions[k], downs[k], float(limbs[k]), step) for k in range(count)]
        most = max(len(irradiance) for _, irradiance in lamps)
        towards = np.stack([np.pad(t, ((0, most - len(t)), (0, 0)), mode="edge") for t, _ in lamps])
        return Lamp(towards, np.stack([np.pad(e, (0, most - len(e))) for _, e in lamps]))

    def _lamp_of(self, sun: Values, position: Values, down: Values, limb: float, step: float) -> tuple[Values, Values]:
        """The directions (nodes, 3) to the Earth at one time, and the irradiance from each."""
        nodes, portions = cone(tuple(down[:, None]), float(np.degrees(limb)), min(step, np.degrees(limb) / EARTH_RINGS))
        towards = np.stack(nodes, axis=-1)[:, 0]
        along = towards @ position
        distance = -along - np.sqrt(np.maximum(along**2 - position @ position + EARTH_RADIUS**2, 0.0))
        normal = (position + distance[:, None] * towards) / EARTH_RADIUS
        lit = (normal @ sun > GRAZING) & (dot(normal, -towards) > GRAZING)
        radiance = np.zeros(len(towards))
        if lit.any():
            ground = Facet(1.0, down, self.brdf, self.values if isinstance(self.brdf, Model) else {}, name="the Earth")
            fixed = np.empty(0) if ground.solution is None else ground.solution.dataset["value"].values
            g = geometry(*frames(normal[lit], None), np.broadcast_to(sun, normal[lit].shape), -towards[lit])
            radiance[lit] = ground.evaluated()(fixed, g) * (normal[lit] @ sun)
        solid_angle = 4 * np.pi * np.sin(limb / 2) ** 2
        return towards, radiance * portions * solid_angle

    def _seen(self) -> tuple[Values, Values, Values]:
        """The body's height over the ground [m], unit vectors to the Earth's centre, and its half angle [rad]."""
        position = vectors(self.position, "the position over the Earth")
        distance = np.linalg.norm(position, axis=1)
        if not (distance > EARTH_RADIUS).all():
            raise ValueError(
                f"the body is {distance.min():.6g} m from the Earth's centre, within its radius of {EARTH_RADIUS:g} m: "
                "give positions in metres from the centre"
            )
        return distance - EARTH_RADIUS, -unit(position, "the position"), np.arcsin(EARTH_RADIUS / distance)


def frames(normal: Values, along: Values | None) -> tuple[Values, Values, Values]:
    """The axes x, y and z (n, 3) of surfaces with unit normals (n, 3); any x where `along` (n, 3) is None.

    ValueError where `along` stands upright on the surface.
    """
    if along is None:
        # the axis of the frame that is farthest from the normal
        along = np.eye(3)[np.argmin(np.abs(normal), axis=-1)]
    x = along - dot(along, normal)[:, None] * normal
    length = np.linalg.norm(x, axis=1, keepdims=True)
    if (length <= 1e-6 * np.linalg.norm(along, axis=1, keepdims=True)).any():
        raise ValueError("along is upright on the surface of a facet, and says nothing of its direction")
    x = x / length
    return x, np.cross(normal, x), normal


def geometry(x: Values, y: Values, z: Values, to_light: Values, to_observer: Values) -> Geometry:
    """The directions (n,) in the frames of surfaces, of unit vectors (n, 3)."""
    return Geometry(*(dot(a, to_light) for a in (x, y, z)), *(dot(a, to_observer) for a in (x, y, z)))
