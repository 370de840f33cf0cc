"""`gonio complete`: a surface at directions that were not measured, by a model and what the scan says beyond it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from gonio import Problem, catalogue, complete, fit, read, write
from gonio.app.correcting import CorrectionOptions
from gonio.app.help_page import Example
from gonio.app.options import ModelName, OutputOptions, Scan, ScanOptions
from gonio.app.views import contents
from gonio.completion.completed import ORIGINS
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.options import Weighting
from gonio.formats import recognise
from gonio.formats.native import TIDY_CSV
from gonio.formats.native.tidy_csv import read_directions
from gonio.options import Option, Panel

if TYPE_CHECKING:
    import xarray as xr

BEST = "gonio-best"  # predicts left-out angles best over the surfaces of docs/real-surfaces.md
EXAMPLES = (
    Example(
        "gonio complete scan.csv --onto directions.csv --out completed.csv",
        "The surface at the directions of a table or of another scan",
    ),
    Example("gonio complete scan.csv --model ggx --out half-space.csv", "The half space at each incidence angle"),
    Example("gonio complete scan.csv --model fit.nc --no-prior --out completed.csv", "The fit of a file, corrected"),
)


@dataclass(frozen=True, kw_only=True)
class CompletedOptions:
    """Where the surface is wanted, and how much each point counts in the fit."""

    PANEL: ClassVar = Panel.RESAMPLING
    onto: Annotated[
        Path | None,
        Option(
            "the directions: a scan, or a table theta_i_deg,theta_r_deg,phi_deg; without it the half space at each "
            "incidence angle",
            metavar="FILE",
        ),
    ] = None
    weighting: Weighting = AUTO

    @property
    def places(self) -> "xr.Dataset | None":
        """The directions, None where no file is named."""
        return None if self.onto is None else _directions_in(self.onto)


def _directions_in(path: Path) -> "xr.Dataset":
    """Those of a table of angles, or of a scan in any format."""
    alone = read_directions(path) if recognise(path).name == TIDY_CSV.name else None
    return read(path) if alone is None else alone


def command(
    scan: Scan,
    completed: CompletedOptions,
    correction: CorrectionOptions,
    used: ScanOptions,
    output: OutputOptions,
    out: Annotated[Path, Option("the file to write, in the format of its suffix", metavar="FILE", panel=Panel.OUTPUT)],
    model: ModelName = BEST,
) -> None:
    """Give a surface where it was not measured, and how sure it is.

    A fit is corrected by what is learned from its residuals. Each value has a standard uncertainty, and an origin:
    measured, corrected by its neighbours, or the model alone.
    """
    data, chosen, places = used.read(scan), correction.chosen, completed.places
    solution = contents.fit_named(model) or fit(Problem(catalogue[model], data, weighting=completed.weighting))
    done = complete(data, solution, places, chosen.prior, chosen.without)
    write(done, out, force=output.force)
    counts = {name: int(np.count_nonzero(done["origin"].values == name)) for name in ORIGINS}
    record = {"scan": str(scan), "model": solution.model.name, "out": str(out), "directions": counts}
    told = ", ".join(f"{count} {name}" for name, count in counts.items())
    output.show(record, (f"wrote {out}: {sum(counts.values())} directions, {told}",))
