"""Symbols: what stands for an array when a model is called to be traced.

A Symbol has a shape and broadcasts as arrays do, so that a model cannot tell it from one.
"""

import itertools
from collections.abc import Iterable
from types import ModuleType
from typing import Any, ClassVar

from gonio.symbols.graph import Axis, Node, constant, operation, picked, power, rename, stacked, summed, table, variable

Dims = tuple[Axis | None, ...]  # None is a dimension of length 1
FLOAT, BOOL = "float64", "bool"
LARGEST_POWER = 16  # beyond, a product is longer than a logarithm
_fresh = itertools.count()


def fresh(size: int) -> Axis:
    """An axis that no other expression has."""
    return Axis(size, f"new{next(_fresh)}")


class Symbol:
    """An expression with the shape of an array."""

    __slots__ = ("dims", "node")
    __array_ufunc__ = None  # an array of NumPy leaves operations with a Symbol to the Symbol
    device = "symbols"
    functions: ClassVar[ModuleType]  # gonio.symbols.namespace, which says so when it is imported

    def __init__(self, node: Node, dims: Dims = ()) -> None:
        self.node, self.dims = node, dims

    @classmethod
    def named(cls, name: str) -> "Symbol":
        """What a caller gives, a number."""
        return cls(variable(name))

    @property
    def shape(self) -> tuple[int, ...]:
        """The length of each dimension."""
        return tuple(1 if axis is None else axis.size for axis in self.dims)

    @property
    def ndim(self) -> int:
        """The number of dimensions."""
        return len(self.dims)

    @property
    def dtype(self) -> str:
        """`float64`, or `bool`."""
        return BOOL if self.node.boolean else FLOAT

    def __array_namespace__(self, api_version: str | None = None) -> ModuleType:
        """The functions that take Symbols."""
        return self.functions

    def __bool__(self) -> bool:
        """A Symbol has no value yet: a model that asks for one cannot be traced."""
        raise TypeError("a traced formula cannot branch on its values: use xp.where")

    def __getitem__(self, key: Any) -> "Symbol":
        """Places, whole dimensions, and new ones of length 1, as arrays take them."""
        keys = list(key) if isinstance(key, tuple) else [key]
        given = sum(k is not None and k is not Ellipsis for k in keys)
        if Ellipsis not in keys:
            keys.append(Ellipsis)
        where = keys.index(Ellipsis)
        keys[where : where + 1] = [slice(None)] * (self.ndim - given)
        left, node = list(self.dims), self.node
        dims: list[Axis | None] = []
        for k in keys:
            if k is None:
                dims.append(None)
            elif k == slice(None):
                dims.append(left.pop(0))
            elif isinstance(k, int):
                axis = left.pop(0)
                if axis is not None:
                    node = picked(node, axis, k % axis.size)
            else:
                raise TypeError(f"a traced formula takes places and whole dimensions, not {k!r}")
        return Symbol(node, tuple(dims))

    def __add__(self, other: Any) -> "Symbol":
        return elementwise("add", self, other)

    def __radd__(self, other: Any) -> "Symbol":
        return elementwise("add", other, self)

    def __sub__(self, other: Any) -> "Symbol":
        return elementwise("sub", self, other)

    def __rsub__(self, other: Any) -> "Symbol":
        return elementwise("sub", other, self)

    def __mul__(self, other: Any) -> "Symbol":
        return elementwise("mul", self, other)

    def __rmul__(self, other: Any) -> "Symbol":
        return elementwise("mul", other, self)

    def __truediv__(self, other: Any) -> "Symbol":
        return elementwise("div", self, other)

    def __rtruediv__(self, other: Any) -> "Symbol":
        return elementwise("div", other, self)

    def __neg__(self) -> "Symbol":
        return elementwise("neg", self)

    def __abs__(self) -> "Symbol":
        return elementwise("abs", self)

    def __pow__(self, exponent: Any) -> "Symbol":
        if isinstance(exponent, int | float):
            return _whole_power(self, float(exponent))
        return elementwise("pow", self, exponent)

    def __rpow__(self, base: Any) -> "Symbol":
        return elementwise("pow", base, self)

    def __lt__(self, other: Any) -> "Symbol":
        return elementwise("lt", self, other)

    def __le__(self, other: Any) -> "Symbol":
        return elementwise("le", self, other)

    def __gt__(self, other: Any) -> "Symbol":
        return elementwise("lt", other, self)

    def __ge__(self, other: Any) -> "Symbol":
        return elementwise("le", other, self)

    def __eq__(self, other: Any) -> "Symbol":  # type: ignore[override]
        return elementwise("eq", self, other)

    def __ne__(self, other: Any) -> "Symbol":  # type: ignore[override]
        return ~elementwise("eq", self, other)

    __hash__ = None  # type: ignore[assignment]

    def __and__(self, other: Any) -> "Symbol":
        return elementwise("and", self, other)

    def __or__(self, other: Any) -> "Symbol":
        return elementwise("or", self, other)

    def __invert__(self) -> "Symbol":
        return elementwise("not", self)


def as_symbol(value: Any) -> Symbol:
    """A Symbol of a number or of a constant array of any depth, whose dimensions get axes of their own."""
    if isinstance(value, Symbol):
        return value
    if hasattr(value, "tolist"):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        return Symbol(constant(value))
    shape = _shape(value)
    axes = tuple(fresh(n) for n in shape)
    return Symbol(table(tuple(_flat(value)), axes), axes)


def elementwise(op: str, *values: Any) -> Symbol:
    """An operation on values that broadcast against each other."""
    nodes, dims = _broadcast([as_symbol(v) for v in values])
    return Symbol(operation(op, *nodes), dims)


def total(value: Symbol, axis: int, keepdims: bool) -> Symbol:
    """The sum along one dimension."""
    where = axis % value.ndim
    along = value.dims[where]
    node = value.node if along is None else summed(value.node, along)
    kept = (None,) if keepdims else ()
    return Symbol(node, value.dims[:where] + kept + value.dims[where + 1 :])


def joined(values: Iterable[Symbol], axis: int) -> Symbol:
    """Values along a new dimension, which is counted from the end."""
    nodes, dims = _broadcast(list(values))
    place = fresh(len(nodes))
    where = len(dims) + 1 + axis if axis < 0 else axis
    return Symbol(stacked(tuple(nodes), place), (*dims[:where], place, *dims[where:]))


def _broadcast(values: list[Symbol]) -> tuple[list[Node], Dims]:
    """Expressions along common axes. ValueError for lengths that differ."""
    depth = max(v.ndim for v in values)
    dims: list[Axis | None] = []
    padded = [(None,) * (depth - v.ndim) + v.dims for v in values]
    for column in zip(*padded, strict=True):
        own = [axis for axis in column if axis is not None]
        if len({axis.size for axis in own}) > 1:
            raise ValueError(f"lengths of {', '.join(str(a.size) for a in own)} do not broadcast")
        # one array in two dimensions runs along two axes
        axis = next((a for a in own if a not in dims), fresh(own[0].size) if own else None)
        dims.append(axis)
    nodes = []
    for value, own_dims in zip(values, padded, strict=True):
        changes = {a: b for a, b in zip(own_dims, dims, strict=True) if a is not None and b is not None and a != b}
        nodes.append(rename(value.node, changes))
    return nodes, tuple(dims)


def _whole_power(base: Symbol, exponent: float) -> Symbol:
    """A constant power, by products or a root where it can be."""
    if exponent == 0.5:
        return elementwise("sqrt", base)
    size = abs(exponent)
    if not size.is_integer() or not 1 <= size <= LARGEST_POWER:
        return elementwise("pow", base, exponent)
    raised = Symbol(power(base.node, int(size)), base.dims)
    return raised if exponent > 0 else 1 / raised


def _shape(value: Any) -> tuple[int, ...]:
    return (len(value), *_shape(value[0])) if isinstance(value, list | tuple) else ()


def _flat(value: Any) -> Iterable[float]:
    if isinstance(value, list | tuple):
        return itertools.chain.from_iterable(map(_flat, value))
    return (float(value),)
