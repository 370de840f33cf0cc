"""A model evaluated for many pairs of directions, such as 1e7 to 1e9: by JAX or NumPy, in bounded memory."""

import functools
from collections import Counter, deque
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from array_api_compat import is_jax_array

from gonio.arrays import Array
from gonio.evaluation.pairs import Pairs, Parts, Piece, components, places, probed
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.processes.portable import cores

PART = 2**19  # pairs of NumPy arrays at once: the call costs a twentieth of the work, and a cache holds the result
PART_ON_DEVICE = 2**24  # pairs of JAX arrays at once
PART_ON_GPU = 2**26  # the same on a GPU, which computes them in the time that it takes to begin
BLOCK = 2**13  # pairs at once in NumPy: their intermediate results fit into a processor's cache
LEAST = 2**10  # fewest pairs that code is compiled for
ALIGNED = 64  # bytes: XLA reads NumPy's memory in place where it begins at a multiple of this
INDEXED = 2**31 - 1  # most pairs of one call: compiled code counts in 32 bits


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
    out: Array | None = None,
) -> Array:
    """Compute the BRDF [1/sr] of a model for many pairs of directions, in bounded memory.

    Parameters
    ----------
    model : Model
        The model.
    wi, wo : array_like
        Unit vectors (..., 3) to the source and to the detector, or tuples of three arrays x, y and z, which is the
        fast form. NumPy arrays, memory-mapped ones too, are read `chunk` pairs at a time and give a NumPy array. JAX
        arrays stay on their device.
    values : mapping
        Weights and shape parameters, as in calling the model; they broadcast against the directions.
    library : str
        "jax", which compiles once a model, or "numpy".
    precision : str
        "float32" or "float64", by default that of the directions.
    device : str
        "cpu", "gpu" or another that JAX knows, by default where JAX computes.
    chunk : int
        Pairs of directions at a time; 0 takes what suits the device.
    out : array, optional
        Takes the result, which saves the time in which the system provides new memory: a C-contiguous NumPy array of
        its shape and precision, or a JAX array, which JAX then deletes.

    Returns
    -------
    array
        The BRDF (...), zero where a direction is below the horizon.

    Raises
    ------
    ValueError
        JAX is missing or has no such device; directions are of wrong shape or length; a name or precision is not
        known; `out` does not suit; or JAX traces the function that calls this, which must call the model itself.

    """
    if library not in ("jax", "numpy"):
        raise ValueError(f"library is 'jax' or 'numpy', not {library!r}")
    if library == "numpy" and device not in ("", "cpu"):
        raise ValueError(f"NumPy computes on the CPU: device={device!r} needs library='jax'")
    if chunk < 0:
        raise ValueError(f"chunk is a number of pairs, not {chunk}")
    _refuse(model, tuple(values))
    pairs = Pairs.of(wi, wo, values, precision, _probed)
    if library == "jax" and any(map(is_jax_array, pairs.operands)):
        if out is not None and (not is_jax_array(out) or (out.shape, out.dtype) != (pairs.shape, pairs.dtype)):
            raise ValueError(f"out must be a JAX array of shape {pairs.shape} and precision {pairs.dtype.name}")
        if any(out is operand for operand in pairs.operands):
            raise ValueError("out is one of the arguments: give another array")
        return _from_device(model, pairs, device, chunk, out)
    result = _result(out, pairs)
    if library == "jax":
        _compiled_stream(model, pairs, device, chunk, result.reshape(-1))
    else:
        _numpy_stream(model, pairs, chunk or BLOCK, result.reshape(-1))
    return result


@functools.lru_cache(maxsize=256)
def _refuse(model: Model, names: tuple[str, ...]) -> None:
    """Raises the model's own errors for unknown names before anything is read, by a call for one pair at the normal."""
    normal = [np.asarray([component]) for component in (0.0, 0.0, 1.0)] * 2
    model(Geometry(*normal), {name: model.shape[name].default if name in model.shape else 1.0 for name in names})


def _probed(parts: Parts) -> Parts:
    """A few of the directions; of JAX arrays in one call where that is possible, because each costs a millisecond."""
    if not all(map(is_jax_array, parts)):
        return probed(parts)
    with _jax().enable_x64(True):
        return _compiled_probed()(parts)


@functools.cache
def _compiled_probed() -> Callable[[Parts], Parts]:
    return _jax().jit(probed)


def _result(out: Array | None, pairs: Pairs) -> np.ndarray:
    """The array that takes the result: `out` where it is suitable, else a new one."""
    if out is None:
        return np.empty(pairs.shape, pairs.dtype)
    if not isinstance(out, np.ndarray) or (out.shape, out.dtype) != (pairs.shape, pairs.dtype):
        raise ValueError(f"out must be a NumPy array of shape {pairs.shape} and precision {pairs.dtype.name}")
    if not (out.flags.c_contiguous and out.flags.writeable):
        raise ValueError("out must be C-contiguous and writeable")
    if any(np.may_share_memory(out, operand) for operand in pairs.operands if isinstance(operand, np.ndarray)):
        raise ValueError("out shares memory with an argument: give another array")
    return out


def _numpy_stream(model: Model, pairs: Pairs, length: int, flat: np.ndarray) -> None:
    """The values in blocks of `length` pairs, on all cores, written to `flat`."""
    pieces = pairs.pieces()

    def compute(a: int) -> None:
        b = min(a + length, flat.size)
        wi, wo, values = pairs.packed([piece(a, b) for piece in pieces])
        flat[a:b] = model(Geometry(*components(wi), *components(wo)), values)

    with ThreadPoolExecutor(cores()) as pool:
        deque(pool.map(compute, range(0, flat.size, length)), maxlen=0)


def _compiled_stream(model: Model, pairs: Pairs, device: str, chunk: int, flat: np.ndarray) -> None:
    """One part after another; while JAX computes one, the one before it is copied to its place.

    Results take the memory of earlier ones: the system needs more time to provide new memory than most models need.
    """
    jax, pieces, tails = _jax(), pairs.pieces(), pairs.tails
    device_used, length = _device(jax, device), chunk or PART
    waiting: deque[tuple[int, Array]] = deque()

    def finish() -> Array:
        a, computed = waiting.popleft()
        on_cpu = next(iter(computed.devices())).platform == "cpu"
        values = np.from_dlpack(computed) if on_cpu else np.asarray(computed)
        flat[a : a + computed.size] = values[: flat.size - a]
        return computed

    with jax.enable_x64(pairs.dtype == np.float64), jax.default_device(device_used):
        firsts = [piece(0, 1) for piece in pieces]
        same = {k: jax.device_put(first) for k, first in enumerate(firsts) if first.shape == tails[k]}
        for a, n in _parts(pairs, pieces, length):
            spare = finish() if len(waiting) > 1 else None
            if spare is None or spare.size != n:
                spare = jax.numpy.empty(n, pairs.dtype)
            parts = [same[k] if k in same else piece(a, a + n) for k, piece in enumerate(pieces)]
            waiting.append((a, _compiled(model)(spare, *pairs.packed(parts), shape=(n,))))
        while waiting:
            finish()


def _parts(pairs: Pairs, pieces: list[Piece], length: int) -> list[tuple[int, int]]:
    """Where parts begin and how long they are: all equally, but for the last, which is a power of two.

    Parts overlap so that code is compiled for few lengths. They also overlap where arrays do not begin at a multiple of
    ALIGNED, so that all parts but the first and the last do, and XLA reads NumPy's memory in place.
    """
    if not pairs.count:
        return []
    last = max(LEAST, 1 << ((pairs.count - 1) % length).bit_length())
    if pairs.count <= length:
        return [(0, last)]
    dense = [piece(0, length) for piece in pieces]
    item = pairs.dtype.itemsize
    beyond = Counter(part.ctypes.data % ALIGNED // item for part in dense if part.shape == (length,)).most_common(1)
    starts = [0, *range(length - (beyond[0][0] if beyond else 0), pairs.count - length, length)]
    remaining = pairs.count - starts[-1] - length
    last = min(length, max(LEAST, 1 << (remaining - 1).bit_length()))
    return [*((start, length) for start in starts), (pairs.count - last, last)]


@functools.lru_cache(maxsize=256)
def _compiled(model: Model) -> Callable[..., Array]:
    """The model as a function that JAX compiles once for each precision and set of names, not for each value.

    Its result takes the memory of the array `spare`, and has its precision.
    """
    jax = _jax()

    def brdf(spare: Array, wi: Parts, wo: Parts, values: dict[str, Array], shape: tuple[int, ...]) -> Array:
        wi, wo, values = jax.tree.map(lambda operand: operand.astype(spare.dtype), (wi, wo, values))
        return jax.numpy.broadcast_to(model(Geometry(*components(wi), *components(wo)), values), shape)

    return jax.jit(brdf, donate_argnums=0, keep_unused=True, static_argnames="shape")


def _from_device(model: Model, pairs: Pairs, device: str, chunk: int, out: Array | None) -> Array:
    """In one call, or part by part into one array that each part passes on to the next: no array leaves its device."""
    jax = _jax()
    device_used = _device(jax, device)
    if pairs.count > INDEXED:
        raise ValueError(f"compiled code counts {INDEXED} pairs of JAX arrays: evaluate {pairs.count} in several calls")
    with jax.enable_x64(pairs.dtype == np.float64), jax.default_device(device_used):
        operands = [
            jax.device_put(part, device_used) if device_used and is_jax_array(part) else part for part in pairs.operands
        ]
        result = jax.numpy.empty(pairs.shape, pairs.dtype) if out is None else out
        on_cpu = next(iter(result.devices())).platform == "cpu"
        length = chunk or (PART_ON_DEVICE if on_cpu else PART_ON_GPU)
        if pairs.count <= length:
            return _compiled(model)(result, *pairs.packed(operands), shape=pairs.shape)
        result = _reshaped((-1,))(result)
        for a, n in _parts(pairs, [], length):
            result = _compiled_part(model, pairs.shape, n)(result, a, *pairs.packed(operands))
        return _reshaped(pairs.shape)(result)


@functools.lru_cache(maxsize=256)
def _compiled_part(model: Model, shape: tuple[int, ...], length: int) -> Callable[..., Array]:
    """A function that computes `length` pairs of JAX arrays from a flat index on, and writes them into the result."""
    jax = _jax()

    def part(result: Array, start: Array, wi: Parts, wo: Parts, values: dict[str, Array]) -> Array:
        pairs = Pairs(wi, wo, values, shape, result.dtype)
        indices = start + jax.numpy.arange(length, dtype="int32")

        def piece(operand: Array, tail: tuple[int, ...]) -> Array:
            operand_shape = operand.shape[: operand.ndim - len(tail)]
            flat = operand.reshape(-1, *tail)
            if flat.shape[0] == 1:
                return flat[0]
            if flat.shape[0] == result.size:
                return jax.lax.dynamic_slice_in_dim(flat, start, length)
            return flat[places(operand_shape, shape, indices)]

        pieces = [piece(operand, tail) for operand, tail in zip(pairs.operands, pairs.tails, strict=True)]
        computed = _compiled(model)(result[:0], *pairs.packed(pieces), shape=(length,))
        # Without the barrier XLA would compute on one core what it writes into a part of an array.
        computed = jax.lax.optimization_barrier(computed)
        return jax.lax.dynamic_update_slice(result, computed, (start,))

    return jax.jit(part, donate_argnums=0)


@functools.lru_cache(maxsize=256)
def _reshaped(shape: tuple[int, ...]) -> Callable[[Array], Array]:
    return _jax().jit(lambda array: array.reshape(shape), donate_argnums=0)


def _jax() -> Any:
    try:
        import jax
    except ImportError as error:
        raise ValueError("this needs JAX: pip install 'gonio[batch]', or choose library='numpy'") from error
    return jax


def _device(jax: Any, name: str) -> Any:
    """JAX's first device of that name, None for JAX's own choice."""
    if not name:
        return None
    try:
        return jax.devices(name)[0]
    except RuntimeError as error:
        available = ", ".join(sorted({device.platform for device in jax.devices()}))
        raise ValueError(
            f"JAX sees no device {name!r} here, only {available}; a GPU needs JAX's wheel for it"
        ) from error
