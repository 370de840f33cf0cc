"""Masking and shadowing of facets by their neighbours (formulas 3)."""

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry


def v_groove(g: Geometry) -> Array:
    """Torrance and Sparrow's V-grooves (guo2023, eq 4): 1, or the unblocked part of the narrower direction."""
    xp = namespace(g.cos_i)
    unblocked = 2 * g.cos_alpha * xp.where(g.cos_i < g.cos_r, g.cos_i, g.cos_r) / g.cos_beta
    return xp.where(unblocked > 1.0, 1.0, unblocked)
