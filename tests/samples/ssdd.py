"""Small SSDD files after the public specification, text and binary."""

import struct
from pathlib import Path

import numpy as np


def _rows(count: int, width: int = 1, seed: int = 0) -> str:
    values = np.random.default_rng(seed).uniform(0, 0.5, (count, width)).round(4)
    return "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist())


def _block(kind: str, lists: str, colours: str = "monochrome", rest: str = "") -> str:
    return f"DATA_TYPE {kind}\nCOLOR_MODEL {colours}\n{rest}{lists}DATA ascii\n"


_SPECULAR = "PARAM_TYPE specular_coordinate_system\n"
_LISTS = "PARAM0_LIST 0 45\nPARAM2_LIST 0 30 60\nPARAM3_LIST 0 90 180\n"
_BINARY = (
    b"VERSION 0.3\r\nSOURCE_TYPE measured\r\nDATA_TYPE brdf\r\nCOLOR_MODEL rgb\r\n"
    b"PARAM_TYPE spherical_coordinate_system\r\nPARAM0_LIST 0 60\r\nPARAM2_LIST 0 60\r\nPARAM3_LIST 0 180\r\n"
    b"DATA binary\r\n" + struct.pack("<24f", *np.linspace(0.1, 0.5, 24)) + b"\r\n"
)

VARIANTS = {
    "specular.ssdd": "# steel\nVERSION 0.3\nSOFTWARE none-1.0\n\n"
    + _block("brdf", _LISTS, rest=_SPECULAR + "REDUCTION_TYPE bilateral_symmetry\n")
    + "# PARAM3: 0\n"
    + _rows(18),
    "turned.ssdd": "VERSION 0.3\n"
    + _block(
        "brdf",
        "PARAM0_LIST 0 45\nPARAM1_LIST 0 90 180 270\nPARAM2_LIST 0 60\nPARAM3_LIST 0 90 180 270\n",
        "xyz",
        "PARAM_TYPE spherical_coordinate_system\n",
    )
    + _rows(64, 3),
    "half.ssdd": "VERSION 0.2\n"
    + _block(
        "brdf",
        "WAVELENGTH_LIST 450 650.5\nPARAM0_LIST 0 30\nPARAM2_LIST 0 40 80\nPARAM3_LIST 0 45 90\n",
        "spectrum",
        "PARAM_TYPE half_difference_coordinate_system\nREDUCTION_TYPE bilateral_symmetry reciprocity\n",
    )
    + _rows(18, 2),
    "both.ssdd": "VERSION 0.3\n"
    + _block("brdf", _LISTS, "rgb", _SPECULAR)
    + _rows(18, 3, 1)
    + "\n# the far side\n"
    + _block("btdf", _LISTS, "rgb", _SPECULAR)
    + _rows(18, 3, 2)
    + _block("specular_reflectance", "PARAM0_LIST 0 45\n")
    + "0.04\n0.05\n",
    "refracted.ssdd": "VERSION 0.3\n"
    + _block("btdf", _LISTS + "PARAM4_LIST 0 -17.1\n", rest=_SPECULAR)
    + _rows(18)
    + _block("brdf", _LISTS, "rgb", _SPECULAR.replace("specular", "distorted_spherical"))
    + _rows(18, 3),
    "mirror.ssdd": "VERSION 0.3\n" + _block("specular_transmittance", "PARAM0_LIST 0 30 60\n", "rgb") + _rows(3, 3),
}


def samples(folder: Path) -> list[Path]:
    """One file of each variant that the reader knows."""
    paths = [folder / name for name in VARIANTS]
    for path in paths:
        path.write_text(VARIANTS[path.name], encoding="utf-8", newline="")
    binary = folder / "binary.ssdd"
    binary.write_bytes(_BINARY)
    return [*paths, binary]
