"""What verifies a set-up, as guo2023 draws it: a mirror (Fig 6) and a diffuse standard (Fig 7)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gonio.measured import dataset
from gonio.optics.fresnel import reflectances
from gonio.plotting.style import MEASURED, THETA_R, colour, heading, house_style, line_style, new_figure
from gonio.units import unit_label
from gonio.verification import Compared, Mirrored

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def mirror_figure(found: Sequence[Mirrored], n: float, k: float, title: str = "") -> "Figure":
    """Reflectances over the incidence angle: dots as measured, lines by Fresnel's equations for n + ik."""
    angles = np.linspace(0, 89, 179)
    r_s, r_p, *_ = reflectances(np.cos(np.radians(angles)), n, k)
    curves = {"s": r_s, "p": r_p, "unpolarised": (r_s + r_p) / 2, "unknown": (r_s + r_p) / 2}
    with house_style():
        figure = new_figure(5.6, 4.0)
        ax = figure.subplots()
        for j, one in enumerate(found):
            ax.plot(angles, curves[one.polarisation], **line_style(j), label=f"{one.polarisation}, Fresnel")
            style = MEASURED | {"color": colour(j), "markersize": 4}
            ax.plot(one.theta_i, one.measured, **style, label=f"{one.polarisation}, measured")
        ax.set_xlabel("θᵢ [deg]")
        ax.set_ylabel("reflectance [1]")
        ax.legend()
        heading(figure, title)
    return figure


def diffuse_figure(found: Compared, title: str = "") -> "Figure":
    """The product f cos(theta_r) over theta_r: dots as measured, lines the certified curve at the same directions."""
    points, signed = found.points, found.theta_r
    cosine = np.cos(np.radians(signed))
    with house_style():
        figure = new_figure(5.6, 4.0)
        ax = figure.subplots()
        for j, theta_i in enumerate(np.unique(points["theta_i"].values)):
            rows = np.flatnonzero(points["theta_i"].values == theta_i)
            rows = rows[np.argsort(signed[rows], kind="stable")]
            certified = points["other"].values[rows] * cosine[rows]
            ax.plot(signed[rows], certified, **line_style(j), label=f"θᵢ = {theta_i:g}°, certified")
            style = MEASURED | {"color": colour(j), "markersize": 4}
            measured = points["brdf"].values[rows] * cosine[rows]
            ax.plot(signed[rows], measured, **style, label=f"θᵢ = {theta_i:g}°, measured")
        ax.set_xlabel(THETA_R)
        ax.set_ylabel(f"f cos θᵣ [{unit_label(dataset.unit(points))}]")
        ax.legend()
        heading(figure, title)
    return figure
