"""Readings through polarisers: what they say of a Mueller matrix, and their mean, which unpolarised light gives.

The coordinate `polarisation` names the state of the incident light, and after `>` that which the detector lets through:
`s`, `s>p`, `>p`. A state is s, p or u (unpolarised, or no polariser), or four Stokes parameters: `1 0.5 0 0.25`. With
the incident light's Stokes vector a = (1, ..) and the analyser's d, a reading is the BRDF

    f = d M a,   d = (1, 0, 0, 0) without an analyser, (1, 1, 0, 0)/2 for s, (1, -1, 0, 0)/2 for p,

so that readings through both analysers add to that without one, f_s>s + f_s>p = f_s, and (f_s + f_p)/2 = f_u = M_00.

Two more states name degrees of linear polarisation, which are ratios of readings and have the unit 1 (degree.py):

    >q/i     Q/I = (f_>s - f_>p)/(f_>s + f_>p) of what leaves, with its sign: M_10/M_00; s>q/i where s light arrives
    >dolp    sqrt(Q^2 + U^2)/I of what leaves, without a sign; s>dolp where s light arrives
    q/i      (f_s - f_p)/(f_s + f_p), by light of s and of p that arrives: M_01/M_00
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.distinct import distinct
from gonio.measured.polarimetry.side_by_side import POLARISATION as POLARISATION
from gonio.measured.polarimetry.side_by_side import Readings, labels_of

Values = npt.NDArray[np.float64]

STATES: Mapping[str, tuple[float, float, float, float]] = {
    "": (1.0, 0.0, 0.0, 0.0),
    "u": (1.0, 0.0, 0.0, 0.0),
    "s": (1.0, 1.0, 0.0, 0.0),
    "p": (1.0, -1.0, 0.0, 0.0),
}
Q, DOLP = "q/i", "dolp"  # of degrees of linear polarisation: with the sign of s less p, and without one
WORDS: Mapping[str, str] = {"unpolarised": "u", "unpolarized": "u", "none": "u", "unknown": "u", "te": "s", "tm": "p"}
# Which readings make one for unpolarised light, and the factor of each; the first whose readings are all there counts.
MEANS: tuple[Mapping[str, float], ...] = (
    {"u>u": 1.0},
    {"s>u": 0.5, "p>u": 0.5},
    {"u>s": 1.0, "u>p": 1.0},
    {"s>s": 0.5, "s>p": 0.5, "p>s": 0.5, "p>p": 0.5},
)


class Analysers(NamedTuple):
    """What each of some readings takes of a Mueller matrix M: the weight of each element in it.

    intensity (points, 4, 4): of a reading; of a degree of polarisation, of what it is divided by. parts: of a degree,
    those of Q and of U (points, 4, 4), without which all are readings. signed (points,): which degrees are Q/I itself;
    of the others U counts too, and the sign is lost.
    """

    intensity: Values
    parts: tuple[Values, Values] | None = None
    signed: npt.NDArray[np.bool_] | None = None


def states(label: str) -> tuple[str, str]:
    """The incident and the detected state of a label: each s, p, u or four Stokes parameters in words, or a degree.

    Raises ValueError for a label that is none, with those that there are.
    """
    incident, _, detected = (part.strip().lower() for part in label.partition(">"))
    incident, detected = (WORDS.get(word, word) or "u" for word in (incident, detected))
    if incident == DOLP and detected == "u":  # a degree alone is that of what leaves
        incident, detected = "u", DOLP
    if incident != Q or detected != "u":
        _stokes(incident, label)
    if detected not in (Q, DOLP):
        _stokes(detected, label)
    return incident, detected


def is_of_degree(label: str) -> bool:
    """Whether a label names a degree of linear polarisation; ValueError for one that is none."""
    incident, detected = states(label)
    return incident == Q or detected in (Q, DOLP)


def names_degrees(points: xr.Dataset) -> bool:
    """Whether a scan names a degree of linear polarisation; other words may be the laboratory's own."""
    words = labels_of(points)[0] if POLARISATION in points.coords else []
    ends = {word.strip().lower() for label in words for word in label.split(">")}
    return not ends.isdisjoint((Q, DOLP))


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
            "leaves in p, or Stokes parameters, 1 0.5 0 0.25; of degrees of polarisation, dolp, >q/i or q/i"
        )
    return vector


def is_polarised(points: xr.Dataset) -> bool:
    """Whether a scan says how its light was polarised, otherwise than not at all."""
    if POLARISATION not in points.coords:
        return False
    return any(states(label) != ("u", "u") for label in distinct(points[POLARISATION].values.astype(str))[0].tolist())


def analysed(points: xr.Dataset) -> Analysers | None:
    """What the readings of a flat scan take of a Mueller matrix; None where no light is polarised.

    Raises ValueError for a label that is none, and for readings and degrees of polarisation in one scan.
    """
    if not is_polarised(points):
        return None
    labels, place = labels_of(points)
    degrees = {is_of_degree(label) for label in labels}
    if len(degrees) > 1:
        words = " and ".join(labels)
        raise ValueError(f"polarisation {words} are readings and ratios of them in one scan: select those of one kind")
    if degrees == {False}:
        return Analysers(np.array([_of_reading(label) for label in labels])[place])
    several = [_of_degree(label) for label in labels]
    intensity, q, u = (np.array(weights)[place] for weights in zip(*several, strict=True))
    signed = np.array([states(label)[1] != DOLP for label in labels])[place]
    return Analysers(intensity, (q, u), signed)


def _of_reading(label: str) -> Values:
    incident, detected = (np.array(_stokes(word, label)) for word in states(label))
    analyser = detected if states(label)[1] == "u" else detected / 2
    return np.outer(analyser, incident)


def _of_degree(label: str) -> tuple[Values, Values, Values]:
    """The weights (4, 4) of I, Q and U."""
    incident, _ = states(label)
    unit = np.eye(4)
    if incident == Q:
        return np.outer(unit[0], unit[0]), np.outer(unit[0], unit[1]), np.zeros((4, 4))
    light = np.array(_stokes(incident, label))
    intensity, q, u = (np.outer(row, light) for row in unit[:3])
    return intensity, q, u


def unpolarised(scan: xr.Dataset, *, strict: bool = False) -> xr.Dataset:
    """The readings that unpolarised light would give, for what knows no polarisation; the history says how they came.

    Readings in s and p at one direction are averaged, those through analysers added, as MEANS says. Repeats of a state
    at a direction are averaged first. Random uncertainties add in squares, shifts by a systematic cause with their
    signs. A value of which a reading is masked is masked. Directions that lack a state are left out; a scan without
    polarised light is returned as it is; one that lacks a state throughout keeps its values. The history says each.

    strict: whether to raise ValueError in these three cases instead.
    """
    flat = dataset.flatten(scan)
    if POLARISATION not in flat.coords:
        return _refused("none") if strict else scan
    labels, place = labels_of(flat)
    try:
        pairs = [">".join(states(label)) for label in labels]
    except ValueError:  # a word of the laboratory's own, which a model without polarisation need not understand
        pairs = ["" for _ in labels]
    if set(pairs) == {"u>u"} and not strict:
        return scan
    recipe = next((mean for mean in MEANS if set(mean) <= set(pairs)), None)
    words = " and ".join(labels)
    if recipe is None or (strict and len(recipe) < len(set(pairs))) or set(pairs) == {"u>u"}:
        return _refused(words) if strict else _taken_as_unpolarised(scan, words)
    return _combined(Readings.of(flat, recipe, np.array(pairs)[place]), recipe, strict)


def _refused(words: str) -> xr.Dataset:
    raise ValueError(f"unpolarised light needs readings in s and in p; there are {words}")


def _taken_as_unpolarised(scan: xr.Dataset, words: str) -> xr.Dataset:
    line = f"polarisation {words} alone: taken as if the light were unpolarised"
    said = line in scan.attrs.get("history", "").splitlines()
    return scan if said else dataset.add_history(scan, line)


def _combined(readings: Readings, recipe: Mapping[str, float], strict: bool) -> xr.Dataset:
    """One reading for each direction, the sum of those of every state times its factor."""
    words = ", ".join(pair.removesuffix(">u") for pair in recipe)
    if readings.lacking and strict:
        raise ValueError(f"the direction {readings.first_lacking} is not there in each of {words}: read the other one")
    value = sum(factor * readings.value(pair) for pair, factor in recipe.items())
    variance = sum((factor * readings.uncertainty(pair)) ** 2 for pair, factor in recipe.items())
    by_state = {pair: readings.shifts(pair) for pair in recipe}
    shifts = {
        name: sum((f * by_state[pair][name] for pair, f in recipe.items()), start=np.zeros(len(readings.whole)))
        for name in next(iter(by_state.values()))
    }
    out = readings.scan(np.asarray(value), np.sqrt(variance), shifts)
    line = f"{words} combined to unpolarised light at {len(readings.whole)} directions"
    if readings.lacking:
        line += f"; {readings.lacking} left out, which lack one of them"
    return dataset.add_history(out, line)
