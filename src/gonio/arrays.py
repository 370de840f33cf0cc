"""Which array library is this? The only file that knows their names."""

import importlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from array_api_compat import array_namespace, device, is_array_api_obj

Array = Any  # an array of any library that follows the array-API standard, or a Python number


def align(*values: Array) -> tuple[Any, tuple[Array, ...]]:
    """Bring `values` to one array library, floating dtype and device; return its namespace and them.

    Any library outranks NumPy (under `vmap` the unmapped arguments are still NumPy arrays), and arrays
    outrank scalars: a float32 geometry stays float32 beside the float64 scalars that SciPy hands back.
    Values of two libraries other than NumPy raise TypeError.
    """
    arrays = [v for v in values if is_array_api_obj(v) or _is_drjit(v)]
    foreign = [a for a in arrays if not isinstance(a, np.ndarray | np.generic)]
    if any(map(_is_drjit, foreign)):
        shim = _DrJit(*foreign)
        return shim, tuple(shim.asarray(v) for v in values)
    ranked = foreign or arrays or [np.empty(0)]
    xp = array_namespace(*ranked)
    floating = [a for a in ranked if xp.isdtype(a.dtype, "real floating")]
    deciding = [a for a in floating if a.ndim > 0] or floating
    dtype = xp.result_type(*deciding) if deciding else xp.asarray(0.0).dtype
    native = {id(a) for a in ranked if not isinstance(a, np.generic)}
    where = device(ranked[0])

    def bring(value: Array) -> Array:
        if id(value) in native:  # a traced array must not be placed on a device again
            return value if value.dtype == dtype else xp.astype(value, dtype)
        return xp.asarray(value, dtype=dtype, device=where)

    return xp, tuple(bring(value) for value in values)


def namespace(array: Array) -> Any:
    """The array-API namespace of `array`, NumPy's for a Python number."""
    if is_array_api_obj(array):
        return array_namespace(array)
    return align(array)[0]


def constants(values: Any, like: Array) -> Array:
    """Numbers as an array in the library, floating dtype and device of `like`, NumPy's own for a Python number."""
    xp = namespace(like)
    if _is_drjit(like) or not is_array_api_obj(like):  # a Python number has no dtype
        return xp.asarray(values)
    return xp.asarray(values, dtype=like.dtype, device=device(like))


def is_traced_never(array: Array) -> bool:
    """Whether values computed from `array` may be kept: NumPy never traces, other libraries may."""
    return isinstance(array, np.ndarray)


_SPECIAL = {
    "jax": "jax.scipy.special",
    "torch": "torch.special",
    "cupy": "cupyx.scipy.special",
    "gonio.symbols": "gonio.symbols.namespace",
}


def special(name: str, value: Array) -> Array:
    """A special function by SciPy's name (erf, erfc, erfinv, gammaln), in the array library of `value`.

    The standard has none: JAX, PyTorch, CuPy and Dr.Jit's compilers bring their own, which stay on the device and
    differentiate; any other library goes through SciPy and back.
    """
    xp = namespace(value)
    if isinstance(xp, _DrJit) and xp.traces:
        return getattr(xp, name)(value)
    module = next((m for library, m in _SPECIAL.items() if library in xp.__name__), None)
    if module:
        return getattr(importlib.import_module(module), name)(value)
    return constants(getattr(importlib.import_module("scipy.special"), name)(np.asarray(value)), value)


def _is_drjit(value: Any) -> bool:
    return type(value).__module__.startswith("drjit.")


class _DrJit:
    """Dr.Jit by the names of the standard that the physics uses: it has no namespace and no dtypes of its own.

    Its tensors without dimensions cannot be indexed, so a scalar has one element here. Its scalar backend neither
    traces nor differentiates and fails in functions such as asinh where all elements take one branch (1.5.0): NumPy
    computes functions for it. LLVM 15 below its compiler aborts in atan2.
    """

    __name__ = "drjit"

    def __init__(self, *arrays: Array) -> None:
        if not all(map(_is_drjit, arrays)):
            raise TypeError("values of Dr.Jit and of another array library")
        self.dr: Any = importlib.import_module("drjit")
        widest = self.dr.expr_t(*(self.dr.tensor_t(type(a)) for a in [a for a in arrays if a.shape] or arrays))
        self.tensor = widest if self.dr.is_float_v(widest) else self.dr.float64_array_t(widest)
        self.traces = self.dr.is_jit_v(widest)

    def asarray(self, values: Any) -> Array:
        """An array of at least one element."""
        array = self.tensor(values)
        return array if array.shape else self.tensor(array.array)

    def where(self, condition: Array, x: Array, y: Array) -> Array:
        """As the standard's; Dr.Jit calls it select."""
        return self.dr.select(condition, x, y)

    def stack(self, arrays: Sequence[Array], axis: int) -> Array:
        """Along a new axis, which is counted from the end."""
        later_axes = -1 - axis
        index = self.asarray(range(len(arrays)))[(..., *[None] * later_axes)]
        widened = [array[(..., None, *[slice(None)] * later_axes)] for array in arrays]
        stacked = widened[0]
        for k, array in enumerate(widened[1:], start=1):
            stacked = self.where(index == k, array, stacked)
        return stacked

    def __getattr__(self, name: str) -> Callable[..., Array]:
        """The sum, elementary and special functions; most are called as in the standard or in SciPy."""
        if not self.traces:
            numpy = array_namespace(np.empty(0))
            return lambda *x, **options: self.asarray(getattr(numpy, name)(*map(np.asarray, x), **options))
        dr = self.dr
        composed = {
            "expm1": lambda x: 2 * dr.sinh(x / 2) * dr.exp(x / 2),
            "log1p": lambda x: 2 * dr.asinh(x / (2 * dr.sqrt(1 + x))),
            "erfc": lambda x: 1 - dr.erf(x),
            "gammaln": dr.lgamma,
        }
        return composed.get(name) or getattr(dr, name)
