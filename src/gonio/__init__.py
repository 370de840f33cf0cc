"""From goniometer readings to a BRDF, the analytic model that explains it, and how sure that is.

Angles are in degrees in files, on the command line and in Datasets; a `Geometry` holds unit vectors.
Public names are loaded on first use, so that `import gonio` costs next to nothing. What is asked for less often is one
level down: solvers and solutions in `gonio.fitting`, what a scan is in `gonio.measured`, formats in `gonio.formats`.
"""

import importlib
from typing import TYPE_CHECKING, Any

_HOMES = {
    "Geometry": "gonio.geometry",
    "Model": "gonio.model",
    "Problem": "gonio.fitting.objective.problem",
    "catalogue": "gonio.models",
    "check": "gonio.findings.registry",
    "compare": "gonio.comparison.ranking",
    "complete": "gonio.completion",
    "convert": "gonio.resampling.conversion",
    "evaluate": "gonio.evaluation",
    "export": "gonio.exporting.entry",
    "fit": "gonio.comparison.answer",
    "fit_many": "gonio.fitting.many.fit_many",
    "from_pandas": "gonio.tables.arrays",
    "join": "gonio.measured.dataset",
    "plot": "gonio.results.figures",
    "published": "gonio.models.publications",
    "read": "gonio.formats",
    "read_heights": "gonio.topography.files",
    "read_table": "gonio.tables.read",
    "report": "gonio.reporting.entry",
    "resample": "gonio.resampling.resample",
    "sample": "gonio.samples",
    "scan": "gonio.tables.arrays",
    "simulate": "gonio.measured.simulation",
    "view": "gonio.viewing.notebook",
    "write": "gonio.formats",
}

# What is asked for less often, for who looks for it at the top: the error says where it is.
_BELOW = {
    "Smooth": "gonio.fitting",
    "Solution": "gonio.fitting",
    "band": "gonio.fitting.certainty.band",
    "bootstrap": "gonio.fitting.certainty.bootstrap",
    "derived": "gonio.derived",
    "difference": "gonio.resampling.difference",
    "fetch": "gonio.archive",
    "mask": "gonio.measured.masking",
    "metrics": "gonio.comparison",
    "profile": "gonio.fitting.certainty.profile",
    "reduce": "gonio.reduction",
    "solution_of": "gonio.fitting",
    "stack": "gonio.stacking",
    "validate": "gonio.comparison",
}

__all__ = [
    "Geometry",
    "Model",
    "Problem",
    "catalogue",
    "check",
    "compare",
    "complete",
    "convert",
    "evaluate",
    "export",
    "fit",
    "fit_many",
    "from_pandas",
    "join",
    "plot",
    "published",
    "read",
    "read_heights",
    "read_table",
    "report",
    "resample",
    "sample",
    "scan",
    "simulate",
    "view",
    "write",
]

if TYPE_CHECKING:
    from gonio.comparison.answer import fit
    from gonio.comparison.ranking import compare
    from gonio.completion import complete
    from gonio.evaluation import evaluate
    from gonio.exporting.entry import export
    from gonio.findings.registry import check
    from gonio.fitting.many.fit_many import fit_many
    from gonio.fitting.objective.problem import Problem
    from gonio.formats import read, write
    from gonio.geometry import Geometry
    from gonio.measured.dataset import join
    from gonio.measured.simulation import simulate
    from gonio.model import Model
    from gonio.models import catalogue
    from gonio.models.publications import published
    from gonio.reporting.entry import report
    from gonio.resampling.conversion import convert
    from gonio.resampling.resample import resample
    from gonio.results.figures import plot
    from gonio.samples import sample
    from gonio.tables import from_pandas, read_table, scan
    from gonio.topography.files import read_heights
    from gonio.viewing.notebook import view


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("gonio")
    if name in _BELOW:
        raise AttributeError(f"gonio has no public name {name!r}; one level down: from {_BELOW[name]} import {name}")
    if name not in _HOMES:
        raise AttributeError(f"gonio has no public name {name!r}; it has {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
