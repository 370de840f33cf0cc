"""`gonio topography`: what a height map says of a surface, the BRDF that it predicts, and whether a fit agrees."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from gonio.acquisition.layout import angles
from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.options import NO_PIPES, AlsoFigure, OutputOptions, refuse_unused
from gonio.app.output import show
from gonio.app.views.topography import numbers as view
from gonio.files import refuse_existing
from gonio.options import Option, Panel
from gonio.plotting.page import Page, drawn_on, target_of

if TYPE_CHECKING:
    import xarray as xr

    from gonio.fitting.solution import Solution
    from gonio.topography.light.prediction import Light

EXAMPLES = (
    Example("gonio topography map.sdf --out map.png", "What a height map says, with a figure"),
    Example("gonio topography map.npy --pitch 0.2 --unit um", "Of a matrix, which says neither pitch nor unit"),
    Example(
        "gonio topography map.sdf --s-filter 1 --l-filter 40 --wavelength 532",
        "Without noise and waviness, and what green light sees of it",
    ),
    Example(
        "gonio topography map.sdf --predict lobe.csv --material aluminium",
        "The BRDF that the map predicts by wave optics, as a scan",
    ),
    Example(
        "gonio topography map.sdf --compare fit.nc",
        "Does the slope of a fit agree with the surface, and should it?",
    ),
)
UNITS = ("m", "mm", "um", "nm", "pm")
OPERATORS = ("forward", "central", "seven-point")
BY = ("waves", "characteristic", "slopes")
OBLIQUITIES = ("auto", "harvey-shack", "kirchhoff")


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """How a map is read and made ready: in the order of the options."""

    PANEL: ClassVar = Panel.DATA
    pitch: Annotated[
        str, Option("distance of points in um, for a matrix that does not say it; or along x and y", metavar="UM|UM,UM")
    ] = ""
    unit: Annotated[
        str, Option("unit of heights, for a matrix that does not say it; um without it", metavar="UNIT", names=UNITS)
    ] = ""
    level: Annotated[
        int, Option("take off a form of this degree: 0 the mean, 1 a plane", metavar="N", lowest=0, highest=10)
    ] = 1
    s_filter: Annotated[
        float | None, Option("nesting index in um: take away what is smaller", metavar="UM", above=0)
    ] = None
    l_filter: Annotated[
        float | None, Option("nesting index in um: take away what is larger", metavar="UM", above=0)
    ] = None
    mask_outliers: Annotated[
        bool, Option("leave out points that stand out of 5 x 5 neighbours by 6 standard deviations")
    ] = False
    operator: Annotated[
        str,
        Option(
            "how slopes are computed: forward, central or seven-point; without it the last where it has room",
            metavar="NAME",
            names=OPERATORS,
        ),
    ] = ""

    def read(self, path: Path) -> "xr.Dataset":
        """The map, levelled and filtered as asked."""
        from gonio import read_heights
        from gonio.topography.filters import mask_outliers, roughness, smooth
        from gonio.topography.levelling import level

        heights = level(read_heights(path, pitch=self._pitch(), unit=self.unit), self.level)
        if self.mask_outliers:
            heights = mask_outliers(heights)
        for nesting, filtered in ((self.s_filter, smooth), (self.l_filter, roughness)):
            heights = heights if nesting is None else filtered(heights, nesting)
        return heights

    def _pitch(self) -> tuple[float, float] | None:
        if not self.pitch:
            return None
        found = [arguments.number(part, f"--pitch {self.pitch!r}") for part in self.pitch.split(",")]
        if len(found) > 2 or not all(step > 0 for step in found):
            raise ValueError(f"--pitch is {self.pitch!r}: give the distance of points in um, such as 0.5 or 0.5,0.4")
        return found[0], found[-1]


@dataclass(frozen=True, kw_only=True)
class LightOptions:
    """The light that falls on the surface."""

    PANEL: ClassVar = Panel.MODEL
    wavelength: Annotated[float, Option("wavelength of the light", metavar="NM", above=0)] = 632.8
    theta_i: Annotated[str, Option("incidence angles", metavar="DEG,..|FIRST:LAST:STEP")] = "0,30,60"
    spot: Annotated[
        float | None, Option("width of the spot in um: larger waves are no roughness", metavar="UM", above=0)
    ] = None
    material: Annotated[
        str,
        Option(
            "material of the surface, or a file of optical constants; without it all light is reflected",
            metavar="NAME|FILE",
        ),
    ] = ""
    cone: Annotated[
        float,
        Option(
            "half-angle of the detector's cone: light that stays in the mirror direction is seen in it",
            metavar="DEG",
            lowest=0,
            highest=30,
        ),
    ] = 0.0

    def light(self, wavelength: float | None = None) -> "Light":
        """The light of a prediction, of another wavelength [nm] where that is given."""
        from gonio.materials import constants
        from gonio.topography.light.prediction import Light

        at = wavelength or self.wavelength
        substance = constants(self.material, at) if self.material else {}
        return Light(wavelength=at, half_angle=self.cone, **substance)


@dataclass(frozen=True, kw_only=True)
class PredictionOptions:
    """The BRDF that a map predicts, and the fit that it is compared with."""

    PANEL: ClassVar = Panel.OUTPUT
    predict: Annotated[
        str,
        Option("write the BRDF that the map predicts to this file, as a scan", metavar="FILE"),
    ] = ""
    theta_r: Annotated[
        str,
        Option("angles of the prediction, forward is positive", metavar="DEG,..|FIRST:LAST:STEP", panel=Panel.MODEL),
    ] = "-80:80:1"
    by: Annotated[
        str,
        Option(
            "predict by waves (any roughness), by characteristic (waves, of steps and pits too) or by slopes (facets)",
            metavar="NAME",
            names=BY,
            panel=Panel.MODEL,
        ),
    ] = "waves"
    obliquity: Annotated[
        str,
        Option(
            "of waves and of characteristic: auto, harvey-shack or kirchhoff",
            metavar="NAME",
            names=OBLIQUITIES,
            panel=Panel.MODEL,
        ),
    ] = "auto"
    compare: Annotated[
        str,
        Option("compare with the facet slope of this fit: solution.nc or its folder", metavar="FILE", panel=Panel.DATA),
    ] = ""

    def fit(self) -> "Solution | None":
        """The fit to compare with; None where none is named. FormatError for a file that holds none."""
        from gonio.app.views import contents
        from gonio.reporting.entry import SOLUTION_FILE

        if not self.compare:
            return None
        path = Path(self.compare)
        inside = path / SOLUTION_FILE
        found = contents.fit_in(inside if inside.is_file() else path)
        if found is None:
            raise ValueError(f"{path}: holds no fit: give what gonio fit --out writes")
        return found


def command(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help=f"a height map: SDF, X3P, NPY, text ({NO_PIPES})", show_default=False),
    ],
    used: MapOptions,
    light: LightOptions,
    prediction: PredictionOptions,
    page: Page,
    output: OutputOptions,
    out: AlsoFigure = "",
) -> None:
    """Tell what a height map says of a surface and its light.

    Roughness parameters are those of ISO 25178-2 after a plane is taken off, with their spread over four quarters of
    the map. Of a slope the operator and the band are said, since it is no number without them. Formats of instruments,
    such as Olympus LEXT, need pip install 'gonio[topography]'.
    """
    refuse_unused(page, out)
    target, suffixes = target_of(out, page.suffixes)
    if prediction.predict:
        from gonio.formats import writer

        writer(prediction.predict)  # a suffix that nothing is written as is told before the work
        refuse_existing(Path(prediction.predict), output.force)
    stored, incidence = prediction.fit(), angles(light.theta_i, "--theta-i")
    if not incidence or not all(0 <= angle < 90 for angle in incidence):
        raise ValueError(f"--theta-i is {light.theta_i!r}: give incidence angles from 0 to below 90 deg")
    heights = used.read(file)
    record, parts, written = _told(heights, (used, light, prediction, output), incidence, stored)
    output.show(record, parts)
    if out:
        from gonio.plotting.style import save
        from gonio.plotting.topography import topography_figure

        with drawn_on(page):
            written += save(topography_figure(parts.summary, title=file.name), target, suffixes, output.force)
    for path in written if output.json != "-" else ():
        show(f"wrote {path}")


def _told(
    heights: "xr.Dataset",
    options: tuple[MapOptions, LightOptions, PredictionOptions, OutputOptions],
    incidence: list[float],
    stored: "Solution | None",
) -> "tuple[dict[str, object], view.Told, list[Path]]":
    """The numbers as plain data and for people, and the scan that was written, where one is asked for."""
    import numpy as np

    from gonio import convert
    from gonio.topography.light.agreement import agreement
    from gonio.topography.light.prediction import predict
    from gonio.topography.summary import summarise

    used, light, asked, output = options
    summary = summarise(
        heights,
        wavelength=light.wavelength,
        theta_i=incidence,
        least=1 / light.spot if light.spot else 0.0,
        operator=used.operator,
    )
    scan, written = None, []
    if asked.predict:
        scan = predict(
            heights,
            incidence,
            angles(asked.theta_r, "--theta-r"),
            light.light(),
            by=asked.by,
            factor=asked.obliquity,
            operator=used.operator,
        )
        done = convert(scan, asked.predict, force=output.force)
        written.append(Path(done.path))
    compared = None
    if stored is not None:
        named = np.unique(stored.scan["wavelength"].values) if "wavelength" in stored.scan.coords else np.array([])
        at = float(named[0]) if named.size == 1 else light.wavelength
        compared = agreement(heights, stored, light.light(at), used.operator)
    told = view.Told(summary, scan, compared)
    return view.record(told), told, written
