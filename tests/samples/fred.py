"""Small tables of FRED: out of plane, in plane with negative angles, direction cosines with logarithms."""

from pathlib import Path

AROUND = """type bsdf_data
format angles=deg bsdf=value scale=1
10\t0
0\t0\t0.031984
5\t0\t0.034271
5\t170\t0.033
50\t0
0\t0\t0.0119
60\t350\t0.5
"""

IN_PLANE = """TYPE BSDF_DATA
FORMAT bsdf=value, angles=deg, scale=2
0, 0
-30, 0, 0.0003
0, 0, 0.1
30, 0, 0.0003
15, 0
-30, 0, 0.0004
15, 0, 0.2
"""

COSINES = """type bsdf_data
format angles=sin bsdf=log scale=1
0.5 0
0.5 0 -1
0 0.6 -2
-0.8 0 -3
"""


def samples(folder: Path) -> list[Path]:
    paths = []
    for name, text in (("around", AROUND), ("in_plane", IN_PLANE), ("cosines", COSINES)):
        paths.append(folder / f"fred_{name}.txt")
        paths[-1].write_text(text, encoding="utf-8")
    return paths
