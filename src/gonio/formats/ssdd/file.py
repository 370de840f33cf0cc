"""SSDD, surface scattering distribution data (.ssdd) of the library libbsdf: BRDF, BTDF and two specular tables.

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

libbsdf documents the layout (SsddFileFormatSpecification.md, version 0.3). A file has up to four blocks, one of each
kind.

A grid is kept in the coordinates that the file names. Distorted coordinates, those about refracted directions (PARAM4)
and blocks on different grids become flat scans. Values that a symmetry (REDUCTION_TYPE) leaves out are filled in where
a grid cannot state the symmetry. Where a file has a BRDF or BTDF, its specular tables are left out and the history says
so. Tables are written as text; a large table is binary where float32 holds every value exactly.
"""

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import remark_lines
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.formats.mirror_grid import existing_grid, mirror_grid
from gonio.formats.specular_scan import specular_scan
from gonio.formats.ssdd.blocks import COLOURS, SsddBlock, read_blocks
from gonio.formats.ssdd.scan import MODES, NAMES, ORDER, below_horizon, joined, relative_azimuths, scattering
from gonio.measured.coordinates import system_of
from gonio.measured.dataset import ABSOLUTE, add_history, unit

Values = npt.NDArray[np.float64]

VERSION = "0.3"
FEW_VALUES = 10_000  # a table of fewer values is text, which people can read
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
        scan = joined([scattering(path, b) for b in scattered])
        for block in blocks:
            if block.kind not in MODES:
                scan = add_history(scan, f"the table of the {block.kind.replace('_', ' ')} is left out: no BRDF")
    else:
        scan = _specular(path, blocks)
    return scan.assign_attrs(provenance="\n".join(notes))


def _specular(path: Path, blocks: list[SsddBlock]) -> xr.Dataset:
    """The scan of the first specular table, for a file that has nothing else."""
    block = blocks[0]
    if len(block.params[1]) > 1:
        raise FormatError(
            path, "a specular table that depends on PARAM1, the incoming azimuth, is not read", block.where
        )
    values = block.values[0, 0, 0].T
    if np.any(values < 0) or not values.any():
        raise FormatError(path, "reflectances below zero, or all of them zero", block.where)
    scan = specular_scan(block.params[0], values, block.sets, block.kind.endswith("transmittance"))
    left_out = [b.kind.replace("_", " ") for b in blocks[1:]]
    return add_history(scan, f"the table of the {left_out[0]} is left out") if left_out else scan


def _layout(scan: xr.Dataset) -> xr.Dataset:
    existing = existing_grid(scan, *NAMES.values())
    is_turned = existing is not None and {"phi", "phi_i"} <= set(existing.dims)
    if existing is None or (is_turned and relative_azimuths(scan["phi"].values, -scan["phi_i"].values) is None):
        return mirror_grid(scan)
    return existing


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
    missing = np.isnan(scan["brdf"].transpose(..., *axes).values) & ~below_horizon(scan, tuple(axes))
    if missing.any():
        raise ValueError("the scan has gaps, and an SSDD file can hold none: gonio.convert fills them")
    kinds = {mode: kind for kind, mode in MODES.items()}
    modes = np.atleast_1d(scan["mode"].values).tolist() if "mode" in scan.coords else ["reflection"]
    heads = _head(scan)
    with path.open("wb") as file:
        file.write(f"VERSION {VERSION}\n".encode())
        for line in remark_lines(scan.attrs.get("provenance", "")):
            file.write((line if _ENTRY.fullmatch(line) else f"# {line}").encode() + b"\n")
        for mode in modes:
            part = scan.sel(mode=mode) if "mode" in along else scan
            file.write(f"\nDATA_TYPE {kinds[mode]}\n{heads}".encode())
            file.write(_table(part["brdf"], axes, scan))


def _head(scan: xr.Dataset) -> str:
    """The entries of a block, from COLOR_MODEL to the last list."""
    system = system_of(scan)
    assert system is not None
    axes = [scan[a].values if a in scan["brdf"].dims else np.zeros(1) for a in system.axes]
    if system.name == "spherical" and "phi_i" in scan["brdf"].dims:
        axes[2] = _absolute(scan)[0]
    system_name = next(n for n, name in NAMES.items() if name == system.name)
    lines = [f"COLOR_MODEL {_colours(scan)}"]
    if _colours(scan) == "spectrum":
        lines.append(f"WAVELENGTH_LIST {_row(np.sort(np.atleast_1d(scan['wavelength'].values)))}")
    lines.append(f"PARAM_TYPE {system_name}_coordinate_system")
    phi = axes[2]
    if system.name == "half-difference" and phi[-1] < 180 and 0 < phi[0] + 180 - phi[-1] <= 45:
        lines.append("REDUCTION_TYPE reciprocity")
    elif phi[0] == 0 and phi[-1] == 180 and not (system.name == "spherical" and "phi_i" in scan["brdf"].dims):
        lines.append("REDUCTION_TYPE bilateral_symmetry")
    for k, values in sorted(zip(ORDER, axes, strict=True), key=lambda entry: entry[0]):
        if k != 1 or system.axes[3] in scan["brdf"].dims:
            lines.append(f"PARAM{k}_LIST {_row(values)}")
    return "\n".join(lines) + "\n"


def _colours(scan: xr.Dataset) -> str:
    if "wavelength" in scan.coords:
        return "spectrum"
    names = tuple(np.atleast_1d(scan["channel"].values).tolist()) if "channel" in scan.coords else ("",)
    model = next((c for c, known in COLOURS.items() if known == names), "")
    if not model:
        raise ValueError(f"an SSDD file has the channels R, G, B, or X, Y, Z, or wavelengths, not {', '.join(names)}")
    return model


def _absolute(scan: xr.Dataset) -> tuple[Values, npt.NDArray[np.intp]]:
    azimuths = relative_azimuths(scan["phi"].values, -scan["phi_i"].values)
    if azimuths is None:
        raise ValueError(
            "the azimuths phi do not shift with phi_i, and an SSDD file has one list for all: use gonio.convert"
        )
    return azimuths


def _table(brdf: xr.DataArray, axes: list[str], scan: xr.Dataset) -> bytes:
    """The entry DATA and the table (PARAM3, 2, 1, 0, colour); binary where it is large and float32 is exact."""
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
    holds=Holds(
        anisotropic=True,
        transmission=True,
        sets=("mode", "wavelength", "channel"),
        channels=(COLOURS["rgb"], COLOURS["xyz"]),
    ),
)
