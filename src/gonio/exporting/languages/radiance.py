"""Radiance's function files (.cal): definitions of functions, without local variables, loops or truth values.

A named expression is the first argument of a further function, whose other arguments are what the rest needs. Radiance
computes the first arguments of a call once (calcomp.h, ALISTSIZ), so that nothing is computed twice.
"""

import re
from collections.abc import Sequence
from typing import ClassVar

from gonio.exporting.languages.language import CALL, PRODUCT, Language, Printed

_NAME = re.compile(r"[A-Za-z_]\w*")


class Cal(Language):
    """Radiance's functions; a condition is positive where it holds and negative where it does not."""

    name = "cal"
    title = "Radiance"
    suffix = ".cal"
    missing = frozenset(
        {"erf", "erfc", "erfinv", "gammaln", "log1p", "expm1", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"}
    )
    operators: ClassVar = {"not": "-"}

    def literal(self, value: float | bool) -> str:
        """Truth values are numbers of either sign."""
        return ("1" if value else "-1") if isinstance(value, bool) else super().literal(value)

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """Radiance computes the value that is chosen alone."""
        return f"if({condition[0]}, {x[0]}, {y[0]})", CALL

    def infix(self, op: str, left: Printed, right: Printed) -> Printed:
        """Comparisons and logic by choices."""
        a, b = left[0], right[0]
        words = {
            "lt": f"if({b} - ({a}), 1, -1)",
            "le": f"if({a} - ({b}), -1, 1)",
            "eq": f"if({a} - ({b}), -1, if({b} - ({a}), -1, 1))",
            "and": f"if({a}, {b}, -1)",
            "or": f"if({a}, 1, {b})",
        }
        return (words[op], CALL) if op in words else super().infix(op, left, right)

    def called(self, function: str, arguments: Sequence[Printed]) -> Printed:
        """A power binds less than the sign before it: -x^2 is (-x)^2."""
        if function == "pow":
            return f"({arguments[0][0]})^({arguments[1][0]})", PRODUCT
        return super().called(function, arguments)

    def let(self, name: str, value: str, boolean: bool) -> str:  # noqa: ARG002
        """What `function` makes an argument of."""
        return f"{name} = {value}"

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function for each named expression, each handing on what the later ones need."""
        lets = [line.partition(" = ")[::2] for line in inside]
        known, called, lines = list(arguments), name, []
        for k, (let, value) in enumerate(lets, start=1):
            later = set(_NAME.findall(" ".join([*(v for _, v in lets[k:]), result])))
            handed = [a for a in known if a in later and a != let]
            head, step = f"{called}({', '.join(known)})", f"{name}_{k}"
            lines.append(f"{head} = {step}({', '.join([value, *handed])});")
            known, called = [let, *handed], step
        return [*lines, f"{called}({', '.join(known)}) = {result};"]


CAL = Cal()
