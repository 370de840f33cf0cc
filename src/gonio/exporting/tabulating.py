"""A model as a table in a format of measured data, and how far what is read back is from the model."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.exporting.subject import Subject
from gonio.files import temporary_folder
from gonio.formats.format import Format
from gonio.geometry import Geometry
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import DIRECTIONS, HORIZON, SETS, add_history, flatten, make_scan
from gonio.resampling.hemisphere import WHOLE, exact_reflectances, projected_nodes
from gonio.resampling.holdings import fitted_to, in_order
from gonio.resampling.lobes import HORIZON_AT, LARGEST, Brdf, Lobe, stub
from gonio.resampling.resample import assembled, directions_of, resample
from gonio.resampling.sources import sets_of

Values = npt.NDArray[np.float64]

PAIRS, FEWER = 20_000, 2_000  # random pairs of directions of each set, and of a list, which is slow to look up
STEEPEST = 85.0  # deg: of these pairs; towards the horizon many models have no bound
NEAR = 10.0  # deg from the mirror direction, where half of the pairs are
ALBEDO_AT = (0.0, 45.0, 75.0, 85.0)  # deg
FLAT_LARGEST = 100_000  # values of a list of directions, which has no grid
CHUNK = 200_000  # directions that are evaluated at once
GRIDS = ("netcdf", "zarr")  # formats without a grid of their own that keep that of a scan


@dataclass(frozen=True)
class Error:
    """How far a table as it reads back is from its model.

    rms: the root mean square difference over that of the model, at random pairs, of f cos(theta_i) cos(theta_r): where
    a BRDF has no bound towards grazing, less and less light is meant. log10_rmse: of decimal logarithms of f, where
    both are positive. lost: the share of pairs at which the table has no value. albedo: the largest relative
    difference of the directional-hemispherical reflectance at ALBEDO_AT, NaN for a list of directions, and for means.
    """

    rms: float
    log10_rmse: float
    lost: float
    albedo: float

    @property
    def numbers(self) -> dict[str, float]:
        """The numbers by name, without those that are not known."""
        known = {
            "relative_rms_error": self.rms,
            "log10_rmse": self.log10_rmse,
            "largest_albedo_error": self.albedo,
            "pairs_without_a_value": self.lost,
        }
        return {n: v for n, v in known.items() if math.isfinite(v) and (v or n != "pairs_without_a_value")}


def brdf_of(subject: Subject, label: str) -> Brdf:
    """One set of a model as a function of angles [deg], taken at HORIZON_AT beyond it."""

    def brdf(theta_i: Values, theta_r: Values, phi: Values) -> Values:
        at = (np.minimum(theta_i, 90.0 - 1e-4), np.minimum(theta_r, HORIZON_AT), phi)
        return np.asarray(subject.brdf(Geometry.from_degrees(*at), label), dtype=float) + np.zeros(np.shape(theta_i))

    return brdf


def lobe_of(subject: Subject) -> Lobe:
    """The narrowest lobe of the sets, up to the incidence angle at which all are bounded."""
    lobes = [Lobe.of(brdf_of(subject, label)) for label in subject.sets]
    return Lobe(min(lobe.width for lobe in lobes), min(lobe.last for lobe in lobes))


def table_of(subject: Subject, target: Format, lobe: Lobe, fineness: float = 1.0) -> tuple[xr.Dataset, list[str]]:
    """The model at the directions that the format stores, and what of it the format does not hold, in words.

    Raises ValueError, with the remedy, where the format cannot hold a model of absolute reflection, or its sets.
    """
    largest = LARGEST / len(subject.sets) if target.layout is not None else FLAT_LARGEST / len(subject.sets)
    reduced, left_out = fitted_to(_with_sets(stub(target, lobe, fineness, largest), subject), target)
    onto = reduced if target.layout is None else target.layout(reduced)
    along = [str(n) for n in reduced["brdf"].dims if n in SETS]
    keys = [dict(zip(along, v, strict=True)) for v in product(*(reduced[n].values.tolist() for n in along))]
    columns: dict[str, Values] = {}
    for label in dict.fromkeys(_label(subject, key) for key in keys):
        columns[label] = _column(brdf_of(subject, label), onto, target)
    each = [columns[_label(subject, key)] for key in keys]
    scan = assembled(reduced, onto, directions_of(onto), keys, {"brdf": each})
    scan = scan.assign_attrs(onto.attrs | {"Conventions": "CF-1.11", "symmetry": "isotropic"})
    if "channel" in along and (order := in_order(list(map(str, scan["channel"].values)), target.holds.channels)):
        scan = scan.sel(channel=list(order))
    return scan if target.layout is not None or target.name in GRIDS else _listed(scan), left_out


def _with_sets(directions: xr.Dataset, subject: Subject) -> xr.Dataset:
    """The grid of directions with the sets of the subject, as a scan would have them."""
    if subject.by:
        is_spectral = subject.by == "wavelength"
        labels = np.array([float(v) for v in subject.sets] if is_spectral else list(subject.sets))
        return directions.assign(brdf=directions["brdf"].expand_dims({subject.by: labels}))
    nm = subject.wavelength
    return directions if nm is None else directions.assign_coords(wavelength=((), float(nm), {"units": "nm"}))


def _label(subject: Subject, key: Mapping[str, Any]) -> str:
    """The set of the subject that has this wavelength or channel; the one set stands for every channel."""
    if len(subject.sets) == 1:
        return subject.label
    wanted = key[subject.by]
    return next(v for v in subject.sets if (float(v) == wanted if subject.by == "wavelength" else v == wanted))


def _column(brdf: Brdf, onto: xr.Dataset, target: Format) -> Values:
    """The values (n,) at the directions of a layout, or their means over patches; NaN below the horizon."""
    if target.means is not None:
        means = target.means(onto, lambda theta_i, theta_r, phi, _: brdf(theta_i, theta_r, phi), False)
        return np.ravel(means.values)
    flat = directions_of(onto)
    theta_i, theta_r, phi = (flat[n].values for n in ("theta_i", "theta_r", "phi"))
    above = (theta_i <= HORIZON) & (theta_r <= HORIZON)
    values = np.full(len(theta_i), np.nan)
    values[above] = np.concatenate([np.zeros(0), *_in_chunks(brdf, theta_i[above], theta_r[above], phi[above])])
    return values


def _in_chunks(brdf: Brdf, *angles: Values) -> Iterator[Values]:
    for at in range(0, len(angles[0]), CHUNK):
        yield brdf(*(a[at : at + CHUNK] for a in angles))


def _listed(scan: xr.Dataset) -> xr.Dataset:
    """The values as a list of directions, each once: about the mirror direction all azimuths are one."""
    flat = flatten(scan)
    names = [n for n in (*DIRECTIONS, *SETS) if n in flat.coords]
    columns = [
        np.unique(flat[n].values if n in SETS else flat[n].values.round(6), return_inverse=True)[1] for n in names
    ]
    first = np.unique(np.column_stack(columns), axis=0, return_index=True)[1]
    return flat.isel(direction=np.sort(first))


def told(scan: xr.Dataset, lines: Sequence[str], model: str) -> xr.Dataset:
    """The table with its heading, and with a history by which nothing takes it for a measurement."""
    scan = scan.assign_attrs(provenance="\n".join(line for line in lines if line), simulated=f"simulated from {model}")
    return add_history(scan.assign_attrs(history=""), f"simulated from {model}: evaluated at every direction")


def written(scan: xr.Dataset, target: Format, name: str) -> tuple[bytes, xr.Dataset]:
    """The content of the file that a table becomes, and the scan that it is read back as."""
    assert target.write is not None
    with temporary_folder() as folder:
        path = folder / name
        target.write(scan, path)
        return path.read_bytes(), target.read(path)


def error_of(subject: Subject, read_back: xr.Dataset, seed: int = 1) -> Error:
    """Compare a table as it is read back with the model at random pairs of directions, half of them at the lobe."""
    squares, total, lost, logarithms = 0.0, 0.0, 0, [np.zeros(0)]
    albedo: list[float] = []
    parts = list(sets_of(read_back))
    nodes = [projected_nodes(t) for t in ALBEDO_AT] if is_table(parts[0][1]) else []
    hemispheres = [(t.theta_i, np.minimum(t.theta_r, HORIZON_AT), t.phi) for t, _ in nodes]
    count = PAIRS if is_table(parts[0][1]) else FEWER
    asked = np.concatenate([np.stack(pairs(seed, count)), *(np.stack(angles) for angles in hemispheres)], axis=1)
    for key, part in parts:
        brdf = brdf_of(subject, _of_part(subject, key))
        found, expected = _resampled(part, *asked), brdf(*asked)  # in one call, which triangulates a list only once
        starts = count + np.cumsum([0, *(len(w) for _, w in nodes)])
        for (_, weights), start in zip(nodes, starts, strict=False):
            some = slice(start, start + len(weights))
            albedo += _albedo_error(weights, found[some], expected[some])
        found, expected = found[:count], expected[:count]
        light = np.cos(np.radians(asked[0, :count])) * np.cos(np.radians(asked[1, :count]))
        has = np.isfinite(found)
        error, whole = ((found - expected) * light)[has], (expected * light)[has]
        scale = float(np.max(np.abs(whole), initial=0.0)) or 1.0  # all sets count alike
        squares += float(np.sum((error / scale) ** 2))
        total += float(np.sum((whole / scale) ** 2))
        lost += int((~has).sum())
        both = has & (found > 0) & (expected > 0)
        logarithms.append(np.log10(found[both] / expected[both]))
    every = np.concatenate(logarithms)
    return Error(
        math.sqrt(squares / total) if total else math.nan,
        math.sqrt(float(np.mean(every**2))) if every.size else math.nan,
        lost / (len(parts) * count),
        max(albedo, default=math.nan),
    )


def is_table(part: xr.Dataset) -> bool:
    """Whether values are on a grid and no means: in a list thousands of directions are slow to look up."""
    return part["brdf"].dims != ("direction",) and exact_reflectances(part) is None


def _albedo_error(weights: Values, found: Values, expected: Values) -> list[float]:
    """The relative difference of the reflectances, over directions at which the table has values.

    None where these are less than WHOLE of the hemisphere.
    """
    has = np.isfinite(found)
    whole = float(np.sum((weights * expected)[has]))
    if weights[has].sum() < WHOLE * np.pi or not whole:
        return []
    return [abs(float(np.sum((weights * found)[has])) / whole - 1)]


def _of_part(subject: Subject, key: Mapping[str, Any]) -> str:
    """The set of the subject that a set of the file is; files that store one set under another name have that alone."""
    return _label(subject, key) if subject.by in key or len(subject.sets) == 1 else subject.label


def _resampled(part: xr.Dataset, theta_i: Values, theta_r: Values, phi: Values) -> Values:
    onto = make_scan(theta_i, theta_r, np.zeros(len(theta_i)), phi)
    if "phi_i" in part.coords:
        onto = onto.assign_coords(phi_i=("direction", np.zeros(len(theta_i)), {"units": "degree"}))
    found: Values = resample(part, onto)["brdf"].values
    return np.ravel(found)


def pairs(seed: int, count: int = FEWER) -> tuple[Values, Values, Values]:
    """theta_i, theta_r and phi [deg] of random pairs within STEEPEST, half of them NEAR the mirror direction."""
    random = np.random.default_rng(seed)
    found: list[Values] = []
    for share in (0.5, 0.5):
        theta_i = random.uniform(0.0, STEEPEST, 8 * count)
        if len(found):
            theta_s, phi_s = NEAR * np.sqrt(random.uniform(0, 1, len(theta_i))), random.uniform(0, 360, len(theta_i))
            _, theta_r, phi, _ = SYSTEMS["specular"].directions(theta_i, theta_s, phi_s)
        else:
            theta_r = np.degrees(np.arccos(random.uniform(0, 1, len(theta_i))))
            phi = random.uniform(0.0, 360.0, len(theta_i))
        rows = np.flatnonzero(theta_r <= STEEPEST)[: int(share * count)]
        found.append(np.stack([theta_i[rows], theta_r[rows], phi[rows]]))
    theta_i, theta_r, phi = np.concatenate(found, axis=1)
    return theta_i, theta_r, phi
