"""Height maps as files of every format that gonio reads by itself: for tests, and what the fuzzing begins from."""

import hashlib
import struct
import zipfile
from pathlib import Path

import numpy as np

HEIGHTS = 0.05 * np.sin(np.arange(12.0)[None, :] / 2) * np.cos(np.arange(9.0)[:, None] / 3) + 1.0  # um, 9 rows of 12
PITCH = (0.5, 0.4)  # um
TYPES = {"u1": 0, "<u2": 1, "<u4": 2, "<f4": 3, "i1": 4, "<i2": 5, "<i4": 6, "<f8": 7}
CODES = {"<i2": "I", "<i4": "L", "<f4": "F", "<f8": "D"}


def sdf_text(path: Path, z: np.ndarray = HEIGHTS, missing: tuple[int, int] | None = None) -> Path:
    """ISO 25178-71 in text, metres times a scale of 1e-6; one point may be marked as bad."""
    rows = [[f"{value:.6f}" for value in row] for row in z]
    if missing:
        rows[missing[0]][missing[1]] = "BAD"
    header = [
        "aISO-1.0",
        "ManufacID = TEST",
        f"NumPoints = {z.shape[1]}",
        f"NumProfiles = {z.shape[0]}",
        f"Xscale = {PITCH[0]}E-6",
        f"Yscale = {PITCH[1]}E-6",
        "Zscale = 1.0E-6",
        "Zresolution = -1",
        "Compression = 0",
        "DataType = 7",
        "CheckType = 0",
    ]
    lines = [*header, "*", *(" ".join(row) for row in rows), "*", "< PartName > panel 7 < / PartName >", "*"]
    path.write_text("\n".join(lines) + "\n")
    return path


def sdf_binary(path: Path, dtype: str = "<f8", missing: tuple[int, int] | None = None) -> Path:
    """ISO 25178-71 in binary; whole numbers count 0.1 nm and mark a missing point by their extreme."""
    scale = 1e-6 if "f" in dtype else 1e-10
    z = HEIGHTS * 1e-6 / scale
    stored = z.astype(dtype) if "f" in dtype else np.rint(z - (10_000 if dtype in ("i1", "u1") else 0)).astype(dtype)
    if missing:
        info = np.iinfo(np.dtype(dtype)) if "f" not in dtype else None
        stored[missing] = np.nan if info is None else (info.max if "u" in dtype else info.min)
    head = struct.pack(
        "<8s10s12s12sHH4d3B",
        b"bISO-1.0",
        b"TEST",
        b"301120260900",
        b"301120260900",
        z.shape[1],
        z.shape[0],
        PITCH[0] * 1e-6,
        PITCH[1] * 1e-6,
        scale,
        1e-12,
        0,
        TYPES[dtype],
        0,
    )
    path.write_bytes(head + stored.tobytes())
    return path


def x3p(path: Path, dtype: str = "<f8", missing: tuple[int, int] | None = None, changes: dict[str, str] | None = None):
    """ISO 25178-72; `changes` replace parts of main.xml."""
    is_float = "f" in dtype
    step = "" if is_float else "<Increment>1e-10</Increment><Offset>1e-6</Offset>"
    z = HEIGHTS * 1e-6
    stored = z.astype(dtype) if is_float else np.rint((z - 1e-6) / 1e-10).astype(dtype)
    bits = b""
    if missing:
        valid = np.ones(z.shape, dtype=np.uint8)
        valid[missing] = 0
        bits = np.packbits(valid.ravel(), bitorder="little").tobytes()
    links = "<PointDataLink>bindata/data.bin</PointDataLink>"
    check = hashlib.md5(stored.tobytes(), usedforsecurity=False).hexdigest()
    links += f"<MD5ChecksumPointData>{check}</MD5ChecksumPointData>"
    links += "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>" * bool(bits)
    xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">
<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{PITCH[0]}e-6</Increment><Offset>0</Offset></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{PITCH[1]}e-6</Increment><Offset>0</Offset></CY>
<CZ><AxisType>A</AxisType><DataType>{CODES[dtype]}</DataType>{step}</CZ></Axes></Record1>
<Record2><Date>2026-11-30T09:00:00</Date><Instrument><Manufacturer>none</Manufacturer><Model>test</Model></Instrument></Record2>
<Record3><MatrixDimension><SizeX>{z.shape[1]}</SizeX><SizeY>{z.shape[0]}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink>{links}</DataLink></Record3>
<Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4>
</p:ISO5436_2>
"""
    for old, new in (changes or {}).items():
        assert old in xml, old
        xml = xml.replace(old, new)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("main.xml", (2026, 11, 30, 9, 0, 0)), xml)
        archive.writestr(zipfile.ZipInfo("bindata/data.bin", (2026, 11, 30, 9, 0, 0)), stored.tobytes())
        if bits:
            archive.writestr(zipfile.ZipInfo("bindata/valid.bin", (2026, 11, 30, 9, 0, 0)), bits)
    return path


def npy(path: Path, z: np.ndarray = HEIGHTS) -> Path:
    """An array of NumPy."""
    np.save(path, z)
    return path


def text(path: Path, separator: str = ",", head: str = "") -> Path:
    """A matrix in text."""
    rows = [separator.join(f"{value:.6f}" for value in row) for row in HEIGHTS]
    path.write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
    return path


GWYDDION = "# Channel: Height\n# Width: 6.0 µm\n# Height: 3.6 µm\n# Value units: um\n"


def sdf_files(folder: Path) -> list[Path]:
    """Surface data files, in text and in binary."""
    texts = [sdf_text(folder / "text.sdf"), sdf_text(folder / "gaps.sdf", missing=(2, 3))]
    return [*texts, *(sdf_binary(folder / f"{kind[-2:]}.sdf", kind, (1, 1)) for kind in ("<f8", "<i4", "<u2"))]


def x3p_files(folder: Path) -> list[Path]:
    """Archives of X3P."""
    return [x3p(folder / "float.x3p"), x3p(folder / "whole.x3p", "<i4", missing=(0, 5)), x3p(folder / "few.x3p", "<f4")]


def npy_files(folder: Path) -> list[Path]:
    """Arrays of NumPy."""
    arrays = {"double": HEIGHTS, "single": HEIGHTS.astype("f4"), "columns": np.asfortranarray(HEIGHTS)}
    return [npy(folder / f"{name}.npy", z) for name, z in arrays.items()]


def matrix_files(folder: Path) -> list[Path]:
    """Matrices in text."""
    return [
        text(folder / "comma.csv"),
        text(folder / "tab.txt", "\t"),
        text(folder / "gwyddion.txt", " ", GWYDDION),
        text(folder / "semicolon.csv", ";", "# a panel\n\n"),
    ]


KINDS = {
    "heights-sdf": sdf_files,
    "heights-x3p": x3p_files,
    "heights-npy": npy_files,
    "heights-matrix": matrix_files,
}
