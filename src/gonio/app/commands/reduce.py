"""`gonio reduce`: what a detector read made into a BRDF; or sheets that are one already, averaged."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from gonio import convert, read
from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions, Scans, To
from gonio.app.output import show
from gonio.app.views.measuring import reduced as views
from gonio.measured.dataset import flatten, signed_theta_r
from gonio.measured.polarisers import unpolarised
from gonio.options import Option, Panel
from gonio.plotting.page import target_of
from gonio.raw import read_readings, reader_of
from gonio.reduction.budget import budget
from gonio.reduction.causes import CAUSES
from gonio.reduction.reduce import reduce, together
from gonio.reduction.repeats import averaged
from gonio.reduction.settings import Reduction
from gonio.reduction.sheets import Shadow, turned
from gonio.reduction.sheets import reduce as of_sheets
from gonio.reduction.standards import FORM, Absolute, Relative
from gonio.reduction.steps.detector import Known
from gonio.reduction.steps.drift import CHOICES
from gonio.reduction.steps.filling import Filling
from gonio.reduction.steps.signature import Signature

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = (
    Example(
        "gonio reduce run.csv --fill under --standard 0.99:factor@0,45 --out scan.csv",
        "Readings of a spot that is seen whole, against a standard certified at 0/45",
    ),
    Example(
        "gonio reduce run.csv --fill beam:2,3 --standard panel.csv --out scan.csv",
        "A part of a wide beam is seen, and the standard's BRDF is in a file",
    ),
    Example(
        "gonio reduce run.csv --fill under --absolute radius=5,distance=99 --out o.nc",
        "Against the incident beam, by the aperture of the detector",
    ),
    Example("gonio reduce one.csv two.csv --out scan.csv", "Average repeats, with the uncertainty of their mean"),
    Example("gonio reduce one.csv --blank blank.csv --out scan.nc", "Subtract what is measured without a sample"),
    Example(
        "gonio reduce one.csv two.csv --mirror --out mean.csv", "Average both sides of the plane of incidence as well"
    ),
)
FLAGS = "raw readings are reduced by --fill and --standard or --absolute"


@dataclass(frozen=True, kw_only=True)
class ReductionOptions:
    """Of sheets that an instrument has divided by a standard: what is subtracted, and what is a repeat of what."""

    PANEL: ClassVar = Panel.REDUCTION
    phi_i: Annotated[
        str, Option("azimuth of the incident light on the sample, one for each file, with commas", metavar="DEG,..")
    ] = ""
    mirror: Annotated[bool, Option("average directions on both sides of the plane of incidence")] = False
    floor: Annotated[
        bool,
        Option("subtract the least signal of each scan, as the detector's zero", "--subtract-floor/--keep-floor"),
    ] = False
    keep_shadow: Annotated[bool, Option("keep directions where the receiver stands in the beam")] = False


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """Of raw readings: what they are compared with, what the detector sees, and what is known of it."""

    PANEL: ClassVar = Panel.READINGS
    fill: Annotated[
        str,
        Option(
            "what the detector sees: the whole spot (under), a part of a wide uniform beam (over), or a beam of 1/e^2 "
            "radius W in a field of view of radius R",
            metavar="under|over|beam:W,R",
        ),
    ] = ""
    standard: Annotated[
        str, Option(f"compare with a standard: {FORM}; or the file of its BRDF", metavar="VALUE:factor@I,R|FILE")
    ] = ""
    standard_signal: Annotated[
        str, Option("the standard's signal without dark, where the file holds no reading of it", metavar="VALUE+-U")
    ] = ""
    absolute: Annotated[
        str,
        Option(
            "compare with the incident beam: radius and distance of the aperture, tau of the filter before the beam, "
            "incident where the file holds no reading of it, share of a wide beam that is seen; `stated` takes what "
            "the file states",
            metavar="radius=R,distance=D,..|stated",
        ),
    ] = ""
    uncertainty: Annotated[
        Mapping[str, float],
        Option(f"standard uncertainty by cause: {', '.join(CAUSES)}", metavar="CAUSE=VALUE"),
    ] = field(default_factory=dict)
    gain: Annotated[Mapping[str, str], Option("the ratio of a range to the others", metavar="RANGE=VALUE+-U")] = field(
        default_factory=dict
    )
    filter: Annotated[Mapping[str, str], Option("the transmittance of a filter", metavar="NAME=VALUE+-U")] = field(
        default_factory=dict
    )
    nonlinearity: Annotated[str, Option("divide signals by 1 + A log10(V/V0)", metavar="A,V0")] = ""
    drift: Annotated[str, Option(f"correct the source by: {', '.join(CHOICES)}", metavar="NAME", names=CHOICES)] = ""
    arm_zero: Annotated[float, Option("the arm reads this at the normal", metavar="DEG", lowest=-90, highest=90)] = 0.0
    tilt: Annotated[str, Option("tilt of the sample along and across the plane of incidence", metavar="DEG,DEG")] = ""
    signature: Annotated[
        str, Option("scan through the direct beam without a sample, at theta_i 0, to subtract", metavar="FILE")
    ] = ""
    specular: Annotated[
        float, Option("specular reflectance of the sample, which the signature is multiplied by", lowest=0, highest=1)
    ] = 0.0
    average: Annotated[bool, Option("average repeats of a direction")] = False
    unpolarised: Annotated[bool, Option("take the mean of readings in s and in p")] = False

    def known(self) -> Reduction:
        """The settings of the reduction."""
        ratios = {
            name: {key: Known.parsed(text, f"--{name} {key}") for key, text in getattr(self, name).items()}
            for name in ("gain", "filter")
        }
        slope, level = _two(self.nonlinearity, "--nonlinearity", "A,V0")
        return Reduction(
            fill=Filling.parsed(self.fill) if self.fill else None,
            uncertainties=self.uncertainty,
            gains=ratios["gain"],
            filters=ratios["filter"],
            nonlinearity=slope,
            level=level,
            drift=self.drift,
            zero=self.arm_zero,
            tilt=_two(self.tilt, "--tilt", "DEG,DEG"),
            signature=self._signature(),
        )

    def compared(self, stated: Mapping[str, Any]) -> Absolute | Relative:
        """What readings are compared with, with what their files state; ValueError where that is nothing, or twice."""
        if bool(self.standard) is bool(self.absolute):
            what = "both are given: leave one out" if self.standard else f"give --standard {FORM}, or --absolute"
            raise ValueError(f"readings are compared with a standard or with the incident beam: {what}")
        if self.absolute:
            if self.standard_signal:
                raise ValueError(
                    "--standard-signal belongs to --standard: for the incident beam, --absolute incident=V"
                )
            return Absolute.parsed(self.absolute, stated)
        signal = Known.parsed(self.standard_signal, "--standard-signal") if self.standard_signal else None
        if Path(self.standard).exists():
            return Relative(scan=read(self.standard), signal=signal)
        return Relative.parsed(self.standard, signal)

    def _signature(self) -> Signature | None:
        if not self.signature:
            if self.specular:
                raise ValueError("--specular belongs to --signature: give both, or neither")
            return None
        flat = flatten(read(self.signature))
        if (flat["theta_i"].values != 0).any():
            raise ValueError(f"{self.signature}: a signature is read at theta_i 0, with theta_r from the direct beam")
        offset = signed_theta_r(flat)
        order = np.argsort(offset)
        return Signature(offset[order], flat["brdf"].values[order], self.specular)


@dataclass(frozen=True, kw_only=True)
class BudgetOptions(OutputOptions):
    """What is written beside the scan."""

    PANEL: ClassVar = Panel.OUTPUT
    figure: Annotated[str, Option("draw the budget of the uncertainty", metavar="FILE")] = ""
    report: Annotated[
        str, Option("write budget, figure, flags and steps as a page: .html, or .pdf", metavar="FILE")
    ] = ""

    def refuse_unknown(self) -> None:
        """ValueError for a suffix that nothing is written as, before anything is."""
        if self.figure:
            target_of(self.figure, (".png",))
        if self.report:
            from gonio.reporting.reduction import refuse_other_suffix

            refuse_other_suffix(Path(self.report))

    def write(self, scan: "xr.Dataset") -> None:
        """The figure and the page that are asked for."""
        written = []
        if self.figure:
            from gonio.plotting.budget.figure import budget_figure
            from gonio.plotting.style import save

            target, suffixes = target_of(self.figure, (".png",))
            drawn = budget_figure(budget(scan), title="uncertainty budget")
            written += save(drawn, target, suffixes, self.force)
        if self.report:
            from gonio.reporting.reduction import write_report

            written.append(write_report(scan, Path(self.report), self.force))
        for path in written if self.json != "-" else ():
            show(f"wrote {path}")


def command(
    scans: Scans,
    out: Annotated[Path, Option("the file to write", metavar="FILE", panel=Panel.OUTPUT)],
    options: ReductionOptions,
    readings: ReadingOptions,
    output: BudgetOptions,
    blank: Annotated[
        Path | None, Option("subtract this scan, measured without a sample", metavar="FILE", panel=Panel.REDUCTION)
    ] = None,
    to: To = "",
) -> None:
    """Make one BRDF of raw readings, or of the raw scans of a sample.

    Readings are signals of a detector, in a table with a column signal_V, _W, _A or _counts, or in a file of an
    instrument. Scans are values that an instrument has divided by a standard already.
    """
    output.refuse_unknown()
    raw = [path for path in scans if reader_of(path) is not None]
    if raw and len(raw) < len(scans):
        other = next(path for path in scans if path not in raw)
        raise ValueError(f"{raw[0]} holds raw readings and {other} a scan: reduce them apart")
    how: Absolute | Relative | None = None
    if raw:
        _refuse_others(ReductionOptions(), options, f"{raw[0]} holds raw readings, and {{}} is for scans", blank)
        reduced, how = _of_readings(raw, readings)
    else:
        _refuse_others(ReadingOptions(), readings, f"{scans[0]} is a scan, and {{}} is for raw readings", None)
        reduced = _of_scans(scans, options, blank)
    done = convert(reduced, out, to, force=output.force)
    output.show(views.record(reduced, done, how), views.lines(reduced, done, how))
    output.write(reduced)


def _refuse_others(default: Any, given: Any, what: str, blank: Path | None) -> None:
    """ValueError where an option of the other kind of file is given."""
    changed = [f.name for f in fields(default) if getattr(given, f.name) != getattr(default, f.name)]
    names = ["--" + name.replace("_", "-") for name in changed] + ["--blank"] * (blank is not None)
    if names:
        raise ValueError(f"{what.format(names[0])}: leave it out ({FLAGS})")


def _of_readings(paths: list[Path], options: ReadingOptions) -> "tuple[xr.Dataset, Absolute | Relative]":
    by, done = options.known(), []
    raws = [(path, read_readings(path)) for path in paths]
    for path, raw in raws:
        if by.fill is None:  # first, since no default would be right
            _at(path, lambda raw=raw: Filling.parsed(str(raw.attrs.get("fill", ""))))
    first = raws[0][1].attrs
    how = options.compared({k: v for k, v in first.items() if all(raw.attrs.get(k) == v for _, raw in raws)})
    for path, raw in raws:
        done.append(_at(path, lambda raw=raw: reduce(raw, how, by)))
    scan = together(done, names=[path.stem for path in paths])
    scan = averaged(scan) if options.average else scan
    return unpolarised(scan, strict=True) if options.unpolarised else scan, how


def _at(path: Path, made: Any) -> Any:
    """What a function gives; its ValueError with the name of the file."""
    try:
        return made()
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _of_scans(scans: list[Path], options: ReductionOptions, blank: Path | None) -> "xr.Dataset":
    samples, angles = [read(path) for path in scans], arguments.azimuths(options.phi_i, len(scans))
    return of_sheets(
        [turned(*pair) for pair in zip(samples, angles, strict=True)] if angles else samples,
        None if blank is None else read(blank),
        floor=options.floor,
        shadow=None if options.keep_shadow else Shadow(),
        mirror=options.mirror,
    )


def _two(text: str, flag: str, form: str) -> tuple[float, float]:
    """Two numbers with a comma; zeros where nothing is given, and a second zero where one is."""
    parts = text.split(",") if text else ["0", "0"]
    if len(parts) > 2:
        raise ValueError(f"{flag} {text!r} is not of the form {form}")
    numbers = [arguments.number(part, f"{flag} {text!r}") for part in parts]
    return numbers[0], numbers[1] if len(numbers) > 1 else 0.0
