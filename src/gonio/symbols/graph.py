"""Expressions as a graph: equal ones are one node, so common subexpressions are found as they are built.

A node is a number at every point of the axes that it depends on. An axis is what a constant array runs along, and is
closed by a sum: printed, it is a loop. A stack holds one expression for each place of an axis, such as the rows of a
Mueller matrix, and is never printed: an index picks one of them.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from weakref import WeakValueDictionary

Key = tuple[object, ...]


@dataclass(frozen=True)
class Axis:
    """What an array runs along: its length, and a name that tells it from others of that length."""

    size: int
    name: str


# How each operation is computed from Python numbers, for constants and for a check of what is printed. What the
# printers write is declared by each of them.
OPERATIONS: dict[str, Callable[..., float | bool]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "pow": lambda a, b: a**b,
    "abs": abs,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "expm1": math.expm1,
    "log": math.log,
    "log1p": math.log1p,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "asinh": math.asinh,
    "acosh": math.acosh,
    "atanh": math.atanh,
    "floor": math.floor,
    "erf": math.erf,
    "erfc": math.erfc,
    "gammaln": math.lgamma,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "not": lambda a: not a,
    "select": lambda condition, a, b: a if condition else b,
}
BOOLEAN = frozenset({"lt", "le", "eq", "and", "or", "not"})
_COMMUTATIVE = frozenset({"add", "mul", "eq", "and", "or"})


class Node:
    """One expression: an operation, its arguments, and what it holds itself (a number, a name, an axis).

    Operations beside those of OPERATIONS are `constant`, `input`, `table` (the numbers of an array along its axes),
    `stack`, `sum`, and `erfinv`, which Python does not have.
    """

    __slots__ = ("__weakref__", "args", "axes", "op", "order", "value")
    op: str
    args: tuple["Node", ...]
    value: object
    axes: frozenset[Axis]
    order: bytes  # follows from the expression alone, so that a model is printed alike whatever was traced before it

    def __repr__(self) -> str:
        """The expression as calls, which is long for a whole model."""
        inside = ", ".join([*([] if self.value is None else [str(self.value)]), *map(repr, self.args)])
        return f"{self.op}({inside})"

    @property
    def boolean(self) -> bool:
        """Whether it is true or false, and no number."""
        return self.op in BOOLEAN or (self.op == "constant" and isinstance(self.value, bool))


_nodes: WeakValueDictionary[Key, Node] = WeakValueDictionary()


def _node(op: str, args: tuple[Node, ...] = (), value: object = None, closed: tuple[Axis, ...] = ()) -> Node:
    """The one node of this content."""
    key: Key = (op, type(value), value, *map(id, args))  # 0.0 and False are equal, and -0.0 is no 0.0
    if isinstance(value, float):
        key = (*key, math.copysign(1.0, value))
    found = _nodes.get(key)
    if found is None:
        found = Node()
        own = value.axes if isinstance(value, Numbers) else closed if op == "stack" else ()
        dropped = () if op == "stack" else closed
        found.op, found.args, found.value = op, args, value
        found.axes = frozenset().union(own, *(a.axes for a in args)) - frozenset(dropped)
        content = repr((op, value, *(a.order for a in args)))
        found.order = hashlib.blake2b(content.encode(), digest_size=16).digest()
        _nodes[key] = found
    return found


@dataclass(frozen=True)
class Numbers:
    """The numbers of a constant array in C order, and its axes."""

    numbers: tuple[float, ...]
    axes: tuple[Axis, ...]


def constant(value: float | bool) -> Node:
    """A number, or true or false."""
    return _node("constant", value=value if isinstance(value, bool) else float(value))


def variable(name: str) -> Node:
    """What a caller gives."""
    return _node("input", value=name)


def table(numbers: tuple[float, ...], axes: tuple[Axis, ...]) -> Node:
    """A constant array."""
    return _node("table", value=Numbers(numbers, axes))


def stacked(places: tuple[Node, ...], axis: Axis) -> Node:
    """One expression for each place of an axis."""
    return _node("stack", places, axis, closed=(axis,))


def summed(body: Node, axis: Axis) -> Node:
    """The sum along an axis, which equal sums share: its name then tells only how deep the sum is nested."""
    if axis not in body.axes:
        return operation("mul", body, constant(float(axis.size)))
    taken = {a for node in walk(body) for a in (*node.axes, *summed_over(node))} - {axis}
    names = (f"{axis.size}_{depth}" for depth in itertools.count())
    bound = next(a for a in (Axis(axis.size, name) for name in names) if a not in taken)
    return _node("sum", (rename(body, {axis: bound}),), bound, closed=(bound,))


def power(base: Node, exponent: int) -> Node:
    """A whole power of at least 1, by products."""
    if exponent == 1:
        return base
    half = power(base, exponent // 2)
    square = operation("mul", half, half)
    return operation("mul", square, base) if exponent % 2 else square


def operation(op: str, *args: Node) -> Node:
    """An elementwise operation; of constants, the number that it gives."""
    if op == "select" and args[0].op == "constant":
        return args[1] if args[0].value else args[2]
    if op == "select" and args[1] is args[2]:
        return args[1]
    if op == "mul" and (one := _factor_one(args)):
        return one
    if op == "div" and args[1].value == 1.0 and args[1].op == "constant":
        return args[0]
    if op in OPERATIONS and all(a.op == "constant" for a in args) and (folded := _folded(op, args)) is not None:
        return folded
    if op in _COMMUTATIVE:
        args = tuple(sorted(args, key=lambda a: a.order))
    return _node(op, args)


def _factor_one(args: tuple[Node, ...]) -> Node | None:
    for one, other in (args, args[::-1]):
        if one.op == "constant" and one.value == 1.0 and not one.boolean:
            return other
    return None


def _folded(op: str, args: tuple[Node, ...]) -> Node | None:
    """What an operation gives for constants; None where Python refuses, as array libraries do not."""
    try:
        found = OPERATIONS[op](*(a.value for a in args))
    except (ArithmeticError, ValueError):
        return None
    return constant(found) if isinstance(found, bool | int | float) else None


def summed_over(node: Node) -> tuple[Axis, ...]:
    """The axis that a node sums over, where it is a sum."""
    return (node.value,) if node.op == "sum" and isinstance(node.value, Axis) else ()


def walk(*roots: Node) -> Iterator[Node]:
    """Every node that the roots need, each once, arguments first."""
    seen: set[int] = set()
    waiting = [(root, False) for root in reversed(roots)]
    while waiting:
        node, ready = waiting.pop()
        if ready:
            yield node
        elif id(node) not in seen:
            seen.add(id(node))
            waiting.append((node, True))
            waiting += [(arg, False) for arg in reversed(node.args)]


def rebuilt(root: Node, change: Callable[[Node, tuple[Node, ...]], Node]) -> Node:
    """The expression with every node that it needs replaced by what `change` makes of it and its new arguments."""
    done: dict[int, Node] = {}
    for node in walk(root):
        done[id(node)] = change(node, tuple(done[id(a)] for a in node.args))
    return done[id(root)]


def with_arguments(node: Node, args: tuple[Node, ...]) -> Node:
    """The same operation of other arguments."""
    if args == node.args:
        return node
    if node.op in ("sum", "stack"):
        closed = (node.value,) if isinstance(node.value, Axis) else ()
        return _node(node.op, args, node.value, closed)
    return operation(node.op, *args)


def rename(root: Node, axes: Mapping[Axis, Axis]) -> Node:
    """The expression along other axes."""
    if not axes or not root.axes & axes.keys():
        return root

    def change(node: Node, args: tuple[Node, ...]) -> Node:
        if not node.axes & axes.keys():
            return node
        if isinstance(node.value, Numbers):
            return table(node.value.numbers, tuple(axes.get(a, a) for a in node.value.axes))
        if node.op == "stack" and isinstance(node.value, Axis):
            return stacked(args, axes.get(node.value, node.value))
        return with_arguments(node, args)

    return rebuilt(root, change)


def picked(root: Node, axis: Axis, place: int) -> Node:
    """The expression at one place of an axis."""
    if axis not in root.axes:
        return root

    def change(node: Node, args: tuple[Node, ...]) -> Node:
        if axis not in node.axes:
            return node
        if node.op == "stack" and node.value == axis:
            return args[place]
        if isinstance(node.value, Numbers):
            return _row(node.value, axis, place)
        return with_arguments(node, args)

    return rebuilt(root, change)


def _row(content: Numbers, axis: Axis, place: int) -> Node:
    """The numbers at one place of one of their axes."""
    where = content.axes.index(axis)
    inner = math.prod(a.size for a in content.axes[where + 1 :])
    step = axis.size * inner
    numbers = tuple(number for k, number in enumerate(content.numbers) if (k % step) // inner == place)
    axes = content.axes[:where] + content.axes[where + 1 :]
    return table(numbers, axes) if axes else constant(numbers[0])
