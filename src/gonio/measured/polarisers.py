"""Readings through polarisers: what they say of a Mueller matrix, and their mean, which unpolarised light gives.

The coordinate `polarisation` names the state of the incident light, and after `>` that which the detector lets through:
`s`, `s>p`, `>p`. A state is s, p or u (unpolarised, or no polariser), or four Stokes parameters: `1 0.5 0 0.25`. With
the incident light's Stokes vector a = (1, ..) and the analyser's d, a reading is the BRDF

    f = d M a,   d = (1, 0, 0, 0) without an analyser, (1, 1, 0, 0)/2 for s, (1, -1, 0, 0)/2 for p,

so that readings through both analysers add to that without one, f_s>s + f_s>p = f_s, and (f_s + f_p)/2 = f_u = M_00.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.causes import causes, with_causes
from gonio.measured.distinct import distinct, distinct_rows

Values = npt.NDArray[np.float64]

POLARISATION = "polarisation"
STATES: Mapping[str, tuple[float, float, float, float]] = {
    "": (1.0, 0.0, 0.0, 0.0),
    "u": (1.0, 0.0, 0.0, 0.0),
    "s": (1.0, 1.0, 0.0, 0.0),
    "p": (1.0, -1.0, 0.0, 0.0),
}
WORDS: Mapping[str, str] = {"unpolarised": "u", "unpolarized": "u", "none": "u", "unknown": "u", "te": "s", "tm": "p"}
# Which readings make one for unpolarised light, and the factor of each; the first whose readings are all there counts.
MEANS: tuple[Mapping[str, float], ...] = (
    {"u>u": 1.0},
    {"s>u": 0.5, "p>u": 0.5},
    {"u>s": 1.0, "u>p": 1.0},
    {"s>s": 0.5, "s>p": 0.5, "p>s": 0.5, "p>p": 0.5},
)


def states(label: str) -> tuple[str, str]:
    """The incident and the detected state of a label, each s, p, u or four Stokes parameters in words.

    Raises ValueError for a label that is none, with those that there are.
    """
    incident, _, detected = (part.strip().lower() for part in label.partition(">"))
    pair = tuple(WORDS.get(word, word) or "u" for word in (incident, detected))
    for word in pair:
        _stokes(word, label)
    return pair[0], pair[1]


def _stokes(word: str, label: str) -> tuple[float, ...]:
    if word in STATES:
        return STATES[word]
    try:
        vector = tuple(float(part) for part in word.split())
    except ValueError:
        vector = ()
    if len(vector) != 4 or vector[0] != 1 or sum(v * v for v in vector[1:]) > 1 + 1e-9:
        raise ValueError(
            f"polarisation {label!r} is not understood: write s, p or u for the incident light, s>p for the part that "
            "leaves in p, or Stokes parameters, 1 0.5 0 0.25"
        )
    return vector


def is_polarised(points: xr.Dataset) -> bool:
    """Whether a scan says how its light was polarised, otherwise than not at all."""
    if POLARISATION not in points.coords:
        return False
    return any(states(label) != ("u", "u") for label in distinct(points[POLARISATION].values.astype(str))[0].tolist())


def analysed(points: xr.Dataset) -> Values | None:
    """The weight (points, 4, 4) of each element of a Mueller matrix in a reading; None where no light is polarised."""
    if not is_polarised(points):
        return None
    labels, place = distinct(np.broadcast_to(points[POLARISATION].values.astype(str), points.sizes["direction"]))
    weights = []
    for label in labels.tolist():
        incident, detected = (np.array(_stokes(word, label)) for word in states(label))
        analyser = detected if states(label)[1] == "u" else detected / 2
        weights.append(np.outer(analyser, incident))
    return np.array(weights)[place]


def unpolarised(scan: xr.Dataset) -> xr.Dataset:
    """The readings that unpolarised light would give, for what knows no polarisation; the history says how they came.

    Readings in s and p at one direction are averaged, those through analysers added, as MEANS says. Directions that
    lack one of them are left out. Random uncertainties add in squares, shifts by a systematic cause with their signs.
    A scan without polarised light is returned as it is; one that lacks a state throughout keeps its values, which the
    history says.
    """
    points = dataset.points(scan)
    if POLARISATION not in points.coords:
        return scan
    labels, place = distinct(np.broadcast_to(points[POLARISATION].values.astype(str), points.sizes["direction"]))
    try:
        pairs = [">".join(states(label)) for label in labels.tolist()]
    except ValueError:  # a word of the laboratory's own, which a model without polarisation need not understand
        pairs = ["" for _ in labels]
    if set(pairs) == {"u>u"}:
        return scan
    recipe = next((mean for mean in MEANS if set(mean) <= set(pairs)), None)
    if recipe is None:
        words = " and ".join(labels.tolist())
        line = f"polarisation {words} alone: taken as if the light were unpolarised"
        said = line in scan.attrs.get("history", "").splitlines()
        return scan if said else dataset.add_history(scan, line)
    names = [name for name in (*dataset.DIRECTIONS, *dataset.SETS) if name in points.coords and name != POLARISATION]
    first, at = distinct_rows([points[name].values for name in names])
    return _combined(points, recipe, np.array(pairs)[place], first, at)


def _combined(
    points: xr.Dataset,
    recipe: Mapping[str, float],
    pairs: npt.NDArray[np.str_],
    first: npt.NDArray[np.intp],
    at: npt.NDArray[np.intp],
) -> xr.Dataset:
    """One reading for each direction; repeats of one state at one direction are averaged first."""
    counts = {pair: np.bincount(at[pairs == pair], minlength=len(first)) for pair in recipe}
    whole = np.flatnonzero(np.all([count > 0 for count in counts.values()], axis=0))

    def mean(column: Values, squares: bool = False) -> Values:
        total = np.zeros(len(whole))
        for pair, factor in recipe.items():
            chosen, count = pairs == pair, counts[pair][whole]
            values = column[chosen]
            sums = np.bincount(at[chosen], values**2 if squares else values, minlength=len(first))[whole]
            total += factor**2 * sums / count**2 if squares else factor * sums / count
        return np.sqrt(total) if squares else total

    columns = [n for n in ("brdf", "uncertainty") if n in points]
    kept = points[columns].isel(direction=first[whole]).drop_vars(POLARISATION)
    means = {n: mean(points[n].values, squares=n == "uncertainty") for n in columns}
    kept = kept.assign({n: ("direction", values, points[n].attrs) for n, values in means.items()})
    kept = with_causes(kept, {name: mean(shifts) for name, shifts in causes(points).items()})
    words = ", ".join(pair.removesuffix(">u") for pair in recipe)
    line = f"{words} combined to unpolarised light at {len(whole)} directions"
    if lacking := len(first) - len(whole):
        line += f"; {lacking} left out, which lack one of them"
    return dataset.add_history(kept, line)
