"""Albedo of one surface, a model with values or a fit: black-, white- and blue-sky, and NBAR, with its uncertainty."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.albedo.integrals import QUADRATURE, black_sky_of_terms, nadir_of_terms, refuse_method, white_sky_of_terms
from gonio.fitting.certainty.band import propagate
from gonio.fitting.certainty.sets import mixture
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.model import Model

Values = npt.NDArray[np.float64]
Terms = Callable[[Mapping[str, Any]], Mapping[str, Any]]  # shape parameters to the number (angles,) of every term


@dataclass(frozen=True)
class Albedo:
    """Albedos with their standard uncertainties, of the shape of the angles.

    uncertainty: from the covariance of the fit; 0 for values given by hand. systematic: NaN where no scan states it.
    """

    value: Any
    uncertainty: Any
    systematic: Any


def black_sky(
    surface: Model | Solution,
    theta_i: Any,
    values: Mapping[str, float] | None = None,
    *,
    select: Mapping[str, Any] | None = None,
    method: str = QUADRATURE,
    nodes: int = 0,
) -> Albedo:
    """Black-sky albedo: the directional-hemispherical reflectance, under the sun alone.

    Parameters
    ----------
    surface : Model or Solution
        A model with `values`, or a fit of absolute data.
    theta_i : float or array_like
        Angles of the sun from the normal [deg], 0 to below 90.
    values : mapping, optional
        Of a model, by the names of its parameters.
    select : mapping, optional
        Of a fit with several sets which one, {"channel": "G"}, or several with their weights in the band.
    method : str
        `quadrature`, for any model; `modis`, the polynomials of the MODIS product, for `ross-li` alone, which err by
        0.018 at 40 deg and 0.075 at 80 deg in the volume kernel (lucht2000).
    nodes : int
        Of the quadrature in each angle; 0 takes as many as the terms need.

    Returns
    -------
    Albedo
        Of the shape of `theta_i`.

    Raises
    ------
    ValueError
        The model has no such method, a lobe is too narrow for the quadrature, or the fit is relative.

    """
    angles = np.asarray(theta_i, dtype=float)
    flat = angles.ravel().tolist()
    of_terms = functools.partial(_black, _model(surface), flat, method, nodes)
    return _shaped(_summed(surface, values, select, of_terms), angles.shape)


def white_sky(
    surface: Model | Solution,
    values: Mapping[str, float] | None = None,
    *,
    select: Mapping[str, Any] | None = None,
    method: str = QUADRATURE,
    nodes: int = 0,
) -> Albedo:
    """White-sky albedo: the bihemispherical reflectance under an even sky. Arguments and errors as of `black_sky`."""
    of_terms = functools.partial(_white, _model(surface), method, nodes)
    return _shaped(_summed(surface, values, select, of_terms), ())


def blue_sky(
    surface: Model | Solution,
    theta_i: Any,
    diffuse: Any,
    values: Mapping[str, float] | None = None,
    *,
    select: Mapping[str, Any] | None = None,
    method: str = QUADRATURE,
    nodes: int = 0,
) -> Albedo:
    """Blue-sky albedo: (1 - D) of the black-sky one and D of the white-sky one, with D the diffuse share of the light.

    diffuse: D, 0 to 1, one number or one for each angle; the sky counts as even. The rest, and errors, as of
    `black_sky`.
    """
    angles, share = np.broadcast_arrays(np.asarray(theta_i, dtype=float), np.asarray(diffuse, dtype=float))
    if not ((share >= 0) & (share <= 1)).all():
        raise ValueError("the diffuse share of the light is outside 0 to 1")
    of_terms = functools.partial(_blue, _model(surface), angles.ravel().tolist(), share.ravel(), method, nodes)
    return _shaped(_summed(surface, values, select, of_terms), angles.shape)


def nbar(
    surface: Model | Solution,
    theta_i: Any,
    values: Mapping[str, float] | None = None,
    *,
    select: Mapping[str, Any] | None = None,
) -> Albedo:
    """Nadir BRDF-adjusted reflectance: the reflectance factor pi f seen from the nadir, the sun at theta_i [deg].

    The other arguments, and errors, as of `black_sky`.
    """
    angles = np.asarray(theta_i, dtype=float)
    flat, model = angles.ravel().tolist(), _model(surface)
    return _shaped(_summed(surface, values, select, lambda shape: nadir_of_terms(model, shape, flat)), angles.shape)


def _model(surface: Model | Solution) -> Model:
    return surface.model if isinstance(surface, Solution) else surface


def _black(model: Model, angles: list[float], method: str, nodes: int, shape: Mapping[str, Any]) -> Mapping[str, Any]:
    return black_sky_of_terms(model, shape, angles, method, nodes)


def _white(model: Model, method: str, nodes: int, shape: Mapping[str, Any]) -> Mapping[str, Any]:
    return {name: np.array([value]) for name, value in white_sky_of_terms(model, shape, method, nodes).items()}


def _blue(
    model: Model, angles: list[float], diffuse: Values, method: str, nodes: int, shape: Mapping[str, Any]
) -> Mapping[str, Any]:
    refuse_method(method, model)
    white = white_sky_of_terms(model, shape, method, nodes)
    black = black_sky_of_terms(model, shape, angles, method, nodes)
    return {name: (1 - diffuse) * black[name] + diffuse * white[name] for name in model.terms}


def _summed(
    surface: Model | Solution, values: Mapping[str, float] | None, select: Mapping[str, Any] | None, of_terms: Terms
) -> Albedo:
    """The weighted sum of what every term gives (angles,), with its uncertainty where it is a fit's."""
    weighted = _Weighted(_model(surface), of_terms)
    if isinstance(surface, Model):
        if select:
            raise ValueError("select chooses a set of a fit, and this is a model")
        surface.basis(
            Geometry.from_degrees(0.0, 0.0, 0.0), {n: v for n, v in (values or {}).items() if n not in surface.weights}
        )
        if not any(n in surface.weights for n in values or {}):
            raise ValueError(f"{surface.name}: give at least one weight: {', '.join(surface.weights)}")
        found = weighted(values or {})
        return Albedo(found, np.zeros_like(found), np.full_like(found, np.nan))
    if values:
        raise ValueError("values belong to a model, and a fit has its own")
    if surface.unit != dataset.ABSOLUTE:
        raise ValueError("the data are relative: without a calibration there is no albedo")
    mixed = mixture(surface, select or {}, "the surface")

    def of_values(all_values: Values) -> Values:
        parts = [w * weighted({n: float(all_values[k]) for n, k in at.items()}) for w, at in mixed]
        return np.sum(parts, axis=0)

    band = propagate(surface, of_values, {k for _, at in mixed for k in at.values()})
    return Albedo(band.value, band.uncertainty, band.systematic)


class _Weighted:
    """The weighted sum over terms; the integrals of a shape are kept, for derivatives by weights need no others."""

    def __init__(self, model: Model, of_terms: Terms) -> None:
        self._model, self._of_terms = model, of_terms
        self._kept: dict[tuple[float, ...], Mapping[str, Any]] = {}

    def __call__(self, values: Mapping[str, float]) -> Values:
        shape = {n: values[n] for n in self._model.shape if n in values}
        key = tuple(shape.values())
        if key not in self._kept:
            self._kept[key] = self._of_terms(shape)
        terms = self._kept[key]
        return np.sum([values[name] * terms[name] for name in self._model.weights if name in values], axis=0)


def _shaped(found: Albedo, shape: tuple[int, ...]) -> Albedo:
    """Numbers for a single angle, else arrays of the shape of the angles."""
    parts = [np.asarray(one).reshape(shape) for one in (found.value, found.uncertainty, found.systematic)]
    return Albedo(*(float(one) if not shape else one for one in parts))
