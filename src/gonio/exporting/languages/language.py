"""What a programming language has to say of itself so that formulas are printed in it.

A language is a class of words: how it writes a number, a choice, an assignment, a loop and a constant array. The order
of a program, its names and its parentheses are the same in all of them and stand here. Another language is one file.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import ClassVar

from gonio.symbols.formula import Formula
from gonio.symbols.graph import Node, Numbers
from gonio.symbols.program import Loop, Program, Stage, Statement, whole
from gonio.symbols.special import SUPPORT
from gonio.symbols.symbol import Symbol

# How tightly operators bind, the loosest first; a call and a name bind most.
CHOICE, EITHER, COMPARED, SUM, PRODUCT, SIGN, CALL = range(7)
_INFIX = {
    "add": ("+", SUM),
    "sub": ("-", SUM),
    "mul": ("*", PRODUCT),
    "div": ("/", PRODUCT),
    "lt": ("<", COMPARED),
    "le": ("<=", COMPARED),
    "eq": ("==", COMPARED),
    "and": ("&&", EITHER),
    "or": ("||", EITHER),
}
_LOGICAL = ("and", "or", "lt", "le", "eq")

Printed = tuple[str, int]  # text, and how tightly its operator binds


class Language:
    """The words of a language of C's family; others change what differs."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str]
    comment: ClassVar[str] = "//"
    reserved: ClassVar[frozenset[str]] = frozenset()
    functions: ClassVar[Mapping[str, str]] = {}  # operations that it calls by another name than ours
    missing: ClassVar[frozenset[str]] = frozenset({"erfinv"})  # functions that it does not have
    operators: ClassVar[Mapping[str, str]] = {"and": "&&", "or": "||", "not": "!"}
    indent: ClassVar[str] = "    "

    def identifier(self, name: str) -> str:
        """A name that the language does not use itself."""
        return f"{name}_" if name in self.reserved else name

    def literal(self, value: float | bool) -> str:
        """A number, with all its digits, or a truth value."""
        if isinstance(value, bool):
            return "true" if value else "false"
        if not math.isfinite(value):
            return self.not_finite(value)
        return repr(float(value))

    def not_finite(self, value: float) -> str:
        """Infinity, or not a number."""
        raise ValueError(f"{self.title} has no word for {value}")

    def select(self, condition: Printed, x: Printed, y: Printed) -> Printed:
        """Either of two values."""
        texts = [in_parentheses(p, EITHER) for p in (condition, x, y)]
        return "{} ? {} : {}".format(*texts), CHOICE

    def let(self, name: str, value: str, boolean: bool) -> str:
        """A name for a value."""
        raise NotImplementedError

    def loop(self, total: str, index: str, size: int, inside: Sequence[str], added: str) -> list[str]:
        """A sum over an index from 0."""
        raise NotImplementedError

    def table(self, name: str, numbers: Sequence[float]) -> list[str]:
        """A constant array."""
        raise NotImplementedError

    def function(self, name: str, arguments: Sequence[str], inside: Sequence[str], result: str) -> list[str]:
        """A function of numbers that gives one number."""
        raise NotImplementedError

    def called(self, function: str, arguments: Sequence[Printed]) -> Printed:
        """A function of values."""
        return f"{function}({', '.join(text for text, _ in arguments)})", CALL

    def infix(self, op: str, left: Printed, right: Printed) -> Printed:
        """An operator between two values; logic gets parentheses, as languages rank its operators differently."""
        sign, binds = _INFIX[op]
        sign = self.operators.get(op, sign)
        if op in _LOGICAL:
            least = SUM if binds == COMPARED else CALL
            return f"{in_parentheses(left, least)} {sign} {in_parentheses(right, least)}", binds
        return f"{in_parentheses(left, binds)} {sign} {in_parentheses(right, binds + 1)}", binds


def in_parentheses(printed: Printed, least: int) -> str:
    """A value where an operator binds as tightly as `least`."""
    text, binds = printed
    return text if binds >= least else f"({text})"


class Writer:
    """Writes programs in one language, and gathers the constant arrays and functions that they share.

    Parameters
    ----------
    language : Language
        What is written.
    prefix : str
        What the names of shared functions and arrays begin with, so that files can be joined.

    """

    def __init__(self, language: Language, prefix: str = "gonio") -> None:
        self.language, self.prefix = language, prefix
        self._tables: dict[tuple[float, ...], str] = {}
        self._support: dict[str, list[str]] = {}

    def shared(self) -> list[str]:
        """Constant arrays and functions that the language lacks, to stand before what uses them."""
        return [*self.tables(), *self.support()]

    def tables(self, wanted: Callable[[str], bool] = bool) -> list[str]:
        """The constant arrays whose names are wanted."""
        return [
            line
            for numbers, name in self._tables.items()
            if wanted(name)
            for line in self.language.table(name, numbers)
        ]

    def support(self) -> list[str]:
        """The functions that the language lacks."""
        return [line for function in self._support.values() for line in ("", *function)]

    def stage(self, stage: Stage) -> list[str]:
        """The statements of a function, without its results."""
        return self._statements(stage.statements, stage.names)

    def results(self, stage: Stage) -> list[str]:
        """What a function gives, in order."""
        return [self.expression(node, stage.names) for node in stage.results]

    def expression(self, node: Node, names: Mapping[Node, str]) -> str:
        """An expression, of which parts have names."""
        return self._printed(node, names)[0]

    def whole(self, formula: Formula) -> tuple[list[str], list[str]]:
        """The statements and the results of a formula as one function."""
        program: Program = whole(formula)
        return self.stage(program.last), self.results(program.last)

    def _statements(self, statements: Iterable[Statement], names: Mapping[Node, str]) -> list[str]:
        lines: list[str] = []
        for statement in statements:
            if isinstance(statement, Loop):
                own = _in_loop(statement, names)
                inside = self._statements(statement.statements, own)
                added = self.expression(statement.body, own)
                index = self.index(statement.axis.name)
                name = self.language.identifier(statement.name)
                lines += self.language.loop(name, index, statement.axis.size, inside, added)
            else:
                others = {n: text for n, text in names.items() if n is not statement.node}
                value = self.expression(statement.node, others)
                lines.append(self.language.let(self.language.identifier(statement.name), value, statement.node.boolean))
        return lines

    def index(self, axis: str) -> str:
        """The name of the index along an axis."""
        return f"k_{axis}"

    def _printed(self, node: Node, names: Mapping[Node, str]) -> Printed:
        language = self.language
        if node in names:
            return language.identifier(names[node]), CALL
        if node.op == "input":
            return language.identifier(str(node.value)), CALL
        if node.op == "constant":
            text = language.literal(node.value)  # type: ignore[arg-type]
            return text, SIGN if text.startswith("-") else CALL
        if isinstance(node.value, Numbers):
            return self._element(node.value), CALL
        args = [self._printed(a, names) for a in node.args]
        if node.op == "select":
            return language.select(*args)
        if node.op == "neg":
            return f"-{in_parentheses(args[0], CALL)}", SIGN
        if node.op == "not":
            return f"{language.operators['not']}{in_parentheses(args[0], CALL)}", SIGN
        if node.op in _INFIX:
            return language.infix(node.op, args[0], args[1])
        return language.called(self._function(node.op), args)

    def _element(self, content: Numbers) -> str:
        """An element of a constant array, which lies flat."""
        name = self._tables.setdefault(content.numbers, f"{self.prefix}_table_{len(self._tables) + 1}")
        place = self.index(content.axes[0].name)
        for axis in content.axes[1:]:
            place = f"{in_parentheses((place, SUM), PRODUCT)} * {axis.size} + {self.index(axis.name)}"
        return f"{name}[{place}]"

    def _function(self, op: str) -> str:
        """The name of a function, which is written first where the language lacks it."""
        if op not in self.language.missing:
            return self.language.functions.get(op, op)
        name = f"{self.prefix}_{op}"
        if op not in self._support:
            value = SUPPORT[op](Symbol.named("x"))
            statements, results = self.whole(Formula((("x",), (), ()), {"value": value.node}, {}))
            self._support[op] = self.language.function(name, ("x",), statements, results[0])
        return name


def _in_loop(loop: Loop, names: Mapping[Node, str]) -> dict[Node, str]:
    """Names that are known in a loop: its own too, without the sum that it computes."""
    own = {n: text for n, text in names.items() if n is not loop.node}
    for statement in loop.statements:
        own[statement.node] = statement.name
    return own
