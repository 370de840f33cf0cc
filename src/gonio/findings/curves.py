"""The in-plane curves of a scan: f over signed theta_r at one incidence angle of one set."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.distinct import combined

Values = npt.NDArray[np.float64]

MOST_POINTS, MOST_CURVES = 200_000, 2_000  # in plane: more are a table of a program, and reading it would take seconds


@dataclass(frozen=True)
class Curve:
    """One curve: the labels of its set, theta_i [deg], and by rising theta_r [deg, signed] its values (n,).

    Directions that occur more than once have the mean of their values.
    """

    labels: dict[str, object]
    theta_i: float
    theta_r: Values
    values: Values

    @property
    def name(self) -> str:
        """The incidence angle and the set in words."""
        parts = [("theta_i", self.theta_i), *self.labels.items()]
        return ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in parts)

    @property
    def set(self) -> tuple[object, ...]:
        """What tells the curve's set from others."""
        return tuple(self.labels.values())


def reflected(scan: xr.Dataset) -> xr.Dataset:
    """The flat values in use of light that was reflected, at directions of the hemisphere."""
    flat = dataset.points(scan)
    polar = np.array([flat[name].values for name in ("theta_i", "theta_r")], dtype=float)
    kept = ((polar >= 0) & (polar <= dataset.HORIZON)).all(axis=0)
    if "mode" in flat.coords:
        kept &= flat["mode"].values.astype(str) == dataset.MODES[0]
    return flat if kept.all() else flat.isel(direction=np.flatnonzero(kept))


def curves(flat: xr.Dataset) -> list[Curve]:
    """The curves of a flat scan of `reflected`, by set and incidence angle; none of a table with very many points."""
    rows = np.flatnonzero(dataset.is_in_plane(flat))
    if not len(rows) or len(rows) > MOST_POINTS:
        return []
    plane = flat.isel(direction=rows)
    names = [name for name in (*dataset.SETS, "phi_i") if name in dataset.sets(plane) or name == "phi_i"]
    names = [name for name in names if name in plane.coords]
    columns = [*(plane[name].values for name in names), np.round(plane["theta_i"].values.astype(float), 6)]
    group = combined(columns)
    if group.max() >= MOST_CURVES:
        return []
    return list(_split(plane, group, names, columns))


def _split(
    plane: xr.Dataset, group: npt.NDArray[np.intp], names: list[str], columns: list[np.ndarray]
) -> Iterator[Curve]:
    signed, values = dataset.signed_theta_r(plane).astype(float), plane["brdf"].values.astype(float)
    order = np.lexsort((signed, group))
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        labels = {name: column[rows[0]].item() for name, column in zip(names, columns, strict=False)}
        theta_r, mean = _merged(signed[rows], values[rows])
        yield Curve(labels, float(columns[-1][rows[0]]), theta_r, mean)


def _merged(theta_r: Values, values: Values) -> tuple[Values, Values]:
    """Each angle once, in their order, with the mean of its values; equal values stay what they are to the last bit."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(theta_r) > 1e-6]))
    counts = np.diff(starts, append=len(theta_r))
    least, most = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    mean = np.where(least == most, least, np.add.reduceat(values, starts) / counts)
    return theta_r[starts], mean
