"""From raw goniometer scans to a BRDF: the blank subtracted, shadowed directions left out, repeats averaged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import add_history, make_scan, points, signed_theta_r, unit

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Shadow:
    """Where a receiver blocks the beam: near the incident direction within so many degrees, near its plane."""

    along: float = 10.0  # deg of signed theta_r about -theta_i
    azimuth: float = 30.0  # deg about the plane of incidence

    def holds(self, scan: xr.Dataset) -> npt.NDArray[np.bool_]:
        """Which directions of a flat scan are shadowed."""
        signed = signed_theta_r(scan)
        from_plane = np.abs((scan["phi"].values + 90.0) % 180.0 - 90.0)
        near = np.abs(signed + scan["theta_i"].values) <= self.along + 1e-9
        return near & (from_plane <= self.azimuth + 1e-9)


def reduce(
    samples: Sequence[xr.Dataset],
    blank: xr.Dataset | None = None,
    *,
    floor: bool = True,
    shadow: Shadow | None = Shadow(),
) -> xr.Dataset:
    """The BRDF of an isotropic sample from raw scans at the same directions (the recipe of krell2026).

    Of each scan's signal, pi f cos(theta_r), the blank's is subtracted; with `floor` also the least value that is
    left, which sets the detector's zero; shadowed directions are left out. Values at one direction or its mirror image
    in the plane of incidence are averaged over all scans: a turned sample is a repeat. At theta_r = 0 all azimuths are
    one direction: each plane counts once, and the scatter is that between planes. `uncertainty` [1/sr] is that of the
    mean, the scatter of n values over sqrt(n), missing where n is 1. ValueError where there is no sample, or where
    blank and samples differ in their directions.
    """
    if not samples:
        raise ValueError("there is no scan to reduce: give one or more samples")
    if len({unit(s) for s in [*samples, *([blank] if blank is not None else [])]}) > 1:
        raise ValueError("samples and blank differ in their units: read them from the same kind of file")
    flats = [points(sample) for sample in samples]
    blanks = _signals(points(blank)) if blank is not None else {}
    pieces = [_piece(flat, blanks, blank is not None, floor, shadow) for flat in flats]
    angles = np.concatenate([piece[0] for piece in pieces])
    signal = np.concatenate([piece[1] for piece in pieces])
    if not len(signal):
        raise ValueError("no direction is left: every one is shadowed or masked")
    directions, mean, error, count = _averaged(angles, signal)
    shadowed = sum(piece[2] for piece in pieces)
    per_signal = np.pi * np.cos(np.radians(directions[:, 1]))
    scan = make_scan(
        directions[:, 0],
        directions[:, 1],
        mean / per_signal,
        directions[:, 2],
        uncertainty=error / per_signal if np.isfinite(error).any() else None,
        unit=unit(samples[0]),
        variables={"repeats": (count, "1")},
        provenance="\n".join(_common(samples)),
    ).assign_attrs(symmetry="isotropic")
    for line in _steps(samples, blank, floor, shadow, shadowed, int(count.max())):
        scan = add_history(scan, line)
    return scan


def _common(samples: Sequence[xr.Dataset]) -> list[str]:
    """The lines of provenance, each once."""
    return list(dict.fromkeys(line for s in samples for line in s.attrs.get("provenance", "").splitlines()))


def _origin(scan: xr.Dataset) -> str:
    past = scan.attrs.get("history", "").splitlines()
    return next((line.removeprefix("read from ") for line in past if line.startswith("read from ")), "a scan")


def _steps(
    samples: Sequence[xr.Dataset], blank: xr.Dataset | None, floor: bool, shadow: Shadow | None, out: int, most: int
) -> list[str]:
    steps = [f"reduced {', '.join(_origin(s) for s in samples)}"]
    steps += [f"subtracted the blank, {_origin(blank)}"] if blank is not None else []
    steps += ["subtracted the least signal of each scan"] if floor else []
    if shadow is not None:
        near = f"within {shadow.along:g} deg of the incident direction and {shadow.azimuth:g} deg of its plane"
        steps += [f"left out {out} values {near}, where the receiver shadows the beam"]
    return [
        *steps,
        f"averaged repeats and mirrored directions, up to {most} values each; uncertainties are of the mean",
    ]


def _signal(flat: xr.Dataset) -> Array:
    """The signal, pi f cos(theta_r)."""
    return np.asarray(flat["brdf"].values * np.pi * np.cos(np.radians(flat["theta_r"].values)), dtype=float)


def _keys(flat: xr.Dataset) -> Array:
    """Directions as rows (n, 3), rounded so that equal ones compare equal."""
    columns = np.column_stack([flat[a].values.astype(float) for a in ("theta_i", "theta_r", "phi")])
    columns[:, 2] %= 360.0
    return np.asarray(np.round(columns, 6) + 0.0)


def _signals(blank: xr.Dataset) -> dict[tuple[float, ...], Array]:
    """The blank's signals by direction: several where a direction was measured more than once."""
    found: dict[tuple[float, ...], list[float]] = {}
    for key, value in zip(map(tuple, _keys(blank).tolist()), _signal(blank).tolist(), strict=True):
        found.setdefault(key, []).append(value)
    return {key: np.array(values) for key, values in found.items()}


def _piece(
    flat: xr.Dataset, blanks: dict[tuple[float, ...], Array], subtract: bool, floor: bool, shadow: Shadow | None
) -> tuple[Array, Array, int]:
    """Directions (n, 3), signals (n) and how many were shadowed."""
    keys, signal = _keys(flat), _signal(flat)
    if subtract:
        signal = signal - _of_blank(keys, blanks)
    if floor and len(signal):
        signal = signal - signal.min()
    kept = ~shadow.holds(flat) if shadow is not None else np.ones(len(signal), dtype=bool)
    return keys[kept], signal[kept], int((~kept).sum())


def _of_blank(keys: Array, blanks: dict[tuple[float, ...], Array]) -> Array:
    """The blank's signal at each direction; the second measurement of one takes the blank's second, if there is one."""
    used: dict[tuple[float, ...], int] = {}
    found = np.empty(len(keys))
    for i, key in enumerate(map(tuple, keys.tolist())):
        if key not in blanks:
            place = ", ".join(
                f"{name} {angle:g}" for name, angle in zip(("theta_i", "theta_r", "phi"), key, strict=True)
            )
            raise ValueError(f"the blank has no value at {place} deg: measure it at the directions of the sample")
        turn = used[key] = used.get(key, -1) + 1
        found[i] = blanks[key][turn % len(blanks[key])]
    return found


def _averaged(angles: Array, signal: Array) -> tuple[Array, Array, Array, Array]:
    """Directions (m, 3) in order, the mean signal, its uncertainty and the number of values."""
    folded = angles.copy()
    normal = folded[:, 1] == 0
    folded[:, 2] = np.where(normal, folded[:, 2] % 180.0, np.minimum(folded[:, 2], 360.0 - folded[:, 2]))
    directions, mean, error, count = _grouped(folded, signal)
    if not (normal := directions[:, 1] == 0).any():
        return directions, mean, error, count
    planes = np.where(normal[:, None], directions * [1, 1, 0], directions)
    one, its_mean, its_error, its_count = _grouped(planes[normal], mean[normal])
    alone = its_count == 1  # where there is one plane, the scatter is that of its repeats
    its_error = np.where(alone, _grouped(planes[normal], error[normal])[1], its_error)
    its_count = np.where(alone, _grouped(planes[normal], count[normal])[1], its_count)
    merged = (
        np.concatenate([directions[~normal], one]),
        np.concatenate([mean[~normal], its_mean]),
        np.concatenate([error[~normal], its_error]),
        np.concatenate([count[~normal], its_count]),
    )
    order = np.lexsort(merged[0].T[::-1])
    return merged[0][order], merged[1][order], merged[2][order], merged[3][order]


def _grouped(keys: Array, values: Array) -> tuple[Array, Array, Array, Array]:
    """Distinct rows, and the mean, its standard uncertainty (missing for one value) and the number of each."""
    rows, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    count = np.bincount(group)
    mean = np.bincount(group, values) / count
    squares = np.bincount(group, (values - mean[group]) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.where(count > 1, np.sqrt(squares / (count - 1) / count), np.nan)
    return rows, mean, error, count.astype(float)
