"""Finding the values that explain a scan: a Problem, a solver that is a value, and a Solution."""

from gonio.fitting.fitting import fit
from gonio.fitting.many.fit_many import fit_many, solution
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.fitting.solution import Solution, Status

__all__ = ["Anneal", "Problem", "Projection", "Smooth", "Solution", "Status", "fit", "fit_many", "solution"]
