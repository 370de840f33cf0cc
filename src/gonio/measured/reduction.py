"""From raw goniometer scans to a BRDF: the blank subtracted, shadowed directions left out, repeats averaged.

A repeat is a value of the same set (wavelength, channel, mode, ..) at the same direction, phi_i included: a surface
that was turned under the beam is another geometry. At theta_r = 0 all azimuths are one direction. What is equal by a
symmetry of the surface alone, its mirror images, is averaged only where that is asked for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import DIRECTIONS, SETS, add_history, make_scan, points, signed_theta_r, unit

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]
DECIMALS = 6  # of a degree, to which equal directions agree
UNCERTAINTIES = ("uncertainty", "uncertainty_systematic")


@dataclass(frozen=True)
class Shadow:
    """Where a receiver blocks the beam: near the incident direction within so many degrees, near its plane."""

    along: float = 10.0  # deg of signed theta_r about -theta_i
    azimuth: float = 30.0  # deg about the plane of incidence

    def holds(self, scan: xr.Dataset) -> npt.NDArray[np.bool_]:
        """Which directions of a flat scan are shadowed; none of transmission, where the receiver is behind."""
        signed = signed_theta_r(scan)
        from_plane = np.abs((scan["phi"].values + 90.0) % 180.0 - 90.0)
        near = np.abs(signed + scan["theta_i"].values) <= self.along + 1e-9
        shadowed = near & (from_plane <= self.azimuth + 1e-9)
        return shadowed & (scan["mode"].values != "transmission") if "mode" in scan.coords else shadowed


@dataclass(frozen=True)
class _Readings:
    """The readings of one or more scans, one a row.

    sets: columns of SETS by name. angles: theta_i, theta_r, phi, phi_i (n, 4), rounded so that equal ones compare
    equal, phi_i 0 where no surface was turned. brdf: values. stated, systematic: their standard uncertainties, NaN
    where none is known; the second is common to all readings.
    """

    sets: Mapping[str, npt.NDArray[np.generic]]
    angles: Array
    brdf: Array
    stated: Array
    systematic: Array


def turned(scan: xr.Dataset, phi_i: float) -> xr.Dataset:
    """The flat scan of a sample that lay turned: `phi_i` [deg] is the azimuth of the incident light on its surface.

    For sheets that do not hold the angle of the stage. ValueError where the scan states phi_i itself.
    """
    flat = points(scan)
    if "phi_i" in flat.coords:
        raise ValueError(f"{_origin(scan)}: phi_i is stated in the file: leave it out of the command")
    column = ("direction", np.full(flat.sizes["direction"], phi_i % 360.0), {"units": "degree"})
    return add_history(flat.assign_coords(phi_i=column), f"the sample lay turned: phi_i is {phi_i % 360.0:g} deg")


def reduce(
    samples: Sequence[xr.Dataset],
    blank: xr.Dataset | None = None,
    *,
    floor: bool = False,
    shadow: Shadow | None = Shadow(),
    mirror: bool = False,
) -> xr.Dataset:
    """The BRDF of a sample from raw scans: blank subtracted, shadowed directions left out, repeats averaged.

    From each scan the blank's value at the same direction is subtracted. Repeats are averaged over all scans; at
    theta_r = 0 each plane counts once, and the scatter is that between planes.

    Parameters
    ----------
    samples : sequence of xarray.Dataset
        Raw scans of one sample.
    blank : xarray.Dataset, optional
        The raw scan without a sample.
    floor : bool
        Whether the least signal that is left, of pi f cos(theta_r), is subtracted from all signals of the scan too, as
        krell2026 does to set a detector's zero. Since the true zero may lie anywhere down to none subtracted, that
        signal over sqrt(3) becomes an uncertainty common to all readings of the scan (a rectangular distribution).
    shadow : Shadow, optional
        Where the receiver blocks the beam; None where it never does.
    mirror : bool
        Whether directions on both sides of the plane of incidence are repeats, as on an isotropic surface; of a turned
        one, phi_i is mirrored too.

    Returns
    -------
    xarray.Dataset
        `brdf` [1/sr]; `uncertainty` [1/sr] of the mean, the scatter of n values over sqrt(n), or what the stated
        uncertainties give where that is more or n is 1, missing where neither is known; and `repeats`, n.

    Raises
    ------
    ValueError
        There is no sample, blank and samples differ in their directions or units, or samples differ in what they name.

    """
    if not samples:
        raise ValueError("there is no scan to reduce: give one or more samples")
    if len({unit(s) for s in [*samples, *([blank] if blank is not None else [])]}) > 1:
        raise ValueError("samples and blank differ in their units: read them from the same kind of file")
    flats = [points(sample) for sample in samples]
    names = _common_names(flats)
    blanks = None if blank is None else _Blank(points(blank), names)
    pieces = [_piece(flat, blanks, floor, shadow) for flat in flats]
    readings = _joined([readings for readings, _ in pieces])
    if not len(readings.brdf):
        raise ValueError("no direction is left: every one is shadowed or masked")
    averaged, count = _averaged(readings, mirror)
    scan = _scan(averaged, count, "phi_i" in names, unit(samples[0]))
    scan.attrs["provenance"] = "\n".join(_common(samples))
    if mirror and "phi_i" not in names:
        scan.attrs["symmetry"] = "isotropic"
    for line in _steps(samples, blank, floor, shadow, sum(out for _, out in pieces)):
        scan = add_history(scan, line)
    return add_history(scan, _averaging(int(count.max()), mirror, "uncertainty" in scan))


def _common_names(flats: Sequence[xr.Dataset]) -> tuple[str, ...]:
    """What tells one reading's geometry from the next: coordinates that all samples have; ValueError where they differ.

    A sample without phi_i may lie in any position under one with it, so neither is a repeat of the other.
    """
    names = [{n for n in (*SETS, "phi_i") if n in flat.coords} for flat in flats]
    if odd := {n for some in names for n in some if not all(n in others for others in names)}:
        name = min(odd)
        remedy = "say how each sample was turned (phi_i)" if name == "phi_i" else "reduce them apart"
        raise ValueError(f"some samples name {name} and some do not, so their values are no repeats: {remedy}")
    return tuple(n for n in (*SETS, "phi_i") if n in names[0])


def _common(samples: Sequence[xr.Dataset]) -> list[str]:
    """The lines of provenance, each once."""
    return list(dict.fromkeys(line for s in samples for line in s.attrs.get("provenance", "").splitlines()))


def _origin(scan: xr.Dataset) -> str:
    past = scan.attrs.get("history", "").splitlines()
    return next((line.removeprefix("read from ") for line in past if line.startswith("read from ")), "a scan")


def _steps(
    samples: Sequence[xr.Dataset], blank: xr.Dataset | None, floor: bool, shadow: Shadow | None, out: int
) -> list[str]:
    steps = [f"reduced {', '.join(_origin(s) for s in samples)}"]
    steps += [f"subtracted the blank, {_origin(blank)}"] if blank is not None else []
    if floor:
        steps += [
            "subtracted the least signal of each scan as the detector's zero: "
            "uncertainty_systematic holds that signal over sqrt(3)"
        ]
    if shadow is not None:
        near = f"within {shadow.along:g} deg of the incident direction and {shadow.azimuth:g} deg of its plane"
        steps += [f"left out {out} values {near}, where the receiver shadows the beam"]
    dropped = {str(n) for s in samples for n in s.data_vars} - {"brdf", "mask", "line", *UNCERTAINTIES}
    steps += [f"left out {', '.join(sorted(dropped))}: columns of single readings"] if dropped else []
    return steps


def _averaging(most: int, mirror: bool, is_known: bool) -> str:
    """The last step in words."""
    what = "repeats and mirror images" if mirror else "repeats"
    if most == 1:
        return f"no {what} to average: each direction was read once"
    return f"averaged {what}, up to {most} values each" + ("; uncertainties are of the mean" if is_known else "")


def _readings(flat: xr.Dataset, names: Sequence[str]) -> _Readings:
    zero = np.zeros(flat.sizes["direction"])
    angles = np.column_stack([flat[a].values.astype(float) if a in flat.coords else zero for a in DIRECTIONS])
    angles[:, 2:] %= 360.0
    angles = np.round(angles, DECIMALS) + 0.0
    angles[:, 2:] %= 360.0
    stated, systematic = (
        flat[n].values.astype(float) if n in flat else np.full(len(zero), np.nan) for n in UNCERTAINTIES
    )
    sets = {n: flat[n].values for n in names if n in SETS}
    return _Readings(sets, angles, flat["brdf"].values.astype(float), stated, systematic)


def _keys(readings: _Readings, names: Sequence[str]) -> list[tuple[object, ...]]:
    """What a reading and its blank have in common, one tuple a row; phi_i only where the blank was turned too."""
    columns = readings.angles.tolist() if "phi_i" in names else readings.angles[:, :3].tolist()
    labels = [values.tolist() for values in readings.sets.values()]
    sets = zip(*labels, strict=True) if labels else [()] * len(columns)
    return [(*one, *angles) for one, angles in zip(sets, columns, strict=True)]


class _Blank:
    """The blank's values by direction: several where a direction was measured more than once."""

    def __init__(self, flat: xr.Dataset, names: Sequence[str]) -> None:
        if odd := {n for n in SETS if n in flat.coords} ^ (set(names) - {"phi_i"}):
            raise ValueError(f"the blank and the samples do not both name {min(odd)}: measure the blank as the samples")
        self.names = [n for n in names if n in flat.coords]
        readings = _readings(flat, self.names)
        self.found: dict[tuple[object, ...], list[tuple[float, float]]] = {}
        variances = np.nan_to_num(readings.stated**2)
        for key, *value in zip(_keys(readings, self.names), readings.brdf.tolist(), variances.tolist(), strict=True):
            self.found.setdefault(key, []).append((value[0], value[1]))

    def of(self, readings: _Readings) -> Array:
        """The value and its variance at each reading (n, 2).

        The second reading of a direction takes the blank's second, if there is one.
        """
        used: dict[tuple[object, ...], int] = {}
        out = []
        for key in _keys(readings, self.names):
            if key not in self.found:
                labels = zip((*readings.sets, *DIRECTIONS), key, strict=False)
                place = ", ".join(f"{n} {v:g}" if isinstance(v, float) else f"{n} {v}" for n, v in labels)
                raise ValueError(f"the blank has no value at {place} deg: measure it at the directions of the sample")
            turn = used[key] = used.get(key, -1) + 1
            out.append(self.found[key][turn % len(self.found[key])])
        return np.array(out).reshape(-1, 2)


def _piece(flat: xr.Dataset, blank: _Blank | None, floor: bool, shadow: Shadow | None) -> tuple[_Readings, int]:
    """The readings of one scan that are left, and how many were shadowed."""
    readings = _readings(flat, [n for n in (*SETS, "phi_i") if n in flat.coords])
    brdf, stated, systematic = readings.brdf, readings.stated, readings.systematic
    if blank is not None:
        of_blank = blank.of(readings)
        brdf, stated = brdf - of_blank[:, 0], np.sqrt(stated**2 + of_blank[:, 1])
    if floor and len(brdf):
        signal_of_one = np.pi * np.cos(np.radians(readings.angles[:, 1]))
        zero = (brdf * signal_of_one).min() / signal_of_one
        brdf, systematic = brdf - zero, np.hypot(np.nan_to_num(systematic), np.abs(zero) / np.sqrt(3))
    kept = ~shadow.holds(flat) if shadow is not None else np.ones(len(brdf), dtype=bool)
    changed = _Readings(readings.sets, readings.angles, brdf, stated, systematic)
    return _rows(changed, np.flatnonzero(kept)), int((~kept).sum())


def _rows(readings: _Readings, rows: Rows) -> _Readings:
    sets = {n: values[rows] for n, values in readings.sets.items()}
    columns = (readings.angles, readings.brdf, readings.stated, readings.systematic)
    return _Readings(sets, *(values[rows] for values in columns))


def _joined(pieces: Sequence[_Readings]) -> _Readings:
    sets = {n: np.concatenate([p.sets[n] for p in pieces]) for n in pieces[0].sets}
    return _Readings(
        sets,
        np.concatenate([p.angles for p in pieces]),
        np.concatenate([p.brdf for p in pieces]),
        np.concatenate([p.stated for p in pieces]),
        np.concatenate([p.systematic for p in pieces]),
    )


def _averaged(readings: _Readings, mirror: bool) -> tuple[_Readings, Array]:
    """One reading a direction, in order, with the uncertainty of the mean as stated; and how many values it is of."""
    angles = readings.angles.copy()
    if mirror:
        mirrored = -angles[:, 2:] % 360.0
        is_less = (mirrored[:, 1] < angles[:, 3]) | ((mirrored[:, 1] == angles[:, 3]) & (mirrored[:, 0] < angles[:, 2]))
        angles[:, 2:] = np.where(is_less[:, None], mirrored, angles[:, 2:])
    normal = angles[:, 1] == 0
    angles[normal, 2] %= 180.0
    folded = _Readings(readings.sets, angles, readings.brdf, readings.stated, readings.systematic)
    planes, count = _grouped(folded)
    normal = planes.angles[:, 1] == 0
    if not normal.any():
        return planes, count
    at_normal = planes.angles * np.where(normal[:, None], [1.0, 1.0, 0.0, 1.0], 1.0)
    merged = _Readings(planes.sets, at_normal, planes.brdf, planes.stated, planes.systematic)
    out, of_planes = _grouped(merged, count)
    return out, of_planes


def _grouped(readings: _Readings, repeats: Array | None = None) -> tuple[_Readings, Array]:
    """Distinct directions: the mean of each, its uncertainty, and the number of values.

    repeats: how many values each reading is the mean of already; a group of one keeps that, and its uncertainty.
    """
    codes = [np.unique(values, return_inverse=True)[1].ravel() for values in readings.sets.values()]
    keys = np.column_stack([*codes, readings.angles])
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group)
    mean = np.bincount(group, readings.brdf) / count
    squares = np.bincount(group, (readings.brdf - mean[group]) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        scatter = np.where(count > 1, np.sqrt(squares / (count - 1) / count), np.nan)
    stated = np.sqrt(np.bincount(group, readings.stated**2)) / count
    systematic = np.bincount(group, readings.systematic) / count
    kept = count.astype(float) if repeats is None else np.where(count > 1, count, repeats[first])
    averaged = _rows(readings, first)
    return _Readings(averaged.sets, averaged.angles, mean, np.fmax(scatter, stated), systematic), kept


def _scan(readings: _Readings, count: Array, turned: bool, units: str) -> xr.Dataset:
    theta_i, theta_r, phi, phi_i = readings.angles.T
    variables: dict[str, tuple[npt.ArrayLike, str]] = {"repeats": (count, "1")}
    if np.isfinite(readings.systematic).any():
        variables["uncertainty_systematic"] = (readings.systematic, units)
    return make_scan(
        theta_i,
        theta_r,
        readings.brdf,
        phi,
        phi_i=phi_i if turned else None,
        uncertainty=readings.stated if np.isfinite(readings.stated).any() else None,
        unit=units,
        coordinates=readings.sets,
        variables=variables,
    )
