"""Specular reflectance (.sdr) and transmittance (.sdt) of Integra: one number per incidence angle and channel.

    TypeColorModel RGB
    sigma 2
     0 60
    red
     def
      0.04 0.09
     enddef
    green
     ..

Integra's own description is not public; the grammar is that of libbsdf (SdrReader.cpp).

A specular reflectance is the weight of a Dirac lobe, not a BRDF in 1/sr. So the scan has one direction per incidence
angle, the mirror direction, with values in a.u.; its attribute `quantity` states what the numbers are, and only such
scans are written. No keyword states reflection or transmission: the suffix .sdt means transmission, and so does a
comment that gonio writes.
"""

import functools
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.formats.integra.text import (
    colour_words,
    head_lines,
    keywords,
    open_words,
    read_header,
    read_tables,
    refuse_other_suffix,
    row_of,
    sets_of,
    transmission,
)
from gonio.formats.specular_scan import REFLECTANCE, TRANSMITTANCE, specular_scan
from gonio.measured.dataset import RELATIVE, add_history, flatten, sets, unit


def _read(path: Path) -> xr.Dataset:
    words = open_words(path)
    header = read_header(words)
    theta_i = header.axes["sigma"]
    tables = read_tables(words, header, len(theta_i), factors=0)
    for table in tables:
        if np.any(table.values < 0):
            raise FormatError(path, f"a reflectance is {table.values.min():g}, below zero", f"line {table.line}")
    values = np.array([t.values for t in tables])
    evidence = transmission(path, header)
    scan = specular_scan(theta_i, values, sets_of(tables), bool(evidence), header.provenance)
    return add_history(scan, f"transmission, {evidence}") if evidence else scan


def _write(is_transmitted: bool, scan: xr.Dataset, path: Path) -> None:
    refuse_other_suffix(path, is_transmitted)
    stored = TRANSMITTANCE if is_transmitted else REFLECTANCE
    flat = flatten(scan)
    at_mirror = np.allclose(flat["theta_r"], flat["theta_i"]) and np.allclose(flat["phi"], 180.0)
    if scan.attrs.get("quantity") != stored or unit(scan) != RELATIVE or not at_mirror:
        raise ValueError(
            f"the scan is no {stored}: a BRDF cannot be written as one; write .ddr, .ddt or another format"
        )
    along = [n for n in sets(flat) if n != "mode"]
    if len(along) > 1 or not set(along) <= {"wavelength", "channel"}:
        raise ValueError(f"an Integra file has sets along wavelength or channel, not {' and '.join(along)}")
    name = next((n for n in ("wavelength", "channel") if n in flat.coords), "")
    labels = np.broadcast_to(flat[name].values if name else "", flat.sizes["direction"])
    names = list(dict.fromkeys(labels.tolist()))
    parts = [flat.isel(direction=np.flatnonzero(labels == n)) for n in names]
    theta_i = parts[0]["theta_i"].values
    if any(not np.array_equal(p["theta_i"].values, theta_i) for p in parts) or np.any(np.diff(theta_i) <= 0):
        raise ValueError("the incidence angles do not ascend, or differ from channel to channel")
    if np.isnan(flat["brdf"].values).any():
        raise ValueError("the scan has gaps, and an Integra file can hold none")
    colours, keys = colour_words(names)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        head = head_lines(scan.attrs.get("provenance", ""), is_transmitted)
        print(*head, f"TypeColorModel {colours}", f"sigma {len(theta_i)}", f" {row_of(theta_i)}", sep="\n", file=file)
        for key, part in zip(keys, parts, strict=True):
            print(key, " def", f"  {row_of(part['brdf'].values)}", " enddef", sep="\n", file=file)


def _recognises(is_marked: bool, head: bytes) -> bool:
    first_words = keywords(head)
    is_specular = {"typecolormodel", "sigma"} <= first_words.words and not first_words.words & {
        "typesym",
        "theta",
        "phi",
    }
    return is_specular and first_words.is_marked == is_marked


def _format(name: str, title: str, suffix: str, is_transmitted: bool) -> Format:
    return Format(
        name=name,
        title=title,
        suffix=suffix,
        recognises=functools.partial(_recognises, is_transmitted),
        read=_read,
        write=functools.partial(_write, is_transmitted),
        holds=Holds(
            azimuths=False,
            reflection=not is_transmitted,
            transmission=is_transmitted,
            relative=True,
            negative=False,
            sets=("wavelength", "channel"),
            channels=(("R", "G", "B"),),
            quantity=TRANSMITTANCE if is_transmitted else REFLECTANCE,
        ),
    )


FORMAT = _format("integra-specular", "Integra specular table", ".sdr", is_transmitted=False)
TRANSMITTED = _format(
    "integra-specular-transmission", "Integra specular table of transmission", ".sdt", is_transmitted=True
)
