"""Python that calls Dr.Jit, for plugins of Mitsuba 3: plain numbers and arrays of any of its backends."""

import keyword
import math
from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.language import CALL, Language, Printed
from gonio.exporting.languages.python import PythonText, is_number
from gonio.exporting.languages.single import Single

RESERVED = frozenset((*keyword.kwlist, "dr", "mi", "math", "range", "abs", "float", "self"))
_OF_DRJIT = (
    *("abs", "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
    *("asinh", "acosh", "atanh", "erf", "erfinv", "floor"),
)


class DrJit(Single, PythonText):
    """Python with the module `drjit as dr`, whose functions take numbers of Python and arrays alike.

    Python raises errors where arrays give infinity or not a number: PRELUDE has a quotient that does not. Truth values
    are turned by `True ^ x`, as `~True` is a number in Python.
    """

    name = "drjit"
    title = "Dr.Jit"
    reserved = RESERVED
    missing = frozenset({"erfc", "expm1", "log1p"})
    operators: ClassVar = {"and": "&", "or": "|", "not": "True ^ "}
    functions: ClassVar = {
        **{name: f"dr.{name}" for name in _OF_DRJIT},
        "pow": "dr.power",
        "gammaln": "dr.lgamma",
    }

    def not_finite(self, value: float) -> str:
        """Constants of Dr.Jit."""
        return "dr.nan" if math.isnan(value) else "dr.inf" if value > 0 else "-dr.inf"

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """A choice for every element."""
        return f"dr.select({condition[0]}, {x[0]}, {y[0]})", CALL

    def infix(self, op: str, left: Printed, right: Printed) -> Printed:
        """A quotient by a number that may be zero is a call."""
        if op == "div" and not is_number(right[0]):
            return f"_div({left[0]}, {right[0]})", CALL
        return Language.infix(self, op, left, right)

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop, whose sum may grow into an array: no addition in place."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} = {total} + ({added})")]
        return [f"{total} = 0.0", f"for {index} in range({size}):", *body]


DRJIT = DrJit()

# The quotient of the files that are written: of two numbers of Python, too, one that is never an error.
PRELUDE = """
def _div(a, b):
    if isinstance(a, (int, float)) and isinstance(b, (int, float)) and b == 0:
        return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)
    return a / b
"""
