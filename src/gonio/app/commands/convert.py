"""`gonio convert`: a file written in another format, and the error that this costs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
import typer

from gonio import Problem, catalogue, convert, fit, read, resample
from gonio.app import arguments, names
from gonio.app.correcting import CorrectionOptions
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions, Scan, ScanOptions, To
from gonio.app.views import contents, conversion
from gonio.completion import Corrected, Correction
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.options import Weighting
from gonio.fitting.solution import Solution, some
from gonio.measured.dataset import SETS, SPECTRAL, add_history, directions, unit
from gonio.options import Option, Panel
from gonio.resampling.conversion import in_words
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling
from gonio.resampling.sources import SYMMETRIES

if TYPE_CHECKING:
    import xarray as xr

IN_PLACE = "scan"  # which may be written over by --force, as the file is read again before it takes the name
SYMMETRY = "symmetry"  # all of SYMMETRIES
EXAMPLES = (
    Example("gonio convert scan.csv scan.nc", "Write a scan as NetCDF, which keeps all that gonio knows of it"),
    Example(
        "gonio convert scan.csv coating.bsdf --to zemax --fill symmetry,ggx",
        "Write a file for Zemax, its gaps filled by symmetry and by a fitted model",
    ),
    Example("gonio convert coating.bsdf coating.csv", "Write any format as a table, which a spreadsheet opens"),
    Example("gonio convert a.csv b-directions.csv --onto b.csv", "Interpolate one scan at the directions of another"),
)


@dataclass(frozen=True, kw_only=True)
class ResamplingOptions:
    """At which directions a scan is taken, and what may stand where it has no value."""

    PANEL: ClassVar = Panel.RESAMPLING
    onto: Annotated[
        Path | None, Option("interpolate at the directions of this file before writing", metavar="FILE")
    ] = None
    impose: Annotated[
        str,
        Option(
            "make values symmetric by averaging: reciprocity, bilateral (both sides of the incidence plane), or both",
            metavar="A,B",
            names=tuple(SYMMETRIES),
        ),
    ] = ""
    fill: Annotated[
        str,
        Option(
            "fill missing directions by symmetry, by a model or the file of a fit, or by both: symmetry,ggx",
            metavar="symmetry|MODEL|FIT",
            names=names.symmetry_or_models,
        ),
    ] = ""
    correct: Annotated[
        bool, Option("correct the model of --fill by what the scan shows beyond it, as `gonio complete` does")
    ] = False
    weighting: Weighting = AUTO

    def steps(self, data: "xr.Dataset", correction: Correction) -> dict[str, Any]:
        """What `resample` and `convert` are asked."""
        return {"impose": arguments.listed(self.impose), "filling": self._filling(data, correction)}

    def _filling(self, data: "xr.Dataset", correction: Correction) -> Filling | None:
        """What may stand in gaps: symmetries by name, and a model, which is fitted to the data first."""
        named = arguments.listed(self.fill)
        if self.correct and not [n for n in named if n not in (*SYMMETRIES, SYMMETRY)]:
            raise ValueError("--correct corrects the model that fills the gaps: name one, as in --fill symmetry,ggx")
        if not named:
            return None
        symmetries = tuple(s for s in SYMMETRIES if s in named or SYMMETRY in named)
        models = [n for n in named if n not in (*SYMMETRIES, SYMMETRY)]
        if len(models) > 1:
            raise ValueError(f"--fill names {len(models)} models, {' and '.join(models)}: one fills the gaps")
        if not models:
            return Filling(symmetries)
        stored = contents.fit_named(models[0])
        solution = stored or fit(Problem(catalogue[models[0]], data, weighting=self.weighting))
        if stored:
            _refuse_other(stored, models[0], data)
        values = some(f"{k} {v:.6g}" for k, v in solution.values.items())
        where = f" in {Path(models[0]).name}" if stored else ""
        weighting = solution.dataset.attrs["weighting"]
        words = f"{solution.model.name} fitted{where} with {weighting} weighting ({values}; {solution.status})"
        if not self.correct:
            return Filling(symmetries, partial(_predicted, solution.brdf, models[0], _alone(data)), words)
        corrected = Corrected.of(data, solution, correction)
        predicted = partial(_predicted, corrected.brdf, models[0], _alone(data))
        return Filling(symmetries, predicted, f"{words}, {corrected.words}")

    def onto_file(self, data: "xr.Dataset", path: Path, steps: dict[str, Any]) -> "xr.Dataset":
        """The data at the directions of another file, the error of that in the history."""
        resampled = resample(data, directions(read(path)), **steps)
        error = in_words(difference(resampled, data))
        return add_history(resampled, f"at the directions of {path.name}: {error}")


def _refuse_other(solution: Solution, name: str, data: "xr.Dataset") -> None:
    """ValueError for a fit of another unit, wavelength or channel than the data that it is to fill."""
    if solution.unit != unit(data):
        raise ValueError(f"{name}: the fit is in {solution.unit}, and the scan in {unit(data)}: it cannot fill it")
    of_fit = _alone(solution.scan) if solution.has_scan else {}
    for coordinate, value in _alone(data).items():
        if coordinate in SPECTRAL and of_fit.get(coordinate, value) != value:
            raise ValueError(
                f"{name}: the fit is of {coordinate} {of_fit[coordinate]}, and the scan of {value}: fit that"
            )


def _alone(data: "xr.Dataset") -> dict[str, Any]:
    """The one channel, wavelength .. that all values of a scan have, of each kind of set that it names."""
    values = {name: np.unique(data[name].values) for name in SETS if name in data.coords}
    return {name: found[0] for name, found in values.items() if len(found) == 1}


def _predicted(brdf: Callable[["xr.Dataset"], Any], name: str, alone: Mapping[str, Any], points: "xr.Dataset") -> Any:
    """A fit at directions, of which those of one set do not say which it is."""
    said = {c: ("direction", np.full(points.sizes["direction"], v)) for c, v in alone.items() if c not in points.coords}
    try:
        return brdf(points.assign_coords(said))
    except ValueError as error:  # a fit of other wavelengths or channels
        raise ValueError(f"{name}: {error}") from error


def command(
    scan: Scan,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="the file to write", show_default=False)],
    resampling: ResamplingOptions,
    correction: CorrectionOptions,
    used: ScanOptions,
    output: OutputOptions,
    to: To = "",
) -> None:
    """Write a file in another format, and say the error that this costs.

    The error is kept in the history of the written file as well.
    """
    data = used.read(scan, findings=False)
    if not resampling.correct:
        correction.refuse_unused("--correct")
    steps, ready = resampling.steps(data, correction.chosen), data
    if resampling.onto is not None:
        ready = resampling.onto_file(data, resampling.onto, steps)
        steps = {"filling": steps["filling"]}  # what the format stores beside these directions is filled as they were
    done = convert(ready, out, to, force=output.force, **steps)
    output.show(conversion.record(done), conversion.lines(done, since=data))
