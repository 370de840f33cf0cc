"""Binary files of ALTA in both byte orders."""

from pathlib import Path

import numpy as np

ROWS = np.array([[0.5, 0.25, 3.0, 0.125], [0.75, 0.25, -1.5, 0.5], [1.0, 0.25, 0.0, 0.0625]])


def content(order: str, rows: int = len(ROWS)) -> bytes:
    header = (
        "#DIM 3 1\n#PARAM_IN  ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n#FORMAT binary\n#VERSION 0\n"
        f"#PRECISION ieee754-double\n#SAMPLE_COUNT {rows}\n#VS 0\n#ENDIAN {order}\n#BEGIN_STREAM\n"
    )
    return header.encode() + ROWS.astype({"little": "<f8", "big": ">f8"}[order]).tobytes() + b"\n#END_STREAM\n"


def samples(folder: Path) -> list[Path]:
    paths = []
    for order in ("little", "big"):
        paths.append(folder / f"{order}.altab")
        paths[-1].write_bytes(content(order))
    return paths
