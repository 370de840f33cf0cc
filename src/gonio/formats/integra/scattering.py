"""Integra's diffuse reflectance (.ddr) and transmittance (.ddt): tables about the mirror direction.

    ;; a comment
    TypeSym PlaneSymmetrical
    TypeColorModel BW
    TypeData Luminance Absolute
    sigma 2
     0 45
    phi 3
     0 90 180
    theta 2
     0 30
    bw
     kbdf
      1 1
     def
     ..
     enddef

sigma is theta_i, theta the angle from the mirror direction, phi the azimuth about it, from the side of the normal; psi
of a 4D file is the azimuth of the incident light. A table runs over theta, then phi, sigma, psi. A luminance is pi
times the BRDF, an intensity the BRDF times cos(theta_r), both divided by kbdf; where data are relative kbdf is the
hemispherical reflectance instead. sigmat are the angles of the directions about which theta is counted where light is
refracted. What AxiSymmetrical leaves out is filled in; DirSymmetrical fills in nothing, as its meaning is not public.
Nothing in a file says whether light was reflected or went through: the suffix .ddt does, or a comment of gonio's.
"""

import functools
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.formats.integra.lobe_reflectance import lobe_reflectances
from gonio.formats.integra.text import (
    Header,
    Table,
    colour_words,
    head_lines,
    keywords,
    open_words,
    read_header,
    read_tables,
    row_of,
    sets_of,
    tables_of,
    transmission,
)
from gonio.formats.mirror_grid import mirror_grid, own_grid
from gonio.measured.coordinates import grid
from gonio.measured.dataset import ABSOLUTE, HORIZON, RELATIVE, add_history, flatten, unit

Values = npt.NDArray[np.float64]

AXES = {"theta_i": "sigma", "theta_s": "theta", "phi_s": "phi", "phi_i": "psi"}
_FILE_ORDER = ("phi_i", "theta_i", "phi_s", "theta_s")
_ROUND = np.array([0.0, 45.0, 90.0, 135.0, 180.0])  # azimuths that stand for all where a lobe has none
_SYMMETRY = {
    "AxiSymmetrical": "plane-symmetrical",
    "PlaneSymmetrical": "plane-symmetrical",
    "ASymmetrical 4D": "anisotropic",
}
_GRAZING = 1e-6  # cosine; an intensity nearer to the horizon says no BRDF


def _read(path: Path) -> xr.Dataset:
    words = open_words(path)
    header = read_header(words)
    for key in ("theta", "phi"):
        if key not in header.axes:
            raise words.wrong(f"no {key} before the first table")
    if header.symmetry == "AxiSymmetrical" and len(header.axes["phi"]) > 1:
        raise words.wrong("an AxiSymmetrical lobe with several azimuths: it has one")
    if (header.symmetry == "ASymmetrical 4D") != ("psi" in header.axes):
        raise words.wrong("psi belongs to TypeSym ASymmetrical 4D, and one of the two is missing")
    axes = {name: header.axes[key] for name, key in AXES.items() if key in header.axes}
    shape = tuple(len(axes[n]) for n in _FILE_ORDER if n in axes)
    tables = read_tables(words, header, math.prod(shape), math.prod(shape[:-2]))
    axes["phi_s"], rows = _azimuths(header)
    directions = _directions(header, axes)
    values = [_brdf(path, header, t, np.take(t.values.reshape(shape), rows, axis=-2), directions) for t in tables]
    return _dataset(path, header, tables, directions, np.array(values))


def _azimuths(header: Header) -> tuple[Values, npt.NDArray[np.intp]]:
    """The azimuths [deg] of the scan, and the file's row for each: symmetries that a grid cannot say filled in."""
    phi = header.axes["phi"]
    rows = np.arange(len(phi))
    if header.symmetry == "AxiSymmetrical":
        return _ROUND, np.zeros(len(_ROUND), dtype=np.intp)
    if header.symmetry == "PlaneSymmetrical" and "sigmat" in header.axes and phi[-1] <= 180:
        other = rows[(phi > 0) & (phi < 180)][::-1]
        return np.concatenate([phi, 360 - phi[other]]), np.concatenate([rows, other])
    return phi, rows


def _directions(header: Header, axes: dict[str, Values]) -> xr.Dataset:
    """The coordinates of the file's nodes, about the refracted direction where the file has one."""
    found = grid("specular", **axes)
    if "sigmat" not in header.axes:
        return found
    centre = grid("specular", **(axes | {"theta_i": header.axes["sigmat"]}))
    return found.assign_coords({n: (centre[n].dims, centre[n].values, centre[n].attrs) for n in ("theta_r", "phi")})


def _brdf(path: Path, header: Header, table: Table, values: Values, directions: xr.Dataset) -> Values:
    """The BRDF [sr-1] of one table on the grid's own axes; what is relative without kbdf stays as it is."""
    names = [n for n in _FILE_ORDER if n in directions.dims]
    cosine = np.cos(np.radians(directions["theta_r"].transpose(*names).values))
    scale = 1.0 if header.is_relative and table.factors is None else np.pi
    with np.errstate(all="ignore"):
        if header.is_intensity:
            values = np.where(cosine > _GRAZING, values * scale / np.maximum(cosine, _GRAZING), 0.0)
        if table.factors is not None:
            factors = table.factors.reshape((*values.shape[:-2], 1, 1))
            values = values * (factors / _reflectances(path, header, table, values) if header.is_relative else factors)
    if not np.all(np.isfinite(values)):
        raise FormatError(path, "kbdf and the table give values without bounds", f"line {table.line}")
    return (values / scale).transpose([names.index(n) for n in AXES if n in names])


def _reflectances(path: Path, header: Header, table: Table, luminance: Values) -> Values:
    centre = header.axes.get("sigmat", header.axes["sigma"])
    phi = _azimuths(header)[0]
    try:
        found = lobe_reflectances(centre, phi, header.axes["theta"], luminance / np.pi)
    except ValueError as error:
        raise FormatError(path, f"kbdf of relative data needs a whole lobe: {error}", f"line {table.line}") from error
    return found[..., None, None]


def _dataset(path: Path, header: Header, tables: list[Table], directions: xr.Dataset, values: Values) -> xr.Dataset:
    sets = sets_of(tables)
    values = values if sets else values[0]
    below = np.broadcast_to(directions["theta_r"].values > HORIZON, values.shape)
    lost = int(np.count_nonzero(np.nan_to_num(values[below])))
    values = np.where(below, np.nan, values)
    is_relative = header.is_relative and tables[0].factors is None
    dims = (*sets, *(n for n in AXES if n in directions.dims))
    scan = directions.assign_coords({n: (n, v, {"units": "nm"} if n == "wavelength" else {}) for n, v in sets.items()})
    scan = scan.assign(brdf=(dims, values, {"units": RELATIVE if is_relative else ABSOLUTE}))
    scan.attrs = {"Conventions": "CF-1.11", "history": "", "provenance": header.provenance}
    if header.symmetry in _SYMMETRY:
        scan.attrs["symmetry"] = _SYMMETRY[header.symmetry]
    whence = transmission(path, header)
    if whence:
        scan = scan.assign_coords(mode="transmission")
    if "sigmat" in header.axes:
        scan = flatten(scan)
    said = _words(header, tables, whence)
    if lost:
        said.append(f"{lost} values below the horizon left out")
    grazing = np.cos(np.radians(directions["theta_r"].values)) <= _GRAZING
    if header.is_intensity and (unknown := int(np.count_nonzero(np.broadcast_to(grazing, below.shape) & ~below))):
        said.append(f"{unknown} intensities at the horizon, which say nothing about the BRDF, read as 0")
    if not np.nan_to_num(scan["brdf"].values).any():
        said.append("every value is zero")
    return functools.reduce(add_history, said, scan).assign_attrs(_stored(header))


def _stored(header: Header) -> dict[str, str]:
    return {"stored": "intensity: BRDF x cos(theta_r)"} if header.is_intensity else {}


def _words(header: Header, tables: list[Table], whence: str) -> list[str]:
    """What was done to the file's values and what was not, a line each."""
    factors = [t.factors for t in tables if t.factors is not None]
    said = []
    if header.is_intensity:
        said.append("cos(theta_r) divided out of the intensities")
    if header.is_relative and factors:
        said.append("each lobe scaled to the hemispherical reflectance that the file states as kbdf")
    elif any(np.any(f != 1) for f in factors):
        said.append("multiplied by the factors kbdf")
    if header.symmetry == "AxiSymmetrical":
        said.append("AxiSymmetrical: the file's one azimuth stands for all about the mirror direction")
    if header.symmetry == "DirSymmetrical":
        said.append("DirSymmetrical: azimuths as they stand in the file, none filled in")
    if "sigmat" in header.axes:
        said.append("angles of the file counted from the refracted direction, sigmat")
    if whence:
        said.append(f"light that went through, {whence}")
    return said


def _layout(scan: xr.Dataset) -> xr.Dataset:
    found = own_grid(scan, "specular")
    return mirror_grid(scan) if found is None else found


def _write(is_transmitted: bool, scan: xr.Dataset, path: Path) -> None:
    if own_grid(scan, "specular") is None:
        raise ValueError("an Integra file has a grid about the mirror direction, and the scan has none: gonio.convert")
    modes = set(np.atleast_1d(scan["mode"].values).tolist()) if "mode" in scan.coords else set()
    if modes and modes != {"transmission" if is_transmitted else "reflection"}:
        raise ValueError(
            f"light of {' and '.join(sorted(modes))} in one file: .ddr is for reflection, .ddt for the other"
        )
    names, tables = tables_of(scan, tuple(n for n in _FILE_ORDER if n in scan["brdf"].dims))
    colours, keys = colour_words(names)
    axes = {key: scan[n].values for n, key in AXES.items() if n in scan["brdf"].dims}
    is_absolute = unit(scan) == ABSOLUTE
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for line in head_lines(scan.attrs.get("provenance", ""), is_transmitted):
            print(line, file=file)
        print(f"TypeSym {_symmetry(axes)}\nTypeColorModel {colours}", file=file)
        print(f"TypeData Luminance {'Absolute' if is_absolute else 'Relative'}", file=file)
        for key in ("psi", "sigma", "phi", "theta"):
            if key in axes:
                print(f"{key} {len(axes[key])}\n {row_of(axes[key])}", file=file)
        for word, values in zip(keys, tables, strict=True):
            print(word, file=file)
            if is_absolute:
                print(f" kbdf\n  {' '.join(['1'] * math.prod(values.shape[:-2]))}", file=file)
            print(" def", file=file)
            rows = (_luminance(values) if is_absolute else values).reshape(-1, values.shape[-1])
            file.writelines(f"  {row_of(row)}\n" for row in rows)
            print(" enddef", file=file)


def _symmetry(axes: dict[str, Values]) -> str:
    if "psi" in axes:
        return "ASymmetrical 4D"
    return "PlaneSymmetrical" if axes["phi"][0] == 0 and axes["phi"][-1] == 180 else "ASymmetrical"


def _luminance(brdf: Values) -> Values:
    """Pi times the BRDF, moved by the last digit where the BRDF then comes back as it was."""
    product = brdf * np.pi
    for near in (np.nextafter(product, -np.inf), np.nextafter(product, np.inf)):
        product = np.where((product / np.pi != brdf) & (near / np.pi == brdf), near, product)
    return product


def _recognises(is_marked: bool, head: bytes) -> bool:
    found = keywords(head)
    is_diffuse = "typecolormodel" in found.words and bool(found.words & {"typesym", "theta", "phi"})
    return is_diffuse and found.is_marked == is_marked


def _format(name: str, title: str, suffix: str, is_transmitted: bool) -> Format:
    return Format(
        name=name,
        title=title,
        suffix=suffix,
        recognises=functools.partial(_recognises, is_transmitted),
        read=_read,
        write=functools.partial(_write, is_transmitted),
        layout=_layout,
        holds=Holds(anisotropic=True, transmission=is_transmitted, relative=True, sets=("wavelength", "channel")),
    )


FORMAT = _format("integra", "Integra diffuse table", ".ddr", is_transmitted=False)
TRANSMITTED = _format("integra-transmission", "Integra diffuse table of transmission", ".ddt", is_transmitted=True)
