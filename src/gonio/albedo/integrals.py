"""The albedo of every term of a model: by quadrature, or by the polynomials of the MODIS product where it has them.

Black-sky is the directional-hemispherical reflectance at one angle of the sun, white-sky the bihemispherical one under
an even sky. A model is a weighted sum of terms, and so is its albedo: the integral of each term, times its weight.
"""

import functools
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.model import Model
from gonio.optics.quadrature import gauss_legendre
from gonio.options import one_of
from gonio.outside import printable

Values = npt.NDArray[np.float64]

QUADRATURE, MODIS = "quadrature", "modis"
METHODS = (QUADRATURE, MODIS)
NODES = (48, 96, 200, 400)  # of quadratures, each tried where the one before depends on its nodes
COARSER, SAME, LEAST = 0.7, 1e-5, 1e-6  # converged if this share of the nodes changes it by no more, relative or at all
INCIDENCES = 48  # nodes over the sun's angle of the white-sky albedo
NARROW = "a lobe is too narrow for the quadrature: gonio check --samples draws directions instead"


def refuse_method(method: str, model: Model) -> None:
    """ValueError for a method that is not known, or that is of another model."""
    if method not in METHODS:
        raise ValueError(f"there is no method {printable(method)!r}: choose {one_of(METHODS)}")
    if method == MODIS and model.name != _modis()["model"]:
        raise ValueError(f"the polynomials of MODIS are of the kernels of {_modis()['model']}, and not of {model.name}")


def black_sky_of_terms(
    model: Model, shape: Mapping[str, Any], theta_i: Sequence[float], method: str = QUADRATURE, nodes: int = 0
) -> dict[str, Values]:
    """The black-sky albedo (angles,) of every term, by weight, at sun angles [deg] from 0 to below 90.

    nodes: of the quadrature in each angle; 0 takes as many as the terms need. Raises ValueError for a lobe that is too
    narrow, and for a method that the model does not have.
    """
    refuse_method(method, model)
    if not all(0 <= angle < 90 for angle in theta_i):
        raise ValueError("an angle of the sun is outside 0 to below 90 deg")
    if method == MODIS:
        t = np.radians(np.asarray(theta_i, dtype=float))
        return {n: np.polynomial.polynomial.polyval(t, [g[0], 0.0, *g[1:]]) for n, g in _modis_terms("black").items()}
    fixed = tuple(sorted((n, float(v)) for n, v in shape.items()))
    columns = [_black_sky(model, fixed, float(angle), nodes) for angle in theta_i]
    return {name: np.array([column[name] for column in columns]) for name in model.terms}


def white_sky_of_terms(
    model: Model, shape: Mapping[str, Any], method: str = QUADRATURE, nodes: int = 0
) -> dict[str, float]:
    """The white-sky albedo of every term, by weight; errors as of `black_sky_of_terms`."""
    refuse_method(method, model)
    if method == MODIS:
        return {name: float(value) for name, value in _modis_terms("white").items()}
    return dict(_white_sky(model, tuple(sorted((n, float(v)) for n, v in shape.items())), nodes))


@functools.lru_cache(maxsize=64)
def _white_sky(model: Model, shape: tuple[tuple[str, float], ...], nodes: int) -> dict[str, float]:
    """The white-sky albedo of every term by quadrature over the sun's angle too."""
    x, w = gauss_legendre(INCIDENCES)
    angles = 45 * (x + 1)
    weights = w * (math.pi / 4) * np.sin(2 * np.radians(angles))

    def over_angles(count: int) -> dict[str, float]:
        columns = [_integrals(model, dict(shape), float(angle), count) for angle in angles]
        return {name: float(sum(weights * [column[name] for column in columns])) for name in model.terms}

    return over_angles(nodes) if nodes else _settled(over_angles)


def nadir_of_terms(model: Model, shape: Mapping[str, Any], theta_i: Sequence[float]) -> dict[str, Values]:
    """The reflectance factor, pi times every term (angles,), seen from the nadir, as NBAR is stated."""
    angles = np.asarray(theta_i, dtype=float)
    basis = model.basis(Geometry.from_degrees(angles, np.zeros_like(angles), np.zeros_like(angles)), shape)
    return {name: np.pi * np.broadcast_to(np.asarray(term, dtype=float), angles.shape) for name, term in basis.items()}


@functools.lru_cache(maxsize=512)
def _black_sky(model: Model, shape: tuple[tuple[str, float], ...], theta_i: float, nodes: int) -> dict[str, float]:
    """The black-sky albedo of every term at one angle of the sun."""

    def at_angle(count: int) -> dict[str, float]:
        return _integrals(model, dict(shape), theta_i, count)

    return at_angle(nodes) if nodes else _settled(at_angle)


def _settled(integrals: Callable[[int], dict[str, float]]) -> dict[str, float]:
    """The integrals by the fewest nodes of NODES that none depends on; ValueError where one depends on all."""
    for nodes in NODES:
        fine, coarse = integrals(nodes), integrals(int(COARSER * nodes))
        if all(math.isclose(fine[n], coarse[n], rel_tol=SAME, abs_tol=LEAST) for n in fine):
            return fine
    raise ValueError(NARROW)


def _integrals(model: Model, shape: Mapping[str, Any], theta_i: float, nodes: int) -> dict[str, float]:
    """The integral of every term times cos(theta_r) over the hemisphere."""
    geometry, weights = _hemisphere(theta_i, nodes)
    basis = model.basis(geometry, shape)
    return {name: float(np.sum(weights * np.asarray(term))) for name, term in basis.items()}


@functools.lru_cache(maxsize=64)
def _hemisphere(theta_i: float, nodes: int) -> tuple[Geometry, Values]:
    """Directions of a Gauss-Legendre quadrature, dense about the plane of incidence, and weights with cos(theta_r)."""
    x, w = gauss_legendre(nodes)
    half, v = gauss_legendre(nodes // 2)
    azimuths = np.concatenate([90 * (half + 1), 90 * (half + 1) + 180])
    theta_r, phi = (a.ravel() for a in np.meshgrid(45 * (x + 1), azimuths, indexing="ij"))
    weights = np.outer(w, np.tile(v, 2)).ravel() * (math.pi / 4) * (math.pi / 2) * np.sin(2 * np.radians(theta_r)) / 2
    return Geometry.from_degrees(np.full_like(theta_r, theta_i), theta_r, phi), weights


@functools.cache
def _modis() -> dict[str, Any]:
    return tomllib.loads(files(__package__).joinpath("modis.toml").read_text(encoding="utf-8"))


def _modis_terms(sky: str) -> dict[str, Any]:
    return {name: entry[sky] for name, entry in _modis()["terms"].items()}
