"""Fitted values that no surface has: the fit follows the data, and its values are not those of the material."""

from collections.abc import Iterator

from gonio.fitting.solution import Solution
from gonio.measured.dataset import ABSOLUTE
from gonio.results.values import HELD, Value, values

REFLECTANCE = "rho"  # with what the names of reflectances begin
TRANSPARENT = 0.1  # an extinction below which a material is no metal: those have 1 and more at optical wavelengths
LEAST_INDEX = 1.0  # of a dielectric


def implausible(solution: Solution) -> Iterator[str]:
    """Each such value with what it would have to be, in words; of relative data no reflectance is known."""
    found = [value for value in values(solution) if value.status != HELD]
    for value in found:
        if value.parameter.startswith(REFLECTANCE) and value.value > 1 and solution.unit == ABSOLUTE:
            yield f"{_name(value)} is {value.value:.3g}: a reflectance cannot exceed 1"
    extinctions = {value.group: value.value for value in values(solution) if value.parameter == "extinction"}
    for value in found:
        if value.parameter == "index" and value.value < LEAST_INDEX:
            extinction = extinctions.get(value.group, next(iter(extinctions.values()), 0.0))
            if extinction < TRANSPARENT:
                yield (
                    f"{_name(value)} is {value.value:.3g} with an extinction of {extinction:.2g}: no dielectric has an "
                    "index below 1, and no metal so little extinction (--dielectric or --metal keeps to one)"
                )


def _name(value: Value) -> str:
    return f"{value.parameter}[{value.group}]" if value.by else value.parameter
