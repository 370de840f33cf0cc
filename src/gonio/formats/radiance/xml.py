"""Writing a WindowElement of matrices over angle bases, as Radiance's bsdf_m.c reads it."""

import re
from collections.abc import Mapping
from typing import Any, TextIO
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import numpy.typing as npt

from gonio.formats.radiance.klems import Basis

# The elements of a material in the order of LBNL's files, and what stands where it is unknown: pyWinCalc needs three.
_MATERIAL = {
    "Name": "not stated",
    "Manufacturer": "not stated",
    "Thickness": "0 Meter",
    "ThermalConductivity": "",
    "EmissivityFront": "",
    "EmissivityBack": "",
    "TIR": "",
    "PermeabilityFactor": "",
    "DeviceType": "Other",
}
_WITH_UNIT = ("Thickness", "ThermalConductivity")
_SPECTRA = ("SourceSpectrum", "DetectorSpectrum")
_NOT_XML = re.compile("[\x00-\x08\x0b-\x1f\ud800-\udfff\ufffe\uffff]")
Matrices = list[tuple[str, npt.NDArray[np.float64]]]


def write(
    file: TextIO, attrs: Mapping[str, Any], bases: tuple[Basis, Basis], blocks: list[tuple[str, str, Matrices]]
) -> None:
    """Write remarks, material and the bases (incident, outgoing), then the matrices by wavelength.

    `blocks` has wavelength, unit, and pairs of a direction such as `Reflection Front` and its matrix.
    """
    stated = [line for key in ("provenance", "history") for line in str(attrs.get(key, "")).splitlines()]
    told = {key: [line for line in stated if line.startswith(f"{key}: ")] for key in (*_MATERIAL, *_SPECTRA)}
    # Of several lines with one key, such as the spectra of several blocks, none is known to be the one that is written.
    known = {key: lines[0].removeprefix(f"{key}: ") for key, lines in told.items() if len(lines) == 1}
    remarks = [line for line in stated if not any(line == f"{key}: {value}" for key, value in known.items())]
    file.write('<?xml version="1.0" encoding="UTF-8"?>\n')
    if remarks:
        text = "\n".join(re.sub("-(?=-)", "- ", _text(line)) for line in remarks)
        file.write(f"<!--\n{text}\n-->\n")
    file.write('<WindowElement xmlns="http://windows.lbl.gov">\n<WindowElementType>System</WindowElementType>\n')
    file.write("<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n<Material>\n")
    for key, default in _MATERIAL.items():
        if value := known.get(key, default):
            value, _, unit = value.partition(" ") if key in _WITH_UNIT else (value, "", "")
            stated_unit = f" unit={quoteattr(_text(unit))}" if unit else ""
            file.write(f"<{key}{stated_unit}>{escape(_text(value))}</{key}>\n")
    file.write("</Material>\n<DataDefinition>\n<IncidentDataStructure>Columns</IncidentDataStructure>\n")
    for basis in dict.fromkeys(bases):
        _basis(file, basis)
    file.write("</DataDefinition>\n")
    for wavelength, unit, matrices in blocks:
        file.write("<WavelengthData>\n<LayerNumber>System</LayerNumber>\n")
        file.write(f'<Wavelength unit="{unit}">{escape(_text(wavelength))}</Wavelength>\n')
        for key in (key for key in _SPECTRA if key in known):
            file.write(f"<{key}>{escape(_text(known[key]))}</{key}>\n")
        for direction, matrix in matrices:
            _block(file, direction, matrix, bases)
        file.write("</WavelengthData>\n")
    file.write("</Layer>\n</Optical>\n</WindowElement>\n")


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
