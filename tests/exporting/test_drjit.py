"""Formulas printed for Dr.Jit, with plain numbers, for which Python would raise errors where arrays do not."""

import itertools
import math

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.exporting.languages.drjit import DRJIT, PRELUDE
from gonio.exporting.languages.language import Writer
from gonio.exporting.source import pairs
from gonio.exporting.subject import of_model
from gonio.model import declarations, sampler_of
from gonio.symbols.formula import INCIDENCE, NUMBERS, REFLECTION, density_of, draw_of, formula_of

pytest.importorskip("drjit", reason="no Dr.Jit: pip install drjit")

LITERALS = 1e-6  # nine digits in a literal, of which steep lobes lose some
QUADRATURES = ("modified-beckmann-kirchhoff", "beckmann-kirchhoff", "generalised-harvey-shack", "he-torrance")


def function_of(formula):
    """The outputs of a formula of plain numbers, as Dr.Jit computes them."""
    writer = Writer(DRJIT)
    statements, results = writer.whole(formula)
    given = [f"{DRJIT.identifier(n)} = given[{n!r}]" for level in formula.inputs for n in level]
    body = "\n".join(f"    {line}" for line in (*given, *statements, f"return ({', '.join(results)},)"))
    text = "\n".join(["import math", "import drjit as dr", PRELUDE, *writer.shared(), "def run(given):", body])
    module = {}
    exec(text, module)
    return module["run"]


@pytest.mark.parametrize("name", catalogue)
def test_numbers_of_python_give_what_the_model_gives(name):
    model = catalogue[name]
    subject = of_model(model, dict.fromkeys(model.weights, 0.5))
    run = function_of(formula_of(model))
    geometry = pairs()
    expected = np.asarray(subject.brdf(geometry))
    some = slice(0, 60, 12 if name in QUADRATURES else 1)  # a sum of thousands takes Python a tenth of a second
    rows = np.stack(np.broadcast_arrays(*geometry), axis=-1)[some].tolist()
    found = [run({**subject.values, **dict(zip((*INCIDENCE, *REFLECTION), row, strict=True))})[0] for row in rows]
    np.testing.assert_allclose(found, expected[some], rtol=LITERALS, atol=1e-12 * np.max(expected))


DRAWN = {f"{m.name} {w}": term for m in catalogue.values() for w, term in m.terms.items() if sampler_of(term)}


@pytest.mark.parametrize("name", DRAWN)
def test_samplers_give_what_they_give(name):
    """Directions and densities, as Mitsuba's plugin draws them."""
    term = DRAWN[name]
    sampler, shape = sampler_of(term), {k: p.default for k, p in declarations(term).items()}
    draw, density = function_of(draw_of(sampler, term)), function_of(density_of(sampler, term))
    arrays = {k: np.asarray(value) for k, value in shape.items()}
    lights = ((0.48, -0.36, 0.8), (0.0, 0.0, 1.0), (0.6, 0.75, math.sqrt(1 - 0.36 - 0.5625)))
    for light, u, v in itertools.product(lights, (0.001, 0.1, 0.4, 0.5, 0.7, 0.95, 0.999), (0.01, 0.3, 0.45, 0.9)):
        expected = np.array(sampler.draw(*map(np.asarray, (*light, u, v)), **arrays), dtype=float)
        numbers = dict(zip((*INCIDENCE, *NUMBERS), (*light, u, v), strict=True))
        np.testing.assert_allclose(draw({**shape, **numbers}), expected, atol=1e-5)
        if expected[2] > 0:
            g = Geometry(*map(np.asarray, (*light, *expected)))
            pair = dict(zip((*INCIDENCE, *REFLECTION), (*light, *expected.tolist()), strict=True))
            right = float(sampler.density(g, **arrays))
            assert density({**shape, **pair})[0] == pytest.approx(right, rel=1e-5)
