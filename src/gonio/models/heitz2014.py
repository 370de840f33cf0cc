"""Facets of a surface with a grain: two widths, the azimuth of their axes, and Smith's masking at every azimuth."""

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian, drawn_by
from gonio.models.walter2007 import Tail
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_elliptical, draw_elliptical_student
from gonio.optics.facets import beckmann_slopes, ggx_slopes, reflected, student_slopes
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.grain import AlongAxes, Azimuth, SlopeX, SlopeY, WidthX, WidthY, along_axes, grain_azimuth
from gonio.optics.masking import (
    elliptical_beckmann_lambda,
    elliptical_ggx_lambda,
    elliptical_student_lambda,
    smith,
)
from gonio.optics.sampling import FacetNormals, VisibleGGX


@drawn_by(AlongAxes(FacetNormals(beckmann_slopes, draw_elliptical, of=lambda m_x, m_y, **_: (m_x, m_y))))
def beckmann_grain_facets(
    g: Geometry, m_x: SlopeX, m_y: SlopeY, psi: Azimuth, index: Index, extinction: Extinction
) -> PerSteradian:
    r"""Gaussian slopes of two widths, Smith's masking, Fresnel (heitz2014smith).

    .. math::

        \begin{aligned}
        f_s &= \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r} \\
        D &= \frac{\exp(-t_x^2/m_x^2 - t_y^2/m_y^2)}{\pi m_x m_y\cos^4\alpha} \\
        G &= \frac{1}{1 + \Lambda(q_i) + \Lambda(q_r)} \\
        \Lambda(q) &= \frac{\operatorname{erf}(q) - 1}{2} + \frac{\exp(-q^2)}{2q\sqrt{\pi}} \\
        q_i &= \frac{z_i}{\sqrt{m_x^2 u_i^2 + m_y^2 v_i^2}} \\
        q_r &= \frac{z_r}{\sqrt{m_x^2 u_r^2 + m_y^2 v_r^2}}
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`), and the slopes t and the components u and v are along axes
    at the azimuth :math:`\psi` (:func:`.along_axes`).
    """
    seen = along_axes(g, psi)
    masking = smith(
        elliptical_beckmann_lambda(seen.x_i, seen.y_i, seen.cos_i, m_x, m_y),
        elliptical_beckmann_lambda(seen.x_r, seen.y_r, seen.cos_r, m_x, m_y),
    )
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, beckmann_slopes(seen, m_x, m_y), masking)


@drawn_by(AlongAxes(VisibleGGX(ggx_slopes, of=lambda w_x, w_y, **_: (w_x, w_y))))
def ggx_grain_facets(
    g: Geometry, w_x: WidthX, w_y: WidthY, psi: Azimuth, index: Index, extinction: Extinction
) -> PerSteradian:
    r"""GGX slopes of two widths, Smith's masking, Fresnel (heitz2014smith).

    .. math::

        \begin{aligned}
        f_s &= \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r} \\
        D &= \frac{1}{\pi w_x w_y\cos^4\alpha\,(1 + E)^2} \\
        E &= t_x^2/w_x^2 + t_y^2/w_y^2 \\
        G &= \frac{1}{1 + \Lambda_i + \Lambda_r} \\
        \Lambda_i &= \frac{1}{2}\left(\sqrt{1 + \frac{w_x^2 u_i^2 + w_y^2 v_i^2}{z_i^2}} - 1\right) \\
        \Lambda_r &= \frac{1}{2}\left(\sqrt{1 + \frac{w_x^2 u_r^2 + w_y^2 v_r^2}{z_r^2}} - 1\right)
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`), and the slopes t and the components u and v are along axes
    at the azimuth :math:`\psi` (:func:`.along_axes`).
    """
    seen = along_axes(g, psi)
    masking = smith(
        elliptical_ggx_lambda(seen.x_i, seen.y_i, seen.cos_i, w_x, w_y),
        elliptical_ggx_lambda(seen.x_r, seen.y_r, seen.cos_r, w_x, w_y),
    )
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, ggx_slopes(seen, w_x, w_y), masking)


STUDENT = FacetNormals(student_slopes, draw_elliptical_student, of=lambda w_x, w_y, c, **_: (w_x, c, w_y))


@drawn_by(AlongAxes(STUDENT))
def student_grain_facets(
    g: Geometry, w_x: WidthX, w_y: WidthY, psi: Azimuth, c: Tail, index: Index, extinction: Extinction
) -> PerSteradian:
    r"""Student's t slopes of two widths, their exact Smith masking, Fresnel (ribardiere2017).

    .. math::

        \begin{aligned}
        f_s &= \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r} \\
        D &= \frac{1}{\pi w_x w_y\cos^4\alpha\,(1 + E)^c} \\
        E &= \frac{t_x^2/w_x^2 + t_y^2/w_y^2}{c - 1} \\
        G &= \frac{1}{1 + \Lambda(q_i) + \Lambda(q_r)} \\
        \Lambda(q) &= A\left(\frac{(c - 1)^c}{2c - 3}\,S_1(q) + \sqrt{c - 1}\,S_2(q)\right) - \frac{1}{2} \\
        A &= \frac{\Gamma(c - 1/2)}{\Gamma(c)\,\sqrt{\pi}} \\
        S_1(q) &= \frac{(c - 1 + q^2)^{3/2 - c}}{q} \\
        S_2(q) &= \int_0^q \left(1 + \frac{u^2}{c - 1}\right)^{1/2 - c}\,\mathrm{d}u \\
        q_i &= \frac{z_i}{\sqrt{w_x^2 u_i^2 + w_y^2 v_i^2}} \\
        q_r &= \frac{z_r}{\sqrt{w_x^2 u_r^2 + w_y^2 v_r^2}}
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`), :math:`\Gamma` the gamma function, and the slopes t and the
    components u and v are along axes at the azimuth :math:`\psi` (:func:`.along_axes`).
    """
    seen = along_axes(g, psi)
    masking = smith(
        elliptical_student_lambda(seen.x_i, seen.y_i, seen.cos_i, w_x, w_y, c),
        elliptical_student_lambda(seen.x_r, seen.y_r, seen.cos_r, w_x, w_y, c),
    )
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, student_slopes(seen, w_x, c, w_y), masking)


GRAIN = {"azimuth of the grain": grain_azimuth("w_x", "w_y")}

beckmann_grain = Model(
    name="beckmann-grain",
    title="Gaussian facets of two widths, grain",
    cite="heitz2014smith",
    terms={"rho_s": beckmann_grain_facets, "rho_d": lambertian},
    combinations={"azimuth of the grain": grain_azimuth("m_x", "m_y")},
    for_turned=True,
)

ggx_grain = Model(
    name="ggx-grain",
    title="GGX facets of two widths, grain",
    cite="heitz2014smith",
    terms={"rho_s": ggx_grain_facets, "rho_d": lambertian},
    combinations=GRAIN,
    for_turned=True,
)

student_t_grain = Model(
    name="student-t-grain",
    title="Student-t facets of two widths, grain",
    cite="ribardiere2017",
    terms={"rho_s": student_grain_facets, "rho_d": lambertian},
    combinations=GRAIN,
    for_turned=True,
)
