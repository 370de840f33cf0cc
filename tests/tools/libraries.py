"""The array libraries that every model must run on."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest


def quickly_compiled(function: Callable[..., Any], *arguments: Any) -> Any:
    """`function(*arguments)`, compiled by JAX as a whole and without optimisation.

    Compiling every operation by itself takes many times as long, and so does optimising; neither shows anything more
    about a model.
    """
    import jax

    options = {"xla_backend_optimization_level": 0, "xla_llvm_disable_expensive_passes": True}
    return jax.jit(function).lower(*arguments).compile(compiler_options=options)(*arguments)


def _directly(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(*arguments)


@dataclass(frozen=True)
class Library:
    """How to make an array of a library from NumPy's, how to come back, and what must be installed for it.

    call: calls a function of arrays as the library's users do.
    """

    name: str
    array: Callable[[Any], Any]
    precision: float
    back: Callable[[Any], np.ndarray] = np.asarray
    needs: str = "numpy"
    call: Callable[..., Any] = _directly

    @contextmanager
    def active(self) -> Iterator[None]:
        """Skips without the library or its GPU; float64 in JAX only while a test runs, never by a global switch."""
        module = pytest.importorskip(self.needs, reason=f"{self.needs} is not installed")
        if self.needs == "cupy" and not module.is_available():
            pytest.skip("cupy finds no GPU")
        if self.name == "jax-float64":
            import jax

            with jax.enable_x64(True):
                yield
        else:
            yield


def _read_only(values: Any) -> Any:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _strict(values: Any) -> Any:
    import array_api_strict

    return array_api_strict.asarray(np.asarray(values, dtype=np.float64))


def _jax(dtype: str) -> Callable[[Any], Any]:
    def make(values: Any) -> Any:
        import jax.numpy as jnp

        return jnp.asarray(np.asarray(values, dtype=dtype))

    return make


def _torch(dtype: str) -> Callable[[Any], Any]:
    def make(values: Any) -> Any:
        import torch

        return torch.asarray(np.asarray(values, dtype=dtype))

    return make


def _cupy(values: Any) -> Any:
    import cupy

    return cupy.asarray(np.asarray(values, dtype=np.float64))


def _drjit(tensor: str) -> Callable[[Any], Any]:
    def make(values: Any) -> Any:
        import drjit.scalar

        return getattr(drjit.scalar, tensor)(np.asarray(values))

    return make


# 1e-12: double precision through some tens of operations. 2e-5: single precision through the same.
LIBRARIES = (
    Library("numpy", lambda values: np.asarray(values, dtype=np.float64), 1e-12),
    Library("numpy-read-only", _read_only, 1e-12),
    Library("numpy-float32", lambda values: np.asarray(values, dtype=np.float32), 2e-5),
    Library("array-api-strict", _strict, 1e-12),
    Library("jax-float64", _jax("float64"), 1e-12, call=quickly_compiled),
    Library("jax-float32", _jax("float32"), 2e-5, call=quickly_compiled),
    Library("torch-float64", _torch("float64"), 1e-12, needs="torch"),
    Library("torch-float32", _torch("float32"), 2e-5, needs="torch"),
    Library("cupy-float64", _cupy, 1e-12, back=lambda array: array.get(), needs="cupy"),
    Library("drjit-scalar-float64", _drjit("TensorXf64"), 1e-12, needs="drjit"),
    Library("drjit-scalar-float32", _drjit("TensorXf"), 2e-5, needs="drjit"),
)
# JAX compiles what it has not compiled before in this process: in one process the models share that.
EVERY_LIBRARY = [
    pytest.param(library, marks=[pytest.mark.xdist_group("jax")] * library.name.startswith("jax"), id=library.name)
    for library in LIBRARIES
]
