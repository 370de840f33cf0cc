"""C of 1999, in double precision."""

import math
from collections.abc import Iterable, Sequence
from typing import ClassVar

from gonio.exporting.languages.language import Language

_WORDS = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while "
    "gamma lgamma tgamma y0 y1 yn j0 j1 jn I index signgam"
)
# Functions and macros of <math.h> too, and what arguments of our functions are called.
KEYWORDS = frozenset((*_WORDS.split(), "values", "pre", "inc", "w_i", "w_r"))


class C(Language):
    """C of 1999 and later; C++ takes it as well."""

    name = "c"
    title = "C"
    suffix = ".h"
    reserved = KEYWORDS
    functions: ClassVar = {"abs": "fabs", "gammaln": "lgamma"}

    def not_finite(self, value: float) -> str:
        """The macros of <math.h>."""
        return "NAN" if math.isnan(value) else "INFINITY" if value > 0 else "-INFINITY"

    def literal(self, value: float | bool) -> str:
        """Truth values are numbers."""
        return str(int(value)) if isinstance(value, bool) else super().literal(value)

    def let(self, name: str, value: str, boolean: bool) -> str:
        """A constant of the block."""
        return f"const {'int' if boolean else 'double'} {name} = {value};"

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A for loop."""
        body = [f"{self.indent}{line}" for line in (*inside, f"{total} += {added};")]
        return [f"double {total} = 0.0;", f"for (int {index} = 0; {index} < {size}; ++{index}) {{", *body, "}"]

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """A constant array of the file."""
        return [f"static const double {name}[{len(numbers)}] = {{", *rows(numbers, self), "};"]

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function that other files do not see."""
        given = ", ".join(f"double {a}" for a in arguments)
        body = [f"{self.indent}{line}" for line in (*inside, f"return {result};")]
        return [f"static double {name}({given}) {{", *body, "}"]


def commented(lines: Iterable[str]) -> list[str]:
    """Lines of text as one comment, which no text can end, and in which no other begins."""
    harmless = (line.replace("*/", "* /").replace("/*", "/ *") for line in lines)
    return ["/*", *(f" * {line}".rstrip() for line in harmless), " */"]


def rows(numbers: Sequence[float], language: Language, each: int = 4) -> list[str]:
    """Numbers of an array in rows."""
    texts = [language.literal(n) for n in numbers]
    return [f"{language.indent}{', '.join(texts[k : k + each])}," for k in range(0, len(texts), each)]


C_LANGUAGE = C()
