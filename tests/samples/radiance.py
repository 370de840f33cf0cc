"""Small valid Radiance XML files of each kind."""

from pathlib import Path

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<!-- a sample of {structure} -->
<WindowElement xmlns="http://windows.lbl.gov">
<Optical>
<Layer>
<Material><Name>Glass &amp; film</Name><Manufacturer>Nobody</Manufacturer><DeviceType>Other</DeviceType></Material>
<DataDefinition>
<IncidentDataStructure>{structure}</IncidentDataStructure>
{bases}
</DataDefinition>
"""
WAVELENGTH = """<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="{unit}">{name}</Wavelength>
{blocks}
</WavelengthData>
"""
BLOCK = """<WavelengthDataBlock>
<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{basis}
<ScatteringDataType>{kind}</ScatteringDataType>
<ScatteringData>
{data}
</ScatteringData>
</WavelengthDataBlock>"""
TAIL = "</Layer>\n</Optical>\n</WindowElement>\n"
BANDS = """<AngleBasis>
<AngleBasisName>Coarse</AngleBasisName>
<AngleBasisBlock><Theta>0</Theta><nPhis>1</nPhis>
<ThetaBounds><LowerTheta>0</LowerTheta><UpperTheta>20</UpperTheta></ThetaBounds></AngleBasisBlock>
<AngleBasisBlock><Theta>50</Theta><nPhis>4</nPhis>
<ThetaBounds><LowerTheta>20</LowerTheta><UpperTheta>80</UpperTheta></ThetaBounds></AngleBasisBlock>
</AngleBasis>"""
COARSE = "<ColumnAngleBasis>Coarse</ColumnAngleBasis><RowAngleBasis>Coarse</RowAngleBasis>"
TREE = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
TREE3 = "{ { 0.1 } { 0.2 }\n{ 0.3 } { 0.4 } { 0.5 } { 0.6 }\n{ 0.01 0.02 0.03 0.04 0.05 0.06 0.07 0.08 } { 0.8 } }"
TREE4 = "{ " + " ".join(f"{{ {(k + 1) / 100} }}" for k in range(15)) + "\n{ " + ", ".join(["0.5"] * 16) + " } }"


def block(direction: str, basis: str, data: str) -> str:
    kind = "BRDF" if direction.startswith("Reflection") else "BTDF"
    return BLOCK.format(direction=direction, basis=basis, kind=kind, data=data)


def matrix(first: int) -> str:
    """Five rows of five values, all different."""
    return "\n".join(", ".join(str((first + 5 * row + column) / 1000) for column in range(5)) for row in range(5))


def file(structure: str, bases: str, *wavelengths: str) -> str:
    return HEAD.format(structure=structure, bases=bases) + "".join(wavelengths) + TAIL


def texts() -> dict[str, str]:
    both = [block("Reflection Front", COARSE, matrix(1)), block("Transmission Back", COARSE, matrix(101))]
    front = [block("Reflection Front", COARSE, matrix(n)) for n in (1, 51, 101)]
    tree3 = [block("Reflection Front", TREE, TREE3), block("Reflection Back", TREE, "{ 0.25 }")]
    visible = WAVELENGTH.format(unit="Integral", name="Visible", blocks="\n".join(both))
    colours = [("Visible", front[0]), ("CIE-X", front[1]), ("CIE-Z", front[2])]
    return {
        "columns": file("Columns", BANDS, visible),
        "rows": file("Rows", BANDS, visible),
        "colours": file("Columns", BANDS, *(WAVELENGTH.format(unit="Integral", name=n, blocks=b) for n, b in colours)),
        "nanometres": file("Columns", BANDS, WAVELENGTH.format(unit="nm", name="550", blocks=front[0])),
        "tree3": file("TensorTree3", "", WAVELENGTH.format(unit="Integral", name="Visible", blocks="\n".join(tree3))),
        "tree4": file(
            "TensorTree4",
            "",
            WAVELENGTH.format(unit="Integral", name="Visible", blocks=block("Transmission Front", TREE, TREE4)),
        ),
    }


def samples(folder: Path) -> list[Path]:
    found = []
    for name, text in texts().items():
        found.append(folder / f"radiance_{name}.xml")
        found[-1].write_text(text, encoding="utf-8")
    return found
