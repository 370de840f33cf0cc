"""Finding the values that explain a scan: a Problem, a solver that is a value, and a Solution."""

from gonio.fitting.fitting import fit
from gonio.fitting.many.fit_many import fit_many
from gonio.fitting.many.results import solution_of
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import FOR_MANY, Projection
from gonio.fitting.search.solver import Solver
from gonio.fitting.solution import Solution
from gonio.fitting.status import Status

__all__ = [
    "FOR_MANY",
    "Anneal",
    "Problem",
    "ProblemOptions",
    "Projection",
    "Smooth",
    "Solution",
    "Solver",
    "Status",
    "fit",
    "fit_many",
    "solution_of",
]
