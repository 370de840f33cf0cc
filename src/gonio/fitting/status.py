"""How a search ended: in words for one fit, and as a small integer for each lane of many.

Solutions and files hold the words (`Status`). The Dataset of `fit_many` holds the integers, with their names in the
attributes flag_values and flag_meanings, as the CF conventions have it.
"""

from enum import StrEnum

# What files say that were written before the words became clearer.
AT_BOUND_BEFORE = "converged with a value at its bound: the data would have it beyond, or do not determine it"

NOT_WEIGHED_BEFORE = (
    "not fitted: some values have no weight, as relative weighting gives none to what is not positive, or no square"
)


class Status(StrEnum):
    """How a search ended; each value is the message, whose part before the colon can stand alone.

    The last three are for lanes of a stack. A scan of its own that cannot be fitted is refused with a ValueError.
    """

    CONVERGED = "converged"
    AT_BOUND = (
        "converged, but one value lies on its limit: the limit is too narrow, or the data cannot determine the value"
    )
    NOT_DETERMINED = "converged, and the data do not determine every value: hold or share what has no uncertainty"
    STEPS_EXHAUSTED = "stopped at the largest number of iterations"
    TOO_FEW_POINTS = "as many values as points or more: nothing is left to tell how good they are"
    NO_POINTS = "not fitted: every value is masked or missing"
    ALL_ZERO = "not fitted: every value is zero"
    NOT_WEIGHED = (
        "not fitted: some values have no weight, as log and relative weighting give none to what is not positive, "
        "or no square"
    )

    @classmethod
    def _missing_(cls, value: object) -> "Status | None":
        return {AT_BOUND_BEFORE: cls.AT_BOUND, NOT_WEIGHED_BEFORE: cls.NOT_WEIGHED}.get(str(value))


STATUSES = tuple(Status)  # their order gives the integers that stand for them, which stores of results hold
MINIMA = (Status.CONVERGED, Status.AT_BOUND, Status.NOT_DETERMINED)  # statuses of a search that reached a minimum


def code(status: Status) -> int:
    """The integer that stands for a status in the results of many lanes: its place in STATUSES."""
    return STATUSES.index(status)
