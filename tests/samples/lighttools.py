"""Small LightTools files of each kind."""

from pathlib import Path

HEADER = (
    "Symmetry Asymmetric\nSpectralContent {}\nScatterAzimuth 5\n0 90 180 270 360\nScatterRadial 3\n0 45 90\nDataBegin\n"
)
ROWS = "1 2 3\n1 5 6\n1 8 9\n1 11 12\n1 2 3\n"
BLOCK = "AOI {}\nPOI 90\nSide {}\n{}ScatterType {}\nTIS {}\n" + ROWS


def block(aoi: float, side: str = "Front", mode: str = "BRDF", more: str = "Wavelength 550\n", tis: float = 0.5) -> str:
    return BLOCK.format(aoi, side, more, mode, tis)


def samples(folder: Path) -> list[Path]:
    plain = HEADER.format("Monochrome") + block(0) + block(30) + "DataEnd\n"
    both = "".join(block(aoi, side, mode) for side in ("Front", "Back") for mode in ("BRDF", "BTDF") for aoi in (0, 60))
    some = block(0) + block(30) + block(10, "Back", "BTDF")
    waves = "".join(block(aoi, more=f"Wavelength {nm}\n") for nm in (450, 650) for aoi in (0, 30))
    colours = "".join(block(a, more=f"Wavelength 555\nTristimulusValue Tris{c}\n") for a in (0, 30) for c in "XYZ")
    files = {
        "plain": "# a remark\n" + plain,
        "carriage_returns": plain.replace("\n", "\r"),
        "both_sides": HEADER.format("Monochrome") + both + "DataEnd\n",
        "flat": HEADER.format("Monochrome") + some + "DataEnd\n",
        "wavelengths": HEADER.format("Monochrome") + waves + "DataEnd\n",
        "colours": HEADER.format("XYZ") + colours + "DataEnd\n",
    }
    for name, text in files.items():
        (folder / f"{name}.bsdf").write_text(text, encoding="utf-8", newline="")
    return [folder / f"{name}.bsdf" for name in files]
