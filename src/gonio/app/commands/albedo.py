"""`gonio albedo`: black-, white- and blue-sky albedo of a model, of a fit, or of every pixel of a stack of fits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from gonio.albedo import METHODS
from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.model_options import ValueOptions
from gonio.app.names import models
from gonio.app.options import OutputOptions, Select
from gonio.options import Option, Panel, one_of

EXAMPLES = (
    Example("gonio albedo ross-li --set fiso=0.3,fvol=0.1,fgeo=0.02", "Of the kernels of land surfaces"),
    Example("gonio albedo results/solution.nc --theta-i 0,30,60", "Of a fit, with its uncertainty"),
    Example(
        "gonio albedo ross-li --set fiso=0.3,fvol=0.1 --diffuse 0.2 --method modis",
        "Blue-sky, by the polynomials of the MODIS product",
    ),
    Example("gonio albedo fits.zarr --diffuse 0.2 --out maps.nc", "Of every pixel that gonio fit-stack fitted"),
)


@dataclass(frozen=True, kw_only=True)
class SkyOptions:
    """Under which light the albedo is asked for, and how it is computed."""

    PANEL: ClassVar = Panel.LIGHT
    theta_i: Annotated[str, Option("angles of the sun from the normal, with commas", metavar="DEG,..")] = "0,30,45,60"
    diffuse: Annotated[
        float | None,
        Option("share of diffuse light, for the blue-sky albedo", metavar="PART", lowest=0, highest=1),
    ] = None
    method: Annotated[
        str, Option(f"{one_of(METHODS)}, whose polynomials are of ross-li alone", names=METHODS, metavar="METHOD")
    ] = METHODS[0]


def command(
    surface: Annotated[
        str,
        typer.Argument(
            metavar="MODEL|FIT|FITS.zarr",
            help="a model, the file solution.nc of a fit, or what gonio fit-stack wrote",
            show_default=False,
            autocompletion=Option("", names=models).completed,
        ),
    ],
    values: ValueOptions,
    sky: SkyOptions,
    output: OutputOptions,
    select: Select = {},  # noqa: B006 - read and never changed
    out: Annotated[
        Path | None,
        Option("write the maps of a stack: NAME.nc or NAME.zarr", metavar="FILE", panel=Panel.OUTPUT),
    ] = None,
) -> None:
    """Compute black-, white- and blue-sky albedo, and NBAR.

    Black-sky is the reflectance into the hemisphere under the sun alone, white-sky that under an even sky, blue-sky a
    mixture. NBAR is the reflectance factor seen from the nadir. Of a fit each has the standard uncertainty of the
    fitted values.

    The quadrature takes any model. The polynomials of MODIS are those of its product, and err by 0.018 at 40 deg and
    0.075 at 80 deg in the volume kernel.
    """
    from gonio import catalogue
    from gonio.app.views import contents
    from gonio.app.views.sky import albedos

    angles = arguments.incidence_angles(sky.theta_i)
    given = values.values()
    if (fits := albedos.fits_of_stack(Path(surface))) is not None:
        if given or select:
            raise ValueError("--set, --material and --select belong to one surface, and these are many fits")
        maps = albedos.maps_of(Path(surface), fits, angles, sky.diffuse, sky.method)
        if out is not None:
            albedos.write_maps(maps, out, output.force)
        record = albedos.record_of_maps(maps, Path(surface))
        output.show(record, albedos.lines_of_maps(record, out))
        return
    if out is not None:
        raise ValueError("--out writes the maps of a stack of fits: ask --json FILE of one surface")
    solution = contents.fit_named(surface)
    if solution is not None and given:
        raise ValueError("--set and --material belong to a model: a fit has its own values")
    found = albedos.of_surface(solution or catalogue[surface], given, select, angles, sky.diffuse, sky.method)
    output.show(found, albedos.lines(found))
