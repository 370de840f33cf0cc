"""A model evaluated for many pairs of directions, 1e7 to 1e9 say: compiled by JAX or in NumPy, in bounded memory."""

import functools
from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from array_api_compat import is_jax_array

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.pairs import Pairs, Piece, components, places
from gonio.processes import cores

CHUNK = {"cpu": 2**18, "gpu": 2**24}  # pairs a call of compiled code: enough to take longer than the call itself
BLOCK = 2**13  # pairs at once in NumPy, whose intermediate results a processor's cache then holds
LEAST = 2**10  # pairs that code is compiled for, however few there are
ALIGNED = 64  # bytes: where XLA reads NumPy's memory in place
INDEXED = 2**31 - 1  # pairs that compiled code counts


def evaluate(
    model: Model,
    wi: Array,
    wo: Array,
    values: Mapping[str, Array],
    *,
    library: str = "jax",
    precision: str = "",
    device: str = "",
    chunk: int = 0,
    out: np.ndarray | None = None,
) -> Array:
    """BRDF [1/sr] of `model` for pairs of unit vectors, `wi` to the source and `wo` to the detector.

    Directions are arrays (..., 3) or tuples of three arrays x, y and z, which is the fast form. They and the `values` of
    weights and shape, which are as in calling the model, broadcast against each other. NumPy arrays, memory-mapped ones
    too, are read `chunk` pairs at a time and give a NumPy array: `out` if one is given, C-contiguous and of the result's
    shape and precision, which saves the system's time for new memory. JAX arrays stay on their device.
    `library` is "jax", which compiles once a model, or "numpy". `precision` is "float32" or "float64", by default that
    of the directions. `device` is "cpu", "gpu" or another that JAX knows, by default where JAX computes.
    Raises ValueError where JAX is missing or sees no such device, for directions of wrong shape or length, unknown
    names or precisions and an unfit `out`. A function that JAX traces calls the model itself.
    """
    if library not in ("jax", "numpy"):
        raise ValueError(f"library is 'jax' or 'numpy', not {library!r}")
    if library == "numpy" and device not in ("", "cpu"):
        raise ValueError(f"NumPy computes on the CPU: device={device!r} needs library='jax'")
    if chunk < 0:
        raise ValueError(f"chunk is a number of pairs, not {chunk}")
    _refuse(model, values)
    pairs = Pairs.of(wi, wo, values, precision)
    if library == "jax" and any(map(is_jax_array, pairs.operands)):
        if out is not None:
            raise ValueError("out is for NumPy arrays: JAX arrays give a new array on their device")
        return _from_device(model, pairs, device, chunk)
    result = _result(out, pairs)
    if library == "jax":
        _compiled_stream(model, pairs, device, chunk, result.reshape(-1))
    else:
        _numpy_stream(model, pairs, chunk or BLOCK, result.reshape(-1))
    return result


def _refuse(model: Model, values: Mapping[str, Array]) -> None:
    """The model's own messages for names, before anything is read: one pair at the normal, at its defaults."""
    normal = [np.asarray([component]) for component in (0.0, 0.0, 1.0)] * 2
    model(Geometry(*normal), {name: model.shape[name].default if name in model.shape else 1.0 for name in values})


def _result(out: np.ndarray | None, pairs: Pairs) -> np.ndarray:
    if out is None:
        return np.empty(pairs.shape, pairs.dtype)
    if not isinstance(out, np.ndarray) or (out.shape, out.dtype) != (pairs.shape, pairs.dtype):
        raise ValueError(f"out must be a NumPy array of shape {pairs.shape} and precision {pairs.dtype.name}")
    if not (out.flags.c_contiguous and out.flags.writeable):
        raise ValueError("out must be C-contiguous and writeable")
    if any(np.may_share_memory(out, operand) for operand in pairs.operands if isinstance(operand, np.ndarray)):
        raise ValueError("out shares memory with what it is computed from: give an array of its own")
    return out


def _numpy_stream(model: Model, pairs: Pairs, length: int, flat: np.ndarray) -> None:
    pieces = pairs.pieces()

    def compute(a: int) -> None:
        b = min(a + length, flat.size)
        wi, wo, values = pairs.packed([piece(a, b) for piece in pieces])
        flat[a:b] = model(Geometry(*components(wi), *components(wo)), values)

    with ThreadPoolExecutor(cores()) as pool:
        deque(pool.map(compute, range(0, flat.size, length)), maxlen=0)


def _compiled_stream(model: Model, pairs: Pairs, device: str, chunk: int, flat: np.ndarray) -> None:
    """One part of equal length after another; while JAX computes one, the one before it is copied to its place."""
    jax, pieces = _jax(), pairs.pieces()
    place = _device(jax, device)
    length = chunk or CHUNK["cpu"]
    if flat.size < length:  # the next power of two, so that few lengths are compiled
        length = max(LEAST, 1 << (flat.size - 1).bit_length())
    waiting: deque[tuple[int, Array]] = deque()

    def finish() -> None:
        a, found = waiting.popleft()
        flat[a : a + length] = np.atleast_1d(np.asarray(found))[: flat.size - a]

    with jax.enable_x64(pairs.dtype == np.float64):
        for a in _starts(pairs, pieces, length):
            parts = jax.device_put([piece(a, a + length) for piece in pieces], place)
            waiting.append((a, _compiled(model)(*pairs.packed(parts))))
            if len(waiting) > 1:
                finish()
        while waiting:
            finish()


def _starts(pairs: Pairs, pieces: list[Piece], length: int) -> list[int]:
    """Where parts of `length` begin: the last overlaps the one before it, so that all are equally long.

    So does the second where the arrays begin off the boundary from which XLA reads them in place.
    """
    if pairs.count <= length:
        return [0] if pairs.count else []
    item = pairs.dtype.itemsize
    dense = [part for part in (piece(0, length) for piece in pieces) if part.shape == (length,)]
    beyond = Counter(part.ctypes.data % ALIGNED // item for part in dense).most_common(1)
    back = beyond[0][0] if beyond else 0
    return [0, *range(length - back, pairs.count - length, length), pairs.count - length]


@functools.lru_cache(maxsize=256)
def _compiled(model: Model) -> Callable[..., Array]:
    """The model as a function that JAX compiles once for each precision and set of names, not for each value."""

    def brdf(wi: tuple[Array, ...], wo: tuple[Array, ...], values: dict[str, Array]) -> Array:
        return model(Geometry(*components(wi), *components(wo)), values)

    return _jax().jit(brdf)


def _from_device(model: Model, pairs: Pairs, device: str, chunk: int) -> Array:
    """Part by part into one array, which every part hands to the next: no part of the arrays leaves the device."""
    jax = _jax()
    place = _device(jax, device)
    if pairs.count > INDEXED:
        raise ValueError(f"compiled code counts {INDEXED} pairs of JAX arrays: evaluate {pairs.count} in several calls")
    with jax.enable_x64(pairs.dtype == np.float64):
        operands = [jax.device_put(part, place) if place or not is_jax_array(part) else part for part in pairs.operands]
        platform = next(iter(next(part for part in operands if is_jax_array(part)).devices())).platform
        length = min(chunk or CHUNK.get(platform, CHUNK["gpu"]), pairs.count)
        done = jax.numpy.empty(pairs.count, pairs.dtype, device=place)
        for a in _starts(pairs, [], length):
            done = _compiled_part(model, pairs.shape, length)(done, a, *pairs.packed(operands))
        return _reshaped(pairs.shape)(done)


@functools.lru_cache(maxsize=256)
def _compiled_part(model: Model, shape: tuple[int, ...], length: int) -> Callable[..., Array]:
    """A function that computes `length` pairs of JAX arrays from a flat place on, and puts them there."""
    jax = _jax()

    def part(done: Array, start: Array, wi: tuple[Array, ...], wo: tuple[Array, ...], values: dict[str, Array]) -> Array:
        pairs = Pairs(wi, wo, values, shape, done.dtype)
        at = start + jax.numpy.arange(length, dtype="int32")

        def piece(operand: Array, tail: tuple[int, ...]) -> Array:
            own = operand.shape[: operand.ndim - len(tail)]
            flat = operand.reshape(-1, *tail).astype(done.dtype)
            if flat.shape[0] == 1:
                return flat[0]
            if flat.shape[0] == done.size:
                return jax.lax.dynamic_slice_in_dim(flat, start, length)
            return flat[places(own, shape, at)]

        pieces = [piece(operand, tail) for operand, tail in zip(pairs.operands, pairs.tails, strict=True)]
        wi, wo, values = pairs.packed(pieces)
        found = model(Geometry(*components(wi), *components(wo)), values)
        return jax.lax.dynamic_update_slice(done, jax.numpy.broadcast_to(found, (length,)), (start,))

    return jax.jit(part, donate_argnums=0)


@functools.lru_cache(maxsize=256)
def _reshaped(shape: tuple[int, ...]) -> Callable[[Array], Array]:
    return _jax().jit(lambda flat: flat.reshape(shape), donate_argnums=0)


def _jax() -> Any:
    try:
        import jax
    except ImportError as error:
        raise ValueError("this needs JAX: pip install 'gonio[batch]', or choose library='numpy'") from error
    return jax


def _device(jax: Any, name: str) -> Any:
    if not name:
        return None
    try:
        return jax.devices(name)[0]
    except RuntimeError as error:
        seen = ", ".join(sorted({device.platform for device in jax.devices()}))
        raise ValueError(f"JAX sees no device {name!r} here, only {seen}; a GPU needs JAX's wheel for it") from error
