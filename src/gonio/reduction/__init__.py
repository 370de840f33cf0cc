"""From what a detector read to a BRDF with a budget of its uncertainty by cause.

    readings = gonio.raw.read_readings("run.csv")
    scan = reduce(readings, Relative.parsed("0.991:factor@0,45"), Reduction(fill=Filling("over")))
    budget(scan).rows

`readings` declares the raw Dataset, `standards` what readings are compared with, `steps` each correction, `causes` the
causes of uncertainty, `reduce` puts them together, `budget` tells the result. `sheets` is for scans that an instrument
has divided by a standard already: it subtracts a blank and averages.
"""

from gonio.reduction.budget import budget, correlation, covariance
from gonio.reduction.readings import make_readings
from gonio.reduction.reduce import flags, reduce, together
from gonio.reduction.settings import Reduction
from gonio.reduction.standards import Absolute, Relative
from gonio.reduction.steps.detector import Known
from gonio.reduction.steps.filling import Filling

__all__ = [
    "Absolute",
    "Filling",
    "Known",
    "Reduction",
    "Relative",
    "budget",
    "correlation",
    "covariance",
    "flags",
    "make_readings",
    "reduce",
    "together",
]
