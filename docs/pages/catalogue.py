"""Make docs/catalogue.md and its figures from the declarations of the models: part of `make pages`."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from gonio import Geometry, catalogue
from gonio.app.views import catalogue as present
from gonio.model import Model
from gonio.plotting.style import THETA_R, house_style, line_style, mark_specular, new_figure, save
from gonio.units import unit_label

DOCS = Path(__file__).resolve().parents[1]
ANGLES = (30.0, 60.0)


def entry(model: Model) -> list[str]:
    """One model: what it is, its terms and equations, parameters, and its physics as computed."""
    lines = [
        f"## {model.name}",
        "",
        f"{model.title}. Source `{model.cite}`, {model.confidence}.",
        "",
        f"    {present.formula(model)}",
        "",
        f"![{model.name}](images/catalogue/{model.name}.png)",
        "",
    ]
    for weight, term in model.terms.items():
        unit = present.WEIGHT_UNITS[model.term_unit(weight)]
        lines += [f"**{weight}** [{unit}]: {(term.__doc__ or '').splitlines()[0]}", "", "```python"]
        lines += [present.equation(term), "```", ""]
    if model.shape:
        lines += ["| shape | meaning | unit | default | from | to |", "|---|---|---|---:|---:|---:|"]
        for name, p in model.shape.items():
            lines.append(f"| {name} | {p.help} | {unit_label(p.unit)} | {p.default:g} | {p.lower:g} | {p.upper:g} |")
        lines.append("")
    lines += [
        "| at default shape, weight 1 | reciprocity | reflectance, 0 to 85° | least value |",
        "|---|---|---|---:|",
    ]
    lines += [f"| {' | '.join(row)} |" for row in present.physics_rows(model)]
    for law, why in model.violates.items():
        lines += ["", f"Breaks {law}: {why}."]
    return [*lines, ""]


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


def main() -> int:
    lines = [
        "# The catalogue",
        "",
        "Made by `make pages` from the declarations of the models; `gonio models NAME` prints the same. Weights are",
        "linear, shape parameters are searched. *Reconstructed* marks a model whose source was not at hand in full: it is",
        "built from abstracts and public descriptions, or from memory, and may differ from the original. Figures show each",
        "term at default shape and weight 1; terms without a normalisation have no reflectance.",
        "",
        "| model | what it is | source | free | breaks |",
        "|---|---|---|---:|---|",
    ]
    for model in catalogue.values():
        mark = "" if model.confidence == "confirmed" else f" ({model.confidence})"
        free, breaks = len(model.parameters), ", ".join(model.violates) or "–"
        lines.append(f"| [{model.name}](#{model.name}) | {model.title}{mark} | {model.cite} | {free} | {breaks} |")
    lines.append("")
    for model in track(catalogue.values(), "drawing", disable=not sys.stderr.isatty()):
        save(drawing(model), DOCS / "images" / "catalogue" / model.name, (".png",), force=True)
        lines += entry(model)
    (DOCS / "catalogue.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
