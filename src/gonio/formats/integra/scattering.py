"""Diffuse reflectance (.ddr) and transmittance (.ddt) of Integra: tables about the mirror direction.

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

Integra's own description is not public; the grammar is that of libbsdf (DdrReader.cpp and DdrWriter.cpp).

sigma is theta_i, theta the angle from the mirror direction, phi the azimuth about it, 0 towards the normal; psi of a 4D
file is the azimuth of the incident light. In a table theta runs fastest, then phi, sigma and psi. A luminance is pi
times the BRDF, an intensity is the BRDF times cos(theta_r); both are divided by kbdf. Where data are relative,
kbdf is the directional-hemispherical reflectance instead. Where light is refracted, sigmat has the angles of the
directions from which theta is measured. The azimuths that AxiSymmetrical leaves out are filled in; for DirSymmetrical
nothing is filled in, as its meaning is not public. No keyword states reflection or transmission: the suffix .ddt means
transmission, and so does a comment that gonio writes.
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
    ChannelTable,
    IntegraHeader,
    colour_words,
    head_lines,
    keywords,
    open_words,
    read_header,
    read_tables,
    refuse_other_suffix,
    row_of,
    sets_of,
    tables_of,
    transmission,
)
from gonio.formats.mirror_grid import existing_grid, mirror_grid
from gonio.measured.coordinates import grid
from gonio.measured.dataset import ABSOLUTE, HORIZON, RELATIVE, add_history, flatten, unit

Values = npt.NDArray[np.float64]

AXES = {"theta_i": "sigma", "theta_s": "theta", "phi_s": "phi", "phi_i": "psi"}
_FILE_ORDER = ("phi_i", "theta_i", "phi_s", "theta_s")
_ROUND = np.array([0.0, 45.0, 90.0, 135.0, 180.0])  # deg; azimuths at which a lobe without azimuths is repeated
_SYMMETRY = {
    "AxiSymmetrical": "plane-symmetrical",
    "PlaneSymmetrical": "plane-symmetrical",
    "ASymmetrical 4D": "anisotropic",
}
_GRAZING = 1e-6  # cosine; an intensity nearer to the horizon gives no BRDF


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


def _azimuths(header: IntegraHeader) -> tuple[Values, npt.NDArray[np.intp]]:
    """The azimuths [deg] of the scan, with those that a symmetry of the file leaves out, and a row for each."""
    phi = header.axes["phi"]
    rows = np.arange(len(phi))
    if header.symmetry == "AxiSymmetrical":
        return _ROUND, np.zeros(len(_ROUND), dtype=np.intp)
    if header.symmetry == "PlaneSymmetrical" and "sigmat" in header.axes and phi[-1] <= 180:
        other = rows[(phi > 0) & (phi < 180)][::-1]
        return np.concatenate([phi, 360 - phi[other]]), np.concatenate([rows, other])
    return phi, rows


def _directions(header: IntegraHeader, axes: dict[str, Values]) -> xr.Dataset:
    """The coordinates of the file's nodes; theta is about the refracted direction where the file has sigmat."""
    nodes = grid("specular", **axes)
    if "sigmat" not in header.axes:
        return nodes
    centre = grid("specular", **(axes | {"theta_i": header.axes["sigmat"]}))
    return nodes.assign_coords({n: (centre[n].dims, centre[n].values, centre[n].attrs) for n in ("theta_r", "phi")})


def _brdf(path: Path, header: IntegraHeader, table: ChannelTable, values: Values, directions: xr.Dataset) -> Values:
    """The BRDF [1/sr] of one table, with the axes in the order of AXES; relative values without kbdf stay unchanged."""
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
        raise FormatError(path, "kbdf and the table give values that are not finite", f"line {table.line}")
    return (values / scale).transpose([names.index(n) for n in AXES if n in names])


def _reflectances(path: Path, header: IntegraHeader, table: ChannelTable, luminance: Values) -> Values:
    centre = header.axes.get("sigmat", header.axes["sigma"])
    phi = _azimuths(header)[0]
    try:
        reflectances = lobe_reflectances(centre, phi, header.axes["theta"], luminance / np.pi)
    except ValueError as error:
        raise FormatError(path, f"kbdf of relative data needs a whole lobe: {error}", f"line {table.line}") from error
    return reflectances[..., None, None]


def _dataset(
    path: Path, header: IntegraHeader, tables: list[ChannelTable], directions: xr.Dataset, values: Values
) -> xr.Dataset:
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
    evidence = transmission(path, header)
    if evidence:
        scan = scan.assign_coords(mode="transmission")
    if "sigmat" in header.axes:
        scan = flatten(scan)
    history = _history(header, tables, evidence)
    if lost:
        history.append(f"{lost} values below the horizon left out")
    grazing = np.cos(np.radians(directions["theta_r"].values)) <= _GRAZING
    if header.is_intensity and (unknown := int(np.count_nonzero(np.broadcast_to(grazing, below.shape) & ~below))):
        history.append(f"{unknown} intensities at the horizon, which say nothing about the BRDF, read as 0")
    if not np.nan_to_num(scan["brdf"].values).any():
        history.append("every value is zero")
    return functools.reduce(add_history, history, scan).assign_attrs(_stored(header))


def _stored(header: IntegraHeader) -> dict[str, str]:
    return {"stored": "intensity: BRDF x cos(theta_r)"} if header.is_intensity else {}


def _history(header: IntegraHeader, tables: list[ChannelTable], evidence: str) -> list[str]:
    """Lines for the history: what was done to the values of the file."""
    factors = [t.factors for t in tables if t.factors is not None]
    history = []
    if header.is_intensity:
        history.append("cos(theta_r) divided out of the intensities")
    if header.is_relative and factors:
        history.append("each lobe scaled to the hemispherical reflectance that the file states as kbdf")
    elif any(np.any(f != 1) for f in factors):
        history.append("multiplied by the factors kbdf")
    if header.symmetry == "AxiSymmetrical":
        history.append("AxiSymmetrical: the file's one azimuth stands for all about the mirror direction")
    if header.symmetry == "DirSymmetrical":
        history.append("DirSymmetrical: azimuths as they stand in the file, none filled in")
    if "sigmat" in header.axes:
        history.append("angles of the file counted from the refracted direction, sigmat")
    if evidence:
        history.append(f"transmission, {evidence}")
    return history


def _layout(scan: xr.Dataset) -> xr.Dataset:
    existing = existing_grid(scan, "specular")
    return mirror_grid(scan) if existing is None else existing


def _write(is_transmitted: bool, scan: xr.Dataset, path: Path) -> None:
    if existing_grid(scan, "specular") is None:
        raise ValueError("an Integra file has a grid about the mirror direction, and the scan has none: gonio.convert")
    refuse_other_suffix(path, is_transmitted)
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
    """Pi times the BRDF; the neighbouring float where only that, divided by pi, gives the BRDF exactly."""
    product = brdf * np.pi
    for near in (np.nextafter(product, -np.inf), np.nextafter(product, np.inf)):
        product = np.where((product / np.pi != brdf) & (near / np.pi == brdf), near, product)
    return product


def _recognises(is_marked: bool, head: bytes) -> bool:
    first_words = keywords(head)
    is_diffuse = "typecolormodel" in first_words.words and bool(first_words.words & {"typesym", "theta", "phi"})
    return is_diffuse and first_words.is_marked == is_marked


def _format(name: str, title: str, suffix: str, is_transmitted: bool) -> Format:
    return Format(
        name=name,
        title=title,
        suffix=suffix,
        recognises=functools.partial(_recognises, is_transmitted),
        read=_read,
        write=functools.partial(_write, is_transmitted),
        layout=_layout,
        holds=Holds(
            anisotropic=True,
            reflection=not is_transmitted,
            transmission=is_transmitted,
            relative=True,
            sets=("wavelength", "channel"),
            channels=(("R", "G", "B"),),
        ),
    )


FORMAT = _format("integra", "Integra diffuse table", ".ddr", is_transmitted=False)
TRANSMITTED = _format("integra-transmission", "Integra diffuse table of transmission", ".ddt", is_transmitted=True)
