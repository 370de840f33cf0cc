"""The catalogue: one file a publication; a Model is found by being declared there, never listed by hand."""

import functools
import importlib
import pkgutil
from collections.abc import Mapping
from typing import Any

from gonio.model import Model, NearestNames


@functools.cache
def _catalogue() -> NearestNames[Model]:
    found: set[Model] = set()
    for module in pkgutil.iter_modules(__path__):
        contents = vars(importlib.import_module(f"{__name__}.{module.name}"))
        found |= {value for value in contents.values() if isinstance(value, Model)}
    by_name = {model.name: model for model in sorted(found, key=lambda model: model.name)}
    if len(by_name) != len(found):
        raise ValueError("two models of the catalogue share a name")
    return NearestNames("model", by_name)


catalogue: Mapping[str, Model]


def __getattr__(name: str) -> Any:
    if name == "catalogue":
        return _catalogue()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
