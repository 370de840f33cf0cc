"""Symbols broadcast as arrays do, equal expressions are one, and what cannot be traced is refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gonio.arrays import constants, namespace, special
from gonio.symbols.evaluate import evaluate
from gonio.symbols.graph import constant, operation, variable, walk
from gonio.symbols.symbol import Symbol

X, Y = Symbol.named("x"), Symbol.named("y")
NUMBERS = st.floats(-3, 3).map(lambda v: round(v, 6))


def value(symbol: Symbol, **inputs: float) -> float:
    assert symbol.ndim == 0
    return float(evaluate([symbol.node], inputs)[0])


def test_equal_expressions_are_one_node():
    assert (X + Y).node is (Y + X).node
    assert (X * Y * 2).node is ((X * Y) * 2).node
    assert (X - Y).node is not (Y - X).node
    assert (X / Y).node is not (Y / X).node
    assert (X < Y).node is (Y > X).node


def test_zero_false_and_minus_zero_are_three_constants():
    assert len({constant(0.0), constant(False), constant(-0.0)}) == 3
    assert math.copysign(1, evaluate([constant(-0.0)], {})[0]) == -1


def test_constants_are_computed_when_they_are_written():
    two = Symbol(constant(2.0))
    assert (two * 3 + 1).node is constant(7.0)
    assert namespace(X).where(two < 3, X, Y).node is X.node
    assert (X * 1).node is X.node
    assert (X / 1).node is X.node
    assert (two / 0).node.op == "div"  # Python refuses what arrays compute


@given(NUMBERS, st.integers(-17, 17))
def test_powers(x, exponent):
    if x == 0:
        x = 0.5
    assert value(X**exponent if exponent else X**1.0, x=x) == pytest.approx(x ** (exponent or 1), rel=1e-14)


def test_a_root_is_a_root():
    assert (X**0.5).node.op == "sqrt"
    assert (X**-1).node.op == "div"
    assert (X**1.5).node.op == "pow"


NODES = [0.1, 0.4, 0.7]


def test_a_sum_along_a_constant_array():
    nodes = constants(np.array(NODES), X)
    total = namespace(X).sum(nodes * X[..., None], axis=-1)
    assert value(total, x=2.0) == pytest.approx(2 * sum(NODES))


def test_equal_sums_are_one():
    sums = [namespace(X).sum(constants(np.array(NODES), X) * X[..., None], axis=-1) for _ in range(2)]
    assert sums[0].node is sums[1].node


def test_an_array_times_itself_along_another_dimension():
    """The outer product, not the square: one array in two dimensions runs along two axes."""
    nodes = constants(np.array(NODES), X)
    outer = nodes[:, None] * nodes[None, :] * X
    assert outer.shape == (3, 3)
    xp = namespace(X)
    assert value(xp.sum(xp.sum(outer, axis=-1), axis=-1), x=1.0) == pytest.approx(sum(NODES) ** 2)
    assert value(xp.sum(nodes * nodes * X, axis=-1), x=1.0) == pytest.approx(sum(n * n for n in NODES))


def test_nested_sums_with_a_kept_dimension():
    xp, nodes = namespace(X), constants(np.array(NODES), X)
    inner = xp.sum(nodes[..., None] * constants(np.array([1.0, 2.0]), X) + X, axis=-1, keepdims=True)
    assert inner.shape == (3, 1)
    assert value(xp.sum(inner[..., 0], axis=-1), x=1.0) == pytest.approx(sum(3 * n + 2 for n in NODES))


def test_a_sum_along_an_axis_of_which_nothing_depends():
    xp = namespace(X)
    assert value(xp.sum(X[..., None] + 0 * constants(np.array(NODES), X), axis=-1), x=2.0) == pytest.approx(6)


def test_rows_of_constants_and_stacks_are_picked():
    xp = namespace(X)
    table = constants([[1.0, 2.0], [3.0, 4.0]], X)
    assert value(xp.sum(table[1, :] * X, axis=-1), x=1.0) == 7
    assert value(table[1, 0] * X, x=1.0) == 3
    matrix = xp.stack([xp.stack([X, Y], axis=-1), xp.stack([Y, X], axis=-1)], axis=-2)
    assert matrix.shape == (2, 2)
    assert (matrix * 2)[0, 1].node is (Y * 2).node
    assert (matrix * 2)[..., 1, 1].node is (X * 2).node


def test_special_functions_are_found():
    for name in ("erf", "erfc", "gammaln", "erfinv"):
        import scipy.special

        assert value(special(name, X), x=0.3) == pytest.approx(getattr(scipy.special, name)(0.3), rel=1e-15)


def test_what_cannot_be_traced_is_refused():
    with pytest.raises(TypeError, match=r"use xp\.where"):
        bool(X < 1)
    with pytest.raises(ValueError, match="do not broadcast"):
        constants(np.array(NODES), X) + constants(np.array([1.0, 2.0]), X)
    with pytest.raises(TypeError, match="whole dimensions"):
        constants(np.array(NODES), X)[1:]


def test_walk_gives_arguments_first():
    node = operation("add", variable("a"), operation("sqrt", variable("b")))
    order = [n.value or n.op for n in walk(node)]
    assert order.index("sqrt") > order.index("b")
    assert order[-1] == "add"
