"""Which values of a fit make the BRDF of a set, or the weighted mean of several, such as the channels of a band."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gonio.fitting.solution import Solution, labels_of, some
from gonio.measured import dataset
from gonio.outside import printable


def mixture(solution: Solution, select: Mapping[str, Any], called: str) -> list[tuple[float, dict[str, int]]]:
    """The weight of each chosen set of a fit, of sum 1, and the places of its values by name.

    select: for each coordinate that tells sets apart the one that is meant, {"channel": "G"}, or several with their
    weights, {"channel": {"R": 0.3, "G": 0.6, "B": 0.1}}; a coordinate of one set may be left out. called: what errors
    call the fit. Raises ValueError where a set has to be chosen or is not there, and where values belong to single
    incidence angles.
    """
    known = labels_of(solution)
    if strange := [name for name in known if name not in dataset.SETS]:
        raise ValueError(f"{called}: its fit has one value for each {strange[0]!r}, and none between them")
    if unknown := [name for name in select if name not in known]:
        have = ", ".join(known) or "one set alone"
        raise ValueError(f"{called}: its fit has no {printable(str(unknown[0]))} to select; it has {have}")
    chosen: list[tuple[float, dict[str, str]]] = [(1.0, {})]
    for name, labels in known.items():
        parts = _weights(select.get(name, labels[0] if len(labels) == 1 else ""), labels, name, called)
        chosen = [(w * part, {**at, name: label}) for w, at in chosen for label, part in parts.items()]
    return [(weight, _places(solution, at)) for weight, at in chosen]


def _weights(wanted: Any, labels: list[str], name: str, called: str) -> dict[str, float]:
    """The weight of each chosen label of a coordinate; their sum is 1."""
    given = wanted if isinstance(wanted, Mapping) else {wanted: 1.0}
    weights = {f"{key:g}" if isinstance(key, float | int) else str(key): w for key, w in given.items()}
    if unknown := [label for label in weights if label not in labels]:
        what = f"no {name} is {printable(unknown[0])}" if unknown[0] else f"its fit holds {len(labels)} sets"
        raise ValueError(f"{called}: {what}; choose by select = {{{name} = ..}}: {some(labels)}")
    numbers = list(weights.values())
    if not all(isinstance(w, int | float) and np.isfinite(w) and w >= 0 for w in numbers) or sum(numbers) <= 0:
        raise ValueError(f"{called}: the weights of {name} are no numbers from 0 with a sum above 0")
    return {label: float(w) / sum(numbers) for label, w in weights.items()}


def _places(solution: Solution, at: Mapping[str, str]) -> dict[str, int]:
    """The places of the values of one set by name."""
    sets = {n: np.array([float(v) if n == "wavelength" else v]) for n, v in at.items()}
    direction = dataset.make_scan([0.0], [0.0], [0.0], coordinates=sets)
    return {name: int(np.ravel(place)[0]) for name, place in solution.places(direction).items()}
