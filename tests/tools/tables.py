"""Tables in the layouts that `gonio import` reads, as text and as workbooks: what the fuzzing begins from."""

from pathlib import Path

from workbooks import write

TEXTS = {
    "long.csv": "AOI;AOS;BSDF [1/sr];U (k=2)\n10,0;-60,0;0,0123;0,001\n10,0;10,0;0,383;0,002\n30,0;30,0;0,41;0,01\n",
    "matrix.csv": "Sample 12, 650 nm\n\ndetector angle [deg],10,30\n-60,0.012,0.013\n10,0.38,0.05\n30,0.05,0.41\n",
    "blocks.txt": "AOI = 10 deg\nangle  value\n -60 0.012\n 10 0.38\n\nAOI = 30 deg\nangle  value\n 30 0.4\n",
    "wide.tsv": "src_z\tsrc_a\tview_z\tview_a\t450 nm\t550 nm\n15\t0\t0\t0\t1.03\t1.04\n45\t0\t45\t180\t1.04\t1.05\n",
    "units.csv": "# black\nAOI,AOS,R_factor,note\ndeg,deg,percent,\n10,-60,3.9,a\n10,10,120,b\n30,30,,c\n",
}
SHEETS = {f"AOI {i}": [["detector", "BRDF 1/sr"], [-60.0, 0.012], [float(i), 0.4]] for i in (10, 30)}


def files(folder: Path) -> list[Path]:
    """The tables, written into a folder."""
    for name, text in TEXTS.items():
        (folder / name).write_text(text, encoding="utf-8")
    books = [write(folder / f"sheets{suffix}", SHEETS) for suffix in (".xlsx", ".ods", ".xls")]
    return [*(folder / name for name in TEXTS), *books]
