"""Written modules run without the program that they are for: what they import from it is stood in for."""

import sys
from collections.abc import Mapping
from types import ModuleType
from typing import Any


def executed(text: str, modules: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The names of a module that gonio has just written.

    modules: what its imports give meanwhile, in place of the program's own modules of these names.
    """
    kept = {name: sys.modules.get(name) for name in modules}
    namespace: dict[str, Any] = {"__name__": "written"}
    try:
        for name, contents in modules.items():
            sys.modules[name] = ModuleType(name)
            vars(sys.modules[name]).update(contents)
        exec(compile(text, "<printed by gonio>", "exec"), namespace)
    finally:
        for name, module in kept.items():
            del sys.modules[name]
            if module is not None:
                sys.modules[name] = module
    return namespace
