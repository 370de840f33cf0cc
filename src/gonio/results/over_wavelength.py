"""The figure of values over wavelength, or over channels, at directions of a scan."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.plotting.panels import FAR_SIDE, first_set, origin_word
from gonio.plotting.style import quantity_of
from gonio.plotting.together.spectrum import Series, spectrum
from gonio.results.view import SAME_ANGLE, Direction, Fits, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = npt.NDArray[np.intp]


def draw_spectrum(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    """Values over wavelength or channel at the directions asked for, or at the brightest of an incidence angle.

    Without directions and incidence angles that is the middle one of the scan.
    Raises ValueError for a scan of one wavelength or channel, and for a direction at which it has no value.
    """
    flat = dataset.points(scan)
    along = next((name for name in dataset.SPECTRAL if name in dataset.sets(flat)), "")
    if not along:
        raise ValueError(
            "spectrum shows several wavelengths or channels, and the scan has one: draw curves, or join the scans of "
            "all wavelengths in one file"
        )
    flat, note = first_set(flat, but=along)
    notes = [note] * bool(note)
    if view.at:
        places = [_at(flat, place) for place in view.at]
    else:
        angles = np.unique(flat["theta_i"].values)
        chosen = angles if view.theta_i else angles[[(len(angles) - 1) // 2]]
        places = [_brightest(flat, angle) for angle in chosen]
        # The title says which direction it is.
        notes.append("brightest direction" + (" of each incidence angle" if len(places) > 1 else ""))
    notes += [FAR_SIDE] * (quantity_of(flat) == "BTDF")
    series = [_series(flat.isel(direction=rows), along, fits) for rows in places]
    return spectrum(
        series,
        along,
        unit=dataset.unit(scan),
        quantity=quantity_of(flat),
        title=title,
        note="; ".join(notes),
        scale=view.scale,
        word=origin_word(scan),
    )


def _at(flat: xr.Dataset, place: Direction) -> Rows:
    """The rows at a direction; ValueError with the nearest one where the scan has no value there."""
    # Without phi_i, which turns the surface below both directions; phi of a direction along the normal means nothing.
    there = _unit_vectors(Geometry.from_degrees(*(flat[name].values for name in dataset.ANGLES)))
    apart = np.linalg.norm(there - _unit_vectors(Geometry.from_degrees(*place)), axis=-1)
    worst = np.degrees(2 * np.arcsin(np.clip(apart / 2, 0, 1))).max(axis=0)
    rows = np.flatnonzero(worst <= SAME_ANGLE)
    if not rows.size:
        nearest = flat.isel(direction=[int(worst.argmin())])
        raise ValueError(f"the scan has no value at {_words(*place)}: the nearest is at {_of(nearest)}")
    return _of_one_turn(flat, rows)


def _unit_vectors(geometry: Geometry) -> npt.NDArray[np.float64]:
    """The two directions of a Geometry (2, points or 1, 3)."""
    flat = [np.atleast_1d(np.asarray(part, dtype=float)) for part in geometry]
    parts = np.broadcast_arrays(*flat)
    return np.stack([np.stack(parts[:3], axis=-1), np.stack(parts[3:], axis=-1)])


def _brightest(flat: xr.Dataset, theta_i: float) -> Rows:
    """The rows at the direction of the largest value of an incidence angle [deg]."""
    here = np.flatnonzero(flat["theta_i"].values == theta_i)
    top = here[int(flat["brdf"].values[here].argmax())]
    names = [name for name in dataset.DIRECTIONS if name in flat.coords]
    same = [np.isclose(flat[n].values[here], flat[n].values[top], rtol=0, atol=SAME_ANGLE) for n in names]
    return here[np.logical_and.reduce(same)]


def _of_one_turn(flat: xr.Dataset, rows: Rows) -> Rows:
    """Of a surface that was turned the rows as it lay first."""
    if "phi_i" not in flat.coords:
        return rows
    turned = flat["phi_i"].values[rows]
    return rows[turned == turned[0]]


def _series(points: xr.Dataset, along: str, fits: Fits) -> Series:
    """The values at one direction in their order, and those of the fits at each wavelength or channel."""
    values = points[along].values
    order = np.argsort(values, kind="stable") if values.dtype.kind in "if" else np.arange(len(values))
    points = points.isel(direction=order)
    first = np.sort(np.unique(points[along].values, return_index=True)[1])
    each = points.isel(direction=first)
    modelled: Mapping[str, Any] = {name: fits[name].brdf(each) for name in sorted(fits)}
    return Series(_of(points), points, each[along].values, modelled)


def _of(points: xr.Dataset) -> str:
    """The direction of the first point in words."""
    words = _words(*(float(points[name].values[0]) for name in dataset.ANGLES))
    return words + (f", φᵢ = {_number(points['phi_i'].values[0])}°" if "phi_i" in points.coords else "")


def _words(theta_i: float, theta_r: float, phi: float) -> str:
    return f"θᵢ = {_number(theta_i)}°, θᵣ = {_number(theta_r)}°, φ = {_number(phi)}°"


def _number(angle: float) -> str:
    return f"{round(float(angle), 2) + 0.0:g}"
