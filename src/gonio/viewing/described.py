"""A model as a page needs it: its declaration, and its formula as JavaScript and GLSL."""

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from gonio.exporting.targets.javascript import functions
from gonio.exporting.targets.shaders.glsl import with_uniforms
from gonio.model import Model

WIDE = 100.0  # ratio of the bounds above which a slider moves by ratios
SHADER = "brdf"  # the function of a shader: float brdf(vec3 w_i, vec3 w_r), with uniforms brdf_values and brdf_pre


def declaration(model: Model) -> dict[str, Any]:
    """Names, units, bounds and words of a model and of its parameters, in the order of the values of its functions."""
    return {
        "name": model.name,
        "title": model.title,
        "cite": model.cite,
        "violates": sorted(model.violates),
        "weights": list(model.weights),
        "parameters": [_weight(model, n) if n in model.weights else _shape(model, n) for n in model.parameters],
    }


def _weight(model: Model, name: str) -> dict[str, Any]:
    said = {"unit": model.term_unit(name), "help": "weight of its term", "weight": True, "held": False}
    return {"name": name, "lower": 0.0, "upper": None, "default": None, "wide": False} | said


def _shape(model: Model, name: str) -> dict[str, Any]:
    p = model.shape[name]
    wide = p.lower > 0 and p.upper / p.lower > WIDE
    limits = {"lower": p.lower, "upper": p.upper, "default": p.default, "wide": wide}
    return {"name": name, "unit": p.unit, "help": p.help, "weight": False, "held": p.held} | limits


@cache
def module(model: Model) -> str:
    """An ES module: `declaration`, and pre, inc, reflected, f and terms of any values."""
    return "\n".join([f"export const declaration = {json.dumps(declaration(model))};", *functions(model)]) + "\n"


@cache
def shader(model: Model) -> str:
    """GLSL ES 3.00: the function SHADER of any values, which are uniforms."""
    return "\n".join(with_uniforms(model, SHADER)) + "\n"


def by_name(models: Mapping[str, Model]) -> list[dict[str, Any]]:
    """What a list of models to choose from shows."""
    return [{"name": m.name, "title": m.title, "violates": sorted(m.violates)} for m in models.values()]
