"""Generalised Harvey-Shack scatter theory of a surface with Gaussian height autocorrelation."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import DIFFRACTED, CorrelationLength, Wavelength, diffracted

RmsHeight = Annotated[float, Parameter(0.05, 0.001, 10.0, "rms height of the surface", "um")]


@drawn_by(DIFFRACTED)
def scattered(
    g: Geometry,
    sigma: RmsHeight,
    length: CorrelationLength,
    index: Index,
    extinction: Extinction,
    wavelength: Wavelength,
) -> PerSteradian:
    r"""Scatter of any roughness and angle, without the light in the mirror direction (krywonos2011; formulas 7.7).

    .. math::

        f_s = F(\beta)\,K

    where F is Fresnel's reflectance (:func:`.unpolarised`) and K the light diffracted by heights of rms sigma and
    correlation length :math:`\ell` (:func:`.diffracted`).
    """
    return unpolarised(g.cos_beta, index, extinction) * diffracted(g, sigma, length, wavelength)


generalised_harvey_shack = Model(
    name="generalised-harvey-shack",
    title="Generalised Harvey-Shack",
    cite="krywonos2011",
    terms={"scale": scattered},
    confidence="reconstructed",
)
