"""The functions that models call, on Symbols: an array-API namespace as far as the physics needs one.

Special functions have SciPy's names, and `gonio.arrays.special` finds them here.
"""

import math
import sys
from collections.abc import Sequence
from typing import Any

from gonio.symbols.symbol import BOOL, FLOAT, Symbol, as_symbol, elementwise, joined, total

float64 = FLOAT
pi = math.pi


def asarray(value: Any, dtype: str | None = None, device: Any = None) -> Symbol:  # noqa: ARG001
    """A Symbol of a number, of an array of them, or the Symbol that it is."""
    return as_symbol(value)


def astype(value: Symbol, dtype: str) -> Symbol:  # noqa: ARG001
    """The Symbol: all numbers are of one kind."""
    return value


def isdtype(dtype: str, kind: str) -> bool:
    """Whether a dtype is `real floating` or `bool`."""
    return dtype == {"real floating": FLOAT, "bool": BOOL}.get(kind, kind)


def result_type(*values: Any) -> str:  # noqa: ARG001
    """The one dtype of numbers."""
    return FLOAT


def where(condition: Any, x: Any, y: Any) -> Symbol:
    """Either value; printed programs may compute both."""
    return elementwise("select", condition, x, y)


def sum(value: Symbol, axis: int = -1, keepdims: bool = False) -> Symbol:
    """The sum along a dimension."""
    return total(value, axis, keepdims)


def stack(values: Sequence[Symbol], axis: int) -> Symbol:
    """Values along a new dimension."""
    return joined(map(as_symbol, values), axis)


def pow(base: Any, exponent: Any) -> Symbol:
    """A power."""
    return as_symbol(base) ** exponent


def atan2(y: Any, x: Any) -> Symbol:
    """The angle of a vector [rad]."""
    return elementwise("atan2", y, x)


def _function(name: str) -> Any:
    def function(value: Any) -> Symbol:
        return elementwise(name, value)

    function.__name__ = name
    function.__doc__ = f"`{name}` of every element, as in the standard or in SciPy."
    return function


_ELEMENTARY = (
    "abs", "sqrt", "exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "atan",
    "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "floor",
)  # fmt: skip
SPECIAL = ("erf", "erfc", "erfinv", "gammaln")
globals().update({name: _function(name) for name in (*_ELEMENTARY, *SPECIAL)})
Symbol.functions = sys.modules[__name__]
