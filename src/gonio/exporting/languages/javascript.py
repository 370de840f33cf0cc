"""JavaScript, whose numbers are in double precision."""

import math
from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.language import Language

_WORDS = (
    "arguments await break case catch class const continue debugger default delete do else enum eval export extends "
    "false finally for function if implements import in instanceof interface let new null package private protected "
    "public return static super switch this throw true try typeof undefined var void while with yield"
)
# And what the functions of a module, their arguments and its constants are called.
_OURS = ("values", "pre", "inc", "wi", "wr", "reflected", "own", "ownPre", "parameters", "terms", "ready", "f")
KEYWORDS = frozenset((*_WORDS.split(), *_OURS))
_OF_MATH = (
    *("abs", "sqrt", "exp", "expm1", "log", "log1p", "floor", "pow", "sin", "cos", "tan", "asin", "acos", "atan"),
    *("atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
)


class JavaScript(Language):
    """JavaScript of 2015 and later, as modules."""

    name = "javascript"
    title = "JavaScript"
    suffix = ".js"
    reserved = KEYWORDS
    functions: ClassVar = {name: f"Math.{name}" for name in _OF_MATH}
    missing = frozenset({"erf", "erfc", "erfinv", "gammaln"})
    operators: ClassVar = {"eq": "===", "and": "&&", "or": "||", "not": "!"}
    indent = "  "

    def not_finite(self, value: float) -> str:
        """Global constants."""
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"

    def let(self, name: str, value: str, boolean: bool) -> str:  # noqa: ARG002
        """A constant of the block."""
        return f"const {name} = {value};"

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} += {added};")]
        return [f"let {total} = 0;", f"for (let {index} = 0; {index} < {size}; ++{index}) {{", *body, "}"]

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """A constant array of the module."""
        return [f"const {name} = [", *rows(numbers, self), "];"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of the module."""
        body = [f"{self.indent}{line}" for line in (*inside, f"return {result};")]
        return [f"function {name}({', '.join(arguments)}) {{", *body, "}"]


JAVASCRIPT = JavaScript()
