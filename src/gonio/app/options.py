"""What several commands share: their options, declared once, and the scan, models and problem that these describe."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    import xarray as xr

    from gonio.model import Model

Scan = Annotated[Path, typer.Argument(help="a measured scan, in any format of `gonio formats`", show_default=False)]
Scans = Annotated[
    list[Path], typer.Argument(help="measured scans, in any format of `gonio formats`", show_default=False)
]
ModelName = Annotated[str, typer.Option("--model", help="a model of `gonio models`", show_default=False)]
ModelArgument = Annotated[str, typer.Argument(help="a model of `gonio models`", show_default=False)]
Values = Annotated[
    list[str], typer.Option("--set", metavar="NAME=VALUE", help="weights (0 if left out) and shape (default)")
]
Published = Annotated[str, typer.Option("--published", metavar="NAME", help="constants of a paper: Al, Cu, ..")]
Json = Annotated[str, typer.Option("--json", metavar="FILE|-", help="write JSON to a file, or to standard output")]
Force = Annotated[bool, typer.Option("--force", help="overwrite what is there")]
SolverName = Annotated[str, typer.Option("--solver", help="projection (exact weights) or anneal (Appendix A)")]
Setting = Annotated[list[str], typer.Option("--setting", metavar="NAME=VALUE", help="a setting of the solver")]
Hold = Annotated[
    list[str], typer.Option("--hold", metavar="NAME=VALUE", help="keep a parameter; gamma=half-width reads it")
]
Group = Annotated[list[str], typer.Option("--group", metavar="NAME=COORD", help="one value for each, as in ks=theta_i")]
Share = Annotated[list[str], typer.Option("--share", metavar="NAME", help="one weight over all channels")]
Smoothed = Annotated[
    list[str], typer.Option("--smooth", metavar="NAME=COORD", help="smooth over it, as in sigma=wavelength[:strength]")
]
Bound = Annotated[list[str], typer.Option("--bound", metavar="NAME=LO:HI", help="other bounds than declared")]
Weigh = Annotated[
    str, typer.Option("--weighting", help="uniform, relative, solid-angle, uncertainty or log", show_default=True)
]
NoiseFloor = Annotated[
    float, typer.Option("--noise-floor", metavar="VALUE", help="relative weighting: the noise is constant below it")
]
LossName = Annotated[str, typer.Option("--loss", help="squared, or huber or cauchy against outliers")]
SourceHalfAngle = Annotated[
    float, typer.Option("--source-half-angle", metavar="DEG", help="cone that the source fills, folded into the model")
]
DetectorHalfAngle = Annotated[
    float, typer.Option("--detector-half-angle", metavar="DEG", help="the same for what the detector takes in")
]
ConeStep = Annotated[
    float, typer.Option("--cone-step", metavar="DEG", help="how far apart the directions are that stand for a cone")
]
CovarianceKind = Annotated[
    str, typer.Option("--covariance", help="robust, scaled, or absolute (the scan's own uncertainties)")
]
Bootstrap = Annotated[int, typer.Option("--bootstrap", metavar="DRAWS", help="fit so many resampled scans: 500")]
Resample = Annotated[str, typer.Option("--resample", help="residual (wild) or pairs, for --bootstrap")]
ProfileOf = Annotated[str, typer.Option("--profile", metavar="A,B", help="profile likelihood of these values, or all")]
Derive = Annotated[bool, typer.Option("--derived", help="reflectance, albedo, peak and half width too")]
Seed = Annotated[int, typer.Option("--seed", help="seed of the random numbers")]
Blocked = Annotated[float, typer.Option("--blocked", metavar="DEG", help="mask directions this near to the beam")]
Floor = Annotated[str, typer.Option("--floor", metavar="VALUE", help="mask values below this noise floor")]
Select = Annotated[list[str], typer.Option("--select", metavar="COORD=VALUE", help="one channel or wavelength")]
MaterialName = Annotated[
    str, typer.Option("--material", metavar="NAME|FILE", help="hold index and extinction at a material's: gold, ..")
]
Wavelength = Annotated[str, typer.Option("--wavelength", metavar="NM", help="for --material, where no scan says it")]
Models = Annotated[str, typer.Option("--models", metavar="A,B", help="names, family (the paper's) or all")]

Workers = Annotated[
    int, typer.Option("--workers", metavar="N", help="processes that share the models; 0: as many as pay off")
]

MODELS_A_WORKER = 8  # fewer are fitted before another process has started


def read_scan(path: Path, blocked: float, floor: str, select: list[str], findings: bool = True) -> "xr.Dataset":
    """A scan masked and reduced as asked; with `findings` its errors are raised and its warnings go to standard error.

    What is only converted or compared may be wrong: it is not made worse by that.
    """
    from gonio import check, read
    from gonio.app import arguments
    from gonio.measured.check import Severity
    from gonio.measured.dataset import select as choose
    from gonio.measured.masking import mask

    data = choose(read(path), arguments.pairs(select, "--select"))
    if blocked > 0 or floor:
        data = mask(data, blocked=blocked, floor=arguments.number(floor, "--floor") if floor else None)
    for finding in check(data) if findings else ():
        if finding.severity is Severity.ERROR:
            raise ValueError(f"{path}: {finding}")
        if finding.severity is Severity.WARNING:
            print(f"gonio: {path}: {finding}", file=sys.stderr)
    return data


def read_joint(scans: "list[tuple[Path, xr.Dataset]]", joint: bool) -> "xr.Dataset":
    """The one scan, or several joined under the names of their files."""
    from gonio.measured.dataset import join

    if len(scans) == 1:
        return scans[0][1]
    if not joint:
        raise ValueError(f"{len(scans)} scans are given: add --joint to fit them together, or fit one at a time")
    names = [path.stem for path, _ in scans]
    if len(set(names)) < len(names):
        names = [str(path) for path, _ in scans]
    if len(set(names)) < len(names):
        raise ValueError("a scan is given twice")
    return join(dict(zip(names, (data for _, data in scans), strict=True)))


def problem_options(
    data: "xr.Dataset",
    hold: list[str],
    group: list[str],
    share: list[str],
    smooth: list[str],
    bound: list[str],
    weighting: str,
    noise_floor: float,
    loss: str,
    material: str,
    wavelength: str,
    cones: tuple[float, float, float],
) -> dict[str, Any]:
    """The options of a Problem from those of a command; `cones` are the fields of an Instrument."""
    from gonio.app import arguments
    from gonio.measured.instrument import Instrument

    options = {
        "held": arguments.held(hold, data),
        "grouped": arguments.groups(group),
        "shared": tuple(share),
        "smooth": arguments.smooth(smooth),
        "bounds": arguments.bounds(bound),
        "weighting": weighting,
        "noise_floor": noise_floor,
        "loss": loss,
        "instrument": Instrument(*cones),
    }
    return arguments.with_material(options, data, material, wavelength) if material else options


def chosen_models(names: str) -> "list[Model]":
    """Models by name, the paper's family, or all of them."""
    from gonio import catalogue
    from gonio.compare import FAMILY

    if names == "all":
        return list(catalogue.values())
    if names == "family":
        return [catalogue[name] for name in FAMILY]
    return [catalogue[name.strip()] for name in names.split(",") if name.strip()]


def workers(asked: int, models: int) -> int:
    """The number of processes: what was asked for, or for 0 every core that this many models keep busy."""
    from gonio.processes import cores

    return asked or max(min(cores(), models // MODELS_A_WORKER), 1)
