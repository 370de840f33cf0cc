"""Small Speos anisotropic files of each kind."""

from collections.abc import Sequence
from pathlib import Path

AZIMUTHS = "0 90 180 270 360"
REFLECTED = ["0 1 1 1 1 1", "45 2 3 4 5 2", "90 2 3 4 3 2"]
TRANSMITTED = ["90 2 3 4 3 2", "135 2 3 4 5 2", "180 1 1 1 1 1"]


def table(rows: Sequence[str], azimuths: str = AZIMUTHS) -> str:
    return "\n".join([f"{len(rows)} {len(azimuths.split())}", "\t" + azimuths.replace(" ", "\t"), *rows, ""])


def text(
    *,
    version: str = "8.0",
    flags: str = "1 0",
    kind: int = 1,
    orientations: str = "0",
    incidences: str = "0 30",
    at: str = "0 0",
    spectrum: Sequence[str] = ("350 50", "850 50"),
    tables: Sequence[str] | None = None,
) -> str:
    modes = sum(map(int, flags.split()))
    count = len(orientations.split())
    lists = f"{count}\n{orientations}\t\n" + f"{len(incidences.split())}\n{incidences}\t\n" * count
    spectra = f"{at}\n\n{len(spectrum)}\n" + "\n".join(spectrum) + "\n"
    if tables is None:
        each = [t for t, flag in zip((REFLECTED, TRANSMITTED), flags.split(), strict=True) if flag == "1"]
        tables = [table(rows) for rows in each for _ in range(count * len(incidences.split()))]
    head = f"OPTIS - Anisotropic BSDF surface file v{version}\n0\nComment\n11\nDescription\n0\t1\t0\n{flags}\n{kind}\n"
    return head + lists * modes + spectra * modes + "".join(tables)


def samples(folder: Path) -> list[Path]:
    files = {
        "plain": text(),
        "old": text(version="7.0") + "End of file\n",
        "intensity": text(kind=0),
        "transmission": text(flags="0 1"),
        "both": text(flags="1 1", kind=0),
        "turned": text(orientations="0 45 90"),
        "spectrum": text(spectrum=("400 10", "500 30", "600 20"), at="10 0"),
        "one_wavelength": text(spectrum=("633 12.5",)),
        "uneven": text(tables=[table(REFLECTED), table(REFLECTED[:2])]),
        "no_scale": text(tables=[table(REFLECTED, "0 10 20 30 40")] * 2),
    }
    for name, content in files.items():
        (folder / f"{name}.anisotropicbsdf").write_text(content, encoding="utf-8", newline="")
    return [folder / f"{name}.anisotropicbsdf" for name in files]
