"""Slopes of a map as facets: the widths that facet models fit, and the BRDF of the slopes themselves.

The surface is made of mirrors larger than the light resolves. Where it is not much rougher than the wavelength, use the
effective slope of `correlation.effective_slope`, or wave optics.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from gonio.geometry import Geometry
from gonio.topography.heights import Values
from gonio.topography.slopes import Slopes

RINGS = 60  # of the histogram of slopes
MOST_SAMPLES = 200_000  # of slopes that decide on Student's t, spread over the map
TAIL = (1.05, 60.0)  # exponent c of Student's t: from tails without a mean to Gaussian


class FacetWidths(NamedTuple):
    """The widths of facet models that a map of slopes has, in the words of gonio's models.

    sigma: rms slope per axis (torrance-sparrow), Sdq/sqrt(2); m: total (beckmann), Sdq. m_by_median and ggx_width: from
    the median slope, which tails and noise do not move: median = m sqrt(ln 2) of Gaussian slopes, = width of GGX.
    student_width and student_c: of student-t, by maximum likelihood; NaN where slopes along x and y differ much.
    """

    sigma: float
    m: float
    m_by_median: float
    ggx_width: float
    student_width: float
    student_c: float


def facet_widths(found: Slopes) -> FacetWidths:
    """The widths of facet models from slopes. Raises ValueError where no slope is known."""
    length = found.length
    if not length.size:
        raise ValueError("no point of the map has a slope: too many of its points are missing")
    median = float(np.median(length))
    width, c = _student(length[:: max(length.size // MOST_SAMPLES, 1)])
    return FacetWidths(found.rms / math.sqrt(2), found.rms, median / math.sqrt(math.log(2)), median, width, c)


def _student(length: Values) -> tuple[float, float]:
    """Width and exponent of the density 1/(pi w^2) (1 + t^2/((c - 1) w^2))^-c of slopes, by maximum likelihood.

    Searched over ln w and ln(c - 1), so that both keep their bounds.
    """
    median = max(float(np.median(length)), 1e-12)
    scaled = (length / median) ** 2

    def cost(at: Values) -> float:
        squared, less = np.exp(2 * at[0]), np.exp(at[1])
        return float(2 * at[0] + (1 + less) * np.mean(np.log1p(scaled / (less * squared))))

    bounds = [(-5, 5), tuple(np.log(np.array(TAIL) - 1))]
    found = minimize(cost, [0.0, 0.0], bounds=bounds)
    return median * math.exp(found.x[0]), 1 + math.exp(found.x[1])


def facets_brdf(g: Geometry, found: Slopes) -> Values:
    """The BRDF [1/sr] of the slopes of a map, taken alike in all directions, of reflectance 1.

    P22 G/(4 cos theta_i cos theta_r cos^4 alpha): P22 is the density of slopes, counted in rings of equal counts;
    Smith's G has Lambda = mean(max(q - mu, 0))/mu of the slopes q along a direction of cotangent mu (formulas 3.2).
    """
    radius, density = density_of_slopes(found.length)
    slope = np.sqrt(np.asarray(g.tan_alpha_squared))
    p22 = np.exp(np.interp(slope, radius, np.log(density), right=-np.inf))
    components = np.sort(np.abs(np.concatenate([part[np.isfinite(part)] for part in (found.x, found.y)])))
    blocked = 1 + smith_lambda(np.asarray(g.cos_i), components) + smith_lambda(np.asarray(g.cos_r), components)
    return np.asarray(p22 / (blocked * 4 * g.cos_i * g.cos_r * g.cos_alpha**4))


def density_of_slopes(length: Values) -> tuple[Values, Values]:
    """The density P22 over the plane of slopes at the radii of rings that hold equally many slopes."""
    edges = np.unique(np.quantile(length, np.linspace(0, 1, max(min(RINGS, length.size // 50), 2) + 1)))
    if edges.size < 2:
        raise ValueError("every slope of the map is the same: it is no rough surface")
    edges[0] = 0.0
    counts = np.histogram(length, edges)[0]
    area = math.pi * np.diff(edges**2)
    return np.sqrt((edges[1:] ** 2 + edges[:-1] ** 2) / 2), np.maximum(counts, 1) / (length.size * area)


def smith_lambda(cos: Values, components: Values) -> Values:
    """Smith's Lambda of directions from the sorted sizes of slopes along one axis, which have both signs alike."""
    mu = cos / np.sqrt(np.maximum(1 - cos**2, 1e-12))
    above = np.searchsorted(components, mu, side="right")
    sums = np.concatenate([np.cumsum(components[::-1])[::-1], [0.0]])
    count = components.size
    return np.asarray((sums[above] - (count - above) * mu) / (2 * count) / mu)
