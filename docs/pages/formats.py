"""Make docs/formats.md from the declarations of the formats: part of `make pages`."""

import importlib
import inspect
import pkgutil
from pathlib import Path

from gonio import formats as package
from gonio.app.views.formats import HEADINGS, LEGEND, record, rows
from gonio.formats.format import Format

DOCS = Path(__file__).resolve().parents[1]

HEAD = """# Formats: what gonio reads and writes

Made by `make pages` from the declarations in `src/gonio/formats`; `gonio formats` prints the table.

gonio reads COUNT formats. A file is recognised by its content, never by its name. Whatever it holds becomes a BRDF (or BTDF) in 1/sr over directions, or
relative data in a.u., and `gonio info FILE` says which, what the file stored, and what was done to it. A format that has no
public grammar (TracePro, ASAP) is not promised. Any other table, also of a workbook, is read by `gonio import` ([my own table](tables.md)).

## Converting

```
gonio convert scan.csv coating.bsdf --to zemax --fill symmetry,ggx --weighting log
```

- What the target cannot hold is left out with a word (uncertainties, masks, a single wavelength's number) or refused (relative data in a
  format of absolute ones, several wavelengths in a format of one, transmission). Nothing is bent silently.
- A target with a grid of its own gets the data **resampled**: values at directions that were measured are taken as they are; between
  them is linear interpolation in the data's own coordinates, and between incidence angles the lobe moves along with the mirror direction.
  Formats with an interpolation of their own (RGL, Klems) are read by that. Outside of the data there is nothing: a gap.
- `--fill symmetry` puts the value of the mirror image or of the exchanged directions into a gap, `--fill MODEL` that of a model fitted to
  the data. Both are counted in the history, and files that can (CSV, NetCDF, Zarr) keep the origin of every value beside it.
- `--impose reciprocity,bilateral` replaces every value by the mean over its images, for programs that take these symmetries for granted.
- Where a model fills the gaps, a scan's incidence angles are continued from 0 to 85 deg, so that no renderer has to darken the rim. What is
  mostly a model, or ends before, is said.
- A **Klems matrix** has one value for each pair of patches: the mean, weighted by both cosines, so that energy is kept. It is exact for tensor
  trees, and by quadrature for scans and models.
- The **error** printed is that of the file as it reads back, at the directions of the data (of a Klems matrix each against the mean over its
  patch): rms and bias relative to the data, weighted by solid angle, the rms within 85 deg of the normal, because towards the horizon a BRDF
  may grow without bound, lg RMSE, in which every decade counts alike, and the largest relative error with its place. It says nothing about
  directions that were not measured.
- The **reflectance** of a table that covers the hemisphere is printed, by `gonio info` and `check` as well. A file that would scatter more light
  than falls on it is refused, unless `--force` is given.
- `gonio diff A B` compares any two files at the directions of the second; `--out FILE` draws it.

In Python: `gonio.convert(scan, path, to="zemax")`, `gonio.resample(scan, directions)`, `gonio.resampling.difference.difference(a, b)`.

## What each can hold

LEGEND

"""


def main() -> None:
    """Write the page."""
    text = (
        HEAD.replace("COUNT", str(len(rows()))).replace("LEGEND", f"{LEGEND[0].upper()}{LEGEND[1:]}.")
        + "\n".join([_row(HEADINGS), "|" + "---|" * len(HEADINGS), *(_row(r) for r in rows())])
        + "\n"
    )
    for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        module = importlib.import_module(found.name)
        declared = [v for v in vars(module).values() if isinstance(v, Format)]
        if declared and not found.ispkg:  # a family's package hands on what its files declare
            text += "\n".join(["", *_entry(module, declared)])
    (DOCS / "formats.md").write_text(text, encoding="utf-8")


def _row(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"


def _entry(module: object, declared: list[Format]) -> list[str]:
    """The formats of one module: their names, and its own words on layout, conventions and limits."""
    lines = []
    for one in sorted(declared, key=lambda f: f.name):
        how = "read and written" if record(one)["write"] else "read"
        lines += [f"## {one.title}", "", f"`{one.name}`, usually `{one.suffix}`; {how}.", ""]
    return [*lines, inspect.getdoc(module) or "", ""]


if __name__ == "__main__":
    main()
