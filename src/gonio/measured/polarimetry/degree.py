"""Degrees of linear polarisation of a scan: from readings through polarisers, or from a column that holds them.

Readings f in several states give sums over states, each the unpolarised part I, and differences Q and U:

    P = Q/I                 with its sign, positive where s is more
    P = sqrt(Q^2 + U^2)/I   where readings at 45 deg to s and p are there too

A random error of a reading moves P by its derivative, and the squares add. A systematic cause moves all readings at
once, so its shifts add with their signs: a calibration that all have in common leaves P as it is. The root in the
second form is above zero by noise alone, by about u where P is less than its uncertainty u.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.causes import SYSTEMATIC, TOTAL
from gonio.measured.polarimetry.side_by_side import POLARISATION, Readings, labels_of
from gonio.measured.polarisers import DOLP, STATES, Q, is_of_degree, states

Values = npt.NDArray[np.float64]
# A further variable of the name DOLP has its uncertainty under one of these.
UNCERTAINTIES = ("uncertainty_dolp", "u_dolp", "std_dolp", "dolp_uncertainty", "dolp_u", "dolp_std")
TO_45, TO_135 = "u>1 0 1 0", "u>1 0 -1 0"
REMEDY = "it needs readings in s and p (polarisation s and p, or >s and >p behind an analyser), or a column dolp"


class Recipe(NamedTuple):
    """Of which readings a degree is made: the factor of each in the sums I, Q and U, and the label of what results."""

    label: str
    intensity: Mapping[str, float]
    q: Mapping[str, float]
    u: Mapping[str, float]

    @property
    def needs(self) -> tuple[str, ...]:
        """The states that have to be there."""
        return tuple(dict.fromkeys((*self.intensity, *self.q, *self.u)))


def _of_two(label: str, s: str, p: str, u: Mapping[str, float] | None = None) -> Recipe:
    return Recipe(label, {s: 1.0, p: 1.0}, {s: 1.0, p: -1.0}, u or {})


_CROSSED = ("s>s", "p>s", "s>p", "p>p")
# The first whose readings are all there counts.
RECIPES = (
    _of_two(f">{DOLP}", "u>s", "u>p", {TO_45: 1.0, TO_135: -1.0}),
    _of_two(f">{DOLP}", "u>s", "u>p", {TO_45: 2.0, "u>s": -1.0, "u>p": -1.0}),
    _of_two(f">{Q}", "u>s", "u>p"),
    Recipe(f">{Q}", dict.fromkeys(_CROSSED, 1.0), dict(zip(_CROSSED, (1.0, 1.0, -1.0, -1.0), strict=True)), {}),
    _of_two(f"s>{Q}", "s>s", "s>p"),
    _of_two(f"p>{Q}", "p>s", "p>p"),
    _of_two(Q, "s>u", "p>u"),
)


def dolp(scan: xr.Dataset) -> xr.Dataset:
    """The degree of linear polarisation of a scan, as a scan of its own with the unit 1.

    Parameters
    ----------
    scan : xarray.Dataset
        Readings in s and p, of the incident light (`polarisation` s and p) or of what leaves (>s and >p, or s>s, s>p,
        p>s and p>p), with further ones at 45 deg (> 1 0 1 0) for both parts of linear polarisation; or a scan with a
        further variable `dolp`, and its standard uncertainty as `uncertainty_dolp`. A scan of degrees stays as it is.

    Returns
    -------
    xarray.Dataset
        Values of -1 to 1 [1] under the name `brdf`, with standard uncertainties and shifts by systematic causes.
        `polarisation` says which degree it is. Directions that lack a state are left out, and values without light are
        missing; the history says both.

    Raises
    ------
    ValueError
        The scan has no such readings.

    """
    if dataset.is_degree(scan):
        return labelled(scan)
    if DOLP in scan.data_vars:
        return _of_column(scan)
    flat = dataset.flatten(scan)
    if POLARISATION not in flat.coords:
        raise ValueError(f"the scan names no polarisation, so no degree of it follows: {REMEDY}")
    labels, place = labels_of(flat)
    pairs = [_canonical(label) for label in labels]
    recipe = next((one for one in RECIPES if set(one.needs) <= set(pairs)), None)
    if recipe is None:
        raise ValueError(f"polarisation {' and '.join(labels)} gives no degree of it: {REMEDY}")
    return _made(Readings.of(flat, recipe.needs, np.array(pairs)[place]), recipe)


def labelled(scan: xr.Dataset) -> xr.Dataset:
    """A scan of degrees of polarisation that says of each which one it is, in its coordinate `polarisation`.

    Without a word it is that of what leaves where unpolarised light arrives; with the state s alone, where s arrives.
    It has a sign where any value is negative. Raises ValueError for a state that is none.
    """
    kind = Q if bool((scan["brdf"] < 0).any()) else DOLP
    if POLARISATION not in scan.coords:
        flat = scan["brdf"].dims == ("direction",)
        label = ("direction", np.full(scan.sizes["direction"], f">{kind}")) if flat else f">{kind}"
        return scan.assign_coords({POLARISATION: label})
    old = scan[POLARISATION].values.astype(str)
    words = {str(label): _of_degree(str(label), kind) for label in np.unique(old)}
    if all(label == word for label, word in words.items()):
        return scan
    new = np.array([words[label] for label in old.ravel().tolist()]).reshape(old.shape)
    return scan.assign_coords({POLARISATION: (scan[POLARISATION].dims, new)})


def in_words(label: str) -> str:
    """What a label says of a degree of polarisation, such as `>dolp: of what leaves, without a sign`."""
    incident, detected = states(label)
    if incident == Q:
        return f"{label}: (s - p)/(s + p) of the light that arrives"
    light = "" if incident == "u" else f" where {incident} light arrives"
    kind = "(s - p)/(s + p)" if detected == Q else "sqrt(Q^2 + U^2)/I"
    return f"{label}: {kind} of what leaves{light}"


def _of_degree(label: str, kind: str) -> str:
    if is_of_degree(label):
        return label
    incident, detected = states(label)
    if detected != "u":
        raise ValueError(
            f"polarisation {label!r} is that of a reading, and the values are degrees: write s>dolp or >q/i"
        )
    return f"{incident if incident != 'u' else ''}>{kind}"


def _canonical(label: str) -> str:
    """Both states of a label, Stokes parameters in one spelling; empty for a word of the laboratory's own."""
    try:
        pair = states(label)
    except ValueError:
        return ""
    return ">".join(s if s in (*STATES, Q, DOLP) else " ".join(f"{float(part):g}" for part in s.split()) for s in pair)


def _of_column(scan: xr.Dataset) -> xr.Dataset:
    """The further variable `dolp` as the values."""
    found = next((name for name in UNCERTAINTIES if name in scan), None)
    unit = {"units": dataset.DEGREE}
    of_brdf = ("brdf", "uncertainty", SYSTEMATIC, TOTAL, DOLP, *([found] if found else []))
    kept = scan.drop_vars([n for n in of_brdf if n in scan]).drop_dims("cause", errors="ignore")
    values = {"brdf": scan[DOLP]} | ({"uncertainty": scan[found]} if found else {})
    for name, variable in values.items():
        if variable.dtype.kind not in "fiu":
            raise ValueError(
                f"the column {variable.name} holds texts: a degree of polarisation is a number from 0 to 1"
            )
        kept = kept.assign({name: (variable.dims, variable.values.astype(float), unit)})
    return labelled(dataset.add_history(kept, "took the column dolp for the values"))


def _made(readings: Readings, recipe: Recipe) -> xr.Dataset:
    value = {state: readings.value(state) for state in recipe.needs}
    i, q, u = (
        sum((f * value[state] for state, f in part.items()), start=np.zeros(len(readings.whole)))
        for part in (recipe.intensity, recipe.q, recipe.u)
    )
    dark = ~(i > 0)
    i = np.where(dark, np.nan, i)
    length = np.hypot(q, u)
    degree = (length if recipe.u else q) / i
    along = (1.0, 0.0) if not recipe.u else (q / np.where(length > 0, length, 1.0), u / np.where(length > 0, length, 1))
    slopes = {
        s: (along[0] * recipe.q.get(s, 0.0) + along[1] * recipe.u.get(s, 0.0) - degree * recipe.intensity.get(s, 0.0))
        / i
        for s in recipe.needs
    }
    variance = sum((slope * readings.uncertainty(s)) ** 2 for s, slope in slopes.items())
    by_state = {s: readings.shifts(s) for s in recipe.needs}
    shifts = {
        name: sum((slope * by_state[s][name] for s, slope in slopes.items()), start=np.zeros(len(i)))
        for name in by_state[recipe.needs[0]]
    }
    out = readings.scan(degree, np.sqrt(variance), shifts, dataset.DEGREE)
    out = out.assign_coords({POLARISATION: ("direction", np.full(len(i), recipe.label))})
    words = ", ".join(state.removesuffix(">u").removeprefix("u") for state in recipe.needs)
    line = f"degree of linear polarisation ({recipe.label}) of {words} at {len(i)} directions"
    line += f"; {readings.lacking} left out, which lack one of them" if readings.lacking else ""
    line += f"; {int(dark.sum())} missing, where their sum is not above zero" if dark.any() else ""
    return dataset.add_history(out, line)
