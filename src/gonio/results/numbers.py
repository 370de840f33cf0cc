"""How numbers are written for people: with as many digits as they deserve."""

import math

from gonio.door.text import clip
from gonio.outside import printable

LEVEL = 0.95  # of the intervals that are shown
LONGEST = 60  # characters of a name from outside in a report


def uncertain(value: float, uncertainty: float, systematic: float = math.nan) -> str:
    """A value with as many digits as its standard uncertainty gives sense to: two of the uncertainty's own.

    The systematic part follows where there is one.
    """
    if math.isnan(uncertainty):
        return f"{value:.6g} (held)"
    if not math.isfinite(uncertainty):
        return f"{value:.4g} (not determined)"
    parts = [value, uncertainty] + [systematic] * (not math.isnan(systematic))
    if uncertainty <= 0 or (value == 0 and uncertainty < 1e-300):
        return " ± ".join([f"{value:.6g}", "0", *(f"{part:.2g}" for part in parts[2:])])
    digits = max(1 - math.floor(math.log10(uncertainty)), 0)
    if digits > 6 or max(map(abs, parts)) >= 1e7:
        return " ± ".join([f"{value:.4e}", *(f"{part:.1e}" for part in parts[1:])])
    return " ± ".join(f"{part:.{digits}f}" for part in parts)


def figure(value: float) -> str:
    """Three significant digits, or a dash for a figure that the data do not allow."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3g}".replace("e-0", "e-").replace("e+0", "e+")


def interval(low: float, high: float) -> str:
    """An interval with four significant digits; a dash where there is none, and words where an end is infinite."""
    if math.isnan(low) or math.isnan(high):
        return "–"
    return f"{_end(low)} to {_end(high)}"


def _end(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "∞" if value > 0 else "−∞"


def name(text: str) -> str:
    """A name from outside on one line of a report: printable, and not longer than LONGEST."""
    return clip(printable(text), LONGEST)
