r"""Numbers from LaTeX: equations as docutils converts them to MathML, evaluated for one pair of directions.

It knows what the equations of the catalogue use: definitions `name = ..` and `name(x) = ..` in any order, products
without a sign, functions of one factor as in `\cos 2\beta`, sums, integrals, matrices and cases. A definition sees
the values of whoever asks for it, so that `x` within `S(\theta) = .. x ..` belongs to that theta.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from docutils.utils.math.latex2mathml import tex2mathml
from scipy import integrate, special

Node = ElementTree.Element
IN_DEGREES = {"θ", "θ_i", "θ_r", "α", "β"}
TERMS = 150  # of a sum without end


def _elementary(of_real: Callable, of_complex: Callable) -> Callable:
    return lambda x: of_complex(x) if isinstance(x, complex) else of_real(x)


FUNCTIONS: dict[str, Callable] = {
    "cos": math.cos,
    "sin": math.sin,
    "tan": math.tan,
    "cot": lambda x: 1 / math.tan(x),
    "exp": math.exp,
    "ln": math.log,
    "erf": math.erf,
    "erfc": math.erfc,
    "arctan": math.atan,
    "arccos": lambda x: math.acos(min(1.0, max(-1.0, x))),
    "min": min,
    "max": max,
    "Re": lambda z: z.real,
    "Im": lambda z: z.imag,
    "sgn": lambda x: math.copysign(1.0, x),
    "Γ": math.gamma,
    "W": lambda x: float(special.lambertw(x).real),
}
_root = _elementary(math.sqrt, cmath.sqrt)


def parsed(latex: str) -> Node:
    """The MathML of a formula, without name spaces."""
    text = tex2mathml(latex).replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")
    return ElementTree.fromstring(text.replace("&ApplyFunction;", "").replace("<mo></mo>", ""))


def key(node: Node) -> str:
    """A name with its index as one word: `θ_i`, `k_dd`."""
    if node.tag in ("msub", "mrow", "math"):
        return ("_" if node.tag == "msub" else "").join(key(child) for child in node)
    return (node.text or "").strip()


def is_text(node: Node, *texts: str) -> bool:
    return node.tag in ("mo", "mi") and (node.text or "").strip() in texts


def names(latex: str) -> set[str]:
    """Every name in a formula, with and without its index."""
    return {key(node) for node in parsed(latex).iter() if node.tag in ("mi", "msub")} | {
        f"{key(node[0])}_{key(node[1])}" for node in parsed(latex).iter("msubsup")
    }


def width(latex: str) -> int:
    """Characters side by side in the widest line: of a fraction those of its wider part, of a sum those of a limit."""
    root = parsed(latex)
    return max((sum(map(_characters, row)) for row in root.iter("mtr")), default=_characters(root))


def _characters(node: Node) -> int:
    if node.tag in ("mfrac", "munderover", "mtable"):
        parts = node if node.tag != "mtable" else [cell for row in node for cell in row]
        return max(map(_characters, parts))
    if node.tag in ("msubsup",):
        return _characters(node[0]) + max(map(_characters, node[1:]))
    return len((node.text or "").strip()) + sum(map(_characters, node))


class Definition:
    """One definition: the name, that of its argument or none, and the nodes of its right side."""

    def __init__(self, left: Sequence[Node], right: Sequence[Node], degrees: bool) -> None:
        self.name, self.argument = key(left[0]), key(left[2]) if len(left) == 4 else None
        assert len(left) in (1, 4), "the left side is a name or a function of one name"
        self.right, self.degrees = right, degrees
        self.text = "".join(ElementTree.tostring(node, "unicode") for node in right)


def definitions(latex: str, degrees: bool) -> list[Definition]:
    """The definitions of one block. A row that begins with an empty cell goes on with the one above."""
    root = parsed(latex)
    rows: list[list[Node]] = []
    table = root.find("mtable")
    if table is None:
        rows = [list(root)]
    else:
        for row in table:
            left, right = (list(cell) for cell in row)
            if left:
                rows.append([])
            rows[-1] += [*left, *right]
    out = []
    for row in rows:
        at = next(k for k, node in enumerate(row) if is_text(node, "="))
        out.append(Definition(row[:at], row[at + 1 :], degrees))
    return out


class Scope:
    """Values by name, and definitions that are evaluated when they are asked for, once for the same values."""

    def __init__(self, values: dict[str, Any], known: dict[str, Definition]) -> None:
        self.values, self.known, self.computed = values, known, dict[tuple[str, Any], Any]()

    def value(self, name: str, degrees: bool) -> Any:
        if name in self.values:
            return self.values[name] * (180 / math.pi if degrees and name in IN_DEGREES else 1)
        return self.defined(name, None)

    def defined(self, name: str, argument: Any) -> Any:
        if (name, argument) not in self.computed:
            one = self.known[name]
            scope = self if argument is None else self.with_value(one.argument or "", argument)
            self.computed[name, argument] = Reader(one.right, scope, one.degrees).whole()
        return self.computed[name, argument]

    def with_value(self, name: str, value: Any) -> "Scope":
        return Scope(self.values | {name: value}, self.known)


class Reader:
    """Evaluates a row of nodes from left to right."""

    def __init__(self, nodes: Sequence[Node], scope: Scope, degrees: bool) -> None:
        self.nodes = [one for node in nodes for one in self._flat(node) if one.tag != "mspace"]
        self.scope, self.degrees, self.at = scope, degrees, 0

    def _flat(self, node: Node) -> list[Node]:
        """A row is no unit: its parentheses are among its children."""
        if node.tag not in ("mrow", "mstyle") or self._cases(node):
            return [node]
        return [one for child in node for one in self._flat(child)]

    @staticmethod
    def _cases(node: Node) -> bool:
        return len(node) == 2 and is_text(node[0], "{")

    def peek(self) -> Node | None:
        return self.nodes[self.at] if self.at < len(self.nodes) else None

    def whole(self) -> Any:
        value = self.sum()
        assert self.peek() is None, f"unread: {key(self.nodes[self.at])}"
        return value

    def read(self, nodes: Sequence[Node]) -> Any:
        """The value of other nodes in this reader's place."""
        return Reader(nodes, self.scope, self.degrees).whole()

    def sum(self) -> Any:
        total = None
        while (node := self.peek()) is not None:
            sign = 1
            if is_text(node, "+", "−"):
                sign = -1 if is_text(node, "−") else 1
                self.at += 1
            elif total is not None:
                break
            value = sign * self.product()
            total = value if total is None else total + value
        return total

    def product(self) -> Any:
        total: Any = None
        while (node := self.peek()) is not None:
            if (
                is_text(node, "+", "−", ",", "<", "≥")
                or self._closes(node)
                or (is_text(node, "d") and node.get("mathvariant"))
            ):
                break
            if is_text(node, "/"):
                self.at += 1
                total = total / self.factor()
                continue
            value = self.factor()
            total = value if total is None else _times(total, value)
        return total

    @staticmethod
    def _closes(node: Node) -> bool:
        inner = node[0] if node.tag == "msup" else node
        return is_text(inner, ")") or (is_text(inner, "|") and inner.get("class") != "mathopen")

    def factor(self) -> Any:
        node = self.nodes[self.at]
        self.at += 1
        if self.peek() is not None and is_text(self.nodes[self.at], "!"):
            self.at += 1
            return math.gamma(self.atom(node) + 1)
        return self.atom(node)

    def atom(self, node: Node) -> Any:
        inner = lambda child: self.read([child])  # noqa: E731
        if is_text(node, "("):
            (value,) = (values := self.arguments())[0]
            return value ** values[1] if values[1] is not None else value
        if is_text(node, "|") and node.get("class") == "mathopen":
            value = abs(self.sum())
            power = self.close()
            return value if power is None else value**power
        if node.tag == "mn":
            return float(node.text or "")
        if node.tag == "mfrac":
            return inner(node[0]) / inner(node[1])
        if node.tag == "msqrt":
            return _root(self.read(list(node)))
        if node.tag == "mover":
            return inner(node[0]).conjugate()
        if node.tag in ("munderover", "msubsup", "mo") and key(node if node.tag == "mo" else node[0]) in ("∑", "∫"):
            return self.summed(node)
        if node.tag == "mrow" and self._cases(node):
            return self.cases(node[1])
        if node.tag == "mtable":
            return self.matrix(node)
        return self.named(node, inner)

    def named(self, node: Node, inner: Callable) -> Any:
        """A name, a function of what follows, or a power of either."""
        base, power = (node[0], inner(node[1])) if node.tag == "msup" else (node, None)
        if base.tag == "mrow":
            return inner(base) ** power
        name = key(base)
        if node.tag == "msubsup":
            name, power = f"{key(node[0])}_{key(node[1])}", inner(node[2])
        if (name in FUNCTIONS and name not in self.scope.values) or self._is_function(name):
            values, after = self.argument()
            value = FUNCTIONS[name](*values) if name in FUNCTIONS else self.scope.defined(name, *values)
            power = power if after is None else after
        elif base.get("mathvariant") == "normal" and name in ("e", "i"):
            value = math.e if name == "e" else 1j
        elif base.tag == "mn":
            value = float(name)
        elif name == "π":
            value = math.pi
        else:
            value = self.scope.value(name, self.degrees)
        return value if power is None else value**power

    def _is_function(self, name: str) -> bool:
        following = self.peek()
        return name in self.scope.known and self.scope.known[name].argument is not None and is_text(following, "(")

    def argument(self) -> tuple[list[Any], Any]:
        """Arguments within parentheses and the power behind these; or one factor, with a number before it."""
        node = self.nodes[self.at]
        if is_text(node, "("):
            self.at += 1
            return self.arguments()
        value = self.factor()
        return [value * self.factor() if node.tag == "mn" else value], None

    def arguments(self) -> tuple[list[Any], Any]:
        values = [self.sum()]
        while is_text(self.nodes[self.at], ","):
            self.at += 1
            values.append(self.sum())
        return values, self.close()

    def close(self) -> Any:
        """Read what closes a group, and return its power."""
        node = self.nodes[self.at]
        assert self._closes(node), key(node)
        self.at += 1
        return self.read([node[1]]) if node.tag == "msup" else None

    def summed(self, node: Node) -> Any:
        """A sum over whole numbers, until its terms no longer count, or an integral up to its d and variable."""
        rest = self.nodes[self.at :]
        if key(node[0]) == "∑":
            self.at = len(self.nodes)
            return _series(lambda m: self.with_value(rest, key(node[1][0]), m))
        end = next(k for k, one in enumerate(rest) if is_text(one, "d") and one.get("mathvariant"))
        name = key(rest[end + 1])
        self.at += end + 2
        low, high = (math.inf if key(n) == "∞" else self.read([n]) for n in node[1:])
        return integrate.quad(lambda x: self.with_value(rest[:end], name, x), low, high, epsabs=0, epsrel=1e-9)[0]

    def with_value(self, nodes: Sequence[Node], name: str, value: float) -> Any:
        return Reader(nodes, self.scope.with_value(name, value), self.degrees).whole()

    def cases(self, table: Node) -> Any:
        for row in table:
            value, condition = (list(cell) for cell in row)
            at = next(k for k, node in enumerate(condition) if is_text(node, "<", "≥"))
            left, right = (self.read(part) for part in (condition[:at], condition[at + 1 :]))
            if (left < right) == is_text(condition[at], "<"):
                return self.read(value[:-1])
        raise AssertionError("no case holds")

    def matrix(self, table: Node) -> np.ndarray:
        return np.array([[self.read(list(cell)) for cell in row] for row in table])


def _series(term: Callable[[float], float]) -> float:
    total = 0.0
    for m in range(1, TERMS):
        value = term(float(m))
        total += value
        if m > 20 and value < 1e-17 * total:
            break
    return total


def _times(a: Any, b: Any) -> Any:
    both = isinstance(a, np.ndarray) and isinstance(b, np.ndarray)
    return a @ b if both else a * b
