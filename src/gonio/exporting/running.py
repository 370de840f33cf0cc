"""Written modules run without the program that they are for: what they import from it is stood in for."""

import runpy
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

Names = Mapping[str, Any]


def executed(path: Path, modules: Mapping[str, Names] | None = None, known: Names | None = None) -> dict[str, Any]:
    """The names of a module that gonio has just written, which is run.

    modules: what its imports give meanwhile, in place of the program's own modules of these names. known: names that
    it finds defined.
    """
    stood_in = modules or {}
    kept = {name: sys.modules.get(name) for name in stood_in}
    try:
        for name, contents in stood_in.items():
            sys.modules[name] = ModuleType(name)
            vars(sys.modules[name]).update(contents)
        return runpy.run_path(str(path), dict(known or {}))
    finally:
        for name, module in kept.items():
            del sys.modules[name]
            if module is not None:
                sys.modules[name] = module
