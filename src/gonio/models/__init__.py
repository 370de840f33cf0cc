"""The catalogue: one file a publication; a Model is found by being declared there, never listed by hand.

Other packages add models through the entry point group `gonio.models`: each entry names a Model, or a module that
declares some.
"""

import functools
import importlib
import pkgutil
import warnings
from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from typing import Any

from gonio.model import Model, NearestNames
from gonio.outside import PackageWarning

GROUP = "gonio.models"
ABOUT = """All models by name, those that other packages bring included.

`gonio.catalogue["ggx"]` is a Model; printed, the catalogue is a list of names and titles. A name that it does not have
raises a KeyError with the nearest names.
"""


@functools.cache
def _catalogue() -> NearestNames[Model]:
    found: set[Model] = set()
    for module in pkgutil.iter_modules(__path__):
        found.update(_declared(importlib.import_module(f"{__name__}.{module.name}")))
    by_name = {model.name: model for model in found}
    if len(by_name) != len(found):
        raise ValueError("two models of the catalogue share a name")
    for model in _provided():
        if by_name.setdefault(model.name, model) is not model:
            warnings.warn(f"another package brings a second model {model.name!r}: the first is kept", PackageWarning, 2)
    return NearestNames("model", {name: by_name[name] for name in sorted(by_name)}, ABOUT)


def _declared(place: Any) -> Iterator[Model]:
    return (value for value in vars(place).values() if isinstance(value, Model))


def _provided() -> Iterator[Model]:
    """Models of other packages; one that cannot be loaded is left out with a warning, and the rest still works."""
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            brought = entry.load()
            models = [brought] if isinstance(brought, Model) else list(_declared(brought))
        except Exception as error:  # whatever another package does wrong
            models = []
            warnings.warn(f"the models of {entry.value!r} cannot be loaded: {error}", PackageWarning, 2)
        else:
            if not models:
                warnings.warn(f"the entry point {entry.value!r} of {GROUP} declares no Model", PackageWarning, 2)
        yield from models


catalogue: Mapping[str, Model]


def __getattr__(name: str) -> Any:
    if name == "catalogue":
        return _catalogue()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
