"""What a check gives: a number, its uncertainty, and what to do where it is too large."""

import math
from dataclasses import dataclass
from typing import NamedTuple

COVERAGE = 2.0  # k


class Detail(NamedTuple):
    """One of the values behind a number: what it is, the value and its standard uncertainty, NaN where unknown."""

    what: str
    value: float
    uncertainty: float = math.nan


@dataclass(frozen=True)
class Outcome:
    """The result of a check.

    number: what should not be above `expected`, in size. unit: of it, empty for a part of one. uncertainty: standard,
    NaN where the data state none. count: of how many values. what: in words, what the number is. remedy: what to do
    where the check fails. details: the values behind the number. notes: what one has to know to read it.
    """

    number: float
    uncertainty: float
    count: int
    what: str
    remedy: str
    unit: str = ""
    expected: float = 0.0
    details: tuple[Detail, ...] = ()
    notes: tuple[str, ...] = ()

    def limit(self, known: float = math.nan) -> float:
        """What the number may be: beyond `expected` by its expanded uncertainty (k = 2), or by what is known if larger.

        known: the expanded uncertainty of the set-up, in the unit of the number.
        """
        spread = [COVERAGE * self.uncertainty, known]
        found = [one for one in spread if math.isfinite(one)]
        return self.expected + max(found) if found else math.nan

    def passes(self, known: float = math.nan) -> bool | None:
        """Whether the number is within its limit; None where that is not known, and the number is above `expected`."""
        if self.expected and abs(self.number) <= self.expected:
            return True
        limit = self.limit(known)
        return abs(self.number) <= limit if math.isfinite(limit) else None
