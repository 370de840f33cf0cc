"""Where to measure next: readings that make values of a fit surest, or tell rival models apart.

`next_readings` plans them for a fit, among the directions of `candidates.reachable`. Below it: `question`, what a
design is judged by; `exact` and `continuous`, the best whole readings and the bound that no design passes; `rivals`,
readings that tell models apart; `remedy`, the directions that would help a value which trades off. docs/
where-to-measure.md says what designs can and cannot do, in numbers.
"""

from gonio.design.candidates import reachable
from gonio.design.next_readings import Plan, next_readings
from gonio.design.noise import Noise
from gonio.design.travel import Cost

__all__ = ["Cost", "Noise", "Plan", "next_readings", "reachable"]
