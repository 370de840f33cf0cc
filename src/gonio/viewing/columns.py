"""A scan as columns of numbers that a page can read: sorted into curves, in one block of bytes.

A block is one set of directions (one wavelength, channel, scan ..), and a cell one incidence of a block. The bytes are
a length as 32 bits, a header as JSON of that length, and little-endian columns, each at a multiple of eight bytes.
"""

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.metrics import least
from gonio.comparison.ranking import settled
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.measured import dataset
from gonio.measured.distinct import combined, distinct
from gonio.measured.polarisers import POLARISATION, unpolarised
from gonio.measured.sound import is_stated
from gonio.plotting.panels import origin_word
from gonio.plotting.style import quantity_of
from gonio.resampling.difference import FLOOR
from gonio.units import unit_label
from gonio.viewing.sparse import is_table, sparse, table_of

Values = npt.NDArray[np.float64]

MOST = 50_000  # rows that a page is given; the others are left out, and the page says so
NUMBERS = ("theta_i", "theta_r", "phi", "phi_i", "signed", "value", "uncertainty", "weight")


@dataclass(frozen=True)
class Columns:
    """The rows of a scan, sorted by block and cell.

    header: what a page has to know of them, as JSON. points: the flat Dataset of the rows, in their order.
    rows: where they are among the values in use of the scan. first: the first row of every cell. columns: float64 by
    name, each of the length of points. least: below which a logarithm says nothing, of the whole scan.
    """

    header: dict[str, Any]
    points: xr.Dataset
    rows: npt.NDArray[np.intp]
    first: npt.NDArray[np.intp]
    columns: dict[str, npt.NDArray[np.float64]]
    least: float

    def encoded(self) -> bytes:
        """All of it as bytes."""
        arrays, place = [], 0
        for name, values in self.columns.items():
            arrays.append({"name": name, "offset": place, "length": len(values)})
            place += 8 * len(values)
        text = json.dumps(self.header | {"arrays": arrays}).encode()
        text += b" " * (-(len(text) + 4) % 8)
        return struct.pack("<I", len(text)) + text + b"".join(v.astype("<f8").tobytes() for v in self.columns.values())


def columns_of(name: str, scan: xr.Dataset, most: int = MOST) -> Columns:
    """The columns of a scan, of a table at some directions, as a model without polarisation sees it.

    Raises ValueError where the scan holds no value that is in use, and for degrees of polarisation, which are no BRDF.
    """
    if dataset.is_degree(scan):
        raise ValueError(f"{name}: degrees of polarisation are no BRDF, which the page shows: gonio plot draws them")
    whole = scan
    if of_table := is_table(scan):
        scan = sparse(scan)
    light, scan = _light(scan), unpolarised(scan)
    flat = dataset.points(scan)
    total = flat.sizes["direction"]
    if not total:
        raise ValueError(f"{name}: no value is in use, so there is nothing to show")
    by = dataset.sets(flat)
    block = combined([flat[n].values for n in by]) if by else np.zeros(total, dtype=np.intp)
    turned = flat["phi_i"].values if "phi_i" in flat.coords else np.zeros(total)
    cell = combined([block, flat["theta_i"].values, turned])
    order = np.lexsort((_signed(flat), ~dataset.is_in_plane(flat), cell))
    order = order[_kept(cell[order], most)]
    least_value = least(flat)
    flat, cell, block, turned = flat.isel(direction=order), cell[order], block[order], turned[order]
    first = np.flatnonzero(np.concatenate([[True], cell[1:] != cell[:-1]]))
    labels = [{n: _plain(flat[n].values[row]) for n in by} for row in _first_of(block)]
    numbers = {n: flat[n].values for n in ("theta_i", "theta_r", "phi")} | {"phi_i": turned, "signed": _signed(flat)}
    numbers |= {"value": flat["brdf"].values, "uncertainty": _uncertainty(flat)}
    weighting, numbers["weight"], noise_floor = _weights(scan, flat)
    floor = float(np.fmax(least_value, FLOOR * noise_floor))
    header = _about(name, scan) | {
        "light": light,
        "total": total,
        "shown": len(order),
        "masked": int(dataset.flatten(scan).sizes["direction"] - total),
        "weighting": weighting,
        "logarithmic": WEIGHTINGS[weighting].logarithmic,
        "floor": floor if np.isfinite(floor) else None,
        "by": list(by),
        "blocks": labels,
        "cells": _cells(flat, block, turned, first, numbers["signed"]),
    }
    if of_table:
        header |= _about_table(whole, labels)
    return Columns(header, flat, order, first, {n: np.asarray(numbers[n], dtype=float) for n in NUMBERS}, least_value)


def _about(name: str, scan: xr.Dataset) -> dict[str, Any]:
    """What its values are."""
    unit = dataset.unit(scan)
    return {
        "name": name,
        "unit": unit,
        "unit_label": unit_label(unit) or "1",
        "quantity": quantity_of(scan),
        "relative": unit == dataset.RELATIVE,
        "origin": origin_word(scan),
    }


def _cells(
    flat: xr.Dataset, block: npt.NDArray[np.intp], turned: Values, first: npt.NDArray[np.intp], signed: Values
) -> list[dict[str, Any]]:
    """Of each cell its block, incidence and rows; `reflected`: whether a model, which reflects, describes it."""
    ends = np.append(first[1:], len(block))
    reflected = flat["mode"].values != "transmission" if "mode" in flat.coords else np.ones(len(block), dtype=bool)
    return [
        {
            "block": int(block[a]),
            "theta_i": float(flat["theta_i"].values[a]),
            "phi_i": float(turned[a]),
            "start": int(a),
            "end": int(b),
            "reflected": bool(reflected[a]),
            "in_plane": int(np.isfinite(signed[a:b]).sum()),
        }
        for a, b in zip(first, ends, strict=True)
    ]


def _light(scan: xr.Dataset) -> str:
    """How readings of polarised light are shown; empty where the scan has none."""
    if POLARISATION not in scan.coords or unpolarised(scan) is scan:
        return ""
    states = distinct(dataset.flatten(scan)[POLARISATION].values.astype(str))[0].tolist()
    if len(states) == 1:
        return f"Readings in {states[0]}, taken as if the light were unpolarised: models are shown for that."
    return f"Readings in {', '.join(states)}, as unpolarised light gives them: models are shown for that."


def _about_table(whole: xr.Dataset, labels: list[dict[str, Any]]) -> dict[str, Any]:
    """Of how many values of a table the rows were interpolated, and how the page finds the table itself."""
    said: dict[str, Any] = {"total": int(np.isfinite(whole["brdf"].values).sum()), "masked": 0, "interpolated": True}
    if table := table_of(whole):
        blocks = [str(label.get("channel", "")) for label in labels]
        planes = [blocks.index(c) if c in blocks else -1 for c in table.channels]
        said["table"] = {"size": list(table.size), "around": table.around, "planes": planes}
    return said


def _signed(flat: xr.Dataset) -> npt.NDArray[np.float64]:
    """theta_r [deg] with its sign in the plane of incidence, NaN outside it."""
    return np.where(dataset.is_in_plane(flat), dataset.signed_theta_r(flat), np.nan)


def _uncertainty(flat: xr.Dataset) -> npt.NDArray[np.float64]:
    """The standard uncertainty of every value, NaN where none is stated."""
    if "uncertainty" not in flat:
        return np.full(flat.sizes["direction"], np.nan)
    stated = flat["uncertainty"].values
    return np.where(is_stated(stated), stated, np.nan)


def _weights(scan: xr.Dataset, flat: xr.Dataset) -> tuple[str, npt.NDArray[np.float64], float]:
    """The weighting that `gonio fit` takes for the scan, the weight of every row, and the noise floor."""
    options = settled(scan, {})
    try:
        weights = WEIGHTINGS[options.weighting].weights(flat, options.noise_floor)
    except ValueError:  # no default suits: no value is positive
        return "uniform", WEIGHTINGS["uniform"].weights(flat, 0.0), 0.0
    return options.weighting, weights, options.noise_floor


def _kept(cell: npt.NDArray[np.intp], most: int) -> npt.NDArray[np.intp]:
    """Rows of sorted cells, of which whole cells are left out evenly, and then rows, until there are few enough."""
    if len(cell) <= most:
        return np.arange(len(cell))
    found = np.unique(cell)
    count = max(1, int(len(found) * most / len(cell)))
    chosen = found[np.linspace(0, len(found) - 1, count).round().astype(int)]
    rows = np.flatnonzero(np.isin(cell, chosen))
    return rows[:: -(-len(rows) // most)]


def _first_of(place: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    return np.asarray([np.flatnonzero(place == k)[0] for k in distinct(place)[0]], dtype=np.intp)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
