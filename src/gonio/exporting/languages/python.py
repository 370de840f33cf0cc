"""Python's own numbers, and arrays of NumPy."""

import keyword
import math
from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.language import CALL, CHOICE, EITHER, Language, Printed, in_parentheses

RESERVED = frozenset((*keyword.kwlist, "values", "pre", "inc", "w_i", "w_r", "math", "np", "range", "abs", "float"))


class PythonText(Language):
    """What all have in common that is Python."""

    suffix = ".py"
    comment = "#"
    reserved = RESERVED

    def literal(self, value: float | bool) -> str:
        """Truth values have capitals."""
        return str(value) if isinstance(value, bool) else super().literal(value)

    def let(self, name: str, value: str, boolean: bool) -> str:  # noqa: ARG002
        """An assignment."""
        return f"{name} = {value}"

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} += {added}")]
        return [f"{total} = 0.0", f"for {index} in range({size}):", *body]

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """A tuple of the module."""
        return [f"{name} = (", *rows(numbers, self), ")"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of the module."""
        body = [f"{self.indent}{line}" for line in (*inside, f"return {result}")]
        return [f"def {name}({', '.join(arguments)}):", *body, ""]


class Python(PythonText):
    """Python with the module math alone, for one pair of directions.

    Python raises errors where other languages give infinity or not a number, also in the part of a choice that is not
    taken. Small functions at the top of a file give those instead.
    """

    name = "python"
    title = "Python"
    operators: ClassVar = {"and": "and", "or": "or", "not": "not "}
    functions: ClassVar = {
        **{name: f"math.{name}" for name in ("expm1", "atan", "atan2", "tanh", "asinh", "erf", "erfc", "floor")},
        **{name: f"_{name}" for name in ("pow", "sqrt", "exp", "log", "log1p", "sin", "cos", "tan")},
        **{name: f"_{name}" for name in ("asin", "acos", "sinh", "cosh", "acosh", "atanh")},
        "abs": "abs",
        "gammaln": "math.lgamma",
    }

    def not_finite(self, value: float) -> str:
        """Constants of math."""
        return "math.nan" if math.isnan(value) else "math.inf" if value > 0 else "-math.inf"

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """A conditional expression."""
        texts = [in_parentheses(p, EITHER) for p in (x, condition, y)]
        return "{} if {} else {}".format(*texts), CHOICE

    def infix(self, op: str, left: Printed, right: Printed) -> Printed:
        """A quotient by a number that may be zero is a call."""
        if op == "div" and not is_number(right[0]):
            return f"_div({left[0]}, {right[0]})", CALL
        return super().infix(op, left, right)


class NumPy(PythonText):
    """Arrays of NumPy that broadcast against each other."""

    name = "numpy"
    title = "NumPy"
    missing = frozenset({"erf", "erfc", "erfinv", "gammaln"})
    operators: ClassVar = {"and": "&", "or": "|", "not": "~"}
    functions: ClassVar = {
        **{name: f"np.{name}" for name in ("abs", "sqrt", "exp", "expm1", "log", "log1p", "floor")},
        **{name: f"np.{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")},
        **{name: f"np.arc{name[1:]}" for name in ("asin", "acos", "atan", "atan2", "asinh", "acosh", "atanh")},
        "pow": "np.power",
    }

    def not_finite(self, value: float) -> str:
        """Constants of NumPy."""
        return "np.nan" if math.isnan(value) else "np.inf" if value > 0 else "-np.inf"

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """A choice for every element."""
        return f"np.where({condition[0]}, {x[0]}, {y[0]})", CALL

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop, whose sum may grow into an array: no addition in place."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} = {total} + ({added})")]
        return [f"{total} = 0.0", f"for {index} in range({size}):", *body]


def is_number(text: str) -> bool:
    """Whether a printed value is a number other than zero."""
    try:
        return float(text) != 0
    except ValueError:
        return False


PYTHON, NUMPY = Python(), NumPy()

# What the functions with a leading underscore are: as in NumPy, without its warnings.
PRELUDE = """
def _div(a, b):
    if b:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _pow(a, b):
    try:
        return math.pow(a, b)
    except OverflowError:
        return math.inf
    except ValueError:
        return math.inf if a == 0 else math.nan


def _sqrt(x):
    return math.sqrt(x) if x >= 0 else math.nan


def _log(x):
    return math.log(x) if x > 0 else -math.inf if x == 0 else math.nan


def _log1p(x):
    return math.log1p(x) if x > -1 else -math.inf if x == -1 else math.nan


def _exp(x):
    return math.exp(x) if not x > 709.0 else math.inf


def _sinh(x):
    return math.sinh(x) if not abs(x) > 710.0 else math.copysign(math.inf, x)


def _cosh(x):
    return math.cosh(x) if not abs(x) > 710.0 else math.inf


def _sin(x):
    return math.sin(x) if abs(x) < math.inf else math.nan


def _cos(x):
    return math.cos(x) if abs(x) < math.inf else math.nan


def _tan(x):
    return math.tan(x) if abs(x) < math.inf else math.nan


def _asin(x):
    return math.asin(x) if abs(x) <= 1 else math.nan


def _acos(x):
    return math.acos(x) if abs(x) <= 1 else math.nan


def _acosh(x):
    return math.acosh(x) if x >= 1 else math.nan


def _atanh(x):
    return math.atanh(x) if abs(x) < 1 else math.copysign(math.inf, x) if abs(x) == 1 else math.nan
"""
