"""Radiance XML files whose values are a formula's, for the peer and for the tests. Knows nothing of gonio."""

DIRECTIONS = ("Reflection Front", "Reflection Back", "Transmission Front", "Transmission Back")
SIZES = {"Full": 145, "Half": 77, "Quarter": 41}
GOLDEN = 0.6180339887498949

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
<Material><Name>Golden</Name><Manufacturer/><DeviceType>Other</DeviceType></Material>
<DataDefinition><IncidentDataStructure>{structure}</IncidentDataStructure></DataDefinition>
<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="Integral">Visible</Wavelength>
"""
_BLOCK = """<WavelengthDataBlock>
<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{basis}
<ScatteringDataType>{kind}</ScatteringDataType>
<ScatteringData>
{data}
</ScatteringData>
</WavelengthDataBlock>
"""
_TAIL = "</WavelengthData>\n</Layer>\n</Optical>\n</WindowElement>\n"


def value(k):
    """The k-th value [1/sr]: neighbours differ by much, and the hemispheres together scatter less than they get."""
    return round(0.01 + 0.14 * (k * GOLDEN % 1), 6)


def _file(structure, blocks):
    parts = [_HEAD.format(structure=structure)]
    for direction, basis, data in blocks:
        kind = "BRDF" if direction.startswith("Reflection") else "BTDF"
        parts.append(_BLOCK.format(direction=direction, basis=basis, kind=kind, data=data))
    return "".join(parts) + _TAIL


def matrix(structure, basis):
    """A file of four matrices over a Klems basis, stored by Columns or Rows."""
    n = SIZES[basis]
    name = f"LBNL/Klems {basis}"
    names = f"<ColumnAngleBasis>{name}</ColumnAngleBasis><RowAngleBasis>{name}</RowAngleBasis>"
    blocks = []
    for d, direction in enumerate(DIRECTIONS):
        rows = [" ".join(str(value(d * n * n + r * n + c)) for c in range(n)) for r in range(n)]
        blocks.append((direction, names, ",\n".join(rows)))
    return _file(structure, blocks)


def tree(rank, depth):
    """A file of four tensor trees: branches, grids and single values mixed by a rule."""
    counter = iter(range(10**9))

    def node(level):
        k = next(counter)
        if level == depth or (level and k % 5 < 2):
            grid = 1 << rank * (k % 2)
            return "{ " + " ".join(str(value(next(counter))) for _ in range(grid)) + " }"
        return "{\n" + "\n".join(node(level + 1) for _ in range(1 << rank)) + "\n}"

    basis = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
    return _file(f"TensorTree{rank}", [(direction, basis, node(0)) for direction in DIRECTIONS])


FILES = {
    "columns full": lambda: matrix("Columns", "Full"),
    "rows half": lambda: matrix("Rows", "Half"),
    "columns quarter": lambda: matrix("Columns", "Quarter"),
    "tree 3": lambda: tree(3, 3),
    "tree 4": lambda: tree(4, 2),
}


def opaque(sides):
    """A file of reflection alone over Klems Quarter: a matrix that differs by band alone, on each of the sides named."""
    n, bands = SIZES["Quarter"], (1, 8, 12, 12, 8)
    band = [k for k, count in enumerate(bands) for _ in range(count)]
    rows = [" ".join(f"{0.02 * (1 + band[r]) + 0.01 * band[c]:.2f}" for c in range(n)) for r in range(n)]
    names = "<ColumnAngleBasis>LBNL/Klems Quarter</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Quarter</RowAngleBasis>"
    return _file("Columns", [(f"Reflection {side}", names, ",\n".join(rows)) for side in sides])
