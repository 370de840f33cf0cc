"""A table over half-difference angles as curves: its cells share no incidence angle, so that a page could draw none.

Curves in the plane of incidence and a sparse hemisphere are interpolated at some incidence angles, by the format's own
rule where it has one. The graphics of the page are given the whole table beside, as `table_of` has it.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.merl import AXES, NAME
from gonio.measured import dataset
from gonio.measured.coordinates import system_of
from gonio.measured.distinct import distinct
from gonio.resampling.interpolation import Targets
from gonio.resampling.resample import without_masked
from gonio.resampling.sources import interpolator_of, sets_of

Values = npt.NDArray[np.float64]

SYSTEM = "half-difference"
INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)  # deg
IN_PLANE = np.arange(-89.0, 89.5, 1.0)  # deg, signed
BESIDE = np.array([0.1, 0.2, 0.35, 0.5, 0.75, 1.5])  # deg from the mirror direction, on both sides
AROUND = (np.arange(5.0, 90.0, 5.0), np.arange(15.0, 360.0, 15.0))  # deg: theta_r and phi of the hemisphere
NO_VALUE = -1.0  # in a table of float32: graphics need not know NaN


def is_table(scan: xr.Dataset) -> bool:
    """Whether a scan is on a grid of half-difference angles."""
    system = system_of(scan)
    return system is not None and system.name == SYSTEM and scan["brdf"].dims != ("direction",)


def sparse(scan: xr.Dataset) -> xr.Dataset:
    """The values of such a scan, flat, at the directions that a page draws."""
    targets = _targets()
    columns: list[Values] = []
    labels: list[dict[str, object]] = []
    how = ""
    for key, part in sets_of(without_masked(scan)):
        between, how = interpolator_of(part)
        columns.append(between(targets))
        labels.append(key)
    count = len(targets)
    repeated = [np.tile(a, len(labels)) for a in (targets.theta_i, targets.theta_r, targets.phi)]
    names = {n: np.repeat(np.array([key[n] for key in labels]), count) for n in labels[0]}
    flat = dataset.make_scan(
        repeated[0],
        repeated[1],
        np.concatenate(columns),
        repeated[2],
        unit=dataset.unit(scan),
        coordinates=names,
        provenance=str(scan.attrs.get("provenance", "")),
        history=str(scan.attrs.get("history", "")),
    )
    return dataset.add_history(flat, f"interpolated {how} for the page")


@cache
def _targets() -> Targets:
    rows: list[npt.NDArray[np.float64]] = []
    for theta_i in INCIDENCES:
        signed = distinct(np.concatenate([IN_PLANE, theta_i + BESIDE, theta_i - BESIDE]))[0]
        plane = np.column_stack([np.abs(signed), np.where(signed >= 0, 180.0, 0.0)])
        around = np.stack(np.meshgrid(*AROUND, indexing="ij"), axis=-1).reshape(-1, 2)
        around = around[around[:, 1] != 180.0]
        both = np.concatenate([plane, around])
        rows.append(np.column_stack([np.full(len(both), theta_i), both]))
    theta_i, theta_r, phi = np.concatenate(rows).T
    return Targets(theta_i, theta_r, phi, np.zeros(len(phi)))


@dataclass(frozen=True)
class Table:
    """A table whose cells are those of MERL: planes of theta_h, theta_d and phi_d, one for each channel.

    size: cells along the three axes. around: what phi_d covers [rad]. channels: of each plane, or one that is "".
    """

    size: tuple[int, ...]
    around: float
    channels: tuple[str, ...]
    scan: xr.Dataset

    def encoded(self) -> bytes:
        """The planes one after the other as little-endian float32, NO_VALUE where there is none."""
        values = without_masked(self.scan)["brdf"].transpose(..., *AXES).values.astype("<f4")
        np.copyto(values, NO_VALUE, where=~np.isfinite(values))
        return values.tobytes()


def table_of(scan: xr.Dataset) -> Table | None:
    """The table of a scan whose cells are those of MERL; None for any other."""
    dims = set(scan["brdf"].dims) - set(AXES)
    if (
        scan.attrs.get(dataset.PARAMETERISATION) != NAME
        or not set(AXES) <= set(scan["brdf"].dims)
        or dims - {"channel"}
    ):
        return None
    around = math.radians(360.0 if float(scan["phi_d"].values[-1]) > 180.0 else 180.0)
    channels = tuple(str(c) for c in scan["channel"].values) if dims else ("",)
    return Table(tuple(scan.sizes[a] for a in AXES), around, channels, scan)
