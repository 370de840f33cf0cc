"""SSDD, surface scattering distribution data (.ssdd): up to a BRDF, a BTDF and two specular tables in one file.

    VERSION 0.3
    DATA_TYPE brdf
    COLOR_MODEL monochrome
    PARAM_TYPE specular_coordinate_system
    PARAM0_LIST 0 45
    PARAM2_LIST 0 30 90
    PARAM3_LIST 0 90 180 270 360
    DATA ascii
    0.3183
    ..

A grid stays one in the coordinates that the file names; distorted ones, those about refracted directions (PARAM4) and
blocks on different grids become flat. Reductions that a grid cannot say are filled in. Of a file that scatters, the
specular tables are left out with a word. Tables are written in text, and in binary where that loses no digit and the
table is large.
"""

import functools
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import FormatError
from gonio.measured.coordinates import SYSTEMS, grid, system_of
from gonio.measured.dataset import ABSOLUTE, HORIZON, add_history, flatten, unit
from gonio.measured.format import Format, Holds
from gonio.measured.formats.integra_specular import specular_scan
from gonio.measured.mirror_grid import mirror_grid, own_grid
from gonio.measured.ssdd_file import COLOURS, Block, read_blocks

Values = npt.NDArray[np.float64]

VERSION = "0.3"
MODES = {"brdf": "reflection", "btdf": "transmission"}
FEW_VALUES = 10_000  # a table of fewer is text, which people can read
_NAMES = {"spherical": "spherical", "specular": "specular", "half_difference": "half-difference"}
_ORDER = (0, 2, 3, 1)  # axes of gonio's systems among PARAM0 to PARAM3
_SAME = 1e-9  # deg, between azimuths of the circle
_ENTRY = re.compile(r"(?:SOFTWARE|API|DATE|NAME|SOURCE_TYPE|DEVICE|CREATION_DATE|MEASUREMENT_DATE) [^#]+")


def _recognises(head: bytes) -> bool:
    text = re.sub(rb"\r\n?", b"\n", head.removeprefix(b"\xef\xbb\xbf"))
    first = next((row for row in text.split(b"\n") if row.strip() and not row.lstrip().startswith(b"#")), b"")
    follows = re.search(rb"(?m)^(DATA_TYPE|SOFTWARE|API|DATE|COLOR_MODEL)[ \t]", text)
    return bool(re.fullmatch(rb"VERSION[ \t]+\d+\.\d+\s*(#.*)?", first.strip()) and follows)


def _read(path: Path) -> xr.Dataset:
    blocks, notes = read_blocks(path)
    scattered = [b for b in blocks if b.kind in MODES]
    if scattered:
        scan = _joined([_scattering(path, b) for b in scattered])
        for block in blocks:
            if block not in scattered:
                scan = add_history(scan, f"the table of the {block.kind.replace('_', ' ')} is left out: no BRDF")
    else:
        scan = _specular(path, blocks)
    return scan.assign_attrs(provenance="\n".join(notes))


def _specular(path: Path, blocks: list[Block]) -> xr.Dataset:
    """The scan of the first specular table, where a file has nothing else."""
    block = blocks[0]
    if len(block.params[1]) > 1:
        raise FormatError(
            path, "a specular table that depends on PARAM1, the incoming azimuth, is not read", block.where
        )
    values = block.values[0, 0, 0].T
    if np.any(values < 0) or not values.any():
        raise FormatError(path, "reflectances below zero, or all of them zero", block.where)
    scan = specular_scan(block.params[0], values, block.sets, block.kind.endswith("transmittance"))
    left = [b.kind.replace("_", " ") for b in blocks[1:]]
    return add_history(scan, f"the table of the {left[0]} is left out") if left else scan


def _scattering(path: Path, block: Block) -> xr.Dataset:
    """One block as a scan of one mode, dense where its coordinates are those of a grid."""
    if not block.values.any():
        raise FormatError(path, f"every {block.kind} value is zero: the detector saw nothing", block.where)
    values = np.moveaxis(block.values, -1, 0)
    values = values.transpose(0, *(4 - k for k in _ORDER))  # set, PARAM0, PARAM2, PARAM3, PARAM1
    phi, rows, said = _whole(block)
    values = values[:, :, :, rows]
    params = [*block.params[:3], phi]
    directions, values, more = _directions(block, params, values)
    dims = _dimensions(directions)
    below = _below(directions, dims)
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
    return functools.reduce(add_history, [*said, *more, *left_out], scan)


def _dimensions(directions: xr.Dataset) -> tuple[str, ...]:
    system = system_of(directions)
    names = system.axes if system else directions["theta_r"].dims
    return tuple(str(d) for d in names if d in directions.dims)


def _below(directions: xr.Dataset, dims: tuple[str, ...]) -> npt.NDArray[np.bool_]:
    """Which nodes have one of their two directions below the horizon, on the dimensions in this order."""
    below = (directions["theta_r"] > HORIZON) | (directions["theta_i"] > HORIZON)
    full = xr.DataArray(np.zeros([directions.sizes[d] for d in dims]), dims=dims)
    return below.drop_vars(below.coords).broadcast_like(full).transpose(*dims).values


def _whole(block: Block) -> tuple[Values, npt.NDArray[np.intp], list[str]]:
    """The azimuths PARAM3 [deg] with what reductions left out where a grid cannot say it; the row of each; in words."""
    phi = block.params[3]
    rows = np.arange(len(phi))
    said = []
    if "reciprocity" in block.reductions:
        if "bilateral_symmetry" in block.reductions:
            other = rows[phi < 90][::-1]
            phi, rows = np.concatenate([phi, 180 - phi[other]]), np.concatenate([rows, other])
            said = ["azimuths phi_d from 90 to 180 deg filled in by the reciprocity and symmetry that the file states"]
        elif phi[-1] == 180 or phi[0] + 180 - phi[-1] > 45:
            other = rows[phi > 0] if phi[-1] == 180 else rows
            phi, rows = np.concatenate([phi, 180 + phi[other]]), np.concatenate([rows, other])
            said = ["azimuths phi_d beyond 180 deg filled in by the reciprocity that the file states"]
    if "bilateral_symmetry" in block.reductions and _is_flat(block):
        other = rows[(block.params[3] > 0) & (block.params[3] < 180)][::-1]
        phi, rows = np.concatenate([phi, 360 - phi[other]]), np.concatenate([rows, other])
        said = ["azimuths beyond 180 deg filled in by the symmetry that the file states"]
    return phi, rows, said


def _is_flat(block: Block) -> bool:
    return block.system == "distorted_spherical" or "PARAM4_LIST" in block.lists


def _directions(block: Block, params: list[Values], values: Values) -> tuple[xr.Dataset, Values, list[str]]:
    """The coordinates of a block, and its values (set, ..) on their dimensions; `node` ends those that are no grid."""
    is_turned = "PARAM1_LIST" in block.lists and (len(params[1]) > 1 or params[1][0] != 0)
    if not is_turned:
        values = values[..., 0]
    if block.system == "spherical" and is_turned:
        relative = _relative(params[3], params[1])
        if relative is not None:
            phi, at = relative
            values = np.take_along_axis(values, at[None, None, None], axis=3)
            return grid("spherical", theta_i=params[0], theta_r=params[2], phi=phi, phi_i=params[1]), values, []
    if not _is_flat(block) and not (block.system == "spherical" and is_turned):
        system = SYSTEMS[_NAMES[block.system]]
        axes = {a: params[k] for a, k in zip(system.axes, _ORDER, strict=True) if k != 1 or is_turned}
        return grid(system.name, **axes), values, []
    return _unordered(block, params, is_turned), values[..., None], ["directions on no grid of gonio's: made flat"]


def _unordered(block: Block, params: list[Values], is_turned: bool) -> xr.Dataset:
    """Directions by node for what is no grid of gonio's: distorted, refracted, or azimuths that do not turn along."""
    dims = ("p0", "p2", "p3", "p1") if is_turned else ("p0", "p2", "p3")
    nodes = np.ix_(*(params[k] for k in _ORDER if k != 1 or is_turned))
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
    named = {"theta_i": theta_i, "theta_r": theta_r, "phi": phi} | ({"phi_i": phi_i} if is_turned else {})
    coords = {n: ((*dims, "node"), np.broadcast_to(v, full)[..., None].copy(), _DEGREE) for n, v in named.items()}
    return xr.Dataset(coords=coords)


_DEGREE = {"units": "degree"}


def _undistorted(mirror: Values, theta: Values, azimuth: Values, phi_i: Values) -> tuple[Values, Values]:
    """theta_r and phi [deg] of distorted angles: polar on a disk whose centre is moved to the mirror direction.

    On the disk the radius is the polar angle over 90 deg; towards its rim the centre moves back.
    """
    radius, turn, away = theta / 90.0, np.radians(azimuth), np.radians(phi_i + 180.0)
    x = radius * np.cos(turn) + (1 - radius) * mirror / 90.0 * np.cos(away)
    y = radius * np.sin(turn) + (1 - radius) * mirror / 90.0 * np.sin(away)
    phi: Values = (np.degrees(np.arctan2(y, x)) - phi_i) % 360.0
    return 90.0 * np.hypot(x, y), phi


def _relative(azimuths: Values, phi_i: Values) -> tuple[Values, npt.NDArray[np.intp]] | None:
    """Azimuths [deg] from those of the incident light, and where each lies (new, phi_i); None where they differ.

    With both signs: of phi_r from phi_i, or with -phi_i of phi from phi_r.
    """
    turned = (azimuths[:, None] - phi_i) % 360.0
    turned = np.where(turned > 360.0 - _SAME, 0.0, turned)
    at = np.argsort(turned, axis=0, kind="stable")
    ordered = np.take_along_axis(turned, at, axis=0)
    if np.any(np.abs(ordered - ordered[:, :1]) > _SAME) or np.any(np.diff(ordered[:, 0]) < _SAME):
        return None
    return np.where(ordered[:, 0] < _SAME, 0.0, ordered[:, 0]), at


def _joined(scans: list[xr.Dataset]) -> xr.Dataset:
    """The scans of both modes as one: dense where their grids and sets are the same, else flat."""
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
        past.append("blocks with different colour models: colours and wavelengths told by channel")
    if any("phi_i" in f.coords for f in flats):
        flats = [f if "phi_i" in f.coords else f.assign_coords(phi_i=f["phi"] * 0.0) for f in flats]
    past.append("blocks on different grids: made flat")
    both = xr.concat(
        flats, dim="direction", data_vars="all", coords="all", join="outer", combine_attrs="drop_conflicts"
    )
    return both.assign_attrs(history="\n".join(past))


def _by_channel(flat: xr.Dataset) -> xr.Dataset:
    """The scan with a `channel` whatever its colours: a wavelength as text, `Y` where it has no colour."""
    if "channel" in flat.coords:
        return flat
    count = flat.sizes["direction"]
    names = [f"{w:g} nm" for w in flat["wavelength"].values] if "wavelength" in flat.coords else ["mono"] * count
    return flat.drop_vars("wavelength", errors="ignore").assign_coords(channel=("direction", np.array(names)))


def _layout(scan: xr.Dataset) -> xr.Dataset:
    found = own_grid(scan, *_NAMES.values())
    is_turned = found is not None and {"phi", "phi_i"} <= set(found.dims)
    if found is None or (is_turned and _relative(scan["phi"].values, -scan["phi_i"].values) is None):
        return mirror_grid(scan)
    return found


def _write(scan: xr.Dataset, path: Path) -> None:
    system = system_of(scan)
    if system is None or scan["brdf"].dims == ("direction",):
        raise ValueError("an SSDD file has a grid, and the scan has none: gonio.convert makes one")
    if unit(scan) != ABSOLUTE:
        raise ValueError("an SSDD file holds a BRDF in 1/sr, and the scan is relative: calibrate it first")
    along = [str(d) for d in scan["brdf"].dims if d not in system.axes]
    if not set(along) <= {"mode", "wavelength", "channel"} or {"wavelength", "channel"} <= set(along):
        raise ValueError(f"an SSDD file has sets along mode and wavelength or channel, not {' and '.join(along)}")
    axes = [a for a in system.axes if a in scan["brdf"].dims]
    missing = np.isnan(scan["brdf"].transpose(..., *axes).values) & ~_below(scan, tuple(axes))
    if missing.any():
        raise ValueError("the scan has gaps, and an SSDD file can hold none: gonio.convert fills them")
    kinds = {mode: kind for kind, mode in MODES.items()}
    modes = np.atleast_1d(scan["mode"].values).tolist() if "mode" in scan.coords else ["reflection"]
    heads = _head(scan)
    with path.open("wb") as file:
        file.write(f"VERSION {VERSION}\n".encode())
        for line in scan.attrs.get("provenance", "").splitlines():
            file.write((line if _ENTRY.fullmatch(line) else f"# {line}").encode() + b"\n")
        for mode in modes:
            part = scan.sel(mode=mode) if "mode" in along else scan
            file.write(f"\nDATA_TYPE {kinds[mode]}\n{heads}".encode())
            file.write(_table(part["brdf"], axes, scan))


def _head(scan: xr.Dataset) -> str:
    """The entries of a block from COLOR_MODEL on."""
    system = system_of(scan)
    assert system is not None
    axes = [scan[a].values if a in scan["brdf"].dims else np.zeros(1) for a in system.axes]
    if system.name == "spherical" and "phi_i" in scan["brdf"].dims:
        axes[2] = _absolute(scan)[0]
    named = next(n for n, name in _NAMES.items() if name == system.name)
    lines = [f"COLOR_MODEL {_colours(scan)}"]
    if _colours(scan) == "spectrum":
        lines.append(f"WAVELENGTH_LIST {_row(np.sort(np.atleast_1d(scan['wavelength'].values)))}")
    lines.append(f"PARAM_TYPE {named}_coordinate_system")
    phi = axes[2]
    if system.name == "half-difference" and phi[-1] < 180 and 0 < phi[0] + 180 - phi[-1] <= 45:
        lines.append("REDUCTION_TYPE reciprocity")
    elif phi[0] == 0 and phi[-1] == 180 and not (system.name == "spherical" and "phi_i" in scan["brdf"].dims):
        lines.append("REDUCTION_TYPE bilateral_symmetry")
    for k, values in sorted(zip(_ORDER, axes, strict=True), key=lambda entry: entry[0]):
        if k != 1 or system.axes[3] in scan["brdf"].dims:
            lines.append(f"PARAM{k}_LIST {_row(values)}")
    return "\n".join(lines) + "\n"


def _colours(scan: xr.Dataset) -> str:
    if "wavelength" in scan.coords:
        return "spectrum"
    names = tuple(np.atleast_1d(scan["channel"].values).tolist()) if "channel" in scan.coords else ("",)
    found = next((c for c, known in COLOURS.items() if known == names), "")
    if not found:
        raise ValueError(f"an SSDD file has the channels R, G, B, or X, Y, Z, or wavelengths, not {', '.join(names)}")
    return found


def _absolute(scan: xr.Dataset) -> tuple[Values, npt.NDArray[np.intp]]:
    found = _relative(scan["phi"].values, -scan["phi_i"].values)
    if found is None:
        raise ValueError(
            "the azimuths phi do not turn along with phi_i: an SSDD file has one list for all; gonio.convert"
        )
    return found


def _table(brdf: xr.DataArray, axes: list[str], scan: xr.Dataset) -> bytes:
    """DATA and the table (PARAM3, 2, 1, 0, colour), in binary where float32 holds every value and there are many."""
    colour = [n for n in ("wavelength", "channel") if n in brdf.dims]
    values = brdf.sortby(colour[0]) if colour == ["wavelength"] else brdf
    ordered = np.nan_to_num(values.transpose(*axes, *colour).values.astype(float))
    ordered = ordered.reshape(*(scan.sizes[a] for a in axes), -1)
    if len(axes) == 3:
        ordered = ordered[:, :, :, None]
    elif axes[2] == "phi":
        at = _absolute(scan)[1]
        ordered = np.take_along_axis(ordered, at[None, None, :, :, None], axis=2)
    table = ordered.transpose(2, 1, 3, 0, 4)
    with np.errstate(over="ignore"):
        single = table.astype("<f4")
    if table.size >= FEW_VALUES and np.array_equal(single.astype(float), table):
        return b"DATA binary\n" + single.tobytes() + b"\n"
    rows = table.reshape(-1, table.shape[-1]).tolist()
    return b"DATA ascii\n" + "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode()


def _row(values: Values) -> str:
    return " ".join(map(repr, np.asarray(values, dtype=float).tolist()))


FORMAT = Format(
    name="ssdd",
    title="SSDD",
    suffix=".ssdd",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    holds=Holds(anisotropic=True, transmission=True, sets=("mode", "wavelength", "channel")),
)
