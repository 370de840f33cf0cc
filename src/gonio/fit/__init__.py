"""Finding the values that explain a scan: a Problem, a solver that is a value, and a Solution."""

from gonio.fit.anneal import Anneal
from gonio.fit.batch import fit_many, solution
from gonio.fit.fitting import fit
from gonio.fit.problem import Problem
from gonio.fit.projection import Projection
from gonio.fit.smooth import Smooth
from gonio.fit.solution import Solution, Status

__all__ = ["Anneal", "Problem", "Projection", "Smooth", "Solution", "Status", "fit", "fit_many", "solution"]
