"""What a fit needs of memory, and a refusal before it is taken: one line instead of a failure in the middle.

Counted are the arrays that grow fastest. The covariance is a matrix of all pairs of values, however few of them are
related. In cells the derivative is one number for each point and parameter, and joint values are a matrix of their own;
otherwise it is a matrix of all points and values, and the tangent plane holds several of that size.
"""

from gonio.fitting.objective.blocks import in_blocks
from gonio.fitting.objective.cells.structure import in_cells
from gonio.fitting.objective.problem import Problem
from gonio.processes.portable import available_memory

NUMBER = 8  # bytes
PLANES = 5  # matrices of all points and values: the derivative, the same scaled, and what decomposes it
COVARIANCES = 2  # the covariance of the free values, and the same among all values
BLOCKS = 12  # arrays as large as the derivative in cells
SMALLEST = 2**28  # bytes that are never refused


def refuse_too_large(problem: Problem, candidates: int = 1) -> None:
    """ValueError where a fit of a problem would need more memory than there is.

    candidates: vectors whose designs, matrices (points, weights), a search holds at once beside the derivative.
    """
    points, values = len(problem.measured), len(problem.names)
    needed = NUMBER * COVARIANCES * values**2
    if cells := in_cells(problem):
        joint = len(cells.joint)
        needed += NUMBER * (BLOCKS * cells.places.size + 4 * joint * (joint + values))
    elif problem.is_large and not in_blocks(problem):
        needed += NUMBER * PLANES * points * values
    if candidates > 1:
        needed += NUMBER * candidates * points * problem.n_weights
    available = available_memory()
    if needed > max(available, SMALLEST):
        raise ValueError(
            f"a fit of {values} values to {points} points takes some {needed / 1e9:.3g} GB of memory, and there are "
            f"{available / 1e9:.3g} GB: fit a part of the scan (--select), with fewer values (leave out --group, or "
            "add --share), or each set on its own (gonio fit-stack)"
        )
