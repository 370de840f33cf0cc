"""The commands about models: list them, evaluate, draw and check them."""

from enum import StrEnum
from typing import Annotated

import typer

from gonio.app.options import Force, Json, MaterialName, ModelArgument, Published, Values, Wavelength
from gonio.app.terminal import app


@app.command("models")
def list_models(
    name: Annotated[str, typer.Argument(help="one model, in full", show_default=False)] = "", json: Json = ""
) -> None:
    """List the models, or show one in full."""
    from gonio import catalogue
    from gonio.app import present

    chosen = [catalogue[name]] if name else list(catalogue.values())
    if json:
        present.emit_json([present.model_record(model) for model in chosen], json)
    if json != "-":
        for part in present.model_lines(chosen[0]) if name else (present.models_table(chosen), present.BREAKS):
            present.console().print(part)


@app.command("eval")
def evaluate(
    model: ModelArgument,
    at: Annotated[str, typer.Option("--at", metavar="DEG", help='"theta_i,theta_r,phi;.." in degrees')],
    values: Values = [],  # noqa: B006 - typer reads the default and never changes it
    published: Published = "",
    material: MaterialName = "",
    wavelength: Wavelength = "",
    stokes: Annotated[
        str, typer.Option("--stokes", metavar="I,Q,U,V", help="arriving light, for a polarised model")
    ] = "",
    json: Json = "",
) -> None:
    """Evaluate a model at given directions."""
    from gonio import catalogue
    from gonio.app import arguments, evaluation, present

    places = arguments.directions(at)
    surface = evaluation.surface(catalogue[model], arguments.values(values, material, wavelength), published)
    records = evaluation.evaluate(surface, places, arguments.stokes(stokes) if stokes else None)
    if json:
        present.emit_json(evaluation.record(surface, places, records), json)
    if json != "-":
        present.console().print(evaluation.table(surface, places, records))


class Drawing(StrEnum):
    """What `gonio draw` draws."""

    CURVES = "curves"
    HEMISPHERE = "hemisphere"
    DOLP = "dolp"


@app.command("draw")
def draw_model(
    model: ModelArgument,
    figure: Annotated[Drawing, typer.Option("--figure", help="what to draw")] = Drawing.CURVES,
    theta_i: Annotated[str, typer.Option("--theta-i", metavar="DEG,..", help="incidence angles")] = "30,60",
    values: Values = [],  # noqa: B006
    published: Published = "",
    material: MaterialName = "",
    wavelength: Wavelength = "",
    stokes: Annotated[str, typer.Option("--stokes", metavar="I,Q,U,V", help="arriving light, for dolp")] = "1,0,0,0",
    out: Annotated[str, typer.Option("--out", metavar="FILE", help=".png, .svg, or a name for both")] = "",
    force: Force = False,
) -> None:
    """Draw a model: curves, hemisphere, or polarisation."""
    from gonio import catalogue
    from gonio.app import arguments, drawing, evaluation, present
    from gonio.plot.style import save

    surface = evaluation.surface(catalogue[model], arguments.values(values, material, wavelength), published)
    angles = arguments.incidence_angles(theta_i)
    drawn = drawing.draw_model(figure.value, surface, angles, arguments.stokes(stokes))
    target, suffixes = arguments.figure_target(out or f"{model}-{figure.value}")
    for path in save(drawn, target, suffixes, force):
        present.console().print(f"wrote {path}")


@app.command("check")
def check_physics(
    target: Annotated[str, typer.Argument(help="a model, a scan, or a fit's solution.nc", show_default=False)],
    values: Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="a model's weights and shape")] = [],  # noqa: B006
    material: MaterialName = "",
    wavelength: Wavelength = "",
    samples: Annotated[
        int, typer.Option("--samples", min=0, help="reflectance from so many drawn directions, for narrow lobes")
    ] = 0,
    json: Json = "",
    force: Force = False,
) -> None:
    """Check positivity, reciprocity and energy."""
    from gonio.app import arguments, checking, present

    checked = checking.check(target, arguments.values(values, material, wavelength), samples)
    if json:
        present.emit_json(checking.record(checked), json, force)
    if json != "-":
        for line in checking.lines(checked):
            present.console().print(line)


@app.command("materials")
def list_materials(
    name: Annotated[str, typer.Argument(help="one material or a file of constants", show_default=False)] = "",
    json: Json = "",
    force: Force = False,
) -> None:
    """List optical constants, or show one material's."""
    from gonio.app import present
    from gonio.materials import material, materials

    chosen = [material(name)] if name else list(materials.values())
    if json:
        present.emit_json([present.material_record(one) for one in chosen], json, force)
    if json != "-":
        for part in present.material_lines(chosen[0]) if name else (present.materials_table(chosen),):
            present.console().print(part)
