"""How much of the light a table scatters: its directional-hemispherical reflectance, or transmittance.

    R(theta_i) = integral of f cos(theta_r) over the hemisphere

For a format that defines its values over all directions, as a Klems matrix does, the integral is the format's own and
exact. Else f between the directions of the table is what `resample` takes there, and the nodes of the quadrature are
dense about the mirror direction. Directions without a value add nothing: where all values are positive R is then less
than the whole, and more than 1 is impossible all the same. `covered` says how much of the hemisphere has values, by
projected solid angle.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import PARAMETERISATION
from gonio.optics.quadrature import gauss_legendre
from gonio.resampling.interpolation import Targets
from gonio.resampling.resample import without_masked
from gonio.resampling.sources import interpolator_of, sets_of

Values = npt.NDArray[np.float64]

WHOLE = 0.95  # of the hemisphere: a table of so much has a reflectance; of less there is only what it holds
EXCESS = 5e-3  # over 1 that the quadrature and the digits of a file can leave
TIS_FACTOR = 1.25  # between a stated TIS and its table; less is a matter of nodes
MOST_ANGLES, MOST_TURNS, MOST_SETS = 7, 2, 8  # incidence angles, positions of a turned surface, and sets
TYPICAL = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)  # deg: of a table without incidence angles of its own
STEEPEST = 89.5  # deg: at grazing incidence no light falls on the surface
MOST_NODES = 1_000  # incidence angles of a table that are its own; half-difference grids have thousands
GRADED = 7.0  # how much denser nodes are at the mirror direction than opposite to it: e^7/14
NODES = (96, 72)  # in the angle from the mirror direction, and about it


class Reflectance(NamedTuple):
    """The share of the light from one direction that one set of a table scatters into its hemisphere."""

    labels: Mapping[str, Any]  # coordinates of SETS of the set
    theta_i: float  # deg
    phi_i: float  # deg, NaN where the surface was not turned
    value: float
    covered: float  # of the hemisphere, by projected solid angle

    @property
    def where(self) -> str:
        """The direction and the set in words."""
        turned = "" if np.isnan(self.phi_i) else f", phi_i {self.phi_i:g}"
        return ", ".join([*(f"{n} {v}" for n, v in self.labels.items()), f"theta_i {self.theta_i:g}{turned} deg"])


def reflectances(scan: xr.Dataset, most_sets: int = MOST_SETS) -> list[Reflectance]:
    """The reflectance of every set at its incidence angles, MOST_ANGLES of them where there are more.

    Of more than `most_sets` sets those with the largest values are taken. Empty for data that are relative, that are no
    BRDF, or of one plane alone. With reflection and transmission of one side, `mode` is "both" for their sum.
    Raises ValueError for more scattered directions than can be interpolated.
    """
    if dataset.unit(scan) != dataset.ABSOLUTE or scan.attrs.get("quantity"):
        return []
    single = {n: scan[n].values.ravel()[0] for n in dataset.SETS if n in scan.coords and scan[n].size}
    parts = [(single | key, part) for key, part in sets_of(without_masked(scan))]
    if len(parts) > most_sets:
        largest = [float(np.nanmax(part["brdf"].values, initial=-np.inf)) for _, part in parts]
        parts = [parts[k] for k in sorted(np.argsort(largest)[::-1][:most_sets])]
    found = [one for labels, part in parts for one in _of_set(labels, part)]
    return [*found, *_of_both_modes(found)]


def excessive(found: Sequence[Reflectance]) -> Reflectance | None:
    """The largest of those above 1 by more than arithmetic can leave; None where there is none."""
    worst = max(found, key=lambda one: one.value, default=None)
    return worst if worst is not None and worst.value > 1 + EXCESS else None


class Contradiction(NamedTuple):
    """A TIS that a file states, and the integral of its table, at one direction and set."""

    stated: float
    table: Reflectance


def contradictions(scan: xr.Dataset, found: Sequence[Reflectance]) -> list[Contradiction]:
    """Where the variable `tis` of a scan and its table differ by more than TIS_FACTOR and what the table lacks.

    A TIS, the total integrated scatter, is a number that formats such as Zemax BSDF state beside each table. Programs
    scale their tables by it or ignore it, so a file in which both differ means one thing here and another there. Some
    laboratories state it without the cosine, over half the azimuths, or without the specular beam.
    """
    if "tis" not in scan:
        return []
    out = []
    for one in found:
        place: dict[str, Any] = {**one.labels, "theta_i": one.theta_i, "phi_i": one.phi_i}
        tis = scan["tis"]
        for name in tis.dims:
            values = tis[name].values
            if values.dtype.kind == "f":
                same = np.abs(values - place.get(str(name), np.nan)) < 1e-5
            else:
                same = np.array([str(v) == str(place.get(str(name))) for v in values])
            tis = tis.isel({name: int(np.argmax(same))}) if same.any() else tis.isel({name: []})
            if not tis.size:
                break
        if tis.ndim or not np.isfinite(tis.values) or one.labels.get("mode") == "both":
            continue
        stated = float(tis.values)
        if stated > TIS_FACTOR * one.value / min(one.covered, 1.0) or stated * TIS_FACTOR < one.value:
            out.append(Contradiction(stated, one))
    return out


def exact_reflectances(part: xr.Dataset) -> tuple[Values, ...] | None:
    """theta_i, phi_i [deg] and the exact reflectances of one set, by the format's own sums; None where it has none."""
    from gonio.formats import formats

    own = formats().get(part.attrs.get(PARAMETERISATION, ""))
    return own.reflectances(part) if own is not None and own.reflectances is not None else None


def _of_set(labels: Mapping[str, Any], part: xr.Dataset) -> Iterator[Reflectance]:
    """The reflectances of one set: the format's own sums where it has such, else by quadrature at each incidence."""
    if (exact := exact_reflectances(part)) is not None:
        for theta_i, phi_i, value in zip(*exact, strict=True):
            yield Reflectance(labels, float(theta_i), float(phi_i), float(value), 1.0)
        return
    if part["brdf"].dims == ("direction",) and dataset.is_in_plane(part).all():
        return
    between, _ = interpolator_of(part)
    for turn in _chosen(part, "phi_i", MOST_TURNS) or [np.nan]:
        for theta_i in _chosen(part, "theta_i", MOST_ANGLES):
            targets, weights = projected_nodes(theta_i, 0.0 if np.isnan(turn) else turn)
            f = between(targets)
            has = np.isfinite(f)
            if has.any():
                value = float(np.sum(weights[has] * f[has]))
                yield Reflectance(labels, theta_i, turn, value, float(weights[has].sum() / np.pi))


def _chosen(part: xr.Dataset, name: str, most: int) -> list[float]:
    """The table's own angles [deg] or some of them, evenly; typical ones where it has as many as directions."""
    if name not in part.coords:
        return []
    values = part[name].values.ravel()
    values = np.unique(np.round(values[np.isfinite(values)], 6))
    values = values[values <= STEEPEST] if name == "theta_i" else values
    if len(values) > MOST_NODES:
        return [t for t in TYPICAL if values[0] <= t <= values[-1]]
    rows = np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).round().astype(int))
    return [float(v) for v in values[rows]] if len(values) else []


def projected_nodes(theta_i: float, phi_i: float = 0.0) -> tuple[Targets, Values]:
    """Directions (n,) above the horizon at one incidence, and their projected solid angles (n,) of sum pi.

    With u from 0 to 1 the angle from the mirror direction is 180 deg sinh(G u)/sinh(G): its steps grow in proportion to
    the angle itself, so that lobes of a tenth of a degree and of ninety are resolved alike. The horizon cuts these
    circles, and f cos(theta_r) falls to zero there, which leaves an error of the order of a step squared; the sum of
    the weights is set to pi, by which a constant f comes out right.
    """
    x, w = gauss_legendre(NODES[0])
    u = (x + 1) / 2
    theta_s = 180.0 * np.sinh(GRADED * u) / np.sinh(GRADED)
    step = np.pi * GRADED * np.cosh(GRADED * u) / np.sinh(GRADED) * w / 2
    azimuth = 360.0 * (np.arange(NODES[1]) + 0.5) / NODES[1]
    polar, about = (v.ravel() for v in np.meshgrid(theta_s, azimuth, indexing="ij"))
    _, theta_r, phi, _ = SYSTEMS["specular"].directions(np.float64(theta_i), polar, about)
    weights = np.repeat(step * np.sin(np.radians(theta_s)), NODES[1]) * np.cos(np.radians(theta_r))
    above = np.flatnonzero(theta_r < 90.0)
    weights = weights[above]
    full = np.full(len(above), theta_i), theta_r[above], phi[above], np.full(len(above), phi_i)
    return Targets(*full), weights * np.pi / weights.sum()


def _of_both_modes(found: Sequence[Reflectance]) -> Iterator[Reflectance]:
    """Reflection and transmission of light from one side and direction, together."""
    partners: dict[tuple[Any, ...], Reflectance] = {}
    for one in found:
        others = {n: v for n, v in one.labels.items() if n != "mode"}
        key = (*sorted(others.items()), round(one.theta_i, 6), "" if np.isnan(one.phi_i) else round(one.phi_i, 6))
        if "mode" not in one.labels:
            continue
        if key in partners:
            other = partners[key]
            yield one._replace(
                labels={**one.labels, "mode": "both"},
                value=one.value + other.value,
                covered=min(one.covered, other.covered),
            )
        partners[key] = one
