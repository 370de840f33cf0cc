"""Many pairs of directions and values that belong to them: checked, and read part by part."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from array_api_compat import is_jax_array

from gonio.arrays import Array

PRECISIONS = ("float32", "float64")
PROBES = 256  # directions whose length is checked

Piece = Callable[[int, int], np.ndarray]  # from two flat indices, what an operand has between them
Parts = tuple[Array, ...]  # directions as one array (..., 3), or as three of components
Packed = tuple[Parts, Parts, dict[str, Array]]
Probe = Callable[[Parts], Parts]


def probed(parts: Parts) -> Parts:
    """Of many directions, PROBES at even spacings."""
    shape = _shape(parts)
    indices = np.unique(np.linspace(0, math.prod(shape) - 1, PROBES).astype(np.int64))
    return tuple(_elements(part, tail, shape, indices) for part, tail in zip(parts, _tails(parts), strict=True))


@dataclass(frozen=True)
class Pairs:
    """Directions, as one array (..., 3) or as three of components, and values, all of which broadcast to `shape`."""

    wi: tuple[Array, ...]
    wo: tuple[Array, ...]
    values: dict[str, Array]
    shape: tuple[int, ...]
    dtype: np.dtype

    @classmethod
    def of(
        cls, wi: Array, wo: Array, values: Mapping[str, Array], precision: str = "", probe: Probe = probed
    ) -> "Pairs":
        """As `gonio.evaluate` takes them; raises ValueError for shapes, lengths and precisions that it refuses.

        `probe` is `probed`, or the same compiled.
        """
        wi, wo = _direction("wi", wi), _direction("wo", wo)
        # Both samples are asked for before either is read: each answer of a GPU takes as long as a million pairs.
        samples = [probe(parts) if math.prod(_shape(parts)) else () for parts in (wi, wo)]
        for part in itertools.chain(*samples):
            if is_jax_array(part):
                part.copy_to_host_async()
        for name, sample in zip(("wi", "wo"), samples, strict=True):
            if sample:
                _refuse_other_lengths(name, sample)
        arrays = {name: _array(value) for name, value in values.items()}
        shape = np.broadcast_shapes(_shape(wi), _shape(wo), *(np.shape(value) for value in arrays.values()))
        return cls(wi, wo, arrays, shape, _dtype(precision, (*wi, *wo)))

    @property
    def operands(self) -> tuple[Array, ...]:
        """All arrays in one order: those of wi, of wo, and the values."""
        return (*self.wi, *self.wo, *self.values.values())

    @property
    def tails(self) -> tuple[tuple[int, ...], ...]:
        """The dimensions of each operand that do not count pairs."""
        return (*_tails(self.wi), *_tails(self.wo), *[()] * len(self.values))

    @property
    def count(self) -> int:
        """How many pairs there are after broadcasting."""
        return math.prod(self.shape)

    def packed(self, operands: list[Array]) -> Packed:
        """Operands, or pieces of them, as directions and values again."""
        i, o = len(self.wi), len(self.wi) + len(self.wo)
        return tuple(operands[:i]), tuple(operands[i:o]), dict(zip(self.values, operands[o:], strict=True))

    def pieces(self) -> list[Piece]:
        """For each operand a function that reads a range of flat indices, and no other memory of it.

        Indices beyond the end get the last pair again. An operand that is the same for all pairs has no dimension for
        them.
        """
        return [self._piece(np.asarray(part), tail) for part, tail in zip(self.operands, self.tails, strict=True)]

    def _piece(self, part: np.ndarray, tail: tuple[int, ...]) -> Piece:
        dtype, width = self.dtype, math.prod(tail)
        if part.size == width:  # the same for all pairs
            same = part.reshape(tail).astype(dtype)
            return lambda a, b: same
        full = np.broadcast_to(part, self.shape + tail)
        steps = [(n, step) for n, step in zip(full.shape, full.strides, strict=True) if n > 1]
        if all(step == n * inner for (_, step), (n, inner) in itertools.pairwise(steps)):
            flat = full.reshape(-1, *tail)  # a view
            return lambda a, b: _filled(np.ascontiguousarray(flat[a:b], dtype), b - a)
        return lambda a, b: _filled(
            full.flat[a * width : b * width].reshape(-1, *tail).astype(dtype, copy=False), b - a
        )


def components(parts: tuple[Array, ...]) -> tuple[Array, Array, Array]:
    """The components x, y and z of directions."""
    x, y, z = parts if len(parts) == 3 else (parts[0][..., k] for k in range(3))
    return x, y, z


def places(array_shape: tuple[int, ...], shape: tuple[int, ...], indices: Array) -> Array:
    """Flat indices into an array of `array_shape`, for flat `indices` into the `shape` to which it broadcasts."""
    flat, stride = 0 * indices, 1
    padded = (1,) * (len(shape) - len(array_shape)) + array_shape
    for size, length in zip(reversed(shape), reversed(padded), strict=True):
        if length > 1:
            flat, stride = flat + indices % size * stride, stride * length
        indices = indices // size
    return flat


def _filled(piece: np.ndarray, length: int) -> np.ndarray:
    """The piece, its last element repeated up to `length`."""
    missing = length - len(piece)
    return np.concatenate([piece, np.repeat(piece[-1:], missing, axis=0)]) if missing else piece


def _array(value: Array) -> Array:
    return value if is_jax_array(value) else np.asarray(value)


def _direction(name: str, vectors: Array) -> Parts:
    """Directions as arrays; ValueError for a wrong shape, or a traced array."""
    parts = tuple(map(_array, vectors if isinstance(vectors, tuple) else (vectors,)))
    if len(parts) != 3 and not (len(parts) == 1 and np.shape(parts[0])[-1:] == (3,)):
        raise ValueError(f"{name} is an array (..., 3) of unit vectors, or a tuple of three arrays: x, y and z")
    if any("Tracer" in type(part).__name__ for part in parts):
        raise ValueError("JAX traces these directions: inside a traced function, call the model itself")
    return parts


def _refuse_other_lengths(name: str, sample: Parts) -> None:
    """ValueError where one of some directions is no unit vector."""
    xyz = components(tuple(np.asarray(part, dtype=np.float64) for part in sample))
    length = np.sqrt(sum(component**2 for component in xyz))
    wrong = length[np.abs(length - 1) > 1e-3]  # a NaN is not wrong: the BRDF of a masked direction is NaN
    if wrong.size:
        raise ValueError(f"{name} has a vector of length {wrong[0]:.4g}: directions are unit vectors")


def _elements(part: Array, tail: tuple[int, ...], shape: tuple[int, ...], indices: np.ndarray) -> Array:
    """The elements of an operand at flat indices into the `shape` to which it broadcasts."""
    part_shape = np.shape(part)[: np.ndim(part) - len(tail)]
    return part[np.unravel_index(places(part_shape, shape, indices), part_shape)] if part_shape else part[None]


def _tails(parts: tuple[Array, ...]) -> list[tuple[int, ...]]:
    """The dimensions of each array that do not count directions."""
    return [(3,)] if len(parts) == 1 else [()] * 3


def _shape(parts: tuple[Array, ...]) -> tuple[int, ...]:
    shapes = (np.shape(part)[: np.ndim(part) - len(tail)] for part, tail in zip(parts, _tails(parts), strict=True))
    return np.broadcast_shapes(*shapes)


def _dtype(precision: str, directions: tuple[Array, ...]) -> np.dtype:
    if precision and precision not in PRECISIONS:
        raise ValueError(f"precision is {' or '.join(PRECISIONS)}, not {precision!r}")
    dtype = np.result_type(*(part.dtype for part in directions))
    if not precision and dtype.kind == "f" and dtype.name not in PRECISIONS:
        raise ValueError(f"directions of {dtype.name} need a precision: {' or '.join(PRECISIONS)}")
    return np.dtype(precision or (dtype if dtype.kind == "f" else np.float64))
