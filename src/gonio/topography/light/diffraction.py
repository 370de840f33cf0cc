"""Scatter of a surface by wave optics from its structure function, without a fit or a model of its spectrum.

    f = R X (2 pi/wavelength^2) Int_0^inf [exp(-k_z^2 D(r)/2) - exp(-k_z^2 Sq^2)] J0(2 pi shift r/wavelength) r dr

with k_z = 2 pi (cos theta_i + cos theta_r)/wavelength. X = 1 is the generalised Harvey-Shack theory (krywonos2011),
X = (cos beta/cos alpha)^2/(cos theta_i cos theta_r) that of Beckmann and Kirchhoff (beckmann1963); R is the reflectance
of a smooth surface. It holds for Gaussian differences of height, small slopes and no shadowing. The light that stays in
the mirror direction, exp(-k_z^2 Sq^2) of it, is no part of the integral.
"""

import math

import numpy as np
from scipy.special import j0

from gonio.geometry import Geometry
from gonio.optics.kirchhoff import kirchhoff_obliquity, shift_squared
from gonio.optics.quadrature import gauss_legendre
from gonio.topography.correlation import Lags, Structure, taper
from gonio.topography.heights import Values

HARVEY, KIRCHHOFF = "harvey-shack", "kirchhoff"
ROUGH = 10.0  # g above which the Kirchhoff obliquity is right: Harvey-Shack does not tend to facets
NODES = 8  # of Gauss-Legendre in a panel
AT_ONCE = 2**21  # numbers of the integrand in memory
FARTHEST = 1000.0  # wavelengths: what is correlated farther scatters within 0.06 deg of the mirror direction


def obliquity(g: Geometry, name: str) -> Values:
    """The factor X of an obliquity by name. Raises ValueError for one that is not known."""
    if name == HARVEY:
        return np.ones(np.shape(g.cos_i))
    if name == KIRCHHOFF:
        return np.asarray(kirchhoff_obliquity(g))
    raise ValueError(f"{name!r} is no obliquity: choose {HARVEY} or {KIRCHHOFF}")


def diffracted(g: Geometry, surface: Structure, wavelength: float) -> Values:
    """The integral above with R = X = 1 [1/sr], of an isotropic surface; wavelength in um.

    Gauss-Legendre quadrature in panels that the fastest J0 and the structure function cross smoothly: rounding for
    analytic structure functions. That of a map, which never settles at its plateau, is brought to it over the outer
    half of its reach by a cosine, which widens the lobe by about wavelength/reach.
    """
    k_z = np.ravel(2 * math.pi / wavelength * (g.cos_i + g.cos_r) * np.ones(np.shape(g.x_r)))
    shift = np.ravel(np.sqrt(shift_squared(g)) * np.ones(np.shape(g.x_r)))
    reach = min(surface.reach, FARTHEST * wavelength)
    fastest = 2 * math.pi / wavelength * max(float(shift.max(initial=0.0)), 0.05)
    panels = max(int(np.ceil(reach / min(math.pi / fastest, surface.scale))), 8)
    points, weights = (np.asarray(part) for part in gauss_legendre(NODES))
    width = reach / panels
    r = ((np.arange(panels)[:, None] + (points[None, :] + 1) / 2) * width).ravel()
    weight = np.tile(weights * width / 2, panels) * r
    if surface.tapered:
        weight = weight * taper(r / reach)
    half_d = surface.of(r) / 2
    out = np.empty(k_z.shape)
    for first in range(0, k_z.size, step := max(AT_ONCE // r.size, 1)):
        rows = slice(first, first + step)
        squared = k_z[rows, None] ** 2
        # exp(-a) - exp(-b) as exp(-b) (exp(b - a) - 1) keeps its digits for smooth surfaces.
        left = np.exp(-squared * surface.variance) * np.expm1(
            np.minimum(squared * (surface.variance - half_d[None, :]), 700.0)
        )
        left = np.where(
            squared * surface.variance > 1,
            np.exp(-squared * half_d[None, :]) - np.exp(-squared * surface.variance),
            left,
        )
        out[rows] = (left * j0(2 * math.pi / wavelength * shift[rows, None] * r[None, :])) @ weight
    return np.reshape(2 * math.pi / wavelength**2 * out, np.shape(g.x_r))


def diffracted_along(g: Geometry, found: Lags, variance: float, wavelength: float) -> Values:
    """The same of a surface with a direction: the Fourier transform over lags (y, x) in place of the Hankel transform.

    The plane of incidence is the map's x axis, unless the geometry turns it (phi_i). variance: to which the structure
    function settles [um^2], as that averaged over directions does. Frequencies beyond the map's
    Nyquist frequency are not in it.
    """
    part = np.hypot(*np.meshgrid(found.x / found.x[-1], found.y / found.y[-1]))
    cell = float(np.diff(found.x[:2])[0] * np.diff(found.y[:2])[0])
    weight = taper(np.minimum(part, 1.0)) * (part < 1) * cell
    half_d = np.where(np.isfinite(found.squared), found.squared / 2, variance)
    k_z = np.ravel(2 * math.pi / wavelength * (g.cos_i + g.cos_r) * np.ones(np.shape(g.x_r)))
    along, across = (np.ravel((i + r) * np.ones(np.shape(g.x_r))) for i, r in ((g.x_i, g.x_r), (g.y_i, g.y_r)))
    out = np.empty(k_z.shape)
    for k, (kz, fx, fy) in enumerate(zip(k_z, along / wavelength, across / wavelength, strict=True)):
        left = (np.exp(-(kz**2) * half_d) - math.exp(-(kz**2) * variance)) * weight
        x, y = np.exp(2j * math.pi * fx * found.x), np.exp(2j * math.pi * fy * found.y)
        out[k] = float(np.real(y @ left @ x))
    return np.reshape(out / wavelength**2, np.shape(g.x_r))
