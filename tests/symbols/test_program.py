"""Programs compute once what does not change, in order, and hand on what the next function needs."""

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.exporting.languages.c import C_LANGUAGE
from gonio.exporting.languages.language import Writer
from gonio.symbols.evaluate import evaluate
from gonio.symbols.formula import Formula, formula_of
from gonio.symbols.graph import constant
from gonio.symbols.program import Let, Loop, staged, whole
from gonio.symbols.symbol import Symbol


def lets(statements):
    for statement in statements:
        yield statement.name
        if isinstance(statement, Loop):
            yield from lets(statement.statements)


@pytest.mark.parametrize("name", ["gonio-best", "modified-beckmann-kirchhoff", "priest-mueller"])
def test_names_are_given_once_and_before_use(name):
    for stage in staged(formula_of(catalogue[name])).stages:
        names = list(lets(stage.statements))
        assert len(names) == len(set(names))
        text = "\n".join(Writer(C_LANGUAGE).stage(stage))
        for k, line in enumerate(text.splitlines()):
            for later in text.splitlines()[k + 1 :]:
                if later.lstrip().startswith("const double "):
                    declared = later.split(" = ")[0].split()[-1]
                    assert f" {declared} " not in f"{line} "


def test_what_a_loop_does_not_change_stands_before_it():
    """gonio-best's profile integrates over nodes; the half width in radians is computed once."""
    program = staged(formula_of(catalogue["cauchy-lorentz-reciprocal"]))
    loop = next(s for s in program.stages[0].statements if isinstance(s, Loop))
    assert all(loop.axis in s.node.axes for s in loop.statements if isinstance(s, Let))


def test_a_hemispherical_integral_of_parameters_alone_is_in_the_first_function():
    """So that a picture of a million directions computes it once."""
    first, second, third = staged(formula_of(catalogue["cauchy-lorentz-reciprocal"])).stages
    assert any(isinstance(s, Loop) for s in first.statements)
    assert not any(isinstance(s, Loop) for s in (*second.statements, *third.statements))


def test_no_truth_value_is_handed_on():
    """Arrays of numbers hold none in strict languages."""
    for model in catalogue.values():
        for nodes in staged(formula_of(model)).carried.values():
            assert not any(node.boolean for node in nodes)


def test_quantities_that_people_know_have_their_names():
    text = "\n".join(Writer(C_LANGUAGE).stage(whole(formula_of(catalogue["ggx"])).last))
    for name in ("cos_beta", "tan_alpha_squared", "below", "term_rho_s"):
        assert f" {name} = " in text


def test_a_formula_with_values():
    """The same number, of fewer inputs."""
    model = catalogue["ggx"]
    values = dict.fromkeys(model.weights, 0.5) | {n: p.default for n, p in model.shape.items()}
    formula = formula_of(model).with_values(values)
    assert formula.inputs[0] == ()
    g = Geometry.from_degrees(30.0, [10.0, 50.0], 150.0)
    found = evaluate(list(formula.outputs.values()), g._asdict())[0]
    np.testing.assert_allclose(found, model(g, values), rtol=1e-14)


def test_parentheses():
    """(a - b) - c and a - (b - c), a/(b/c), -(a + b), (a < b) and so on."""
    a, b, c = (Symbol.named(n) for n in "abc")
    cases = {
        "a - b - c": a - b - c,
        "a - (b - c)": a - (b - c),
        "a / (b / c)": a / (b / c),
        "a / b / c": a / b / c,
        "-(a + b)": -(a + b),
        "a * (b + c)": a * (b + c),
        "(a - b) * c": (a - b) * c,
        "-a * b": -a * b,
        "pow(a, b + c)": a ** (b + c),
        "a - -1.0": a - Symbol(constant(-1.0)),
    }
    for text, symbol in cases.items():
        formula = Formula((("a", "b", "c"), (), ()), {"f": symbol.node}, {})
        (result,) = Writer(C_LANGUAGE).whole(formula)[1]
        assert sorted(result) == sorted(text)  # commutative arguments may change places
        assert result.count("(") == text.count("(")
