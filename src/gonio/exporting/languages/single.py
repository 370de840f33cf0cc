"""What languages have in common that compute in single precision."""

import math

from gonio.exporting.languages.language import Language

SMALLEST = 1.1754944e-38  # the smallest normal number: smaller ones are zero on most graphics processors
LARGEST = 3.4028235e38


class Single(Language):
    """A language whose numbers have 24 bits: literals stay in their range, and constants keep nine digits."""

    # what it does not have, and what drivers compute without the digits of a small argument, as (e^x - e^-x) / 2
    missing = frozenset(
        {"erf", "erfc", "erfinv", "gammaln", "expm1", "log1p", "sinh", "tanh", "asinh", "acosh", "atanh"}
    )

    def literal(self, value: float | bool) -> str:
        """A number, moved to the range of single precision, so that what guards a quotient still does."""
        if isinstance(value, bool) or not math.isfinite(value) or value == 0:
            return super().literal(value)
        return self.number(math.copysign(min(max(abs(value), SMALLEST), LARGEST), value))

    def number(self, value: float) -> str:
        """The digits of a finite number, always with a point or an exponent."""
        text = f"{value:.9g}"
        return text if "." in text or "e" in text else f"{text}.0"
