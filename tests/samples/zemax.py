"""Small Zemax tables: each symmetry, both kinds of scatter, one channel and three, keywords in any case."""

from pathlib import Path

PLANE = """# made by hand
#
Source\tMeasured
Symmetry\tPlaneSymmetrical
SpectralContent\tMonochrome
ScatterType\tBRDF
SampleRotation\t1
0
AngleOfIncidence\t2
10\t60
ScatterAzimuth\t3
0\t90\t180
ScatterRadial\t4
0\t5\t30\t90

Monochrome
DataBegin
TIS\t0.25
0.5\t0.4\t0.3\t0.2
0.5\t0.41\t0.31\t0.21
0.5\t0.42\t0.32\t0
TIS\t0.5
1.5\t1.25\t0.75\t0.5
1.5\t1.3\t0.8\t0.55
1.5\t1.4\t0.125\t0
DataEnd
"""

ASYMMETRICAL = """source Measured
SYMMETRY asymmetrical
spectralcontent xyz
scattertype btdf
samplerotation 1
0
angleofincidence 1
30
scatterazimuth 4
0 90 180 270
scatterradial 2
0 20
tristimulusx
databegin
tis 0.1
1 2
1 3
1 4
1 5
dataend
tristimulusy
databegin
tis 0.2
2 3
2 4
2 5
2 6
dataend
tristimulusz
databegin
tis 0.3
3 4
3 5
3 6
3 7
dataend
"""

TURNED = """Source Measured
Symmetry ASymmetrical4D
SpectralContent Monochrome
ScatterType BRDF
SampleRotation 2
0 45
AngleOfIncidence 2
0 20
ScatterAzimuth 2
0 180
ScatterRadial 2
0 10
Monochrome
DataBegin
TIS 0.1
1 2
3 4
TIS 0.2
5 6
7 8
TIS 0.3
9 10
11 12
TIS 0.4
13 14
15 16
DataEnd
"""


def samples(folder: Path) -> list[Path]:
    paths = []
    for name, text in (("plane", PLANE), ("asymmetrical", ASYMMETRICAL), ("turned", TURNED)):
        paths.append(folder / f"zemax_{name}.bsdf")
        paths[-1].write_text(text, encoding="utf-8")
    return paths
