"""Small files of Integra's diffuse data, as the public reader libbsdf takes them."""

from pathlib import Path

_AXES = "sigma 2\n 0 60\nphi 3\n 0 90 180\ntheta 3\n 0 30 60\n"


def _table(word: str, values: str, factors: str = "kbdf\n 1.0 1.0\n") -> str:
    return f"{word}\n {factors} def\n{values} enddef\n"


_LOBES = " 1 0.5 0.25\n 1 0.5 0.125\n 1 0.5 0.1\n 2 0.75 0.3\n 2 0.75 0.2\n 2 0.75 0.1\n"

VARIANTS = {
    "plane.ddr": ";; steel, 2 mm\nSource Generated\nTypeSym PlaneSymmetrical\nTypeColorModel BW\n"
    "TypeData Luminance Absolute\n" + _AXES + _table("bw", _LOBES, "kbdf\n 1.0 0.5\n"),
    "rgb.ddt": "TypeSym ASymmetrical\r\nTypeColorModel RGB\r\nTypeData Luminance Absolute\r\n"
    + (
        _AXES.replace("0 90 180", "0 120 240")
        + _table("red", _LOBES, "")
        + _table("green", _LOBES, "")
        + _table("blue", _LOBES, "")
    ).replace("\n", "\r\n"),
    "spectral.ddr": "TypeSym PlaneSymmetrical\nTypeColorModel spectral 2\nTypeData Intensity Absolute\n"
    + _AXES
    + _table("wl 450", _LOBES)
    + _table("wl 650.5", _LOBES),
    "turned.ddr": "TypeSym ASymmetrical 4D\nTypeColorModel BW\nTypeData Luminance Absolute\npsi 2\n 0 90\n"
    + _AXES
    + _table("bw", _LOBES + _LOBES, "kbdf\n 1 1 0.5 0.25\n"),
    "axial.ddr": "TypeSym AxiSymmetrical\nTypeColorModel BW\nTypeData Luminance Relative\n"
    "sigma 2\n 0 60\nphi 1\n 0\ntheta 3\n 0 30 150\nbw\n kbdf\n 0.5 0.25\n def\n 1 0.5 0\n 2 0.75 0\n enddef\n",
    "relative.ddr": "TypeSym DirSymmetrical\nTypeColorModel BW\nTypeData Luminance Relative\n"
    + _AXES
    + _table("bw", _LOBES, ""),
    "refracted.ddt": "TypeSym PlaneSymmetrical\nTypeColorModel BW\nTypeData Luminance Absolute\nsigma 2\n 0 60\n"
    "sigmat\n 0 35.2\nphi 3\n 0 90 180\ntheta 3\n 0 30 60\n" + _table("bw", _LOBES),
    "marked.ddt": ";; transmission: no keyword says so\nTypeSym PlaneSymmetrical\nTypeColorModel BW\n"
    "TypeData Luminance Absolute\n" + _AXES + _table("bw", _LOBES),
}


def samples(folder: Path) -> list[Path]:
    """One file of each variant that the reader knows."""
    paths = [folder / name for name in VARIANTS]
    for path in paths:
        path.write_bytes(VARIANTS[path.name].encode())
    return paths
