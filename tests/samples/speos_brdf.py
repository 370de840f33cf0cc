"""Small Speos BRDF files of each kind."""

from itertools import product
from pathlib import Path

AZIMUTHS = "0\t90\t180\t270\t360"
REFLECTED = "0\t1\t1\t1\t1\t1\n45\t2\t3\t4\t5\t2\n90\t2\t3\t4\t3\t2\n"
TRANSMITTED = "90\t2\t3\t4\t3\t2\n135\t2\t3\t4\t5\t2\n180\t1\t1\t1\t1\t1\n"


def text(version: str = "8.0", flags: str = "1\t0", kind: int = 1, nm: str = "450 550", same: bool = False) -> str:
    each = [rows for rows, flag in zip((REFLECTED, TRANSMITTED), flags.split(), strict=True) if flag == "1"]
    head = f"OPTIS - brdf surface file v{version}\n0\nScattering surface\n0\n\n{flags}\n{kind}\n"
    out = head + f"2\t{len(nm.split())}\n0\t30\n" + nm.replace(" ", "\t") + "\n"
    for rows, aoi, wave in product(each, (0, 30), map(float, nm.split())):
        percent = 20.0 if same else 10.0 + aoi / 10 + wave / 100
        out += f"{percent}\n3\t5\n\t{AZIMUTHS}\n{rows}"
    return out


def samples(folder: Path) -> list[Path]:
    files = {
        "plain": text(),
        "nine": text("9.0", nm="550"),
        "intensity": text(kind=0),
        "both": text(flags="1\t1"),
        "same": text(same=True),
    }
    for name, content in files.items():
        (folder / f"{name}.brdf").write_text(content, encoding="utf-8", newline="")
    return [folder / f"{name}.brdf" for name in files]
