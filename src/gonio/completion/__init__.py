"""What a measurement says beyond its model: the residual of a fit, learned and carried to directions not measured."""

from gonio.completion.completed import Corrected, complete
from gonio.completion.correction import Correction

__all__ = ["Corrected", "Correction", "complete"]
