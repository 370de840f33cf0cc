"""Reflectance of facets that carry layers: coherent films and stacks of them, and a clear coat that is thick.

All in real arithmetic: some array libraries have no complex numbers. A complex number is a pair of arrays here, and
angles stay those of the light outside, beta.
"""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Parameter
from gonio.optics.fresnel import TINY, Extinction, Index, refracted
from gonio.optics.kirchhoff import Wavelength

FilmIndex = Annotated[float, Parameter(1.45, 1.0, 3.0, "refractive index of the film")]
Thickness = Annotated[float, Parameter(0.1, 0.0, 2.0, "thickness of the film", "um")]
CoatIndex = Annotated[float, Parameter(1.5, 1.0, 2.2, "refractive index of the clear coat")]


class Layer(NamedTuple):
    """One film: index n + i k, and thickness in the unit of the wavelength."""

    n: Array
    k: Array
    thickness: Array


class _Complex(NamedTuple):
    """A complex number in real arithmetic."""

    real: Array
    imaginary: Array

    def plus(self, other: "_Complex") -> "_Complex":
        return _Complex(self.real + other.real, self.imaginary + other.imaginary)

    def minus(self, other: "_Complex") -> "_Complex":
        return _Complex(self.real - other.real, self.imaginary - other.imaginary)

    def times(self, other: "_Complex") -> "_Complex":
        return _Complex(
            self.real * other.real - self.imaginary * other.imaginary,
            self.real * other.imaginary + self.imaginary * other.real,
        )

    def over(self, other: "_Complex") -> "_Complex":
        squared = other.squared
        # only at grazing, where total reflection meets a resonance of the film
        scale = 1 / namespace(squared).where(squared < TINY, TINY, squared)
        return _Complex(
            (self.real * other.real + self.imaginary * other.imaginary) * scale,
            (self.imaginary * other.real - self.real * other.imaginary) * scale,
        )

    @property
    def squared(self) -> Array:
        """Square of the modulus."""
        return self.real**2 + self.imaginary**2


class _Medium(NamedTuple):
    """q, the index times the cosine of the ray within (`refracted`), and the square of the index."""

    q: _Complex
    squared: _Complex


def _medium(cos_beta: Array, n: Array, k: Array) -> _Medium:
    return _Medium(_Complex(*refracted(cos_beta, n, k)), _Complex(n**2 - k**2, 2 * n * k))


def _boundary(above: _Medium, below: _Medium) -> tuple[_Complex, _Complex]:
    """Amplitudes of s and p that the boundary of two media reflects."""
    across, along = below.squared.times(above.q), above.squared.times(below.q)
    return (
        above.q.minus(below.q).over(above.q.plus(below.q)),
        across.minus(along).over(across.plus(along)),
    )


def _outside(cos_beta: Array) -> _Medium:
    """Air, or vacuum."""
    return _Medium(_Complex(cos_beta, 0 * cos_beta), _Complex(1 + 0 * cos_beta, 0 * cos_beta))


def stack(
    cos_beta: Array, layers: Sequence[Layer], index: Array, extinction: Array, wavelength: Array
) -> tuple[Array, Array]:
    """Reflectances of s and p of coherent films, the outermost first, on a substrate of index n + i k (byrnes2016).

    Parameters
    ----------
    cos_beta : array
        Cosine of the local incidence, outside.
    layers : sequence of Layer
        The films from the outside inwards; without any it is the bare substrate.
    index, extinction : array
        Of the substrate.
    wavelength : array
        In vacuum, in the unit of the thicknesses.

    Returns
    -------
    tuple of array
        |r_s|^2 and |r_p|^2.

    """
    xp = namespace(cos_beta)
    media = [_outside(cos_beta), *(_medium(cos_beta, layer.n, layer.k) for layer in layers)]
    below = _medium(cos_beta, index, extinction)
    amplitudes = _boundary(media[-1], below)
    one = _Complex(1.0, 0.0)
    for above, film, layer in reversed(list(zip(media[:-1], media[1:], layers, strict=True))):
        turns = 4 * math.pi * layer.thickness / wavelength
        fall = xp.exp(-turns * film.q.imaginary)
        there_and_back = _Complex(fall * xp.cos(turns * film.q.real), fall * xp.sin(turns * film.q.real))
        returned = [amplitude.times(there_and_back) for amplitude in amplitudes]
        first = _boundary(above, film)
        amplitudes = tuple(  # type: ignore[assignment]
            r.plus(back).over(one.plus(r.times(back))) for r, back in zip(first, returned, strict=True)
        )
    return amplitudes[0].squared, amplitudes[1].squared


def film(cos_beta: Array, n: Array, thickness: Array, index: Array, extinction: Array, wavelength: Array) -> Array:
    r"""Reflectance of one coherent, transparent film for unpolarised light (byrnes2016).

    .. math::

        \begin{aligned}
        F &= \frac{\lvert r_s\rvert^2 + \lvert r_p\rvert^2}{2} \\
        r_s &= \frac{a_s + b_s\,v}{1 + a_s\,b_s\,v} \\
        r_p &= \frac{a_p + b_p\,v}{1 + a_p\,b_p\,v} \\
        v &= \mathrm{e}^{4\pi\mathrm{i}d\kappa_1/\lambda}
        \end{aligned}

    with the amplitudes of the upper and of the lower face of the film,

    .. math::

        \begin{aligned}
        a_s &= \frac{\cos\beta - \kappa_1}{\cos\beta + \kappa_1} \\
        a_p &= \frac{n_f^2\cos\beta - \kappa_1}{n_f^2\cos\beta + \kappa_1} \\
        b_s &= \frac{\kappa_1 - \kappa_2}{\kappa_1 + \kappa_2} \\
        b_p &= \frac{N^2\kappa_1 - n_f^2\kappa_2}{N^2\kappa_1 + n_f^2\kappa_2} \\
        \kappa_1 &= \sqrt{n_f^2 - \sin^2\beta} \\
        \kappa_2 &= \sqrt{N^2 - \sin^2\beta} \\
        N &= n + \mathrm{i}k
        \end{aligned}

    where :math:`n_f` is the index of the film, d its thickness, and N that of what lies below, n the index and k the
    extinction.
    """
    r_s, r_p = stack(cos_beta, [Layer(n, 0.0, thickness)], index, extinction, wavelength)
    return (r_s + r_p) / 2


def film_of(
    g: Geometry,
    n_f: FilmIndex,
    thickness: Thickness,
    index: Index,
    extinction: Extinction,
    wavelength: Wavelength,
) -> Dimensionless:
    """`film` at the local incidence of a pair of directions: a factor of facets (`fresnel.over_facets`)."""
    return film(g.cos_beta, n_f, thickness, index, extinction, wavelength)


def coat_of(g: Geometry, n_c: CoatIndex, index: Index, extinction: Extinction) -> Dimensionless:
    """`coat` at the local incidence of a pair of directions: a factor of facets (`fresnel.over_facets`)."""
    return coat(g.cos_beta, n_c, index, extinction)


def coat_by_polarisation(cos_beta: Array, n: Array, index: Array, extinction: Array) -> tuple[Array, Array]:
    """Reflectances of s and p of a transparent coat that is thick: the light within it adds without interference."""
    middle = _medium(cos_beta, n, 0.0)
    upper = _boundary(_outside(cos_beta), middle)
    lower = _boundary(middle, _medium(cos_beta, index, extinction))
    r_s, r_p = (_incoherent(one.squared, two.squared) for one, two in zip(upper, lower, strict=True))
    return r_s, r_p


def coat(cos_beta: Array, n: Array, index: Array, extinction: Array) -> Array:
    r"""Reflectance of a transparent coat that is thick, for unpolarised light: reflections within add as intensities.

    .. math::

        \begin{aligned}
        F &= \frac{F_s + F_p}{2} \\
        F_s &= A_s + \frac{(1 - A_s)^2\,\lvert b_s\rvert^2}{1 - A_s\,\lvert b_s\rvert^2} \\
        F_p &= A_p + \frac{(1 - A_p)^2\,\lvert b_p\rvert^2}{1 - A_p\,\lvert b_p\rvert^2}
        \end{aligned}

    with the reflectances of the upper face of the coat and the amplitudes of the lower,

    .. math::

        \begin{aligned}
        A_s &= \left(\frac{\cos\beta - \kappa_1}{\cos\beta + \kappa_1}\right)^2 \\
        A_p &= \left(\frac{n_c^2\cos\beta - \kappa_1}{n_c^2\cos\beta + \kappa_1}\right)^2 \\
        b_s &= \frac{\kappa_1 - \kappa_2}{\kappa_1 + \kappa_2} \\
        b_p &= \frac{N^2\kappa_1 - n_c^2\kappa_2}{N^2\kappa_1 + n_c^2\kappa_2} \\
        \kappa_1 &= \sqrt{n_c^2 - \sin^2\beta} \\
        \kappa_2 &= \sqrt{N^2 - \sin^2\beta} \\
        N &= n + \mathrm{i}k
        \end{aligned}

    where :math:`n_c` is the index of the coat, and N that of what lies below, n the index and k the extinction.
    """
    r_s, r_p = coat_by_polarisation(cos_beta, n, index, extinction)
    return (r_s + r_p) / 2


def _incoherent(upper: Array, lower: Array) -> Array:
    """Reflectance of two faces, whatever passes between them any number of times."""
    lost = 1 - upper * lower
    return upper + (1 - upper) ** 2 * lower / namespace(lost).where(lost < TINY, TINY, lost)
