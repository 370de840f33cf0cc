"""The numbers of expressions, by NumPy: of values that are known when a program is written, and for proofs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gonio.arrays import special
from gonio.symbols.graph import Axis, Node, Numbers, summed_over, walk
from gonio.symbols.namespace import SPECIAL

_UFUNCS: dict[str, Any] = {
    "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "pow": np.power,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2,
    "asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh,
    "lt": np.less, "le": np.less_equal, "eq": np.equal,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not, "select": np.where,
}  # fmt: skip  # what NumPy calls by another name


def evaluate(nodes: Sequence[Node], inputs: Mapping[str, Any]) -> list[Any]:
    """The numbers of expressions for values of their inputs: arrays of any one shape, or numbers.

    Raises KeyError for an input that is missing.
    """
    needed = list(walk(*nodes))
    axes = sorted({a for n in needed for a in (*n.axes, *summed_over(n))}, key=lambda a: (a.size, a.name))
    depth = {axis: -1 - k for k, axis in enumerate(axes)}  # dimensions after those of the inputs
    trailing = tuple(1 for _ in axes)
    found: dict[Node, Any] = {}
    with np.errstate(all="ignore"):
        for node in needed:
            found[node] = _value(node, [found[a] for a in node.args], inputs, depth, trailing)
    return [np.reshape(found[n], np.shape(found[n])[: np.ndim(found[n]) - len(axes)]) for n in nodes]


def _value(node: Node, args: list[Any], inputs: Mapping[str, Any], depth: Mapping[Axis, int], trailing: Any) -> Any:
    if node.op == "input":
        value = np.asarray(inputs[str(node.value)], dtype=float)
        return value.reshape(value.shape + trailing)
    if node.op == "constant":
        return np.asarray(node.value).reshape(trailing)
    if isinstance(node.value, Numbers):
        return _table(node.value, depth, trailing)
    if over := summed_over(node):
        return np.sum(args[0], axis=depth[over[0]], keepdims=True)
    if node.op in SPECIAL:
        return special(node.op, args[0])
    ufunc = _UFUNCS[node.op] if node.op in _UFUNCS else getattr(np, node.op)
    return ufunc(*args)


def _table(content: Numbers, depth: Mapping[Axis, int], trailing: tuple[int, ...]) -> Any:
    """The numbers with each axis in its place."""
    numbers = np.array(content.numbers).reshape([axis.size for axis in content.axes])
    order = sorted(range(len(content.axes)), key=lambda k: depth[content.axes[k]])
    shape = list(trailing)
    for axis in content.axes:
        shape[depth[axis]] = axis.size
    return numbers.transpose(order).reshape(shape)
