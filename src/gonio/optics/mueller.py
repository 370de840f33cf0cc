"""Mueller matrices of light that facets reflect (formulas 1 and 6.5), in real arithmetic.

Stokes parameters are (|Es|^2 + |Ep|^2, |Es|^2 - |Ep|^2, 2 Re(Es Ep*), 2 Im(Es* Ep)), with s = k x z/|k x z| and
p = k x s on both rays; k is the direction of travel, -w_i and w_r, z the surface normal. A ray along z is taken to lie
in the plane of the surface's x axis.
"""

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.optics.fresnel import reflectances

OPPOSITE = 1e-12  # squared sine of 2 beta below which the rotations are those of exact opposition


def reflection(g: Geometry, n: Array, k: Array) -> Array:
    r"""Mueller matrix (..., 4, 4) of a smooth facet of index n + i k whose normal is the half vector (priest2002).

    It depolarises nothing. Both rotations into the facet's plane of incidence come from vectors, so that no direction
    but exact opposition is singular; there the facet's s and p axes are those of the surface.

    .. math::

        \begin{aligned}
        M &= T(-\varepsilon_r)\,M_F\,T(\varepsilon_i) \\
        M_F &= \begin{pmatrix} A & B & 0 & 0 \\ B & A & 0 & 0 \\ 0 & 0 & C & S \\ 0 & 0 & -S & C \end{pmatrix} \\
        T(\varepsilon) &= \begin{pmatrix} 1 & 0 & 0 & 0 \\ 0 & \cos 2\varepsilon & -\sin 2\varepsilon & 0 \\
        0 & \sin 2\varepsilon & \cos 2\varepsilon & 0 \\ 0 & 0 & 0 & 1 \end{pmatrix} \\
        A &= \frac{\lvert r_s\rvert^2 + \lvert r_p\rvert^2}{2} \\
        B &= \frac{\lvert r_s\rvert^2 - \lvert r_p\rvert^2}{2} \\
        C &= \operatorname{Re}(r_s\,\overline{r_p}) \\
        S &= \operatorname{Im}(r_s\,\overline{r_p}) \\
        r_s &= \frac{\cos\beta - \kappa}{\cos\beta + \kappa} \\
        r_p &= \frac{N^2\cos\beta - \kappa}{N^2\cos\beta + \kappa} \\
        \kappa &= \sqrt{N^2 - \sin^2\beta} \\
        N &= n + \mathrm{i}k
        \end{aligned}

    The rotations from the surface's plane of incidence to the facet's are

    .. math::

        \begin{aligned}
        \varepsilon_i &= -\operatorname{sgn}(\sin\varphi)
        \arccos\left(\frac{\cos\alpha - \cos\theta_i\cos\beta}{\sin\theta_i\sin\beta}\right) \\
        \varepsilon_r &= -\operatorname{sgn}(\sin\varphi)
        \arccos\left(\frac{\cos\alpha - \cos\theta_r\cos\beta}{\sin\theta_r\sin\beta}\right)
        \end{aligned}

    where n is the index and k the extinction.
    """
    xp = namespace(g.cos_beta)
    r_s, r_p, real, imaginary = reflectances(g.cos_beta, n, k)
    mean, half = (r_s + r_p) / 2, (r_s - r_p) / 2
    (cos_i, sin_i), (cos_r, sin_r) = _rotations(g)
    none = 0 * mean
    return xp.stack(
        [
            _row(mean, half * cos_i, -half * sin_i, none),
            _row(
                half * cos_r,
                mean * cos_r * cos_i + real * sin_r * sin_i,
                real * sin_r * cos_i - mean * cos_r * sin_i,
                imaginary * sin_r,
            ),
            _row(
                -half * sin_r,
                real * cos_r * sin_i - mean * sin_r * cos_i,
                mean * sin_r * sin_i + real * cos_r * cos_i,
                imaginary * cos_r,
            ),
            _row(none, -imaginary * sin_i, -imaginary * cos_i, real),
        ],
        axis=-2,
    )


def _row(*elements: Array) -> Array:
    return namespace(elements[0]).stack(elements, axis=-1)


def _rotations(g: Geometry) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Cosine and sine of twice the angle between surface and facet axes, for the arriving and the leaving ray."""
    x = g.y_r * g.z_i - g.z_r * g.y_i
    y = g.z_r * g.x_i - g.x_r * g.z_i
    z = g.x_r * g.y_i - g.y_r * g.x_i
    squared = x * x + y * y + z * z
    opposite = squared < OPPOSITE
    u_i, v_i, sin_i = _azimuth(g.x_i, g.y_i)
    u_r, v_r, sin_r = _azimuth(g.x_r, g.y_r)
    # components of the facet's s axis along the surface's s and p axes; the s axes of the two rays point opposite ways
    along_i, across_i = y * u_i - x * v_i, g.z_i * (x * u_i + y * v_i) - sin_i * z
    along_r, across_r = x * v_r - y * u_r, g.z_r * (x * u_r + y * v_r) - sin_r * z
    return _doubled(along_i, across_i, opposite), _doubled(along_r, across_r, opposite)


def _azimuth(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Unit vector of the azimuth, the x axis at the pole, and the sine of the polar angle."""
    xp = namespace(x)
    squared = x * x + y * y
    pole = squared == 0
    sine = xp.sqrt(xp.where(pole, 1.0, squared))
    return xp.where(pole, 1.0, x / sine), xp.where(pole, 0.0, y / sine), xp.where(pole, 0.0, sine)


def _doubled(along: Array, across: Array, opposite: Array) -> tuple[Array, Array]:
    """Both across components are minus the sine: of the arriving rotation, and of the leaving one."""
    xp = namespace(along)
    squared = xp.where(opposite, 1.0, along**2 + across**2)
    cos = xp.where(opposite, 1.0, (along**2 - across**2) / squared)
    return cos, xp.where(opposite, 0.0, -2 * along * across / squared)
