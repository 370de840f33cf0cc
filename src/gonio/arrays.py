"""Which array library is this? The only file that knows their names."""

import importlib
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
    arrays = [v for v in values if is_array_api_obj(v)]
    foreign = [a for a in arrays if not isinstance(a, np.ndarray | np.generic)]
    ranked = foreign or arrays
    if not ranked:
        ranked = [np.empty(0)]
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
    return align(array)[0] if not is_array_api_obj(array) else array_namespace(array)


def is_traced_never(array: Array) -> bool:
    """Whether values computed from `array` may be kept: NumPy never traces, other libraries may."""
    return isinstance(array, np.ndarray)


def special(name: str, value: Array) -> Array:
    """A special function by SciPy's name (erf, erfc, gammaln), in the array library of `value`.

    The standard has none: JAX and PyTorch bring their own, which trace and differentiate; any other library goes
    through SciPy and back.
    """
    xp = namespace(value)
    library = xp.__name__.split(".")[0]
    if library == "jax":
        return getattr(importlib.import_module("jax.scipy.special"), name)(value)
    if "torch" in xp.__name__:
        return getattr(importlib.import_module("torch.special"), name)(value)
    computed = getattr(importlib.import_module("scipy.special"), name)(np.asarray(value))
    return xp.asarray(computed, dtype=value.dtype)
