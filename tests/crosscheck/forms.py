"""How the formulas of Mitsuba 3 and SCATMECH differ from gonio's models, written out anew. Knows nothing of gonio.

A peer's value is brought into the form of the model by what is known of both formulas, without any value of gonio's.
docs/verification.md lists every difference. Directions are unit vectors w_i and w_r (3, n), z the normal.
"""

import numpy as np
from scipy.special import erf


class Pairs:
    """Cosines and slopes of pairs of directions: of both with the normal, of w_i with the half vector, and its tilt."""

    def __init__(self, w_i, w_r):
        half = w_i + w_r
        self.cos_i, self.cos_r = w_i[2], w_r[2]
        self.tan2_half = (half[0] ** 2 + half[1] ** 2) / half[2] ** 2
        self.cos_half = 1 / np.sqrt(1 + self.tan2_half)
        self.cos_beta = np.linalg.norm(half, axis=0) / 2


def ggx_lambda(cos, width):
    return (np.sqrt(1 + width**2 * (1 / cos**2 - 1)) - 1) / 2


def beckmann_lambda(cos, m):
    a = cos / (m * np.sqrt(1 - cos**2))
    return (erf(a) - 1) / 2 + np.exp(-(a**2)) / (2 * a * np.sqrt(np.pi))


def rational(cos, m):
    """Walter's fit of Beckmann's masking of one direction (walter2007, eq 27)."""
    a = cos / (m * np.sqrt(1 - cos**2))
    return np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1.0)


def ggx(tan2, width):
    return (1 + tan2) ** 2 / (np.pi * width**2 * (1 + tan2 / width**2) ** 2)


def beckmann(tan2, m):
    return (1 + tan2) ** 2 / (np.pi * m**2) * np.exp(-tan2 / m**2)


def schlick(cos, at_normal):
    return at_normal + (1 - at_normal) * (1 - cos) ** 5


def fresnel(cos, n, k=0.0):
    """Reflectance of unpolarised light in complex arithmetic."""
    index = n + 1j * k
    inside = np.sqrt(index**2 - (1 - cos**2))
    s, p = (cos - inside) / (cos + inside), (index**2 * cos - inside) / (index**2 * cos + inside)
    return (abs(s) ** 2 + abs(p) ** 2) / 2


def as_it_is(value, pairs):
    """No difference."""
    return value


def correlated_ggx(width):
    """Mitsuba multiplies the masking of both directions, where the model correlates heights."""

    def form(value, p):
        i, r = ggx_lambda(p.cos_i, width), ggx_lambda(p.cos_r, width)
        return value * (1 + i) * (1 + r) / (1 + i + r)

    return form


def correlated_beckmann(m):
    """Mitsuba multiplies a rational fit of the masking of both directions, where the model has Smith's, correlated."""

    def form(value, p):
        exact = 1 / (1 + beckmann_lambda(p.cos_i, m) + beckmann_lambda(p.cos_r, m))
        return value * exact / (rational(p.cos_i, m) * rational(p.cos_r, m))

    return form


def schlick_highlight(width, index, specular):
    """Mitsuba's highlight has the exact Fresnel factor of a dielectric, the model's Schlick's with 0.08 specular."""

    def form(value, p):
        masking = 1 / ((1 + ggx_lambda(p.cos_i, width)) * (1 + ggx_lambda(p.cos_r, width)))
        highlight = ggx(p.tan2_half, width) * masking / (4 * p.cos_i * p.cos_r)
        return value + (schlick(p.cos_beta, 0.08 * specular) - fresnel(p.cos_beta, index)) * highlight

    return form


def over_four_cosines(value, p):
    """Mitsuba's clearcoat lacks the 1/(4 cos theta_i cos theta_r) that is in the shader's smithG_GGX."""
    return value / (4 * p.cos_i * p.cos_r)


def without_fresnel(index, extinction):
    """SCATMECH's facets have a Fresnel factor, the model's have none."""
    return lambda value, p: value / fresnel(p.cos_beta, index, extinction)


def masked_ggx(width):
    """SCATMECH masks nothing here, the model as Smith does."""
    return lambda value, p: value / (1 + ggx_lambda(p.cos_i, width) + ggx_lambda(p.cos_r, width))


def cauchy_for_gaussian(m, width, index):
    """SCATMECH's slopes are Gaussian; the model has a Cauchy distribution and the Fresnel factor of the normal in B."""

    def form(value, p):
        cauchy = p.cos_half / (width**2 + p.tan2_half)
        return value * 4 * cauchy / (beckmann(p.tan2_half, m) * fresnel(1.0, index))

    return form
