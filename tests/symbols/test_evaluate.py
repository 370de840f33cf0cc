"""The numbers of expressions are NumPy's, for arrays and along axes."""

import itertools

import numpy as np
import pytest

from gonio.symbols.evaluate import evaluate
from gonio.symbols.graph import OPERATIONS, Axis, operation, summed, table, variable

ROWS, COLUMNS = Axis(2, "rows"), Axis(3, "columns")
NUMBERS = np.array([[1.0, 2.0, 4.0], [8.0, 16.0, 32.0]])
X = np.array([[0.5, -1.0, 2.0, 3.0], [1.5, 0.25, -2.0, 7.0]])  # of a shape that no axis has


def test_a_sum_over_two_axes_is_that_of_every_value_of_an_array():
    body = operation(
        "mul",
        operation("add", variable("x"), table((10.0, 20.0), (ROWS,))),
        table(tuple(NUMBERS.ravel()), (ROWS, COLUMNS)),
    )
    over_columns = summed(body, COLUMNS)
    whole = summed(operation("mul", over_columns, table((3.0, 5.0), (ROWS,))), ROWS)
    expected = ((X[..., None, None] + np.array([[10.0], [20.0]])) * NUMBERS * np.array([[3.0], [5.0]])).sum(
        axis=(-2, -1)
    )
    (found,) = evaluate([whole], {"x": X})
    assert found.shape == X.shape
    np.testing.assert_allclose(found, expected, rtol=1e-15)
    (alone,) = evaluate([whole], {"x": 0.5})
    assert alone.shape == ()
    np.testing.assert_allclose(alone, expected[0, 0], rtol=1e-15)


def test_axes_stand_in_their_order_whatever_that_of_the_table():
    transposed = table(tuple(NUMBERS.T.ravel()), (COLUMNS, ROWS))
    inner = summed(operation("mul", transposed, table((1.0, 10.0, 100.0), (COLUMNS,))), COLUMNS)
    (found,) = evaluate([summed(operation("mul", inner, table((3.0, 5.0), (ROWS,))), ROWS)], {})
    assert found == (NUMBERS @ [1.0, 10.0, 100.0]) @ [3.0, 5.0]


@pytest.mark.parametrize("op", sorted(OPERATIONS))
def test_every_operation_is_that_of_one_number(op):
    """OPERATIONS computes with Python's numbers, this with NumPy's arrays."""
    count = OPERATIONS[op].__code__.co_argcount if hasattr(OPERATIONS[op], "__code__") else 2 if op == "atan2" else 1
    truth = (False, True) if op in ("and", "or", "not") else (-0.75, 0.25, 0.5, 1.5)
    for arguments in itertools.product(truth, repeat=count):
        try:
            expected = OPERATIONS[op](*arguments)
        except (ArithmeticError, ValueError):
            continue
        names = [f"x{k}" for k in range(count)]
        (found,) = evaluate([operation(op, *map(variable, names))], dict(zip(names, arguments, strict=True)))
        if not isinstance(expected, complex):
            assert found == pytest.approx(expected, rel=1e-14)
