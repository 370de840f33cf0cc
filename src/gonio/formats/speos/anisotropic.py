"""Anisotropic BSDF of Ansys Speos (.anisotropicbsdf), text mode: tables per orientation and incidence, and a spectrum.

The Ansys help documents the rows ("Structure of Anisotropic BSDF Files"), as do the converters of optical-automation
(ansys_bsdf): header, mode, comment, length and text of the description, anisotropy vector, flags of reflection and
transmission, kind of values; then for each mode the count and list of anisotropy angles and, for each of these, of
incidences; for each mode the incidence and anisotropy angle of the spectrum, its description, its length and its rows
`nm percent`; then the tables in the order of the lists.

The spectrum is the integral of the table at the spectrum's incidence: BSDF(nm) = table x percent(nm) / 100 / integral.
Between two incidences the reciprocals of the integrals are interpolated linearly; outside the list that of the nearest
incidence is used. Where a spectrum of several wavelengths is constant, the scan gets no wavelength. The anisotropy
angle is the angle from the plane of incidence, in the forward direction, to the anisotropy vector, counterclockwise;
phi_i, the azimuth of the incident light from that vector, is 180 deg minus this angle. The vector is 1 0 0 where the
provenance states no other.
"""

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.formats import hemispheres
from gonio.formats.format import Format, Holds
from gonio.formats.hemispheres import Hemisphere, in_words
from gonio.formats.speos.spectrum import Spectrum, rounded, scale_of, separated
from gonio.formats.speos.tables import (
    DEFAULT_VECTOR,
    MODES,
    MOST_VALUES,
    VECTOR,
    SpeosLines,
    SpeosTable,
    bsdf,
    close_to_one,
    divided,
    grid_of,
    opened,
    provenance_rows,
    scaled,
    table,
)
from gonio.measured.dataset import ABSOLUTE, RELATIVE

TITLE = "Speos anisotropic BSDF"
VERSIONS = ("7.0", "8.0")  # the last one is written
LATER = ("9.0", "10.0", "11", "11.0")  # with the same rows in text mode; 11 was seen, as pyspeos has it
HALF_TURN = 180.0
_HEADER = re.compile(rb"(\xef\xbb\xbf)?\s*optis - anisotropic bsdf surface file v(?!1\.0\b)", re.IGNORECASE)


def _read(path: Path) -> xr.Dataset:
    rows, provenance = opened(path, "anisotropic bsdf", (*VERSIONS, *LATER), lambda text: len(text.split()) == 3)
    vector = in_words(rows.numbers("the anisotropy vector", 3))
    provenance += [VECTOR + vector] if vector != DEFAULT_VECTOR else []
    flags = rows.flags("the flag of reflection", "the flag of transmission")
    modes = [mode for mode, is_present in zip(MODES, flags, strict=True) if is_present]
    if not modes:
        raise rows.wrong("holds neither reflection nor transmission")
    kind = int(rows.flags("the kind of values")[0])
    places = {mode: _places(rows, mode) for mode in modes}
    spectra = {}
    for mode in modes:
        spectra[mode], text = _spectrum(rows)
        provenance += [f"{mode} spectrum: {text}"] if text else []
    tables = {mode: [table(rows, mode, kind) for _ in places[mode]] for mode in modes}
    rows.end()
    scales = {mode: scale_of(places[mode], tables[mode], spectra[mode]) for mode in modes}
    absolute = all(math.isfinite(scale) for scale in scales.values())
    is_flat = all(s.is_flat for s in spectra.values())
    size = sum(t.values.size * (1 if is_flat else len(spectra[m].nm)) for m in modes for t in tables[m])
    if size > MOST_VALUES:
        raise rows.wrong(f"tables times wavelengths are {size} values, more than {MOST_VALUES}: thin out the spectrum")
    hemispheres_ = [h for m in modes for h in _bsdfs(m, places[m], tables[m], spectra[m], scales[m], absolute, is_flat)]
    if not all(np.isfinite(h.values).all() for h in hemispheres_):
        raise rows.wrong("the spectrum scales values to infinity")
    history = [line for m in modes for line in _history(m, spectra[m], scales[m], absolute, is_flat)]
    history += divided([t for m in modes for t in tables[m]])
    turned = any(h.phi_i is not None for h in hemispheres_)
    attrs = {"symmetry": "anisotropic" if turned else "isotropic"}
    attrs["stored"] = f"{'BSDF' if kind else 'BSDF x cos(theta_r)'} times a factor, and a spectrum of its integral"
    unit = ABSOLUTE if absolute else RELATIVE
    return hemispheres.dataset(hemispheres_, unit, provenance="\n".join(provenance), history=history, attrs=attrs)


def _places(rows: SpeosLines, mode: str) -> list[tuple[float, float]]:
    """Anisotropy angle and incidence [deg] of each table of one mode, in order."""
    places = []
    for anisotropy in _list(rows, f"anisotropy angles in {mode}", 0.0, 360.0):
        places += [(anisotropy, theta_i) for theta_i in _list(rows, f"incidences in {mode}", 0.0, 90.0)]
    return places


def _list(rows: SpeosLines, expected: str, low: float, high: float) -> list[float]:
    (count,) = rows.counts(f"the number of {expected}")
    angles = rows.numbers(expected, count)
    return [float(a) + 0.0 for a in hemispheres.axis(rows.path, rows.line, angles, expected, low, high)]


def _spectrum(rows: SpeosLines) -> tuple[Spectrum, str]:
    """The spectrum of one mode and its description."""
    theta_i, anisotropy = rows.numbers("the angles of the spectrum", 2)
    hemispheres.axis(rows.path, rows.line, [theta_i], "the incidence of the spectrum", 0.0, 90.0)
    text = rows.text("the description of the spectrum").strip()
    (count,) = rows.counts("the number of wavelengths")
    pairs = []
    for _ in range(count):
        pairs.append(rows.numbers("a wavelength and its percentage", 2))
        if pairs[-1][0] <= 0 or pairs[-1][1] < 0:
            raise rows.wrong(f"{pairs[-1][1]:g} % at {pairs[-1][0]:g} nm: neither may be negative, nor nm zero")
    nm = hemispheres.axis(rows.path, rows.line, [row[0] for row in pairs], "a wavelength", 0.0, math.inf)
    up = np.argsort(nm)
    return Spectrum(theta_i, anisotropy, nm[up], np.array([row[1] for row in pairs])[up] / 100), text


def _bsdfs(
    mode: str,
    places: Sequence[tuple[float, float]],
    tables: Sequence[SpeosTable],
    spectrum: Spectrum,
    scale: float,
    absolute: bool,
    is_flat: bool,
) -> list[Hemisphere]:
    """The tables of one mode in 1/sr, once for each wavelength unless `is_flat`; unscaled unless `absolute`."""
    reference = int(spectrum.parts.argmax())
    factor = close_to_one(scale * float(spectrum.parts[reference])) if absolute else 1.0
    turned = len({anisotropy for anisotropy, _ in places}) > 1 or places[0][0] != 0
    highest = float(spectrum.parts[reference])
    ratios = {
        float(n): rounded(float(p) / highest) if highest else 1.0
        for n, p in zip(spectrum.nm, spectrum.parts, strict=True)
    }
    sets_and_ratios: list[tuple[dict[str, str | float], float]] = [({"mode": mode}, 1.0)]
    if not is_flat:
        sets_and_ratios = [({"mode": mode, "wavelength": n}, r) for n, r in ratios.items()]
    bsdfs = []
    for (anisotropy, theta_i), stored in zip(places, tables, strict=True):
        theta_r, phi, values = bsdf(stored, factor)
        phi_i = float(hemispheres.turned(HALF_TURN - anisotropy)) if turned else None
        for sets, ratio in sets_and_ratios:
            part = scaled(values, ratio)
            bsdfs.append(Hemisphere(theta_i, theta_r, phi, part, phi_i=phi_i, sets=sets))
    return bsdfs


def _history(mode: str, spectrum: Spectrum, scale: float, absolute: bool, is_flat: bool) -> list[str]:
    """Lines for the history: how the values of one mode were scaled."""
    at = f"at theta_i = {spectrum.theta_i:g} deg"
    if not absolute:
        return [f"{mode} is relative: the spectrum {at} cannot scale tables that do not go round, or hold no light"]
    highest = float(spectrum.parts.max())
    if close_to_one(scale * highest) == 1.0:
        history = [f"the integral of the {mode} table {at} is the spectrum's {highest:.4%}"]
    else:
        history = [f"{mode} scaled by {scale * highest:.6g}, so that its integral {at} is the spectrum's {highest:.4%}"]
    if is_flat:
        history.append(f"the {mode} spectrum is flat from {spectrum.nm[0]:g} to {spectrum.nm[-1]:g} nm: no wavelength")
    elif len(spectrum.nm) > 1:
        history.append(
            f"at {len(spectrum.nm)} wavelengths one {mode} table times the spectrum, not as many measurements"
        )
    return history


def _write(scan: xr.Dataset, path: Path) -> None:
    brdf, directions = grid_of(scan, ("mode", "wavelength"), TITLE)
    modes = [str(mode) for mode in brdf["mode"].values]
    comment, description, vector = provenance_rows(scan)
    turned = hemispheres.turned(HALF_TURN - np.nan_to_num(brdf["phi_i"].values, nan=HALF_TURN))
    order = np.argsort(turned)
    incidences = brdf["theta_i"].values.tolist()
    lists = [str(len(turned)), in_words(turned[k] for k in order)]
    lists += [str(len(incidences)), in_words(incidences)] * len(turned)
    out = [
        f"OPTIS - Anisotropic BSDF surface file v{VERSIONS[-1]}",
        "0",
        comment,
        str(len(description)),
        description,
        vector,
    ]
    out += [" ".join("1" if mode in modes else "0" for mode in MODES), "1", *lists * len(modes)]
    tables = []
    for k, mode in enumerate(modes):
        base_table, spectrum = separated(brdf.isel(mode=k), int(order[0]), TITLE)
        out += [
            f"{in_words([spectrum[0]])} {in_words([turned[order[0]]])}",
            _spectrum_description(scan, mode),
            str(len(spectrum[1])),
        ]
        out += spectrum[1]
        for i in order:
            for part in base_table[:, i]:
                tables += directions.lines(mode, part)
    path.write_text("\n".join([*out, *tables, "End of file", ""]), encoding="utf-8", newline="\n")


def _spectrum_description(scan: xr.Dataset, mode: str) -> str:
    start = f"{mode} spectrum: "
    lines = scan.attrs.get("provenance", "").splitlines()
    return next((line.removeprefix(start) for line in lines if line.startswith(start)), "")


FORMAT = Format(
    name="speos-anisotropic",
    title=TITLE,
    suffix=".anisotropicbsdf",
    recognises=lambda head: _HEADER.match(head) is not None,
    read=_read,
    write=_write,
    layout=lambda scan: hemispheres.layout(scan, anisotropic=True),
    holds=Holds(anisotropic=True, transmission=True, negative=False, sets=("mode", "wavelength")),
)
