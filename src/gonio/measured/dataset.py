"""The one kind of thing that travels: an xarray Dataset of a BRDF over directions.

Variables: `brdf` [sr-1, a.u. for relative data, 1 of degrees of polarisation]; optional `uncertainty` (standard, k = 1)
and
`uncertainty_systematic` in the same unit, with `systematic` (cause, direction) where its causes are known (causes.py);
optional `mask` (0 = in use). Coordinates: `theta_i`, `theta_r` (0 to 90)
and `phi` [degree]; `phi_i` [degree] where the surface was turned; and those of SETS where there are several sets:
`wavelength` [nm], `channel`, `scan`, `mode` (reflection or transmission), `side` (front or back: the one that the light
comes to) and `polarisation`. Light that went through has theta_r from the normal of the far side.
Dimensions are either one flat `direction`, or dense: those of SETS, then the axes of a grid (coordinates.py), whose
nodes below the horizon hold NaN. `history` has one line a step, `provenance` the header lines of the file.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

import gonio.accessor  # noqa: F401 - a Dataset has it from now on
from gonio.geometry import Geometry
from gonio.measured.causes import CAUSE, SYSTEMATIC, TOTAL, gathered, in_common, spread
from gonio.measured.distinct import distinct
from gonio.units import CF_STRINGS

ANGLES = ("theta_i", "theta_r", "phi")
SPECTRAL = ("wavelength", "channel")
DIRECTIONS = (*ANGLES, "phi_i")  # phi_i is there where the surface was turned
MODES = ("reflection", "transmission")
SETS = ("scan", "mode", "side", "polarisation", *SPECTRAL)  # coordinates that tell one set of directions from the next
MASK_MEANINGS = (
    "in_use",
    "blocked",
    "below_floor",
    "excluded",
    "saturated",
    "shaded",
    "drifted",
    "instrument",
)
HORIZON = 90.0 + 1e-9  # deg; a direction at 90 is of the hemisphere, also where rounding moved it
# Attribute: the dimensions of a format's own that run over the directions of one scan, such as the patches of a matrix.
AXES = "axes_of_directions"
PARAMETERISATION = "parameterisation"  # attribute: the format whose own interpolation holds between the directions
ABSOLUTE, RELATIVE, DEGREE = (CF_STRINGS[n] for n in ("brdf", "relative", "degree of polarisation"))
UNITS = (ABSOLUTE, RELATIVE, DEGREE)

Values = npt.ArrayLike


def make_scan(
    theta_i: Values,
    theta_r: Values,
    brdf: Values,
    phi: Values | None = None,
    *,
    phi_i: Values | None = None,
    uncertainty: Values | None = None,
    unit: str = ABSOLUTE,
    coordinates: Mapping[str, Values] | None = None,
    variables: Mapping[str, tuple[Values, str]] | None = None,
    provenance: str = "",
    history: str = "",
) -> xr.Dataset:
    """A flat Dataset from columns of equal length; angles in degrees.

    Without `phi`, theta_r is signed and in plane: positive is the forward side, phi = 180 deg.
    `coordinates` holds those of SETS; `variables` anything else as (values, unit).
    """
    theta_r = np.asarray(theta_r, dtype=float)
    if phi is None:
        phi = np.where(theta_r >= 0, 180.0, 0.0)
        theta_r = np.abs(theta_r)
    data: dict[str, tuple[Values, str]] = {"brdf": (brdf, unit)}
    if uncertainty is not None:
        data["uncertainty"] = (uncertainty, unit)
    data |= variables or {}
    angles = {"theta_i": theta_i, "theta_r": theta_r, "phi": phi} | ({} if phi_i is None else {"phi_i": phi_i})
    scan = xr.Dataset(
        {name: ("direction", np.asarray(v), {"units": u}) for name, (v, u) in data.items()},
        coords={name: ("direction", np.asarray(v, dtype=float), {"units": "degree"}) for name, v in angles.items()}
        | {name: ("direction", np.asarray(v)) for name, v in (coordinates or {}).items()},
        attrs={"Conventions": "CF-1.11", "history": history, "provenance": provenance} | said_to_be_simulated(history),
    )
    if "wavelength" in scan.coords:
        scan["wavelength"].attrs["units"] = "nm"
    return scan


def is_turned(scan: xr.Dataset) -> bool:
    """Whether the surface was turned about its normal while it was measured: the scan has several phi_i."""
    return "phi_i" in scan.coords and len(np.unique(np.mod(scan["phi_i"].values, 360.0))) > 1


def said_to_be_simulated(history: str) -> dict[str, str]:
    """The attribute `simulated` of a scan whose history says that it was, wherever the scan has been since."""
    said = re.search(r"(?:^|: )(simulated from \S+)", history, re.MULTILINE)
    return {"simulated": said[1]} if said else {}


def add_history(scan: xr.Dataset, line: str) -> xr.Dataset:
    """A copy with one more line of history."""
    past = scan.attrs.get("history", "")
    return scan.assign_attrs(history=f"{past}\n{line}" if past else line)


def unit(scan: xr.Dataset) -> str:
    """`sr-1`, for relative data `a.u.`, for a degree of polarisation `1`; ValueError where the Dataset does not say."""
    found = scan["brdf"].attrs.get("units")
    if found not in UNITS:
        raise ValueError(
            f"the BRDF's unit is {found!r}: set brdf.attrs['units'] to 'sr-1', or 'a.u.' for relative data"
        )
    return str(found)


def is_degree(scan: xr.Dataset) -> bool:
    """Whether the values of a scan are degrees of linear polarisation, which have the unit 1."""
    return bool(scan["brdf"].attrs.get("units") == DEGREE)


def modes(scan: xr.Dataset) -> set[str]:
    """The modes of a scan's values; a scan that names none is of reflection."""
    return set(np.unique(scan["mode"].values).tolist()) if "mode" in scan.coords else {MODES[0]}


def flatten(scan: xr.Dataset) -> xr.Dataset:
    """Every value on one `direction` dimension, whatever the dimensions were.

    Nodes of a grid below the horizon are left out: they are no directions. So are variables that have dimensions
    beside those of the BRDF, and the parameterisation that needs these.
    """
    if scan["brdf"].dims == ("direction",):
        alone = [n for n in (*DIRECTIONS, *SETS) if n in scan.coords and not scan[n].dims]  # one for all directions
        count = scan.sizes["direction"]
        columns: dict[str, Any] = {n: ("direction", np.full(count, scan[n].values[()]), scan[n].attrs) for n in alone}
        return scan.assign_coords(columns) if alone else scan
    wide = scan["brdf"].dims
    names = [n for n in (*scan.data_vars, *DIRECTIONS, *SETS) if n in scan.variables and set(scan[n].dims) <= set(wide)]
    below = (scan["theta_i"] > HORIZON) | (scan["theta_r"] > HORIZON)
    full = {n: scan[n].broadcast_like(scan["brdf"]).transpose(*wide).values for n in names}
    kept = ~(np.isnan(full["brdf"]) & below.broadcast_like(scan["brdf"]).transpose(*wide).values)
    columns = {n: ("direction", values[kept], scan[n].attrs) for n, values in full.items()}
    coords: dict[str, Any] = {n: columns.pop(n) for n in list(columns) if n in (*DIRECTIONS, *SETS)}
    if SYSTEMATIC in scan and {str(d) for d in scan[SYSTEMATIC].dims} <= {*map(str, wide), CAUSE}:
        by_cause = scan[SYSTEMATIC].broadcast_like(scan["brdf"]).transpose(CAUSE, *wide)
        columns[SYSTEMATIC] = ((CAUSE, "direction"), by_cause.values[:, kept], by_cause.attrs)
        coords |= {CAUSE: scan[CAUSE]} if CAUSE in scan.coords else {}
    attrs = {name: value for name, value in scan.attrs.items() if name not in (PARAMETERISATION, AXES)}
    return xr.Dataset(columns, coords=coords, attrs=attrs)


def in_use(scan: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Which values of a flat scan take part: not masked, and finite."""
    good = np.isfinite(scan["brdf"].values)
    return good & (scan["mask"].values == 0) if "mask" in scan else good


def points(scan: xr.Dataset) -> xr.Dataset:
    """The flat scan without its masked and missing values."""
    flat = flatten(scan)
    used = in_use(flat)
    return flat.isel(direction=slice(None) if used.all() else np.flatnonzero(used))


def geometry(scan: xr.Dataset) -> Geometry:
    """Directions of a flat scan as unit vectors."""
    return Geometry.from_degrees(*(scan[a].values.astype(float) for a in DIRECTIONS if a in scan.coords))


def directions(scan: xr.Dataset) -> xr.Dataset:
    """The directions of a scan alone, on its grid where it has one: those of several sets each once."""
    names = [n for n in DIRECTIONS if n in scan.variables]
    grid = [str(d) for d in scan["brdf"].dims if d not in SETS]
    kept = [*names, *(d for d in grid if d in scan.coords and d not in names)]
    own = {AXES: scan.attrs[AXES]} if AXES in scan.attrs else {}
    alone = xr.Dataset(coords={n: scan[n].variable for n in kept}, attrs=own)
    if grid != ["direction"]:
        return alone
    rows = np.unique(np.column_stack([scan[n].values for n in names]), axis=0, return_index=True)[1]
    return alone.isel(direction=np.sort(rows))


def is_in_plane(scan: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Which directions of a flat scan lie in the plane of incidence."""
    azimuth = scan["phi"].values % 180.0
    return np.isclose(azimuth, 0.0) | np.isclose(azimuth, 180.0) | np.isclose(scan["theta_r"].values, 0.0)


def signed_theta_r(scan: xr.Dataset) -> npt.NDArray[np.float64]:
    """theta_r [deg] of in-plane directions, positive on the forward side."""
    forward = np.cos(np.radians(scan["phi"].values)) < 0
    return np.where(forward, scan["theta_r"].values, -scan["theta_r"].values) + 0.0


def sets(scan: xr.Dataset) -> tuple[str, ...]:
    """The coordinates along which a flat scan holds more than one set."""
    return tuple(name for name in SETS if name in scan.coords and len(distinct(scan[name].values)[0]) > 1)


def select(scan: xr.Dataset, choice: Mapping[str, Any]) -> xr.Dataset:
    """The part of a scan where every coordinate named has the value given; ValueError when none is left.

    A dense scan stays on its grid where the choice is along one of its dimensions, and is flattened otherwise.
    """
    for name, wanted in choice.items():
        if name not in scan.coords:
            raise ValueError(f"there is no coordinate {name!r} to select; there are {', '.join(map(str, scan.coords))}")
        along = scan[name].dims
        if len(along) > 1 or (along and along != (name,)) or name in ANGLES:
            scan = flatten(scan)
            along = ("direction",)
        values = np.atleast_1d(scan[name].values)
        is_number = values.dtype.kind in "if"
        keep = np.isclose(values.astype(float), float(wanted)) if is_number else values.astype(str) == str(wanted)
        if not keep.any():
            raise ValueError(f"no {name} is {wanted}; there are {', '.join(f'{v}' for v in np.unique(values))}")
        rows = np.flatnonzero(keep)
        if along:
            scan = scan.isel({along[0]: rows if along == ("direction",) else rows[0]})
    return add_history(scan, "selected " + ", ".join(f"{k}={v}" for k, v in choice.items())) if choice else scan


def join(scans: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Put several scans into one, told apart by a coordinate `scan`: for fits that share parameters.

    Directions, wavelengths and channels may differ from scan to scan, and masks are kept.

    Parameters
    ----------
    scans : mapping
        Each scan by its name. Where a scan holds several itself, `scan` is the name given here, a stroke, and its own.

    Returns
    -------
    xarray.Dataset
        One scan over `direction`, with the coordinate `scan`.

    Raises
    ------
    ValueError
        Units differ, or only some of the scans have a coordinate.

    """
    if not scans:
        raise ValueError("there is no scan to join")
    units = {unit(scan) for scan in scans.values()}
    if len(units) > 1:
        raise ValueError(f"scans in {' and '.join(sorted(units))} cannot be joined: calibrate the relative ones first")
    flats = {name: _named(scan, name) for name, scan in scans.items()}
    silent = [name for name, flat in flats.items() if not {SYSTEMATIC, TOTAL} & set(flat.data_vars)]
    flats = dict(zip(flats, map(spread, in_common(list(flats.values()), list(flats))), strict=True))
    for coordinate in dict.fromkeys(str(c) for flat in flats.values() for c in flat.coords):
        if lacking := [name for name, flat in flats.items() if coordinate not in flat.coords]:
            raise ValueError(f"{', '.join(lacking)} says no {coordinate}, and other scans do: add it, or leave it out")
    if any("mask" in flat for flat in flats.values()):
        flats = {name: _with_mask(flat) for name, flat in flats.items()}
    joined: xr.Dataset = xr.concat(
        list(flats.values()),
        dim="direction",
        data_vars="all",
        coords="all",
        join="outer",
        combine_attrs="drop_conflicts",
    )
    past = [f"{name}: {line}" for name, flat in flats.items() for line in flat.attrs.get("history", "").splitlines()]
    simulated = "; ".join(dict.fromkeys(f.attrs["simulated"] for f in flats.values() if "simulated" in f.attrs))
    attrs = {"history": "\n".join(past)} | ({"simulated": simulated} if simulated else {})
    joined = add_history(gathered(joined).assign_attrs(attrs), f"joined {', '.join(flats)}")
    if silent and len(silent) < len(flats):
        joined = add_history(joined, f"took no systematic uncertainty for {', '.join(silent)}, which states none")
    return joined


def _named(scan: xr.Dataset, name: str) -> xr.Dataset:
    """The flat scan with its name as `scan`, without the lines of its file, which would be those of several."""
    flat = flatten(scan).drop_vars("line", errors="ignore")
    own = flat["scan"].values if "scan" in flat.coords else np.full(flat.sizes["direction"], "")
    return flat.assign_coords(scan=("direction", np.array([f"{name}/{o}" if o else name for o in own.tolist()])))


def _with_mask(flat: xr.Dataset) -> xr.Dataset:
    """The flat scan with a mask, one that masks nothing where it has none."""
    if "mask" in flat:
        return flat
    return flat.assign(mask=("direction", np.zeros(flat.sizes["direction"], dtype=np.int8)))
