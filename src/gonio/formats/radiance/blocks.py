"""What a WindowElement says: its blocks of data with their wavelength, mode and side, and its angle bases."""

from dataclasses import dataclass

import numpy as np

from gonio.door.elements import Element
from gonio.door.text import MOST_VALUES, clip, number
from gonio.formats.radiance import klems
from gonio.formats.radiance.klems import Basis

MODES = {"reflection": "BRDF", "transmission": "BTDF"}
SIDES = ("front", "back")
CHANNELS = {"CIE-X": "X", "CIE-Y": "Y", "CIE-Z": "Z"}
_CHROMATICITIES = ("cie-u", "cie-v")
_NANOMETRES = {"nanometer": 1.0, "nanometers": 1.0, "nm": 1.0, "micron": 1e3, "micrometer": 1e3, "um": 1e3}


@dataclass(frozen=True)
class Block:
    """One WavelengthDataBlock: its sets and the element of its data."""

    wavelength: str | float
    mode: str
    side: str
    element: Element

    @property
    def data(self) -> Element:
        return self.element.child("ScatteringData")


def about(layer: Element) -> list[str]:
    """What the file says of the material and the spectra, a line each."""
    material = layer.find("Material")
    named = list(material.children) if material else []
    for wavelength in layer.all("WavelengthData"):
        named += [e for tag in ("SourceSpectrum", "DetectorSpectrum") for e in wavelength.all(tag)]
    lines = [f"{e.tag}: {' '.join(e.text.split())} {e.attributes.get('unit', '')}".rstrip() for e in named if e.text]
    return list(dict.fromkeys(line for line in lines if not line.endswith(":")))


def blocks(layer: Element) -> tuple[list[Block], list[str]]:
    """Every block of data with its sets, and lines that say what was left out."""
    found: list[Block] = []
    left_out = []
    for element in layer.all("WavelengthData"):
        name = element.word("Wavelength")
        if name.lower() in _CHROMATICITIES:
            left_out.append(f"left out {name}, a chromaticity")
            continue
        wavelength = _wavelength(element.child("Wavelength"), name)
        for block in element.all("WavelengthDataBlock"):
            mode, side = _direction(block)
            found.append(Block(wavelength, mode, side, block))
    if not found:
        raise layer.wrong("the layer holds no WavelengthDataBlock with scattering data")
    if len({type(b.wavelength) for b in found}) > 1:
        found = [Block(str(b.wavelength), b.mode, b.side, b.element) for b in found]
    seen: set[tuple[str | float, str, str]] = set()
    for b in found:
        if (b.wavelength, b.mode, b.side) in seen:
            raise b.element.wrong(f"{b.mode} of the {b.side} for {b.wavelength} is there twice")
        seen.add((b.wavelength, b.mode, b.side))
    if {b.wavelength for b in found} >= {"Visible", "X", "Z"}:
        found = [Block("Y" if b.wavelength == "Visible" else b.wavelength, b.mode, b.side, b.element) for b in found]
    return found, list(dict.fromkeys(left_out))


def _wavelength(element: Element, name: str) -> str | float:
    """The channel's name, or the wavelength [nm]."""
    scale = _NANOMETRES.get(element.attributes.get("unit", "").lower())
    if scale is None:
        return CHANNELS.get(name.upper(), name)
    value = number(element.path, element.line, name, "a wavelength")
    if not 0 < value < 1e100:
        raise element.wrong(f"a wavelength is {clip(name)}")
    return value * scale


def _direction(block: Element) -> tuple[str, str]:
    words = block.word("WavelengthDataDirection").lower().split()
    if len(words) != 2 or words[0] not in MODES or words[1] not in SIDES:
        what = f"WavelengthDataDirection is {clip(' '.join(words))!r}, not Reflection or Transmission, Front or Back"
        raise block.child("WavelengthDataDirection").wrong(what)
    kind = block.find("ScatteringDataType")
    if kind is not None and kind.text.strip().upper() not in ("BRDF", "BTDF", "BSDF"):
        raise kind.wrong(f"ScatteringDataType is {clip(kind.text.strip())!r}, not BRDF or BTDF")
    return words[0], words[1]


def bases(definition: Element) -> tuple[dict[str, Basis], list[str]]:
    """The known bases and those that the file defines, which come first, by name in small letters."""
    bases = {b.name.lower(): b for b in klems.BASES}
    remarks = []
    for element in definition.all("AngleBasis"):
        found = _defined(element)
        known = bases.get(found.name.lower(), found)
        if known.counts == found.counts and np.allclose(known.bounds, found.bounds, atol=1e-6):
            found = known
        else:
            remarks.append(f"took the file's own definition of {known.name}, which is not Radiance's")
        bases[found.name.lower()] = found
    return bases, remarks


def _defined(element: Element) -> Basis:
    name = element.word("AngleBasisName")
    lower, counts, upper = [], [], 0.0
    for block in element.all("AngleBasisBlock"):
        bounds = block.child("ThetaBounds")
        low, high = (number(b.path, b.line, bounds.word(b.tag), b.tag) for b in _both(bounds))
        text = block.word("nPhis")
        if not text.isdecimal() or not 0 < int(text[:9]) <= 3600 or len(text) > 9:
            raise block.child("nPhis").wrong(f"nPhis is {clip(text)!r}, not a count from 1 to 3600")
        if not abs(low - upper) < 1e-6 or not low < high <= 90:
            raise bounds.wrong(f"a band reaches from {low:g} to {high:g}; it must begin at {upper:g} and end by 90 deg")
        lower.append(upper)
        counts.append(int(text))
        upper = high
    if not lower or sum(counts) ** 2 > MOST_VALUES:
        raise element.wrong(f"the angle basis {clip(name)!r} has {sum(counts)} patches")
    return Basis(name, tuple(lower), tuple(counts), upper)


def _both(bounds: Element) -> tuple[Element, Element]:
    return bounds.child("LowerTheta"), bounds.child("UpperTheta")


def basis(block: Element, tag: str, bases: dict[str, Basis]) -> Basis:
    name = block.word(tag)
    if name.lower() not in bases:
        known = clip(", ".join(b.name for b in bases.values()), 200)
        raise block.child(tag).wrong(
            f"{tag} is {clip(name)!r}, which the file does not define; there are {clip(known, 200)}"
        )
    return bases[name.lower()]
