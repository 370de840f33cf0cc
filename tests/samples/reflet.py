"""Small Reflet exports of both forms."""

from pathlib import Path

TEXT = """Name / Comment :\tpaint
Date:\t7/12/2011 11:51:11 PM
Data file type :\tIntensity BRDF
Theta sample :\t0
Spectral Mode :\t0
'Scanning :\t2 axes
Phi measure beginning :\t-90
Phi measure end :\t90
Phi measure step :\t90
Theta Lighting\t{}
-30\t1\t2\t3
0\t4\t5\t6
30\t7\t8\t9
\t\t
"""
RTD = """OPTIS - Anisotropic BSDF surface file v1.0\t\t\t
SampleID:\tSample {}\t \t
0 1 0\t\t\t
1\t0\t\t
0\t\t\t
1\t\t\t
3\t\t\t
0 45 90\t\t\t
10 0\t\t\t
Reflection Spectrum\t\t\t
2\t\t\t
100 50\t\t\t
1000 50\t\t\t
\t-90\t0\t90
-30\t1\t2\t3
0\t4\t5\t6
30\t7\t8\t9
\t\t\t
\t0\t90\t180\t270
0\t4\t5\t5\t5
30\t7\t8\t5\t2
\t\t\t
"""


def samples(folder: Path) -> list[Path]:
    files = {
        "reflet.txt": TEXT.format(0) + TEXT.format(60),
        "repeated.txt": (TEXT.format(0) + TEXT.format(0)).replace("\n", "\r"),
        "reflet.rtd": (RTD.format(0) + RTD.format(60)).replace("\n", "\r"),
    }
    for name, content in files.items():
        (folder / name).write_text(content, encoding="utf-8", newline="")
    return [folder / name for name in files]
