"""Writing a WindowElement of matrices over angle bases, as Radiance's bsdf_m.c reads it."""

import math
import re
from collections.abc import Mapping
from typing import Any, TextIO
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import numpy.typing as npt

from gonio.formats.radiance.blocks import SPECTRA
from gonio.formats.radiance.klems import Basis

# The elements of a material in LBNL's schema BSDF-v1.7.7, and what stands where one is unknown: pyWinCalc needs three.
_MATERIAL = {
    "Name": "not stated",
    "ProductName": "",
    "Manufacturer": "not stated",
    "Thickness": "0 Meter",
    "DeviceType": "Other",
    "ThermalConductivity": "",
    "AirPermeability": "",
    "EmissivityFront": "",
    "EmissivityBack": "",
    "TIR": "",
    "EffectiveOpennessFraction": "",
    "PermeabilityFactor": "",
    **{
        f"OpticalProperties {name}": "" for name in ("Transmittance", "ReflectanceFront", "ReflectanceBack", "Comments")
    },
    "Color": "",
    "AERCAcceptance": "",
    "Comments": "",
    "Width": "",
    "Height": "",
    "Openness": "",
}
_WORDS = ("Name", "ProductName", "Manufacturer", "DeviceType", "Comments", "Color", "AERCAcceptance")  # others: numbers
_LENGTHS = ("Thickness", "Width", "Height")
_UNITS = ("meter", "millimeter", "centimeter", "inch", "foot")  # that Radiance converts
_NOT_XML = re.compile("[\x00-\x08\x0b-\x1f\ud800-\udfff\ufffe\uffff]")
Matrices = list[tuple[str, npt.NDArray[np.float64]]]


def write(
    file: TextIO, attrs: Mapping[str, Any], bases: tuple[Basis, Basis], blocks: list[tuple[str, str, Matrices]]
) -> None:
    """Write remarks, material and the bases (incident, outgoing), then the matrices by wavelength.

    `blocks` has wavelength, unit, and pairs of a direction such as `Reflection Front` and its matrix.
    """
    stated = [line for key in ("provenance", "history") for line in str(attrs.get(key, "")).splitlines()]
    spectra = [f"{key}{of}" for key in SPECTRA for of in ("", *dict.fromkeys(f" of {name}" for name, *_ in blocks))]
    told = {key: [line for line in stated if line.startswith(f"{key}: ")] for key in (*_MATERIAL, *spectra)}
    # Of several lines with one key none is known to be the one that is written.
    single = {key: lines[0].removeprefix(f"{key}: ") for key, lines in told.items() if len(lines) == 1}
    known = {key: value for key, value in single.items() if key in spectra or _is_element(key, value)}
    remarks = [line for line in stated if not any(line == f"{key}: {value}" for key, value in known.items())]
    file.write('<?xml version="1.0" encoding="UTF-8"?>\n')
    if remarks:
        text = "\n".join(re.sub("-(?=-)", "- ", _text(line)) for line in remarks)
        file.write(f"<!--\n{text}\n-->\n")
    file.write('<WindowElement xmlns="http://windows.lbl.gov">\n<WindowElementType>System</WindowElementType>\n')
    file.write("<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n<Material>\n")
    _material(file, known)
    file.write("</Material>\n<DataDefinition>\n<IncidentDataStructure>Columns</IncidentDataStructure>\n")
    for basis in dict.fromkeys(bases):
        _basis(file, basis)
    file.write("</DataDefinition>\n")
    for wavelength, unit, matrices in blocks:
        lit = {key: known.get(f"{key} of {wavelength}", known.get(key)) for key in SPECTRA}
        spectrum = "".join(f"<{key}>{escape(_text(text))}</{key}>\n" for key, text in lit.items() if text)
        # One block in each WavelengthData, as in LBNL's files: pyWinCalc reads the first and passes over the rest.
        for direction, matrix in matrices:
            file.write("<WavelengthData>\n<LayerNumber>System</LayerNumber>\n")
            file.write(f'<Wavelength unit="{unit}">{escape(_text(wavelength))}</Wavelength>\n{spectrum}')
            _block(file, direction, matrix, bases)
            file.write("</WavelengthData>\n")
    file.write("</Layer>\n</Optical>\n</WindowElement>\n")


def _material(file: TextIO, known: Mapping[str, str]) -> None:
    """Write the elements of the material, those within another one between its tags."""
    open_tag = ""
    for key, default in _MATERIAL.items():
        within, _, tag = key.rpartition(" ")
        if not (value := known.get(key, default)):
            continue
        if within != open_tag:
            file.write((f"</{open_tag}>\n" if open_tag else "") + (f"<{within}>\n" if within else ""))
            open_tag = within
        value, _, unit = (value, "", "") if tag in _WORDS else value.partition(" ")
        if tag == "Thickness":
            unit = unit or "Meter"  # as Radiance takes it; pyWinCalc requires one
        stated_unit = f" unit={quoteattr(_text(unit))}" if unit else ""
        file.write(f"<{tag}{stated_unit}>{escape(_text(value))}</{tag}>\n")
    if open_tag:
        file.write(f"</{open_tag}>\n")


def _is_element(key: str, text: str) -> bool:
    """Whether a line of provenance holds what the element takes: pyWinCalc refuses a file with a word for a number."""
    tag = key.rpartition(" ")[2]
    if tag in _WORDS:
        return True
    number, _, unit = text.partition(" ")
    try:
        value = float(number)
    except ValueError:
        return False
    return math.isfinite(value) and (tag not in _LENGTHS or unit.lower() in ("", *_UNITS))


def _text(text: str) -> str:
    """The text with a question mark for each character that XML does not allow."""
    return _NOT_XML.sub("?", text)


def _basis(file: TextIO, basis: Basis) -> None:
    file.write(f"<AngleBasis>\n<AngleBasisName>{escape(basis.name)}</AngleBasisName>\n")
    theta = basis.centres()[0][np.cumsum(basis.counts) - 1].tolist()
    for centre, n, low, high in zip(theta, basis.counts, basis.lower, basis.bounds[1:].tolist(), strict=True):
        bounds = f"<LowerTheta>{low!r}</LowerTheta><UpperTheta>{high!r}</UpperTheta>"
        inner = f"<Theta>{centre!r}</Theta><nPhis>{n}</nPhis><ThetaBounds>{bounds}</ThetaBounds>"
        file.write(f"<AngleBasisBlock>{inner}</AngleBasisBlock>\n")
    file.write("</AngleBasis>\n")


def _block(file: TextIO, direction: str, matrix: npt.NDArray[np.float64], bases: tuple[Basis, Basis]) -> None:
    kind = "BRDF" if direction.startswith("Reflection") else "BTDF"
    incident, outgoing = (escape(b.name) for b in bases)
    file.write(f"<WavelengthDataBlock>\n<WavelengthDataDirection>{direction}</WavelengthDataDirection>\n")
    file.write(f"<ColumnAngleBasis>{incident}</ColumnAngleBasis>\n<RowAngleBasis>{outgoing}</RowAngleBasis>\n")
    file.write(f"<ScatteringDataType>{kind}</ScatteringDataType>\n<ScatteringData>\n")
    file.write(",\n".join(", ".join(map(repr, row)) for row in matrix.tolist()) + "\n")  # as LBNL's
    file.write("</ScatteringData>\n</WavelengthDataBlock>\n")
