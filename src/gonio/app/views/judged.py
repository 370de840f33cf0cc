"""How many points lg RMSE leaves out or floors, as plain data and for people."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

from gonio.app.output import figure
from gonio.comparison.metrics import Judged
from gonio.units import unit_label


def judged_record(judged: Judged) -> dict[str, Any]:
    """The counts as plain data."""
    return asdict(judged)


def judged_lines(of_models: Sequence[Judged], unit: str) -> Iterator[str]:
    """What holds for all the models of one scan, in words; nothing where lg RMSE is over all points as they are."""
    one = of_models[0]
    if one.not_positive:
        yield f"lg RMSE leaves out {one.not_positive} of {one.points} values, which are not positive"
    if most := max(judged.floored for judged in of_models):
        floor = f"{figure(one.floor)} {unit_label(unit)}"
        if len(of_models) == 1:
            yield f"lg RMSE: {most} values of the model lie below {floor} and count as that"
        else:
            yield f"floored: how many values of the model lie below {floor} and count as that in lg RMSE"
