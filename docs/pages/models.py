"""Make docs/models/, a page a model and an index, and their figures, from the declarations: part of `make pages`."""

import re
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from _model_choice import paragraph
from _pages import DOCS, table
from rich.progress import track

from gonio import Geometry, catalogue
from gonio.app.views import catalogue as present
from gonio.literature.equations import factors, markdown, summary, symbol
from gonio.literature.references import Reference, reference
from gonio.model import Model
from gonio.plotting.style import THETA_R, house_style, line_style, mark_specular, new_figure, save
from gonio.units import unit_label

PAGES, FIGURES = DOCS / "models", DOCS / "images" / "models"
ANGLES = (30.0, 60.0)
CHECKED = ((30.0, 30.0, 180.0), (40.0, 20.0, 180.0), (50.0, 35.0, 120.0), (60.0, 60.0, 0.0))
RECONSTRUCTED = (
    "*Reconstructed:* the source was not at hand in full. The model is built from abstracts and public descriptions, or "
    "from memory, and may differ from the original."
)


def page(model: Model) -> str:
    """One model: where it is from, all that it takes to compute it, and what is known of its physics."""
    lines = [f"# {model.name}", "", f"{model.title}.", "", f"**Source:** {source(model)}", ""]
    if model.confidence != "confirmed":
        lines += [RECONSTRUCTED, ""]
    lines += [*equations(model), *parameters(model), *physics(model), *evaluated(model)]
    same = [f"[{other.name}]({other.name}.md)" for other in catalogue.values() if other.cite == model.cite != ""]
    if len(same) > 1:
        others = [one for one in same if not one.startswith(f"[{model.name}]")]
        lines += [f"From the same source: {', '.join(others)}.", ""]
    lines += ["[All models](index.md)"]
    return "\n".join(lines) + "\n"


def source(model: Model) -> str:
    """Authors, year, title, journal, and a link."""
    found = model.source
    return model.cite if found is None else citation(found)


def citation(one: Reference) -> str:
    text = f"{one.byline}: *{one.title}*."
    if one.where:
        text += f" {one.where}."
    if one.doi:
        text += f" [doi:{one.doi}]({one.link})"
    return text


def equations(model: Model) -> Iterator[str]:
    """The sum, each term with its factors, and the angles."""
    yield from ("## Equations", "", "The BRDF [1/sr] is", "", "$$", model.sum_of_terms, "$$", "")
    shown: set[str] = set()
    for weight, term in model.terms.items():
        unit = present.WEIGHT_UNITS[model.term_unit(weight)]
        yield from (f"### Weight {weight}", "", f"{cited(summary(term))} Unit of the weight: {unit}.", "")
        yield from (cited(markdown(term)), "")
        for factor in factors(term):
            if factor.__name__ not in shown:
                shown.add(factor.__name__)
                yield from (f"**`{factor.__name__}`**: {cited(summary(factor))}", "", from_equation(factor), "")
    yield from ("### Angles", "", ANGLES_TEXT, "", from_equation(Geometry), "")


def cited(text: str) -> str:
    """Publications by author and year in place of their keys, without the places in the project's own collection."""
    text = re.sub(r" \(formulas [^()]*\)|[;,] formulas [\d.]+", "", text)
    return re.sub(r"\b[a-z]+\d{4}\b", lambda key: one.short if (one := reference(key[0])) else key[0], text)


def from_equation(function: Callable[..., Any]) -> str:
    """The docstring from its first equation on: what stands above is about the code."""
    _, dollars, after = markdown(function).partition("$$")
    return dollars + after


ANGLES_TEXT = (
    "The unit vectors $(x_i, y_i, z_i)$ and $(x_r, y_r, z_r)$ point from the surface to the source and to the detector; z is "
    "the surface normal. $\\theta_i$ and $\\theta_r$ are their angles from it, and $\\varphi$ is the azimuth between them: "
    "$\\varphi = \\pi$ is the side of the mirror direction. Angles are in rad unless a unit stands beside them, and the "
    "BRDF is 0 below the horizon. The facet whose normal is the half vector of both directions is tilted by $\\alpha$, and light "
    "meets it at the angle $\\beta$:"
)


def parameters(model: Model) -> Iterator[str]:
    yield from ("## Parameters", "")
    rows: list[tuple[object, ...]] = [
        (f"${symbol(w)}$", f"`{w}`", "weight, linear", present.WEIGHT_UNITS[model.term_unit(w)], "", "0", "")
        for w in model.weights
    ]
    for name, p in model.shape.items():
        unit = unit_label(p.unit) or "1"
        rows.append((f"${symbol(name)}$", f"`{name}`", p.help, unit, f"{p.default:g}", f"{p.lower:g}", f"{p.upper:g}"))
    yield table(("symbol", "name", "meaning", "unit", "default", "from", "to"), rows, 4)
    yield ""


def physics(model: Model) -> Iterator[str]:
    """What `gonio check` computes, what the model breaks, and the figure."""
    yield from ("## Physics", "", "Computed at default shape, each term with weight 1:", "")
    heads = ("term", "reciprocity", "reflectance, 0 to 85°", "least value")
    yield table(heads, present.physics_rows(model), 3)
    yield ""
    for law, why in model.violates.items():
        yield from (f"Breaks {law}: {why}.", "")
    if model.only_named:
        yield from (f"Fitted only where it is named: {model.only_named}.", "")
    yield from (f"![{model.name}](../images/models/{model.name}.png)", "")


def evaluated(model: Model) -> Iterator[str]:
    """Python, shell, values to check another implementation by, and the code."""
    weights = ", ".join(f'"{weight}": 1.0' for weight in model.weights)
    options = " ".join(f"--set {weight}=1" for weight in model.weights)
    yield from ("## Evaluate", "", "```python", "import gonio", "")
    yield "geometry = gonio.Geometry.from_degrees(40.0, 20.0, 180.0)  # theta_i, theta_r, phi"
    yield from (f'brdf = gonio.catalogue["{model.name}"](geometry, {{{weights}}})', "```", "")
    yield from ("```sh", f'gonio eval {model.name} {options} --at "40,20,180"', "```", "")
    yield from ("Values at default shape and weight 1, to check another implementation by:", "")
    geometry = Geometry.from_degrees(*np.transpose(CHECKED))
    basis = {w: np.broadcast_to(value, len(CHECKED)) for w, value in model.basis(geometry, {}).items()}
    rows = [
        [*map("{:g}°".format, angles), *(f"{v[k]:.6g}" for v in basis.values())] for k, angles in enumerate(CHECKED)
    ]
    yield table(["θᵢ", "θᵣ", "φ", *basis], rows, 0)
    yield from ("", "<details>", "<summary>The code of the terms</summary>", "")
    for weight, term in model.terms.items():
        yield from (f"`{weight}`:", "", "```python not run: is part of a function", present.equation(term), "```", "")
    yield from ("</details>", "")


def drawing(model: Model) -> Any:
    """Each term at default shape and weight 1 of its unit, in plane, at two incidence angles."""
    theta_r = np.linspace(-85, 85, 681)
    with house_style():
        drawn = new_figure(6.4, 2.4)
        axes = drawn.subplots(1, len(ANGLES), sharey=True)
        for ax, theta_i in zip(axes, ANGLES, strict=True):
            basis = model.basis(Geometry.in_plane(np.full_like(theta_r, theta_i), theta_r), {})
            for k, (weight, term) in enumerate(basis.items()):
                ax.plot(theta_r, np.broadcast_to(term, theta_r.shape), **line_style(k), label=weight)
            most = max(float(np.max(term)) for term in basis.values())
            if all(float(np.min(term)) >= 0 for term in basis.values()):
                ax.set_yscale("log")
                ax.set_ylim(most / 1e5, most * 3)
            mark_specular(ax, theta_i)
            ax.set_xticks(range(-60, 61, 30))
            ax.set_xlabel(THETA_R)
            ax.set_title(f"θᵢ = {theta_i:g}°")
        axes[0].set_ylabel("BRDF at weight 1 [sr⁻¹]")
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper")
    return drawn


def index() -> str:
    """The advice and the table of all models."""
    lines = ["# Models", "", "## Which model for my kind of surface", "", paragraph(), "", "## All models", ""]
    lines += [
        f"These are {len(catalogue)} models. Each is a weighted sum of terms. Weights are linear, shape parameters are searched. Every page has the equations in",
        "full, the source, the parameters, what the model breaks and values to check another implementation by.",
        "*Reconstructed* marks a model whose source was not at hand in full. `gonio models NAME` prints the formula as code,",
        "`gonio models NAME --json -` the LaTeX too. `make pages` writes these pages from the declarations of the models.",
        "",
    ]
    rows = []
    for model in catalogue.values():
        mark = "" if model.confidence == "confirmed" else f" ({model.confidence})"
        breaks = ", ".join(model.violates) or "–"
        cited = model.source.short if model.source else model.cite
        rows.append((f"[{model.name}]({model.name}.md)", model.title + mark, cited, len(model.parameters), breaks))
    lines.append(table(("model", "what it is", "source", "free", "breaks"), rows, 3, 1))
    return "\n".join(lines) + "\n"


def main() -> int:
    PAGES.mkdir(exist_ok=True)
    for left in PAGES.glob("*.md"):  # that of a model that was renamed
        left.unlink()
    (PAGES / "index.md").write_text(index(), encoding="utf-8")
    for model in track(catalogue.values(), "drawing", disable=not sys.stderr.isatty()):
        save(drawing(model), FIGURES / model.name, (".png",), force=True)
        (PAGES / f"{model.name}.md").write_text(page(model), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
