"""The commands about models: list them, evaluate, draw and check them."""

from typing import Annotated

import typer

from gonio.app.options import Force, Json
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
    model: Annotated[str, typer.Argument(help="a model of `gonio models`", show_default=False)],
    at: Annotated[str, typer.Option("--at", metavar="DEG", help='"theta_i,theta_r,phi;.." in degrees')],
    values: Annotated[
        list[str], typer.Option("--set", metavar="NAME=VALUE", help="weights (0 if left out) and shape (default)")
    ] = [],  # noqa: B006 - typer reads the default and never changes it
    published: Annotated[
        str, typer.Option("--published", metavar="NAME", help="constants of a paper: Al, Cu, ..")
    ] = "",
    json: Json = "",
) -> None:
    """Evaluate a model at given directions."""
    from gonio import Geometry, catalogue
    from gonio import published as surfaces
    from gonio.app import arguments, present
    from gonio.units import label

    places = arguments.directions(at)
    chosen = catalogue[model]
    surface = surfaces[published] if published else None
    if surface and surface.model != model:
        raise ValueError(f"the constants of {published} belong to {surface.model}, not to {model}")
    unit = surface.unit if surface else "sr-1"
    given = arguments.numbers(values, "--set")
    out = [
        float(chosen(Geometry.from_degrees(*place), (surface.at(place[0]) if surface else {}) | given))
        for place in places
    ]
    if json:
        text = "1/sr" if unit == "sr-1" else unit
        present.emit_json({"model": model, "at": places, "values": out, "unit": text}, json)
    if json != "-":
        table = present.table("theta_i [deg]", "theta_r [deg]", "phi [deg]", f"BRDF [{label(unit)}]", left=0)
        for place, value in zip(places, out, strict=True):
            table.add_row(*(f"{angle:g}" for angle in place), f"{value:.6g}")
        present.console().print(table)


@app.command("check")
def check_physics(
    target: Annotated[str, typer.Argument(help="a model, a scan, or a fit's solution.nc", show_default=False)],
    values: Annotated[list[str], typer.Option("--set", metavar="NAME=VALUE", help="a model's weights and shape")] = [],  # noqa: B006
    json: Json = "",
    force: Force = False,
) -> None:
    """Check positivity, reciprocity and energy."""
    from gonio.app import arguments, checking, present

    checked = checking.check(target, arguments.numbers(values, "--set"))
    if json:
        present.emit_json(checking.record(checked), json, force)
    if json != "-":
        for line in checking.lines(checked):
            present.console().print(line)
