"""Frames of a surface: whether a model has a direction of its own in the surface."""

import numpy as np

from gonio.exporting.source import pairs
from gonio.exporting.subject import Subject
from gonio.geometry import Geometry

TURNS = (0.6, 1.9, 4.1)  # azimuths [rad] without a symmetry in common
ROUNDING = 1e-6  # relative: a turn changes the last digits of a cosine, which a narrow lobe multiplies


def isotropic(subject: Subject) -> bool:
    """Whether the values stay the same where the surface is turned about its normal or seen in a mirror."""
    geometry = pairs()
    for label in subject.sets:
        expected = np.asarray(subject.brdf(geometry, label))
        bound = ROUNDING * np.maximum(np.abs(expected), ROUNDING * np.nanmax(np.abs(expected)))
        for angle in TURNS:
            found = np.asarray(subject.brdf(_turned(geometry, angle), label))
            mirrored = np.asarray(subject.brdf(_mirrored(geometry), label))
            if np.any(np.abs(found - expected) > bound) or np.any(np.abs(mirrored - expected) > bound):
                return False
    return True


def _turned(g: Geometry, angle: float) -> Geometry:
    cos, sin = np.cos(angle), np.sin(angle)
    return Geometry(
        *(cos * g.x_i - sin * g.y_i, sin * g.x_i + cos * g.y_i, g.z_i),
        *(cos * g.x_r - sin * g.y_r, sin * g.x_r + cos * g.y_r, g.z_r),
    )


def _mirrored(g: Geometry) -> Geometry:
    return Geometry(g.x_i, -g.y_i, g.z_i, g.x_r, -g.y_r, g.z_r)
