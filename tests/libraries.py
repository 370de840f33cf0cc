"""The array libraries that every model must run on."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Library:
    """How to make an array of a library from NumPy's, and how to come back."""

    name: str
    array: Callable[[Any], Any]
    precision: float

    @contextmanager
    def active(self) -> Iterator[None]:
        """float64 in JAX only while a test runs, never by a global switch."""
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


# 1e-12: double precision through some tens of operations. 2e-5: single precision through the same.
LIBRARIES = (
    Library("numpy", lambda values: np.asarray(values, dtype=np.float64), 1e-12),
    Library("numpy-read-only", _read_only, 1e-12),
    Library("numpy-float32", lambda values: np.asarray(values, dtype=np.float32), 2e-5),
    Library("array-api-strict", _strict, 1e-12),
    Library("jax-float64", _jax("float64"), 1e-12),
    Library("jax-float32", _jax("float32"), 2e-5),
)
