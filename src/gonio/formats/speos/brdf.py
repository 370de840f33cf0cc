"""Complete scattering of Ansys Speos (.brdf), text mode: a table with a percentage per incidence and wavelength.

The Ansys help documents the rows ("Structure of BRDF Files"), as do the converters and examples of optical-automation
(ansys_bsdf): header, mode, comment, length and text of the description, flags of reflection and transmission, kind of
values, the counts of incidences and wavelengths, their two lists; then, for each mode, incidence and wavelength (the
last runs fastest), the percentage of light that the table scatters, and the table. Where every wavelength has the same
tables, the scan gets no wavelength.
"""

import math
import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.formats import hemispheres
from gonio.formats.format import Format, Holds
from gonio.formats.hemispheres import Hemisphere, in_words
from gonio.formats.speos.tables import (
    FLAT,
    MODES,
    SpeosTable,
    bsdf,
    close_to_one,
    divided,
    grid_of,
    opened,
    provenance_rows,
    reciprocal,
    table,
)
from gonio.measured.dataset import ABSOLUTE, RELATIVE

TITLE = "Speos BRDF"
VERSIONS = ("9.0", "8.0")  # the last one is written
LEAST_INCIDENCES = 2  # which the Ansys help requires
_HEADER = re.compile(rb"(\xef\xbb\xbf)?\s*optis - brdf surface file v", re.IGNORECASE)

Place = tuple[str, float, float]  # mode, theta_i [deg], nm


def _read(path: Path) -> xr.Dataset:
    rows, provenance = opened(path, "brdf", VERSIONS, lambda text: len(text.split()) == 2)
    flags = rows.flags("the flag of reflection", "the flag of transmission")
    modes = [mode for mode, is_present in zip(MODES, flags, strict=True) if is_present]
    if not modes:
        raise rows.wrong("holds neither reflection nor transmission")
    kind = int(rows.flags("the kind of values")[0])
    sizes = rows.counts("the number of incidences", "the number of wavelengths")
    numbers = rows.numbers("the incidences", sizes[0])
    incidences = hemispheres.axis(path, rows.line, numbers, "an incidence", 0.0, 90.0) + 0.0
    numbers = rows.numbers("the wavelengths", sizes[1])
    wavelengths = hemispheres.axis(path, rows.line, numbers, "a wavelength", math.ulp(0.0), math.inf)
    tables: dict[Place, SpeosTable] = {}
    scales: dict[Place, float] = {}
    for place in product(modes, incidences.tolist(), wavelengths.tolist()):
        (percent,) = rows.numbers("the percentage of light", 1)
        if percent < 0:
            raise rows.wrong(f"the percentage of light is {percent:g}, below zero")
        tables[place] = table(rows, place[0], kind)
        scales[place] = _scale(tables[place], percent)
    rows.end()
    absolute = all(math.isfinite(scale) for scale in scales.values())
    hemispheres_ = _bsdfs(tables, scales if absolute else dict.fromkeys(scales, 1.0))
    if not all(np.isfinite(h.values).all() for h in hemispheres_):
        raise rows.wrong("the percentages scale values to infinity")
    is_flat = len(wavelengths) > 1 and len(hemispheres_) == len(modes) * len(incidences)
    history = _history(scales, absolute) + divided(list(tables.values()))
    if is_flat:
        low, high = wavelengths.min(), wavelengths.max()
        history.append(f"every table is the same from {low:g} to {high:g} nm: no wavelength")
    attrs = {"symmetry": "isotropic", "stored": f"{'BSDF' if kind else 'BSDF x cos(theta_r)'} times factors"}
    unit = ABSOLUTE if absolute else RELATIVE
    return hemispheres.dataset(hemispheres_, unit, provenance="\n".join(provenance), history=history, attrs=attrs)


def _scale(stored: SpeosTable, percent: float) -> float:
    """The factor by which the integral of a table becomes its percentage; NaN where the table has no integral."""
    if not percent and not stored.values.any():
        return 1.0
    return close_to_one(reciprocal(stored.integral) * percent / 100)


def _bsdfs(tables: dict[Place, SpeosTable], scales: dict[Place, float]) -> list[Hemisphere]:
    """The tables in 1/sr; where all wavelengths have the same, those of the first one without its wavelength."""
    bsdfs = []
    for (mode, theta_i, nm), stored in tables.items():
        theta_r, phi, values = bsdf(stored, scales[mode, theta_i, nm])
        bsdfs.append(Hemisphere(theta_i, theta_r, phi, values, sets={"mode": mode, "wavelength": nm}))
    count = len({nm for _, _, nm in tables})
    firsts = bsdfs[::count]
    if count > 1 and all(_same(first, bsdfs[k * count : (k + 1) * count]) for k, first in enumerate(firsts)):
        return [Hemisphere(h.theta_i, h.theta_r, h.phi, h.values, sets={"mode": h.sets["mode"]}) for h in firsts]
    return bsdfs


def _same(first: Hemisphere, others: Sequence[Hemisphere]) -> bool:
    return all(
        np.array_equal(getattr(first, name), getattr(other, name))
        for other in others
        for name in ("theta_r", "phi", "values")
    )


def _history(scales: dict[Place, float], absolute: bool) -> list[str]:
    """Lines for the history: how the values were scaled."""
    if not absolute:
        return ["values are relative: the percentages cannot scale tables that do not go round, or hold no light"]
    factors = sorted({scale for scale in scales.values() if scale != 1.0})
    if not factors:
        return ["the integral of each table is its percentage"]
    span = f"{factors[0]:.6g}" + (f" to {factors[-1]:.6g}" if len(factors) > 1 else "")
    return [f"tables scaled by {span}, so that their integrals are their percentages"]


def _write(scan: xr.Dataset, path: Path) -> None:
    brdf, directions = grid_of(scan, ("mode", "wavelength"), TITLE)
    if brdf.sizes["phi_i"] > 1:
        raise ValueError(f"{TITLE} holds no turned surfaces: select one phi_i, or write speos-anisotropic")
    incidences = brdf["theta_i"].values.tolist()
    if len(incidences) < LEAST_INCIDENCES:
        raise ValueError(f"{TITLE} holds two incidences at least, which Speos demands: write speos-anisotropic")
    values, wavelengths = brdf.values[:, :, :, 0], brdf["wavelength"].values
    if np.isnan(wavelengths).all():
        wavelengths, values = np.array(FLAT), np.repeat(values, len(FLAT), axis=1)
    order = np.argsort(wavelengths)
    modes = [str(mode) for mode in brdf["mode"].values]
    comment, description, _ = provenance_rows(scan)
    flags = " ".join("1" if mode in modes else "0" for mode in MODES)
    out = [f"OPTIS - brdf surface file v{VERSIONS[-1]}", "0", comment, str(len(description)), description, flags, "1"]
    out += [f"{len(incidences)} {len(order)}", in_words(incidences), in_words(wavelengths[order])]
    theta_r, phi = brdf["theta_r"].values, brdf["phi"].values
    for k, mode in enumerate(modes):
        for i, w in product(range(len(incidences)), order):
            percent = 100 * hemispheres.integral(theta_r, phi, values[k, w, i])
            out += [in_words([percent]), *directions.lines(mode, values[k, w, i])]
    path.write_text("\n".join([*out, ""]), encoding="utf-8", newline="\n")


FORMAT = Format(
    name="speos-brdf",
    title=TITLE,
    suffix=".brdf",
    recognises=lambda head: _HEADER.match(head) is not None,
    read=_read,
    write=_write,
    layout=lambda scan: hemispheres.layout(scan, anisotropic=False),
    holds=Holds(transmission=True, negative=False, sets=("mode", "wavelength")),
)
