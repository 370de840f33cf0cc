"""Beckmann and Kirchhoff's scalar theory of a surface with Gaussian height autocorrelation."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import DIFFRACTED, CorrelationLength, Wavelength, diffracted, kirchhoff_obliquity

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
    r"""Scatter in the Kirchhoff approximation, without the light in the mirror direction (beckmann1963; formulas 7.7).

    Very rough surfaces reflect like Beckmann's facets of total slope 2 sigma/length.

    .. math::

        f_s = F(\beta)\,O\,K

    where F is Fresnel's reflectance (:func:`.unpolarised`), O the obliquity (:func:`.kirchhoff_obliquity`) and K the
    light diffracted by heights of rms sigma and correlation length :math:`\ell` at the wavelength :math:`\lambda`
    (:func:`.diffracted`).
    """
    return (
        unpolarised(g.cos_beta, index, extinction) * kirchhoff_obliquity(g) * diffracted(g, sigma, length, wavelength)
    )


beckmann_kirchhoff = Model(
    name="beckmann-kirchhoff",
    title="Beckmann-Kirchhoff, Gaussian heights",
    cite="beckmann1963",
    terms={"scale": scattered},
    violates={"energy": "nothing is masked, so that rough surfaces near grazing reflect more than arrives"},
)
