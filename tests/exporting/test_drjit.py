"""Formulas printed for Dr.Jit, with plain numbers, for which Python would raise errors where arrays do not."""

import numpy as np
import pytest

from gonio import catalogue
from gonio.exporting.languages.drjit import DRJIT, PRELUDE
from gonio.exporting.languages.language import Writer
from gonio.exporting.source import pairs
from gonio.exporting.subject import of_model
from gonio.symbols.formula import INCIDENCE, REFLECTION, formula_of

pytest.importorskip("drjit", reason="no Dr.Jit: pip install drjit")

LITERALS = 1e-6  # nine digits in a literal, of which steep lobes lose some
QUADRATURES = ("modified-beckmann-kirchhoff", "beckmann-kirchhoff", "generalised-harvey-shack", "he-torrance")


def function_of(subject):
    """The BRDF of plain numbers, as Dr.Jit computes it."""
    formula = formula_of(subject.model)
    writer = Writer(DRJIT)
    statements, (result,) = writer.whole(formula)
    given = [f"{DRJIT.identifier(n)} = given[{n!r}]" for n in (*formula.inputs[0], *INCIDENCE, *REFLECTION)]
    body = "\n".join(f"    {line}" for line in (*given, *statements, f"return {result}"))
    text = "\n".join(["import math", "import drjit as dr", PRELUDE, *writer.shared(), "def run(given):", body])
    module = {}
    exec(text, module)
    return module["run"]


@pytest.mark.parametrize("name", catalogue)
def test_numbers_of_python_give_what_the_model_gives(name):
    model = catalogue[name]
    subject = of_model(model, dict.fromkeys(model.weights, 0.5))
    run = function_of(subject)
    geometry = pairs()
    expected = np.asarray(subject.brdf(geometry))
    some = slice(0, 60, 12 if name in QUADRATURES else 1)  # a sum of thousands takes Python a tenth of a second
    rows = np.stack(np.broadcast_arrays(*geometry), axis=-1)[some].tolist()
    found = [run({**subject.values, **dict(zip((*INCIDENCE, *REFLECTION), row, strict=True))}) for row in rows]
    np.testing.assert_allclose(found, expected[some], rtol=LITERALS, atol=1e-12 * np.max(expected))
