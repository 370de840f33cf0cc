"""The F-operator of ISO 25178-2: the form that is taken off a height map, a plane by default."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.topography.heights import Values, values, with_values

HIGHEST = 10  # degree of a form: more follows waviness, which filters take away
BLOCK = 2**18  # points at once


def level(heights: xr.Dataset, degree: int = 1) -> xr.Dataset:
    """Take a polynomial off a height map, fitted by least squares to the points in use.

    Parameters
    ----------
    heights : xarray.Dataset
        The map.
    degree : int
        Total degree in x and y, 0 to 10: 0 is the mean, 1 a plane, 2 a paraboloid, which takes off a sphere too.

    Returns
    -------
    xarray.Dataset
        The map without it, of mean 0.

    Raises
    ------
    ValueError
        The degree is outside 0 to 10, or the map has too few points for it.

    """
    if not 0 <= degree <= HIGHEST:
        raise ValueError(f"a form of degree {degree} is none: give 0 (mean) to {HIGHEST}, 1 for a plane")
    z = values(heights)
    terms = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    if min(z.shape) <= degree or np.isfinite(z).sum() <= len(terms):
        raise ValueError(f"a map of {z.shape[1]} x {z.shape[0]} points is too small for a form of degree {degree}")
    name = {0: "its mean", 1: "a least-squares plane"}.get(degree, f"a polynomial of degree {degree}")
    return with_values(heights, z - _form(z, terms), f"took off {name}")


def _form(z: Values, terms: list[tuple[int, int]]) -> Values:
    """The polynomial (y, x) by normal equations; Legendre polynomials over -1..1 keep them well conditioned."""
    degree = max(i for i, _ in terms)
    ends = (np.linspace(-1, 1, n) for n in (z.shape[1], z.shape[0]))
    along: list[Any] = [np.polynomial.legendre.legvander(at, degree) for at in ends]
    products, right = np.zeros((len(terms), len(terms))), np.zeros(len(terms))
    for rows in _blocks(z.shape):
        design = _design(along, terms, rows)
        used = np.isfinite(z[rows]).ravel()
        products += design[:, used] @ design[:, used].T
        right += design[:, used] @ z[rows].ravel()[used]
    try:
        weights = np.linalg.solve(products, right)
    except np.linalg.LinAlgError as error:
        raise ValueError("the points in use do not determine the form: take off one of a lower degree") from error
    form = np.empty(z.shape)
    for rows in _blocks(z.shape):
        form[rows] = (weights @ _design(along, terms, rows)).reshape(form[rows].shape)
    return form


def _blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    step = max(BLOCK // shape[1], 1)
    return (slice(first, first + step) for first in range(0, shape[0], step))


def _design(along: list[Any], terms: list[tuple[int, int]], rows: slice) -> npt.NDArray[np.float64]:
    """Every polynomial at the points of some rows (terms, points)."""
    x, y = along[0], along[1][rows]
    return np.stack([np.outer(y[:, j], x[:, i]).ravel() for i, j in terms])
