"""Polarised light: reflected Stokes vectors, their degree and angle of polarisation, and the emissivity of a surface.

Stokes parameters and their bases are those of `gonio.optics.mueller`: s is horizontal, p lies in the plane of the ray
and the surface normal.
"""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.model import Model
from gonio.optics.quadrature import gauss_legendre

Values = npt.NDArray[np.float64]
UNPOLARISED = (1.0, 0.0, 0.0, 0.0)
NODES = (100, 200, 400, 800)
CONVERGED = 1e-4
IMPOSSIBLE = 1e-9  # excess of the degree of polarisation over 1 that rounding can leave


def stokes(values: npt.ArrayLike) -> Values:
    """Four Stokes parameters (..., 4) that light can have; ValueError where the degree of polarisation exceeds 1."""
    vector = np.asarray(values, dtype=float)
    if vector.shape[-1:] != (4,) or not np.isfinite(vector).all():
        raise ValueError(f"Stokes parameters are four finite numbers I, Q, U, V, not {values!r}")
    intensity, polarised = vector[..., 0], np.linalg.norm(vector[..., 1:], axis=-1)
    if (intensity < 0).any() or (polarised > intensity * (1 + IMPOSSIBLE)).any():
        raise ValueError(f"no light has the Stokes parameters {values!r}: I must be at least sqrt(Q^2 + U^2 + V^2)")
    return vector


def reflected(mueller: Values, incident: npt.ArrayLike = UNPOLARISED) -> Values:
    """Stokes vector after a Mueller matrix.

    Parameters
    ----------
    mueller : array
        Mueller matrices (..., 4, 4), such as `Model.mueller` gives [1/sr].
    incident : array_like
        Stokes vector (..., 4) of the incident light; unpolarised unless given.

    Returns
    -------
    array
        Stokes vectors (..., 4): radiance per irradiance [1/sr] for a BRDF.

    """
    out: Values = np.einsum("...jk,...k->...j", mueller, stokes(incident))
    return out


def degree_of_linear_polarisation(vector: Values) -> Values:
    """Linearly polarised share of light.

    Parameters
    ----------
    vector : array
        Stokes vectors (..., 4).

    Returns
    -------
    array
        0 to 1; NaN where there is no light.

    """
    with np.errstate(invalid="ignore", divide="ignore"):
        share: Values = np.hypot(vector[..., 1], vector[..., 2]) / vector[..., 0]
    return share


def angle_of_linear_polarisation(vector: Values) -> Values:
    """Angle of the linear polarisation from the s axis towards the p axis (formulas 6.5).

    Parameters
    ----------
    vector : array
        Stokes vectors (..., 4).

    Returns
    -------
    array
        -90 to 90 [deg].

    """
    angle: Values = np.degrees(np.arctan2(vector[..., 2], vector[..., 1])) / 2
    return angle


def emissivity(model: Model, values: Mapping[str, float], theta_r: float) -> Values:
    """Stokes emissivity of an opaque surface, by Kirchhoff's law (formulas 6.9).

    What does not arrive in theta_r from an unpolarised hemisphere of unit radiance is emitted: 1 - int f00
    cos(theta_i) and -int f_j0 cos(theta_i). Gauss-Legendre nodes in theta_i and phi are doubled until no component
    changes by 1e-4.

    Parameters
    ----------
    model : Model
        A model with Mueller terms.
    values : mapping
        Its weights and shape parameters.
    theta_r : float
        The direction [deg] of emission.

    Returns
    -------
    array
        The Stokes vector (4,).

    Raises
    ------
    ValueError
        The model has no polarisation, its lobe is too narrow for the quadrature, or more light is reflected than
        arrives.

    """
    arriving = _arriving(model, values, theta_r, NODES[0])
    for nodes in NODES[1:]:
        coarser, arriving = arriving, _arriving(model, values, theta_r, nodes)
        if np.max(np.abs(arriving - coarser)) < CONVERGED:
            break
    else:
        raise ValueError(f"the lobe of {model.name} is too narrow to integrate over the hemisphere: widen it")
    if arriving[0] > 1:
        raise ValueError(
            f"{model.name} reflects {arriving[0]:.4g} of a uniform hemisphere towards {theta_r:g} deg: "
            "more than arrives leaves nothing to emit; choose smaller weights"
        )
    return np.array(UNPOLARISED) - arriving


def _arriving(model: Model, values: Mapping[str, float], theta_r: float, nodes: int) -> Values:
    """Stokes vector that leaves towards theta_r under an unpolarised hemisphere of unit radiance."""
    x, w = gauss_legendre(nodes)
    half, v = gauss_legendre(nodes // 2)
    theta_i, phi = np.meshgrid(45 * (x + 1), np.concatenate([90 * (half + 1), 90 * (half + 1) + 180]), indexing="ij")
    i = np.radians(theta_i)
    weights = np.outer(w, np.tile(v, 2)) * (math.pi / 4) * (math.pi / 2) * np.cos(i) * np.sin(i)
    matrices = np.asarray(model.mueller(Geometry.from_degrees(theta_i, np.full_like(theta_i, theta_r), phi), values))
    arriving: Values = np.einsum("tp,tpj->j", weights, matrices[..., 0])
    return arriving
