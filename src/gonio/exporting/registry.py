"""The targets by name: each is found by being declared in a module of `targets`."""

import functools
import importlib
import pkgutil

from gonio.exporting import targets as declared
from gonio.exporting.target import Target
from gonio.outside import NearestNames


@functools.cache
def targets() -> NearestNames[Target]:
    """Every target by name. A name that it does not have raises a KeyError with the nearest names."""
    found: set[Target] = set()
    for module in pkgutil.walk_packages(declared.__path__, f"{declared.__name__}."):
        for value in vars(importlib.import_module(module.name)).values():
            many = value if isinstance(value, tuple | list) else (value,)
            found |= {one for one in many if isinstance(one, Target)}
    return NearestNames("target", {t.name: t for t in sorted(found, key=lambda t: t.name)})
