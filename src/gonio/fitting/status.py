"""How a search ended, in words and as the number that stands for it where there are many."""

from enum import StrEnum


class Status(StrEnum):
    """How a search ended; the values are the messages."""

    CONVERGED = "converged"
    AT_BOUND = "converged with a value at its bound: the data would have it beyond, or do not determine it"
    NOT_DETERMINED = "converged, and the data do not determine every value: hold or share what has no uncertainty"
    STEPS_EXHAUSTED = "stopped at the largest number of iterations"
    TOO_FEW_POINTS = "as many values as points or more: nothing is left to tell how good they are"
    NO_POINTS = "not fitted: every value is masked or missing"
    ALL_ZERO = "not fitted: every value is zero"
    NOT_WEIGHED = "not fitted: some values have no weight, as relative weighting gives none to what is not positive"


STATUSES = tuple(Status)
MINIMA = (Status.CONVERGED, Status.AT_BOUND, Status.NOT_DETERMINED)  # of which the values are those of a minimum


def code(status: Status) -> int:
    """The number that stands for a status where there are many."""
    return STATUSES.index(status)
