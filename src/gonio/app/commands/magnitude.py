"""`gonio magnitude`: how bright a body of flat facets is in the sky, over time."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from gonio.app import talk
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions, refuse_unused
from gonio.app.output import show
from gonio.options import Option, Panel
from gonio.outside import shortened
from gonio.plotting.page import Page, drawn_on, target_of

if TYPE_CHECKING:
    import xarray as xr

    from gonio.photometry import Air, Earth, Facet, Pass

EXAMPLES = (
    Example("gonio magnitude satellite.toml pass.csv", "The magnitudes of a satellite over a pass, in V"),
    Example(
        "gonio magnitude satellite.toml pass.csv --out curve.png",
        "Draw the light curve with the band of its uncertainty",
    ),
    Example(
        "gonio magnitude satellite.toml pass.csv --extinction 0.12 --earthshine 0.3",
        "Dimmed by the atmosphere, lit by the Earth too",
    ),
    Example("gonio magnitude satellite.toml pass.csv --band B --system Vega --json -", "In B, for another program"),
)


class Bands(StrEnum):
    """The bands."""

    U = "U"
    B = "B"
    V = "V"
    R = "R"
    I = "I"  # noqa: E741 - the name of the band


class System(StrEnum):
    """The systems of magnitudes."""

    AB = "AB"
    VEGA = "Vega"


class Over(StrEnum):
    """What a light curve is drawn over."""

    TIME = "time"
    PHASE = "phase"


@dataclass(frozen=True, kw_only=True)
class LightOptions:
    """What lights the body, and in which band it is seen through which air."""

    PANEL: ClassVar = Panel.LIGHT
    band: Annotated[Bands, Option("band of the magnitude; the BRDFs have to be of its wavelength")] = Bands.V
    system: Annotated[System, Option("system of the magnitude")] = System.AB
    sun_half_angle: Annotated[
        float, Option("half angle of the sun's disk; 0 is a point", metavar="DEG", lowest=0, highest=30)
    ] = 0.267
    earthshine: Annotated[
        float | None, Option("add the light of an Earth of this albedo", metavar="ALBEDO", lowest=0, highest=1)
    ] = None
    extinction: Annotated[
        float | None,
        Option("extinction of the atmosphere, in magnitudes per airmass: 0.12 is a good site in V", lowest=0),
    ] = None

    def curve(self, facets: "list[Facet]", seen: "Pass", path: Path) -> "xr.Dataset":
        """The light curve; ValueError, with the path of the table, where it lacks what an option needs."""
        from gonio.photometry import light_curve

        return light_curve(
            facets,
            seen.sun,
            seen.observer,
            self.band.value,
            self.system.value,
            sun_half_angle=self.sun_half_angle,
            earth=self.earth(seen, path),
            air=self.air(seen, path),
        )

    def earth(self, seen: "Pass", path: Path) -> "Earth | None":
        """The Earth, where it is asked for or can hide the sun."""
        from gonio.photometry import Earth

        if seen.position is None:
            if self.earthshine is not None:
                raise ValueError(f"{path}: says nothing of the Earth, which --earthshine needs: add position_x_km, ..")
            return None
        return Earth(seen.position, values={"rho": self.earthshine or 0.0})

    def air(self, seen: "Pass", path: Path) -> "Air | None":
        """The atmosphere, where it is asked for."""
        from gonio.photometry import Air

        if self.extinction is None:
            return None
        if seen.altitude is None:
            raise ValueError(f"{path}: has no altitude over the horizon, which --extinction needs: add altitude_deg")
        return Air(self.extinction, seen.altitude)


def command(
    body: Annotated[
        Path,
        typer.Argument(metavar="BODY.toml", help="the facets: area, normal, and fit or model", show_default=False),
    ],
    table: Annotated[
        Path,
        typer.Argument(metavar="PASS.csv", help="where sun and observer are over time", show_default=False),
    ],
    light: LightOptions,
    page: Page,
    output: OutputOptions,
    over: Annotated[Over, Option("what the figure has on its axis", panel=Panel.FIGURE)] = Over.TIME,
    out: Annotated[
        str,
        Option(
            "draw the light curve: NAME.pdf, NAME.png, NAME.svg, or NAME for those of --format",
            metavar="FILE",
            panel=Panel.OUTPUT,
        ),
    ] = "",
) -> None:
    """Compute the magnitude of a body of facets from fitted BRDFs.

    BODY.toml has a table [[facet]] for each flat surface: area in m2, normal = [x, y, z], and fit = "solution.nc" of
    gonio fit, or model = "lambert" and values = {rho = 0.3}. Facets hide nothing from each other.

    PASS.csv has a row for each time: sun_altitude_deg, sun_azimuth_deg, altitude_deg, azimuth_deg and height_km of a
    satellite over the ground, whose frame has z to its zenith and y to the sun's side; or vectors sun_x, observer_x_km
    and so on from the body; or theta_i_deg, theta_r_deg, phi_deg and distance_km of a single facet. magnitude_mag is
    what was observed, for comparison.

    The uncertainty is that of the fitted values. It is as good as the models are: see how far they miss angles that
    they were not shown.
    """
    from gonio import catalogue
    from gonio.app.views.sky import magnitudes
    from gonio.photometry import read_facets, read_pass

    refuse_unused(page, out)
    target_of(out, page.suffixes)
    _refuse_fits(body, (out, output.json))
    facets, seen = read_facets(body, catalogue), read_pass(table)
    if seen.unused:
        talk.tell(shortened(f"gonio: {table}: columns without a meaning here: ", list(seen.unused), ""))
    curve = light.curve(facets, seen, table)
    output.show(magnitudes.record(curve, seen), magnitudes.lines(curve, seen, facets))
    if out:
        written = _drawn(curve, seen, page, out, over.value, body.stem, output.force)
        for path in written if output.json != "-" else ():
            show(f"wrote {path}")


def _refuse_fits(body: Path, outputs: tuple[str, ...]) -> None:
    """ValueError where an output is the file of a fit that the body names."""
    from gonio.files import refuse_overlap
    from gonio.photometry.bodies import fits_named

    for written in outputs:
        if written and written != "-":
            refuse_overlap(Path(written), fits_named(body))


def _drawn(curve: "xr.Dataset", seen: "Pass", page: Page, out: str, over: str, title: str, force: bool) -> list[Path]:
    """The files of the figure of a light curve."""
    from gonio.app.views.sky.magnitudes import times_of
    from gonio.plotting.sky import light_curve_figure
    from gonio.plotting.style import save

    target, suffixes = target_of(out, page.suffixes)
    with drawn_on(page):
        figure = light_curve_figure(curve, times_of(seen), seen.measured, seen.spread, over=over, title=title)
        return save(figure, target, suffixes, force)
