"""Small files of Integra's specular data."""

from pathlib import Path

VARIANTS = {
    "grey.sdr": ";; a window\nSource Edited\nTypeColorModel BW\nsigma 4\n 0 30 60 90\n"
    "bw\n def\n 0.04 0.05 0.09 1\n enddef\n",
    "rgb.sdr": "Source Measured\nTypeColorModel RGB\nsigma 2\n 0 60\nred\n def\n 0.1 0.2\n enddef\n"
    "green\n def\n 0.1 0.3\n"
    " enddef\nblue\n def\n 0 0.125\n enddef\n",
    "spectral.sdt": "TypeColorModel spectral 2\nsigma 2\n 0 60\nwl 500\n def\n 0.9 0.7\n enddef\n"
    "wl 600\n def\n 0.8 0.6\n"
    " enddef\n",
    "marked.sdt": ";; transmission: no keyword says so\nSource Measured\nTypeColorModel BW\nsigma 2\n 0 60\n"
    "bw\n def\n 0.9 0.7\n enddef\n",
}


def samples(folder: Path) -> list[Path]:
    """One file of each variant that the reader knows."""
    paths = [folder / name for name in VARIANTS]
    for path in paths:
        path.write_bytes(VARIANTS[path.name].encode())
    return paths
