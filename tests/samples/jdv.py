r"""The two layouts of the RT-300S text, with the same numbers; lines end in \r."""

from pathlib import Path

GONIOMETER = """DataType:\tBRDF(RT-300S)\t \t
SampleID:\tSample {incidence}\t \t
Date:\t7/12/2011\t\t
Incidence:\t{incidence}\t \t
Polar:\t-30,30,30\t \t
Azimuth:\t-90,-80,10\t \t
\t\t\t
Raw data\t\t\t
\t-30\t0\t30
-90\t-1.5\t2.25\t3
-80\t4\t5\t{last}
\t\t\t
"""

RAYWIZ = """DataType:\tBRDF(Raywiz)\t \t
SampleID:\tSample {incidence}\t \t
Date:\t7/12/2011\t\t
1\t1\t2\t
-90\t-80\t-30\t30
{incidence}\t\t\t
-1.5\t4\t\t
2.25\t5\t\t
3\t{last}\t\t
\t\t\t
"""


def samples(folder: Path) -> list[Path]:
    paths = []
    for name, block in (("goniometer", GONIOMETER), ("raywiz", RAYWIZ)):
        text = block.format(incidence=0, last=6) + block.format(incidence=60, last=7)
        paths.append(folder / f"jdv_{name}.jdv")
        paths[-1].write_bytes(text.replace("\n", "\r").encode())
    return paths
