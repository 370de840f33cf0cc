"""From goniometer readings to a BRDF, the analytic model that explains it, and how sure that is.

Angles are in degrees in files, on the command line and in Datasets; a `Geometry` holds unit vectors.
Public names are loaded on first use, so that `import gonio` costs next to nothing.
"""

import importlib
from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

_HOMES = {
    "Anneal": "gonio.fitting.search.anneal",
    "Geometry": "gonio.geometry",
    "Instrument": "gonio.measured.instrument",
    "Model": "gonio.model",
    "Parameter": "gonio.model",
    "Problem": "gonio.fitting.objective.problem",
    "Projection": "gonio.fitting.search.projection",
    "Solution": "gonio.fitting.solution",
    "catalogue": "gonio.models",
    "check": "gonio.measured.check",
    "convert": "gonio.resampling.conversion",
    "evaluate": "gonio.evaluation",
    "join": "gonio.measured.dataset",
    "published": "gonio.models.publications",
    "read": "gonio.formats",
    "resample": "gonio.resampling.resample",
    "simulate": "gonio.measured.simulation",
    "write": "gonio.formats",
}

__all__ = [
    "Anneal",
    "Geometry",
    "Instrument",
    "Model",
    "Parameter",
    "Problem",
    "Projection",
    "Solution",
    "catalogue",
    "check",
    "convert",
    "evaluate",
    "join",
    "published",
    "read",
    "resample",
    "simulate",
    "write",
]

if TYPE_CHECKING:
    from gonio.evaluation import evaluate
    from gonio.fitting.objective.problem import Problem
    from gonio.fitting.search.anneal import Anneal
    from gonio.fitting.search.projection import Projection
    from gonio.fitting.solution import Solution
    from gonio.formats import read, write
    from gonio.geometry import Geometry
    from gonio.measured.check import check
    from gonio.measured.dataset import join
    from gonio.measured.instrument import Instrument
    from gonio.measured.simulation import simulate
    from gonio.model import Model, Parameter
    from gonio.models import catalogue
    from gonio.models.publications import published
    from gonio.resampling.conversion import convert
    from gonio.resampling.resample import resample


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return _version("gonio")
    if name not in _HOMES:
        raise AttributeError(f"gonio has no public name {name!r}; it has {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
