"""Writing a WindowElement of matrices over angle bases, as Radiance's bsdf_m.c reads it."""

import re
from collections.abc import Mapping
from typing import Any, TextIO
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from gonio.formats.radiance.klems import Basis

_NAMED = ("Name", "Manufacturer", "DeviceType")
_NOT_XML = re.compile("[\x00-\x08\x0b-\x1f\ud800-\udfff\ufffe\uffff]")
Matrices = list[tuple[str, npt.NDArray[np.float64]]]


def write(
    file: TextIO, attrs: Mapping[str, Any], bases: tuple[Basis, Basis], blocks: list[tuple[str, str, Matrices]]
) -> None:
    """Write remarks, material and the bases (incident, outgoing), then the matrices by wavelength.

    `blocks` has wavelength, unit, and pairs of a direction such as `Reflection Front` and its matrix.
    """
    stated = [line for key in ("provenance", "history") for line in str(attrs.get(key, "")).splitlines()]
    material = {key: line for key in reversed(_NAMED) for line in stated if line.startswith(f"{key}: ")}
    remarks = [line for line in stated if line not in material.values()]
    file.write('<?xml version="1.0" encoding="UTF-8"?>\n')
    if remarks:
        text = "\n".join(re.sub("-(?=-)", "- ", _text(line)) for line in remarks)
        file.write(f"<!--\n{text}\n-->\n")
    file.write('<WindowElement xmlns="http://windows.lbl.gov">\n<WindowElementType>System</WindowElementType>\n')
    file.write("<FileType>BSDF</FileType>\n<Optical>\n<Layer>\n<Material>\n")
    for key in _NAMED:
        default = "Other" if key == "DeviceType" else ""
        value = material.get(key, f"{key}: {default}").removeprefix(f"{key}: ")
        file.write(f"<{key}>{escape(_text(value))}</{key}>\n")
    file.write("</Material>\n<DataDefinition>\n<IncidentDataStructure>Columns</IncidentDataStructure>\n")
    for basis in dict.fromkeys(bases):
        _basis(file, basis)
    file.write("</DataDefinition>\n")
    for wavelength, unit, matrices in blocks:
        file.write("<WavelengthData>\n<LayerNumber>System</LayerNumber>\n")
        file.write(f'<Wavelength unit="{unit}">{escape(_text(wavelength))}</Wavelength>\n')
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
    file.writelines(" ".join(map(repr, row)) + "\n" for row in matrix.tolist())
    file.write("</ScatteringData>\n</WavelengthDataBlock>\n")
