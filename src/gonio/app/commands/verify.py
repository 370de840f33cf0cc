"""`gonio verify`: a set-up against what is known, a mirror or a diffuse standard."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
import typer

from gonio import read
from gonio.acquisition import readings
from gonio.app.help_page import Example
from gonio.app.options import AlsoFigure, OutputOptions, refuse_unused
from gonio.app.output import show
from gonio.app.views.measuring import verified as view
from gonio.options import Option, Panel
from gonio.outside import nearest
from gonio.plotting.page import Page, drawn_on, target_of
from gonio.raw import read_readings, reader_of_raw
from gonio.verification.checks import CHECKS, READINGS, SCAN
from gonio.verification.checks.outcome import COVERAGE

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    Draw = Callable[[], Figure]

EXAMPLES = (
    Example(
        "gonio verify mirror.jsonl --material aluminium --uncertainty 1",
        "A mirror against Fresnel's equations; the set-up is known to 1 % (k = 2)",
    ),
    Example(
        "gonio verify scan.csv --certified one.csv --out standard.png",
        "A standard against its certificate, drawn",
    ),
    Example("gonio verify scan.csv --reflectance 0.3 --json -", "Against a constant, over growing ranges of theta_r"),
    Example("gonio verify scan.csv --check reciprocity,energy", "Of any scan, without a standard"),
    Example("gonio verify run.jsonl --check all", "Every check that these readings allow"),
)


ALL = "all"  # of CHECKS that the file allows


@dataclass(frozen=True, kw_only=True)
class Known:
    """What is known of the surface that was measured."""

    PANEL: ClassVar = Panel.MEASUREMENT
    material: Annotated[str, Option("the mirror's material, or a file of optical constants", metavar="NAME|FILE")] = ""
    certified: Annotated[Path | None, Option("the certified BRDF of a diffuse standard", metavar="FILE")] = None
    reflectance: Annotated[
        float | None, Option("reflectance of a standard that is taken for Lambertian", metavar="R", above=0)
    ] = None
    wavelength: Annotated[float | None, Option("wavelength, where the readings name none", metavar="NM", above=0)] = (
        None
    )
    transmittance: Annotated[
        float | None, Option("of the filter in the incident beam, where the bench states none", above=0)
    ] = None
    uncertainty: Annotated[
        float | None, Option("expanded uncertainty (k = 2) of the set-up, in percent", metavar="PERCENT", above=0)
    ] = None

    check: Annotated[
        tuple[str, ...],
        Option(
            f"other checks, of one scan or of raw readings: {', '.join(CHECKS)}, or {ALL} that the file allows",
            metavar="NAME,..",
            names=(*CHECKS, ALL),
        ),
    ] = ()
    zero: Annotated[
        float | None, Option("standard uncertainty of the zero of the angles, for that check", metavar="DEG", above=0)
    ] = None

    @property
    def expanded(self) -> float:
        """The uncertainty as a number, NaN where none is given."""
        return math.nan if self.uncertainty is None else self.uncertainty / 100


def command(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="of a mirror the journals, one for each polarisation; of a standard its scan",
            show_default=False,
        ),
    ],
    known: Known,
    page: Page,
    output: OutputOptions,
    out: AlsoFigure = "",
) -> None:
    """Verify a set-up by a mirror or a diffuse standard.

    delta is that of the paper (eq 9), and belongs to the range that is named with it: no standard is Lambertian far
    from the normal. The set-up passes where delta is below half the expanded uncertainty.

    With --check the readings or the scan speak for themselves. Each number is given with its uncertainty, and passes
    within the expanded one (k = 2), or within --uncertainty where that is more.
    """
    refuse_unused(page, out)
    target, suffixes = target_of(out, page.suffixes)
    if sum(map(bool, (known.material, known.certified, known.reflectance, known.check))) != 1:
        raise ValueError(
            "say what is known: --material of a mirror, --certified curve of a standard, or its --reflectance; or name "
            "what is checked, --check all"
        )
    if known.zero is not None and not known.check:
        raise ValueError("--zero belongs to --check zero: leave it out")
    if known.check:
        _checks(files, known, output, out)
        return
    draw = _mirror(files, known, output) if known.material else _standard(files, known, output)
    if out:
        from gonio.plotting.style import save

        with drawn_on(page):
            for path in save(draw(), target, suffixes, output.force):
                if output.json != "-":
                    show(f"wrote {path}")


def _checks(files: list[Path], known: Known, output: OutputOptions, out: str) -> None:
    """Every check that is asked for; of all those that the file does not allow are named with the reason."""
    if len(files) != 1:
        raise ValueError(f"{len(files)} files are given: check one at a time")
    if known.wavelength or known.transmittance or out:
        raise ValueError(
            "--wavelength and --transmittance belong to a mirror, and --out to a mirror or a standard: leave them out"
        )
    asked = [name.strip() for one in known.check for name in one.split(",") if name.strip()]
    if unknown := [name for name in asked if name not in (*CHECKS, ALL)]:
        raise ValueError(f"no check {unknown[0]!r}: {nearest(unknown[0], (*CHECKS, ALL))}")
    is_raw = reader_of_raw(files[0]) is not None
    data, kind = (read_readings(files[0]), READINGS) if is_raw else (read(files[0]), SCAN)
    is_all = ALL in asked
    found, left_out = {}, {}
    for name in [n for n in CHECKS if kind in CHECKS[n].takes] if is_all else dict.fromkeys(asked):
        try:
            if kind not in CHECKS[name].takes:
                raise ValueError(f"{name} is a check of {' or '.join(CHECKS[name].takes)}, and this is {kind}")
            found[name] = CHECKS[name].run(data)
        except ValueError as error:
            if not is_all:
                raise ValueError(f"{files[0]}: {error}") from error
            left_out[name] = str(error)
    if not found:
        raise ValueError(f"{files[0]}: allows no check: " + "; ".join(left_out.values()))
    limits = {name: known.expanded if not one.unit else math.nan for name, one in found.items()}
    if known.zero is not None:
        limits["zero"] = COVERAGE * known.zero
    output.show(view.checks_record(found, limits, left_out), view.checks_lines(found, limits, left_out))


def _mirror(files: list[Path], known: Known, output: OutputOptions) -> "Draw":
    from gonio.materials import constants
    from gonio.verification import specular

    raws = [readings(path) for path in files]
    stated = {float(raw["wavelength"].values[0]) for raw in raws if "wavelength" in raw}
    wavelengths = stated if known.wavelength is None else {known.wavelength}
    if len(wavelengths) != 1:
        named = ", ".join(f"{one:g} nm" for one in sorted(wavelengths)) or "none"
        raise ValueError(f"the readings name as wavelength {named}: give --wavelength, and journals of one")
    at = constants(known.material, wavelengths.pop())
    n, k = at["index"], at["extinction"]
    found = [specular(raw, n, k, known.transmittance) for raw in raws]
    deviations = [one.deviation(known.expanded) for one in found]
    output.show(view.mirror_record(found, deviations), view.mirror_lines(found, deviations))

    def draw() -> "Figure":
        from gonio.plotting.measuring import mirror_figure

        return mirror_figure(found, n, k, f"mirror of {Path(known.material).stem}")

    return draw


def _standard(files: list[Path], known: Known, output: OutputOptions) -> "Draw":
    from gonio.verification import diffuse, lambertian

    if len(files) != 1:
        raise ValueError(f"{len(files)} scans are given: verify one standard at a time")
    if known.wavelength or known.transmittance:
        raise ValueError("--wavelength and --transmittance belong to a mirror: leave them out")
    scan = read(files[0])
    certified = lambertian(scan, known.reflectance) if known.reflectance else read(known.certified or "")
    found = diffuse(scan, certified)
    deviations = found.deviations(known.expanded)
    reach = float(np.abs(found.theta_r).max())
    by = [found.within(reach, float(angle), known.expanded) for angle in np.unique(found.points["theta_i"].values)]
    output.show(view.diffuse_record(found, deviations, by), view.diffuse_lines(found, deviations, by))

    def draw() -> "Figure":
        from gonio.plotting.measuring import diffuse_figure

        return diffuse_figure(found, files[0].name)

    return draw
