"""Scans from what is in memory: arrays, and data frames of pandas or of any library with columns of names."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import ABSOLUTE, HORIZON, MODES, RELATIVE, SETS, add_history, make_scan
from gonio.tables import vocabulary as v
from gonio.tables.layouts import LONG, Part
from gonio.tables.read import assembled
from gonio.tables.request import Asker, request
from gonio.tables.source import Cell, Row


def scan(
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    brdf: npt.ArrayLike,
    phi: npt.ArrayLike | None = None,
    uncertainty: npt.ArrayLike | None = None,
    unit: str = "sr-1",
    **further: npt.ArrayLike,
) -> xr.Dataset:
    """Make a scan of arrays, which are broadcast against each other.

    Parameters
    ----------
    theta_i, theta_r : array_like
        Angles of incidence and reflection [deg]. Without `phi`, `theta_r` is signed, positive on the forward side.
    brdf : array_like
        Values [1/sr]; relative ones with the unit "a.u.". NaN is a gap.
    phi : array_like, optional
        Relative azimuth [deg], 180 in the forward direction.
    uncertainty : array_like, optional
        Standard uncertainty, in the unit of the values.
    unit : str
        "sr-1", or "a.u." for relative values.
    **further : array_like
        Other coordinates: `phi_i` [deg], `wavelength` [nm], `channel`, `scan`, `mode`, `side`, `polarisation`.

    Returns
    -------
    xarray.Dataset
        A scan as `gonio.read` gives it, over one dimension `direction` in the order of the broadcast arrays.

    Raises
    ------
    ValueError
        An angle is missing or outside the hemisphere, a value is infinite, shapes do not fit, or a name is not one of
        these.

    Examples
    --------
    >>> import gonio
    >>> coating = gonio.scan(30.0, [0.0, 30.0, 60.0], [0.12, 0.80, 0.15])
    >>> coating["brdf"].values.tolist()
    [0.12, 0.8, 0.15]

    """
    known = v.unit_of(unit)
    if not known or v.UNITS[known].kind not in (v.ABSOLUTE, v.RELATIVE):
        raise ValueError(f"the unit {unit!r} is neither 'sr-1' nor, for relative data, 'a.u.'")
    if strange := sorted(set(further) - {"phi_i", *SETS}):
        raise ValueError(f"a scan has no {strange[0]!r}; there are phi_i, {', '.join(SETS)}")
    named: dict[str, npt.ArrayLike] = {"theta_i": theta_i, "theta_r": theta_r, "brdf": brdf}
    named |= {n: a for n, a in (("phi", phi), ("uncertainty", uncertainty)) if a is not None} | further
    arrays = {name: _array(name, values) for name, values in named.items()}
    try:
        flat = {n: a.ravel() for n, a in zip(arrays, np.broadcast_arrays(*arrays.values()), strict=True)}
    except ValueError:
        shapes = ", ".join(f"{n} {a.shape}" for n, a in arrays.items())
        raise ValueError(f"these shapes do not fit together: {shapes}") from None
    _refuse(flat)
    return add_history(
        make_scan(
            flat["theta_i"],
            flat["theta_r"],
            flat["brdf"],
            flat.get("phi"),
            phi_i=flat.get("phi_i"),
            uncertainty=flat.get("uncertainty"),
            unit=ABSOLUTE if v.UNITS[known].kind == v.ABSOLUTE else RELATIVE,
            coordinates={name: flat[name] for name in SETS if name in flat},
        ),
        "made from arrays",
    )


def _array(name: str, values: npt.ArrayLike) -> np.ndarray:
    try:
        return np.asarray(values, dtype=str if name in v.TEXTS else float)
    except (ValueError, TypeError):
        raise ValueError(f"{name} is not an array of numbers") from None


def _refuse(flat: dict[str, np.ndarray]) -> None:
    lowest = 0.0 if "phi" in flat else -90.0
    for name, least in (("theta_i", 0.0), ("theta_r", lowest)):
        outside = ~((flat[name] >= least) & (flat[name] <= HORIZON))
        if outside.any():
            raise ValueError(f"{name} is {flat[name][outside][0]:g} deg, outside {least:g} to 90")
    for name in (n for n in ("phi", "phi_i") if n in flat):
        if not np.isfinite(flat[name]).all():
            raise ValueError(f"{name} has values that are not finite")
    if "wavelength" in flat and not (np.isfinite(flat["wavelength"]) & (flat["wavelength"] > 0)).all():
        raise ValueError("a wavelength is not a positive number")
    for name in (n for n in ("brdf", "uncertainty") if n in flat):
        if np.isinf(flat[name]).any():
            raise ValueError(f"{name} has values that are infinite")
    if not flat["brdf"].size:
        raise ValueError("there are no values")
    if strange := set(flat.get("mode", np.array([])).tolist()) - {*MODES}:
        raise ValueError(f"mode is {min(strange)!r}, neither {MODES[0]} nor {MODES[1]}")


def from_pandas(
    df: Any,
    columns: Mapping[str, str] | str | None = None,
    *,
    values: str = "",
    quantity: str = "",
    flip: bool = False,
) -> xr.Dataset:
    """Make a scan of a data frame, whose columns are understood as the headings of a file are.

    Parameters
    ----------
    df : DataFrame or mapping
        A frame of pandas or polars, any object with `columns` of names and columns by name, or arrays by name.
    columns, values, quantity, flip
        As `gonio.read_table` takes them.

    Returns
    -------
    xarray.Dataset
        A scan as `gonio.read` gives it.

    Raises
    ------
    FormatError
        A ValueError, as `gonio.read_table` raises it, with `DataFrame` in the place of a file; its lines are those of
        a CSV file of the same frame.

    """
    names = list(df.keys() if isinstance(df, Mapping) else df.columns)
    held = [np.asarray(df[name]) for name in names]
    if not held or any(array.ndim != 1 or len(array) != len(held[0]) for array in held):
        raise ValueError("the frame has no columns, or columns of several lengths")
    asked = request(columns=columns, values=values, quantity=quantity, flip=flip)
    cells = [[_cell(c) for c in array.tolist()] for array in held]
    rows = [Row(i, row, "") for i, row in enumerate(zip(*cells, strict=True), start=2)]
    part = Part(LONG, 1, [str(name) for name in names], [], rows)
    if not rows:
        raise ValueError("the frame has no rows")
    return assembled([part], "columns of a data frame", Asker(Path("DataFrame"), asked)).scan


def _cell(value: Any) -> Cell:
    if value is None or value != value:  # pandas has several kinds of nothing, none of which is itself
        return None
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return str(value).strip() or None
