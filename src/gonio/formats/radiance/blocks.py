"""Reading a WindowElement: its blocks of data with their wavelength, mode and side, and its angle bases.

The elements are those that Radiance's readers bsdf_m.c (matrices) and bsdf_t.c (tensor trees) know.
"""

from dataclasses import dataclass

import numpy as np

from gonio.door.elements import Element
from gonio.door.text import MOST_VALUES, clip, number
from gonio.formats.radiance import klems
from gonio.formats.radiance.klems import Basis

MODES = {"reflection": "BRDF", "transmission": "BTDF"}
SIDES = ("front", "back")
CHANNELS = {"CIE-X": "X", "CIE-Y": "Y", "CIE-Z": "Z"}
SPECTRA = ("SourceSpectrum", "DetectorSpectrum")  # of each WavelengthData
_CHROMATICITIES = ("cie-u", "cie-v")
_NANOMETRES = {"nanometer": 1.0, "nanometers": 1.0, "nm": 1.0, "micron": 1e3, "micrometer": 1e3, "um": 1e3}


@dataclass(frozen=True)
class WavelengthDataBlock:
    """One WavelengthDataBlock: its wavelength [nm] or channel, mode and side, and the XML element itself."""

    wavelength: str | float
    mode: str
    side: str
    element: Element

    @property
    def data(self) -> Element:
        """The element ScatteringData."""
        return self.element.child("ScatteringData")


def about(layer: Element) -> list[str]:
    """Lines `name: text unit` of provenance on the material and on the spectra of source and detector.

    An element within another is called after both, and a spectrum that differs between the blocks after its wavelength,
    as in `SourceSpectrum of Visible`.
    """
    material = layer.find("Material")
    lines = []
    for element in material.children if material else []:
        lines += [_told(element.tag, element), *(_told(f"{element.tag} {e.tag}", e) for e in element.children)]
    for tag in SPECTRA:
        told = {_name_of(e): _told(tag, spectrum) for e in layer.all("WavelengthData") for spectrum in e.all(tag)}
        same = len(set(told.values())) == 1 and len(told) == len(set(map(_name_of, layer.all("WavelengthData"))))
        lines += [line if same or not line else line.replace(tag, f"{tag} of {name}", 1) for name, line in told.items()]
    return list(dict.fromkeys(filter(None, lines)))


def _told(name: str, element: Element) -> str:
    """The element as a line of provenance; empty where it has no text."""
    text = " ".join(element.text.split())
    return f"{name}: {text} {element.attributes.get('unit', '')}".rstrip() if text else ""


def _name_of(wavelength_data: Element) -> str:
    """What the file calls the wavelength, a number as Python prints it."""
    name = wavelength_data.word("Wavelength")
    try:
        return repr(float(name))
    except ValueError:
        return name


def blocks(layer: Element) -> tuple[list[WavelengthDataBlock], list[str]]:
    """Every block of data, and lines on what was left out. Raises FormatError where there is none, or one twice."""
    data_blocks: list[WavelengthDataBlock] = []
    left_out = []
    for element in layer.all("WavelengthData"):
        name = element.word("Wavelength")
        if name.lower() in _CHROMATICITIES:
            left_out.append(f"left out {name}, a chromaticity")
            continue
        wavelength = _wavelength(element.child("Wavelength"), name)
        for block in element.all("WavelengthDataBlock"):
            if (direction := block.word("WavelengthDataDirection")).lower().startswith("absor"):
                left_out.append(f"left out {direction}, which is not scattered")
                continue
            mode, side = _direction(block)
            data_blocks.append(WavelengthDataBlock(wavelength, mode, side, block))
    if not data_blocks:
        raise layer.wrong("the layer holds no WavelengthDataBlock with scattering data")
    if len({type(b.wavelength) for b in data_blocks}) > 1:
        data_blocks = [WavelengthDataBlock(str(b.wavelength), b.mode, b.side, b.element) for b in data_blocks]
    seen: set[tuple[str | float, str, str]] = set()
    for b in data_blocks:
        if (b.wavelength, b.mode, b.side) in seen:
            raise b.element.wrong(f"{b.mode} of the {b.side} for {b.wavelength} occurs twice")
        seen.add((b.wavelength, b.mode, b.side))
    if {b.wavelength for b in data_blocks} >= {"Visible", "X", "Z"}:
        data_blocks = [
            WavelengthDataBlock("Y" if b.wavelength == "Visible" else b.wavelength, b.mode, b.side, b.element)
            for b in data_blocks
        ]
    return data_blocks, list(dict.fromkeys(left_out))


def _wavelength(element: Element, name: str) -> str | float:
    """The wavelength [nm] where the element has a unit of length, else the name of the channel."""
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
        message = f"WavelengthDataDirection is {clip(' '.join(words))!r}, not Reflection or Transmission, Front or Back"
        raise block.child("WavelengthDataDirection").wrong(message)
    kind = block.find("ScatteringDataType")
    if kind is not None and kind.text.strip().upper() not in ("BRDF", "BTDF", "BSDF"):
        raise kind.wrong(f"ScatteringDataType is {clip(kind.text.strip())!r}, not BRDF or BTDF")
    return words[0], words[1]


def bases(definition: Element) -> tuple[dict[str, Basis], list[str]]:
    """The angle bases by name in lower case: Radiance's, replaced by those that the file defines; and remarks."""
    bases = {b.name.lower(): b for b in klems.BASES}
    remarks = []
    for element in definition.all("AngleBasis"):
        defined = _defined(element)
        known = bases.get(defined.name.lower(), defined)
        if known.counts == defined.counts and np.allclose(known.bounds, defined.bounds, atol=1e-6):
            defined = known
        else:
            remarks.append(f"took the file's own definition of {known.name}, which is not Radiance's")
        bases[defined.name.lower()] = defined
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
    """The basis that the child `tag` of a block names. Raises FormatError for a name that is not among `bases`."""
    name = block.word(tag)
    if name.lower() not in bases:
        known = clip(", ".join(b.name for b in bases.values()), 200)
        raise block.child(tag).wrong(
            f"{tag} is {clip(name)!r}, which the file does not define; there are {clip(known, 200)}"
        )
    return bases[name.lower()]
