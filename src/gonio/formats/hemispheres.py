"""Tables of values over a hemisphere, one table per incidence: what the formats of Speos and LightTools share.

It has checks for rows of numbers and for axes, the integral of a table over solid angle, and the conversion of tables
to a Dataset and back. The Dataset is dense where every table has the same directions, and a flat scan otherwise.
"""

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import number
from gonio.files import FormatError
from gonio.measured.coordinates import grid, system_of
from gonio.measured.dataset import ABSOLUTE, SETS, flatten, make_scan

Values = npt.NDArray[np.float64]
AXES = ("theta_i", "phi_i", "theta_r", "phi")
SAME = 1e-9  # deg, and relative: numbers that differ by less are one number, printed twice
HUGE = 1e100  # beyond it, sums of values overflow
MOST_INCIDENCES = 60  # more than a goniometer steps through: the scan has directions drawn at random
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # deg; each divides 90


@dataclass(frozen=True)
class Hemisphere:
    """The table of one incidence: values (theta_r, phi), angles [deg], and the set (mode, wavelength, ..)."""

    theta_i: float
    theta_r: Values
    phi: Values
    values: Values
    phi_i: float | None = None
    sets: Mapping[str, str | float] = field(default_factory=dict)
    scalars: Mapping[str, float] = field(default_factory=dict)  # one number per table, kept as a variable


def row(path: Path, line: int, words: Sequence[str], expected: str) -> list[float]:
    """The finite numbers of one line. Raises FormatError with the line and with `expected`, what the numbers are."""
    try:
        values = list(map(float, words))
    except ValueError:
        values = [math.nan]
    if "_" in "".join(words) or not sum(map(abs, values)) < HUGE:  # reads one at a time only where one is wrong
        values = [number(path, line, word, expected) for word in words]
        if beyond := [value for value in values if not -HUGE < value < HUGE]:
            raise FormatError(path, f"{expected} is {beyond[0]:g}: no instrument measures that", f"line {line}")
    return values


def axis(path: Path, line: int, values: Sequence[float], expected: str, low: float, high: float) -> Values:
    """Angles as an array. Raises FormatError for one outside low to high, and where they are not strictly monotonic."""
    angles = np.array(values, dtype=float)
    outside = angles[(angles < low) | (angles > high)]
    if outside.size:
        raise FormatError(path, f"{expected} is {outside[0]:g}, outside {low:g} to {high:g}", f"line {line}")
    steps = np.diff(angles)
    if not ((steps > SAME).all() or (steps < -SAME).all()):
        message = f"{expected} neither ascends nor descends throughout: list each once, in order"
        raise FormatError(path, message, f"line {line}")
    return angles


def is_round(azimuths: Values) -> bool:
    """Whether ascending azimuths [deg] cover the circle: they span 360 deg, or the step that closes it is no wider."""
    span = float(azimuths[-1] - azimuths[0])
    return span >= 360 - SAME or (len(azimuths) > 1 and 360 - span <= np.diff(azimuths).max() + SAME)


def without_closing(azimuths: Values, values: Values) -> tuple[Values, Values]:
    """The azimuths and columns without the last one, where it is 360 deg after the first and has the same values."""
    if len(azimuths) > 1 and abs(azimuths[-1] - azimuths[0] - 360) <= SAME and (values[:, 0] == values[:, -1]).all():
        return azimuths[:-1], values[:, :-1]
    return azimuths, values


def integral(theta: Values, azimuths: Values, values: Values, cosine: bool = True) -> float:
    """The integral of values (theta, azimuth) over solid angle, times cos(theta) where `cosine`.

    Values are linear in both angles [deg] between the nodes, and azimuths cover the circle. Beyond the first and the
    last theta nothing is added. A constant c over theta from 0 to 90 gives pi c with the cosine, 2 pi c without.
    """
    weights, widths = _weights(np.asarray(theta, dtype=float).tobytes(), np.asarray(azimuths, float).tobytes(), cosine)
    return float(weights @ values @ widths)


@functools.lru_cache(maxsize=32)
def _weights(theta: bytes, azimuths: bytes, cosine: bool) -> tuple[Values, Values]:
    """The weight of each node of theta, and the width [rad] of each azimuth; both arguments are float64 in degrees.

    They are cached by the bytes of the nodes, because most tables of a file share their nodes.
    """
    t = np.radians(np.frombuffer(theta))
    once, twice = (-np.cos(2 * t) / 4, -np.sin(2 * t) / 8) if cosine else (-np.cos(t), -np.sin(t))
    slope = np.diff(twice) / np.diff(t)  # a node's weight: the integral of its hat function times sin (times cos)
    weights = np.zeros(len(t))
    weights[:-1] += slope - once[:-1]
    weights[1:] += once[1:] - slope
    p = np.radians(np.frombuffer(azimuths) % 360.0)
    order = np.argsort(p, kind="stable")
    steps = np.diff(p[order], append=p[order[0]] + 2 * np.pi)
    widths = np.empty(len(p))
    widths[order] = (steps + np.roll(steps, 1)) / 2
    return weights, widths


def in_words(numbers: Iterable[float]) -> str:
    """Numbers as text, each with every digit that it needs to be read back unchanged."""
    return " ".join(repr(float(n)).removesuffix(".0") for n in numbers)


def tidy(angles: npt.ArrayLike) -> Values:
    """Angles [deg] rounded to nine decimals, which removes the rounding errors of added and subtracted half turns."""
    return np.round(np.asarray(angles, dtype=float), 9) + 0.0


def turned(angles: npt.ArrayLike) -> Values:
    """Azimuths [deg] reduced to 0 up to, but not including, 360, rounded to nine decimals."""
    return tidy(np.asarray(angles, dtype=float) % 360.0) % 360.0


def dataset(
    tables: Sequence[Hemisphere], unit: str, *, provenance: str, history: Sequence[str], attrs: Mapping[str, str]
) -> xr.Dataset:
    """The tables as one Dataset: dense where all have the same directions, flat otherwise."""
    scan = _dense(tables, unit)
    if scan is None:
        scan = _flat_scan(tables, unit)
        history = [*history, "tables differ in their directions: kept as a flat scan"]
    if not scan["brdf"].values.any():
        history = [*history, "every value is zero"]
    return scan.assign_attrs({"history": "\n".join(history), "provenance": provenance} | dict(attrs))


def _dense(tables: Sequence[Hemisphere], unit: str) -> xr.Dataset | None:
    first = tables[0]
    phi = np.unique(first.phi)
    if len(phi) < len(first.phi) or any(
        not (np.array_equal(t.theta_r, first.theta_r) and np.array_equal(t.phi, first.phi)) for t in tables
    ):
        return None
    keys = [_key(t) for t in tables]
    names = [*(n for n in SETS if n in first.sets), *(n for n in AXES[:2] if n in keys[0])]
    if any(set(key) != set(names) for key in keys):
        return None
    nodes = {n: _nodes(key[n] for key in keys) for n in names}
    place = {n: {value: k for k, value in enumerate(v)} for n, v in nodes.items()}
    shape = tuple(len(v) for v in nodes.values())
    at = {tuple(place[n][key[n]] for n in names): table for key, table in zip(keys, tables, strict=True)}
    if len(at) < len(tables) or len(at) < math.prod(shape):
        return None
    by_theta, by_phi = np.argsort(first.theta_r), np.argsort(first.phi)
    values = np.empty((*shape, len(by_theta), len(by_phi)))
    for index, table in at.items():
        values[index] = table.values[np.ix_(by_theta, by_phi)]
    wide = [n for n in ("theta_i", "theta_r", "phi", "phi_i") if n in (*names, "theta_r", "phi")]
    axes = {**nodes, "theta_r": first.theta_r[by_theta], "phi": phi}
    scan = grid("spherical", **{n: axes[n] for n in wide})
    set_coords = {n: (n, np.array(nodes[n]), {"units": "nm"} if n == "wavelength" else {}) for n in names if n in SETS}
    brdf = xr.Variable((*names, "theta_r", "phi"), values, {"units": unit}).transpose(*set_coords, *wide)
    scalars = {n: _scalars(names, shape, {i: t.scalars[n] for i, t in at.items()}) for n in first.scalars}
    return scan.assign_coords(set_coords).assign({"brdf": brdf} | scalars)


def _key(table: Hemisphere) -> dict[str, str | float]:
    """The coordinates of a table in a dense Dataset."""
    turned = {} if table.phi_i is None else {"phi_i": table.phi_i}
    return {"theta_i": table.theta_i, **turned, **table.sets}


def _nodes(values: Iterable[str | float]) -> list[str | float]:
    """Each value once: numbers in ascending order, names in the order of the file."""
    distinct = list(dict.fromkeys(values))
    return distinct if isinstance(distinct[0], str) else sorted(distinct, key=float)


def _scalars(names: list[str], shape: tuple[int, ...], by_index: Mapping[tuple[int, ...], float]) -> xr.Variable:
    values = np.empty(shape)
    for index, value in by_index.items():
        values[index] = value
    return xr.Variable(names, values, {"units": "1"})


def _flat_scan(tables: Sequence[Hemisphere], unit: str) -> xr.Dataset:
    sizes = [t.values.size for t in tables]

    def repeated(values: Iterable[str | float]) -> npt.NDArray:
        return np.repeat(np.array(list(values)), sizes)

    first = tables[0]
    return make_scan(
        repeated(t.theta_i for t in tables),
        np.concatenate([np.repeat(t.theta_r, len(t.phi)) for t in tables]),
        np.concatenate([t.values.ravel() for t in tables]),
        np.concatenate([np.tile(t.phi, len(t.theta_r)) for t in tables]),
        phi_i=None if first.phi_i is None else repeated(float(t.phi_i or 0) for t in tables),
        unit=unit,
        coordinates={n: repeated(t.sets[n] for t in tables) for n in SETS if n in first.sets},
        variables={n: (repeated(t.scalars[n] for t in tables), "1") for n in first.scalars},
    )


def on_grid(scan: xr.Dataset, sets: Sequence[str], title: str) -> xr.DataArray:
    """The BRDF of a scan on a spherical grid, with dimensions (*sets, *AXES); those that the scan lacks have length 1.

    Raises ValueError for other dimensions, for missing values, and for relative data.
    """
    brdf = scan["brdf"]
    if brdf.attrs.get("units") != ABSOLUTE:
        raise ValueError(f"{title} holds absolute values in sr-1: calibrate the scan first")
    lacking = [name for name in ("theta_i", "theta_r", "phi") if name not in brdf.dims]
    if lacking or set(brdf.dims) - {*sets, *AXES}:
        dimensions = ", ".join(map(str, brdf.dims))
        raise ValueError(
            f"{title} holds a grid of theta_i, theta_r and phi, not of {dimensions}: resample the scan onto it"
        )
    if not np.isfinite(brdf.values).all():
        raise ValueError(f"{title} holds a value at every direction: fill the gaps first")
    for name in (*sets, "phi_i"):
        if name not in brdf.dims:
            known = scan[name].values.ravel()[:1] if name in scan.coords else np.array([np.nan])
            brdf = brdf.drop_vars(name, errors="ignore").expand_dims({name: known})
    return brdf.transpose(*sets, *AXES)


def layout(scan: xr.Dataset, anisotropic: bool) -> xr.Dataset:
    """The spherical grid over the full circle that a file of tables stores for a scan.

    A scan on a spherical grid keeps its axes; azimuths that do not cover the circle are mirrored at the plane of
    incidence. Any other scan gives its incidence angles, theta_r from 0 to 90 and azimuths from 0 to 360 deg, in steps
    near its own. `phi_i` is among the axes only where `anisotropic`.
    """
    names = [n for n in ("theta_i", "theta_r", "phi", "phi_i") if n in scan["brdf"].dims]
    system = system_of(scan)
    if system is not None and system.name == "spherical":
        stored = [n for n in names if n != "phi_i" or anisotropic]
        axes = {n: np.unique(tidy(scan[n].values)) for n in stored}
        if not is_round(axes["phi"]):  # half a circle stands for the other half too
            axes["phi"] = np.unique(turned(np.concatenate([axes["phi"], -axes["phi"]])))
        return grid("spherical", **axes)
    flat = flatten(scan)
    theta_i = np.unique(flat["theta_i"].values.round(6))
    if len(theta_i) > MOST_INCIDENCES:
        theta_i = np.arange(np.ceil(theta_i[0] / 5) * 5, theta_i[-1] + SAME, 5.0)
    axes = {
        "theta_i": theta_i,
        "theta_r": np.arange(0.0, 90.0 + SAME, _step(flat["theta_r"].values)),
        "phi": np.arange(0.0, 360.0, _step(flat["phi"].values)),
    }
    phi_i = np.unique(flat["phi_i"].values.round(6)) if "phi_i" in flat.coords else np.zeros(1)
    if anisotropic and len(phi_i) > 1:
        axes["phi_i"] = phi_i if len(phi_i) <= MOST_INCIDENCES else np.arange(0.0, 360.0, 15.0)
    return grid("spherical", **axes)


def _step(angles: Values) -> float:
    """The step of STEPS that is nearest to the median step between distinct angles [deg]."""
    steps = np.diff(np.unique(angles.round(6)))
    usual = float(np.median(steps)) if steps.size else STEPS[-1]
    return min(STEPS, key=lambda step: abs(step - usual))
