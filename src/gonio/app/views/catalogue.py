"""Models and optical constants, one by one and as tables: what the catalogue and the materials declare."""

import ast
import inspect
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from gonio.app.output import faint, figure, strong, table
from gonio.model import declarations
from gonio.units import unit_label

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.materials import Material
    from gonio.model import Model, Term


def model_record(model: "Model") -> dict[str, Any]:
    """A model's declaration as plain data, its equations in LaTeX."""
    source = model.source
    return {
        "name": model.name,
        "title": model.title,
        "cite": model.cite,
        "source": None if source is None else source.record,
        "confidence": model.confidence,
        "equation": model.sum_of_terms,
        "equations": {weight: list(blocks) for weight, blocks in model.equations.items()},
        "weights": list(model.weights),
        "shape": [
            {"name": n, "default": p.default, "lower": p.lower, "upper": p.upper, "unit": p.unit, "help": p.help}
            for n, p in model.shape.items()
        ],
        "violates": dict(model.violates),
    }


def models_table(models: Sequence["Model"]) -> "Table":
    out = table("model", "what it is", "breaks", left=3)
    for model in models:
        mark = "" if model.confidence == "confirmed" else f" ({model.confidence})"
        out.add_row(model.name, model.title + mark, "".join(sorted(law[0].upper() for law in model.violates)))
    return out


BREAKS = "breaks: E energy unbounded, P can be negative, R not reciprocal"


def formula(model: "Model") -> str:
    """The sum of terms, each with its weight and shape parameters."""
    return "f = " + " + ".join(f"{w} {t.__name__}({', '.join(declarations(t))})" for w, t in model.terms.items())


def equation(term: "Term") -> str:
    """The body of a term as it is written, which is its equation; empty where the source is not at hand."""
    try:
        source = textwrap.dedent(inspect.getsource(inspect.unwrap(term)))
    except OSError:
        return ""
    function = next(node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))
    documented = ast.get_docstring(function) is not None
    above = function.body[0].end_lineno if documented else function.body[0].lineno - 1
    return textwrap.dedent("\n".join(source.splitlines()[above:]))


WEIGHT_UNITS = {"sr-1": "1", "deg-1": "deg/sr", "1": "1/sr"}


def physics_rows(model: "Model") -> Iterator[tuple[str, str, str, str]]:
    """Each weight with its term's reciprocity, range of reflectance and least value, computed at default shape."""
    from gonio.app.views.physics import check

    for name, (positive, exchanged, energy) in check(model.name, {}).items():
        if exchanged.holds is None:
            reciprocity = exchanged.why
        else:
            worst = f"worst ln ratio {abs(exchanged.figures.get('worst ln ratio', 0)):.2g}"
            reciprocity = "holds" if exchanged.holds else worst
        spread = energy.figures.values()
        reflectance = f"{figure(min(spread))} to {figure(max(spread))}" if spread else "not normalised"
        yield name.split(", ")[-1].removesuffix(" = 1"), reciprocity, reflectance, figure(positive.figures["least"])


def model_lines(model: "Model") -> Iterator[Any]:
    """One model in full, as on the catalogue page: terms, equations, shape parameters, and its physics."""
    from rich.padding import Padding
    from rich.text import Text

    yield strong(model.name, f": {model.title}")
    yield f"source, {model.confidence}: {model.source or model.cite or 'none named'}\n"
    yield formula(model) + "\n"
    for weight, term in model.terms.items():
        unit = WEIGHT_UNITS[model.term_unit(weight)]
        yield strong(weight, f" [{unit}]: {(term.__doc__ or '').partition(chr(10))[0]}")
        if text := equation(term):
            yield Padding(Text(text, "dim"), (0, 0, 1, 4))
    for name, p in model.shape.items():
        unit = f" {unit_label(p.unit)}".rstrip()
        yield strong(name, f": {p.help}: {p.default:g}{unit}, from {p.lower:g} to {p.upper:g}")
    rows = table("at default shape", "reciprocity", "reflectance to 85 deg", "least value", left=2)
    for row in physics_rows(model):
        rows.add_row(*row)
    yield rows
    for law, why in model.violates.items():
        yield f"breaks {law}: {why}"
    if model.only_named:
        yield f"fitted only where it is named: {model.only_named}"
    if model.source and model.sum_of_terms:
        yield faint(f"docs/models/{model.name}.md has the equations in mathematical notation")
    yield faint(f"gonio draw {model.name}, gonio check {model.name} and gonio eval {model.name} show more")


def material_record(material: "Material") -> dict[str, Any]:
    """Optical constants as plain data."""
    return {
        "name": material.name,
        "title": material.title,
        "cite": material.cite,
        "where": material.where,
        "note": material.note,
        "lines_only": material.lines,
        "wavelength_um": material.wavelength_um.tolist(),
        "n": material.n.tolist(),
        "k": material.k.tolist(),
    }


def materials_table(materials: Sequence["Material"]) -> "Table":
    out = table("material", "source", "wavelengths [µm]", left=3)
    for one in materials:
        out.add_row(one.name, one.cite, ", ".join(f"{w:g}" for w in one.wavelength_um))
    return out


ROWS_OF_A_MATERIAL = 24


def material_lines(material: "Material") -> Iterator[Any]:
    """One material in full: source, notes, and its constants with the reflectance at normal incidence."""
    yield strong(material.name, f": {material.title}")
    yield f"source {material.cite}, {material.where}".removesuffix(", ")
    if material.note:
        yield material.note
    out = table("wavelength [µm]", "n", "k", "reflectance", left=0)
    rows = list(zip(material.wavelength_um, material.n, material.k, strict=True))
    step = -(-len(rows) // ROWS_OF_A_MATERIAL)
    for wavelength, n, k in rows[::step]:
        out.add_row(f"{wavelength:g}", f"{n:.4g}", f"{k:.4g}", f"{((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2):.4f}")
    yield out
    if step > 1:
        yield f"every {step}th of {len(rows)} rows"
