"""Masking and shadowing of facets by their neighbours (formulas 3)."""

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry


def v_groove(g: Geometry) -> Array:
    """Torrance and Sparrow's V-grooves (guo2023, eq 4): 1, or the unblocked part of the narrower direction."""
    xp = namespace(g.z_i + g.z_r)
    narrower = xp.minimum(g.cos_i + 0 * g.cos_r, g.cos_r + 0 * g.cos_i)
    return xp.clip(2 * g.cos_alpha * narrower / g.cos_beta, 0.0, 1.0)
