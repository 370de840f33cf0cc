"""Many pairs of directions and values that belong to them: checked, and read part by part."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from array_api_compat import is_jax_array

from gonio.arrays import Array

PRECISIONS = ("float32", "float64")
LOOKED_AT = 256  # directions whose length is measured

Piece = Callable[[int, int], np.ndarray]
Parts = tuple[Array, ...]
Packed = tuple[Parts, Parts, dict[str, Array]]
Look = Callable[[Parts], Parts]


def some(parts: Parts) -> Parts:
    """Of directions, those at even spacings that are looked at."""
    shape = _shape(parts)
    at = np.unique(np.linspace(0, math.prod(shape) - 1, LOOKED_AT).astype(np.int64))
    return tuple(_elements(part, tail, shape, at) for part, tail in zip(parts, _tails(parts), strict=True))


@dataclass(frozen=True)
class Pairs:
    """Directions, as one array (..., 3) or as three of components, and values, all of which broadcast to `shape`."""

    wi: tuple[Array, ...]
    wo: tuple[Array, ...]
    values: dict[str, Array]
    shape: tuple[int, ...]
    dtype: np.dtype

    @classmethod
    def of(cls, wi: Array, wo: Array, values: Mapping[str, Array], precision: str = "", look: Look = some) -> "Pairs":
        """As `gonio.evaluate` takes them; raises ValueError for shapes, lengths and precisions that it refuses.

        `look` is `some`, or the same compiled.
        """
        wi, wo = _direction("wi", wi, look), _direction("wo", wo, look)
        given = {name: _array(value) for name, value in values.items()}
        shape = np.broadcast_shapes(_shape(wi), _shape(wo), *(np.shape(value) for value in given.values()))
        return cls(wi, wo, given, shape, _dtype(precision, (*wi, *wo)))

    @property
    def operands(self) -> tuple[Array, ...]:
        return (*self.wi, *self.wo, *self.values.values())

    @property
    def tails(self) -> tuple[tuple[int, ...], ...]:
        """The dimensions of each operand that do not count pairs."""
        return (*_tails(self.wi), *_tails(self.wo), *[()] * len(self.values))

    @property
    def count(self) -> int:
        return math.prod(self.shape)

    def packed(self, operands: list[Array]) -> Packed:
        """Operands, or pieces of them, as directions and values again."""
        i, o = len(self.wi), len(self.wi) + len(self.wo)
        return tuple(operands[:i]), tuple(operands[i:o]), dict(zip(self.values, operands[o:], strict=True))

    def pieces(self) -> list[Piece]:
        """For each operand what reads a range of flat places: nothing else of it is touched.

        Places beyond the end get the last pair again. An operand that is the same for all pairs comes without places.
        """
        return [self._piece(np.asarray(part), tail) for part, tail in zip(self.operands, self.tails, strict=True)]

    def _piece(self, part: np.ndarray, tail: tuple[int, ...]) -> Piece:
        dtype, width = self.dtype, math.prod(tail)
        if part.size == width:  # the same for all pairs
            same = part.reshape(tail).astype(dtype)
            return lambda a, b: same
        full = np.broadcast_to(part, self.shape + tail)
        steps = [(n, step) for n, step in zip(full.shape, full.strides, strict=True) if n > 1]
        if all(step == n * inner for (_, step), (n, inner) in pairwise(steps)):
            flat = full.reshape(-1, *tail)  # a view
            return lambda a, b: _filled(np.ascontiguousarray(flat[a:b], dtype), b - a)
        return lambda a, b: _filled(
            full.flat[a * width : b * width].reshape(-1, *tail).astype(dtype, copy=False), b - a
        )


def components(parts: tuple[Array, ...]) -> tuple[Array, Array, Array]:
    """The components x, y and z of directions."""
    x, y, z = parts if len(parts) == 3 else (parts[0][..., k] for k in range(3))
    return x, y, z


def places(own: tuple[int, ...], shape: tuple[int, ...], at: Array) -> Array:
    """Flat places in an array of shape `own`, of flat places `at` in the `shape` to which it broadcasts."""
    found, stride = 0 * at, 1
    for size, length in zip(reversed(shape), reversed((1,) * (len(shape) - len(own)) + own), strict=True):
        if length > 1:
            found, stride = found + at % size * stride, stride * length
        at = at // size
    return found


def _filled(piece: np.ndarray, length: int) -> np.ndarray:
    missing = length - len(piece)
    return np.concatenate([piece, np.repeat(piece[-1:], missing, axis=0)]) if missing else piece


def _array(given: Array) -> Array:
    return given if is_jax_array(given) else np.asarray(given)


def _direction(name: str, given: Array, look: Look) -> Parts:
    parts = tuple(map(_array, given if isinstance(given, tuple) else (given,)))
    if len(parts) != 3 and not (len(parts) == 1 and np.shape(parts[0])[-1:] == (3,)):
        raise ValueError(f"{name} is an array (..., 3) of unit vectors, or a tuple of three arrays: x, y and z")
    if any("Tracer" in type(part).__name__ for part in parts):
        raise ValueError("JAX traces these directions: inside a traced function, call the model itself")
    if math.prod(_shape(parts)):
        seen = components(tuple(np.asarray(part, dtype=np.float64) for part in look(parts)))
        length = np.sqrt(sum(component**2 for component in seen))
        wrong = length[np.abs(length - 1) > 1e-3]  # a NaN is not wrong: the BRDF of a masked direction is NaN
        if wrong.size:
            raise ValueError(f"{name} has a vector of length {wrong[0]:.4g}: directions are unit vectors")
    return parts


def _elements(part: Array, tail: tuple[int, ...], shape: tuple[int, ...], at: np.ndarray) -> Array:
    """The elements of an operand at flat places of the `shape` to which it broadcasts."""
    own = np.shape(part)[: np.ndim(part) - len(tail)]
    return part[np.unravel_index(places(own, shape, at), own)] if own else part[None]


def _tails(parts: tuple[Array, ...]) -> list[tuple[int, ...]]:
    return [(3,)] if len(parts) == 1 else [()] * 3


def _shape(parts: tuple[Array, ...]) -> tuple[int, ...]:
    shapes = (np.shape(part)[: np.ndim(part) - len(tail)] for part, tail in zip(parts, _tails(parts), strict=True))
    return np.broadcast_shapes(*shapes)


def _dtype(precision: str, directions: tuple[Array, ...]) -> np.dtype:
    if precision and precision not in PRECISIONS:
        raise ValueError(f"precision is {' or '.join(PRECISIONS)}, not {precision!r}")
    found = np.result_type(*(part.dtype for part in directions))
    if not precision and found.kind == "f" and found.name not in PRECISIONS:
        raise ValueError(f"directions of {found.name} need a precision: {' or '.join(PRECISIONS)}")
    return np.dtype(precision or (found if found.kind == "f" else np.float64))
