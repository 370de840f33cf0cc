"""Shared by the in-plane figures: which curves of a scan are drawn, and fine grids for the curves of models."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.metrics import curves
from gonio.measured import dataset
from gonio.resampling.resample import ORIGINS

Values = npt.NDArray[np.float64]
MOST_CURVES = 6
FAR_SIDE = "transmission: θᵣ from the normal of the far side"
GAP = 1.9  # times the usual step: a missing direction of an even scan doubles it


@dataclass(frozen=True)
class Curve:
    """One in-plane curve of a scan, and the directions of a fine grid across it."""

    theta_i: float
    theta_r: Values
    points: xr.Dataset
    fine_theta_r: Values
    fine: xr.Dataset

    @property
    def measured(self) -> Values:
        """The measured BRDF of the curve's points."""
        return np.asarray(self.points["brdf"].values)


_FILLED = re.compile(r"\b[1-9]\d* filled by ")  # in the history: values that a model or a symmetry gave


def origin_word(scan: xr.Dataset) -> str:
    """What the values of a scan are: simulated, measured, or measured and filled by a model or a symmetry."""
    if "simulated" in scan.attrs:
        return "simulated"
    return "measured and filled" if _FILLED.search(scan.attrs.get("history", "")) else "measured"


def with_gaps(theta_r: Values, values: Values) -> tuple[Values, Values]:
    """A curve with a NaN wherever its steps in theta_r are much longer than usual, so that no line crosses a gap."""
    steps = np.diff(theta_r)
    after = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if len(steps) > 1 else np.empty(0, dtype=np.intp)
    return np.insert(theta_r, after, np.nan), np.insert(values, after, np.nan)


def by_origin(points: xr.Dataset, word: str) -> dict[str, Any]:
    """Rows of a flat scan by what gave their values, where it remembers; all under `word` where it does not."""
    if "origin" not in points:
        return {word: slice(None)}
    origin = points["origin"].values.astype(int)
    kinds = {name: np.flatnonzero(origin == k) for k, name in enumerate(ORIGINS)}
    return {name.replace("_", " "): rows for name, rows in kinds.items() if rows.size}


def evenly(count: int, most: int) -> npt.NDArray[np.intp]:
    """The places of at most `most` of `count`, evenly chosen with both ends; of one that in the middle."""
    if most == 1:
        return np.array([(count - 1) // 2])
    return np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))


def first_set(flat: xr.Dataset, but: str = "") -> tuple[xr.Dataset, str]:
    """The first of several sets (channels, wavelengths, modes ..) of a flat scan, and which it is in words.

    All values of the coordinate `but` stay.
    """
    first = {name: flat[name].values[0].item() for name in dataset.sets(flat) if name != but}
    if not first:
        return flat, ""
    return dataset.select(flat, first), _words(first)


def parted(flat: xr.Dataset) -> dict[str, xr.Dataset]:
    """Every set of a flat scan (channel, wavelength, mode ..) by what it is in words; one without words is all."""
    names = dataset.sets(flat)
    kinds = dict.fromkeys(zip(*(flat[name].values.tolist() for name in names), strict=True)) if names else {}
    return {
        _words(first): dataset.select(flat, first) for first in (dict(zip(names, kind, strict=True)) for kind in kinds)
    } or {"": flat}


def _words(chosen: Mapping[str, Any]) -> str:
    return ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in chosen.items())


def panel_curves(scan: xr.Dataset, most: int = MOST_CURVES) -> tuple[list[Curve], str]:
    """The in-plane curves to draw, evenly chosen if they are more than `most`, and in words what is not drawn.

    A scan of several channels, wavelengths or scans shows the first; ValueError where no curve is in plane.
    """
    flat = dataset.points(scan)
    notes = []
    flat, note = first_set(flat)
    notes += [note] * bool(note)
    notes += [FAR_SIDE] * (dataset.modes(flat) == {"transmission"})
    in_plane = [(key, rows) for key, rows in curves(flat) if rows.size > 1]
    if not in_plane:
        raise ValueError("the scan holds no in-plane curve to draw: its directions are out of the plane of incidence")
    if len(in_plane) > most:
        notes.append(f"{most} of {len(in_plane)} incidence angles")
        in_plane = [in_plane[k] for k in evenly(len(in_plane), most)]
    return [_curve(flat, key, rows) for key, rows in in_plane], "; ".join(notes)


def _curve(flat: xr.Dataset, key: dict[str, Any], rows: npt.NDArray[np.intp]) -> Curve:
    points = flat.isel(direction=rows)
    theta_r = dataset.signed_theta_r(points)
    extra = key["theta_i"] if theta_r[0] <= key["theta_i"] <= theta_r[-1] else theta_r[0]
    fine_theta_r = np.unique(np.concatenate([np.linspace(theta_r[0], theta_r[-1], 601), [extra]]))
    names = [name for name in dataset.SETS if name in points.coords]
    fine = dataset.make_scan(
        np.full(fine_theta_r.shape, key["theta_i"]),
        fine_theta_r,
        np.zeros(fine_theta_r.shape),
        unit=dataset.unit(flat),
        coordinates={name: np.full(fine_theta_r.shape, points[name].values[0]) for name in names},
    )
    return Curve(key["theta_i"], theta_r, points, fine_theta_r, fine)
