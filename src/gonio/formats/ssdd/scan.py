"""The blocks of an SSDD file as one scan: dense in the file's coordinates, flat where gonio has no such grid.

The coordinates and the symmetries are those of libbsdf's SsddFileFormatSpecification.md.
"""

import functools
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import FormatError
from gonio.formats.ssdd.blocks import SsddBlock
from gonio.measured.coordinates import SYSTEMS, grid, system_of
from gonio.measured.dataset import ABSOLUTE, HORIZON, add_history, flatten

Values = npt.NDArray[np.float64]

MODES = {"brdf": "reflection", "btdf": "transmission"}
NAMES = {"spherical": "spherical", "specular": "specular", "half_difference": "half-difference"}  # SSDD's: gonio's
ORDER = (0, 2, 3, 1)  # the PARAM list for each axis of gonio's coordinate systems
_SAME = 1e-9  # deg; azimuths that differ by less are one


def scattering(path: Path, block: SsddBlock) -> xr.Dataset:
    """One block as a scan of one mode, dense where its coordinates are a grid. Raises FormatError where all is zero."""
    if not block.values.any():
        raise FormatError(path, f"every {block.kind} value is zero: the detector saw nothing", block.where)
    values = np.moveaxis(block.values, -1, 0)
    values = values.transpose(0, *(4 - k for k in ORDER))  # set, PARAM0, PARAM2, PARAM3, PARAM1
    phi, rows, history = _filled_azimuths(block)
    values = values[:, :, :, rows]
    params = [*block.params[:3], phi]
    directions, values, more = _directions(block, params, values)
    dims = _dimensions(directions)
    below = below_horizon(directions, dims)
    lost = int(np.count_nonzero(values[:, below]))
    values = np.where(below, np.nan, values)
    sets = block.sets
    coords = {n: (n, v, {"units": "nm"} if n == "wavelength" else {}) for n, v in sets.items()}
    scan = directions.assign_coords(coords | {"mode": MODES[block.kind]})
    scan = scan.assign(brdf=((*sets, *dims), values if sets else values[0], {"units": ABSOLUTE}))
    scan.attrs = {"Conventions": "CF-1.11", "history": "", "provenance": ""}
    if "bilateral_symmetry" in block.reductions:
        scan.attrs["symmetry"] = "plane-symmetrical"
    if "node" in dims:
        scan = flatten(scan)
    left_out = [f"{lost} values of the {block.kind} below the horizon left out"] if lost else []
    return functools.reduce(add_history, [*history, *more, *left_out], scan)


def _dimensions(directions: xr.Dataset) -> tuple[str, ...]:
    system = system_of(directions)
    names = system.axes if system else directions["theta_r"].dims
    return tuple(str(d) for d in names if d in directions.dims)


def below_horizon(directions: xr.Dataset, dims: tuple[str, ...]) -> npt.NDArray[np.bool_]:
    """Which nodes have one of their two directions below the horizon, as an array over `dims` in this order."""
    below = (directions["theta_r"] > HORIZON) | (directions["theta_i"] > HORIZON)
    full = xr.DataArray(np.zeros([directions.sizes[d] for d in dims]), dims=dims)
    return below.drop_vars(below.coords).broadcast_like(full).transpose(*dims).values


def _filled_azimuths(block: SsddBlock) -> tuple[Values, npt.NDArray[np.intp], list[str]]:
    """The azimuths PARAM3 [deg], the row of the table for each, and lines for the history.

    Azimuths that a symmetry leaves out are added where a grid cannot state the symmetry.
    """
    phi = block.params[3]
    rows = np.arange(len(phi))
    history = []
    if "reciprocity" in block.reductions:
        if "bilateral_symmetry" in block.reductions:
            other = rows[phi < 90][::-1]
            phi, rows = np.concatenate([phi, 180 - phi[other]]), np.concatenate([rows, other])
            history = [
                "azimuths phi_d from 90 to 180 deg filled in by the reciprocity and symmetry that the file states"
            ]
        elif phi[-1] == 180 or phi[0] + 180 - phi[-1] > 45:
            other = rows[phi > 0] if phi[-1] == 180 else rows
            phi, rows = np.concatenate([phi, 180 + phi[other]]), np.concatenate([rows, other])
            history = ["azimuths phi_d beyond 180 deg filled in by the reciprocity that the file states"]
    if "bilateral_symmetry" in block.reductions and _is_flat(block):
        other = rows[(block.params[3] > 0) & (block.params[3] < 180)][::-1]
        phi, rows = np.concatenate([phi, 360 - phi[other]]), np.concatenate([rows, other])
        history = ["azimuths beyond 180 deg filled in by the symmetry that the file states"]
    return phi, rows, history


def _is_flat(block: SsddBlock) -> bool:
    return block.system == "distorted_spherical" or "PARAM4_LIST" in block.lists


def _directions(block: SsddBlock, params: list[Values], values: Values) -> tuple[xr.Dataset, Values, list[str]]:
    """The coordinates of a block, its values (set, ..) on their dimensions, and lines for the history.

    Coordinates that are no grid have a last dimension `node`.
    """
    is_turned = "PARAM1_LIST" in block.lists and (len(params[1]) > 1 or params[1][0] != 0)
    if not is_turned:
        values = values[..., 0]
    if block.system == "spherical" and is_turned:
        relative = relative_azimuths(params[3], params[1])
        if relative is not None:
            phi, at = relative
            values = np.take_along_axis(values, at[None, None, None], axis=3)
            return grid("spherical", theta_i=params[0], theta_r=params[2], phi=phi, phi_i=params[1]), values, []
    if not _is_flat(block) and not (block.system == "spherical" and is_turned):
        system = SYSTEMS[NAMES[block.system]]
        axes = {a: params[k] for a, k in zip(system.axes, ORDER, strict=True) if k != 1 or is_turned}
        return grid(system.name, **axes), values, []
    return _unordered(block, params, is_turned), values[..., None], ["directions on no grid of gonio's: made flat"]


def _unordered(block: SsddBlock, params: list[Values], is_turned: bool) -> xr.Dataset:
    """The directions of each node where gonio has no such grid: distorted or refracted, or phi varies with phi_i."""
    dims = ("p0", "p2", "p3", "p1") if is_turned else ("p0", "p2", "p3")
    nodes = np.ix_(*(params[k] for k in ORDER if k != 1 or is_turned))
    theta_i, second, azimuth = nodes[:3]
    phi_i = nodes[3] if is_turned else np.zeros(())
    offset = block.lists.get("PARAM4_LIST", np.zeros(len(params[0]))).reshape(theta_i.shape)
    if block.system == "specular":
        _, theta_r, phi, _ = SYSTEMS["specular"].directions(theta_i + offset, second, azimuth)
    elif block.system == "spherical":
        theta_r, phi = second, (azimuth - phi_i) % 360.0
    else:
        theta_r, phi = _undistorted(theta_i + offset, second, azimuth, phi_i)
    full = tuple(np.broadcast_shapes(*(n.shape for n in nodes)))
    angles = {"theta_i": theta_i, "theta_r": theta_r, "phi": phi} | ({"phi_i": phi_i} if is_turned else {})
    coords = {n: ((*dims, "node"), np.broadcast_to(v, full)[..., None].copy(), _DEGREE) for n, v in angles.items()}
    return xr.Dataset(coords=coords)


_DEGREE = {"units": "degree"}


def _undistorted(mirror: Values, theta: Values, azimuth: Values, phi_i: Values) -> tuple[Values, Values]:
    """theta_r and phi [deg] of distorted spherical coordinates: polar ones on a disk that is shifted at its centre.

    On the disk the radius is the polar angle over 90 deg. Its centre is moved to the mirror direction; the shift
    decreases linearly to zero at the rim.
    """
    radius, turn, away = theta / 90.0, np.radians(azimuth), np.radians(phi_i + 180.0)
    x = radius * np.cos(turn) + (1 - radius) * mirror / 90.0 * np.cos(away)
    y = radius * np.sin(turn) + (1 - radius) * mirror / 90.0 * np.sin(away)
    phi: Values = (np.degrees(np.arctan2(y, x)) - phi_i) % 360.0
    return 90.0 * np.hypot(x, y), phi


def relative_azimuths(azimuths: Values, phi_i: Values) -> tuple[Values, npt.NDArray[np.intp]] | None:
    """Azimuths [deg] relative to phi_i, and their indices (new, phi_i); None where they differ with phi_i.

    It works both ways: phi from `azimuths` phi_r and phi_i, and phi_r from phi and -phi_i.
    """
    turned = (azimuths[:, None] - phi_i) % 360.0
    turned = np.where(turned > 360.0 - _SAME, 0.0, turned)
    at = np.argsort(turned, axis=0, kind="stable")
    ordered = np.take_along_axis(turned, at, axis=0)
    if np.any(np.abs(ordered - ordered[:, :1]) > _SAME) or np.any(np.diff(ordered[:, 0]) < _SAME):
        return None
    return np.where(ordered[:, 0] < _SAME, 0.0, ordered[:, 0]), at


def joined(scans: list[xr.Dataset]) -> xr.Dataset:
    """The scans of one or both modes as one: dense where their grids and sets are the same, else flat."""
    first, *others = scans
    if not others:
        return first
    (second,) = others
    past = [line for s in scans for line in s.attrs["history"].splitlines()]
    both: xr.Dataset
    if first.drop_vars(["brdf", "mode"]).identical(second.drop_vars(["brdf", "mode"]).assign_attrs(first.attrs)):
        both = xr.concat(
            scans,
            dim="mode",
            data_vars="all",
            coords="minimal",
            compat="override",
            join="override",
            combine_attrs="override",
        )
        return both.assign_attrs(history="\n".join(past))
    flats = [flatten(s) for s in scans]
    flats = [f.isel(direction=np.flatnonzero(f["theta_i"].values <= HORIZON)) for f in flats]
    if len({frozenset(f.coords) & {"wavelength", "channel"} for f in flats}) > 1:
        flats = [_by_channel(f) for f in flats]
        past.append("blocks with different colour models: colours and wavelengths distinguished by channel")
    if any("phi_i" in f.coords for f in flats):
        flats = [f if "phi_i" in f.coords else f.assign_coords(phi_i=f["phi"] * 0.0) for f in flats]
    past.append("blocks on different grids: made flat")
    both = xr.concat(
        flats, dim="direction", data_vars="all", coords="all", join="outer", combine_attrs="drop_conflicts"
    )
    return both.assign_attrs(history="\n".join(past))


def _by_channel(flat: xr.Dataset) -> xr.Dataset:
    """The scan with a coordinate `channel`: a wavelength becomes text, a scan without colours gets `mono`."""
    if "channel" in flat.coords:
        return flat
    count = flat.sizes["direction"]
    names = [f"{w:g} nm" for w in flat["wavelength"].values] if "wavelength" in flat.coords else ["mono"] * count
    return flat.drop_vars("wavelength", errors="ignore").assign_coords(channel=("direction", np.array(names)))
