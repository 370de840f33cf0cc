"""The linearity of a detector by flux addition: two apertures A and B, each alone and both open, at several levels.

    NL = V(A+B)/(V(A) + V(B))

is 1 for a linear detector. For V = P (1 + a log10(P/P0)) it is 1 + a H to first order, with

    H = log10(V(A) + V(B)) - (V(A) log10 V(A) + V(B) log10 V(B))/(V(A) + V(B)),

log10(2) for equal fluxes, at every level alike. So each level gives the nonlinearity a of a decade.
"""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import total
from gonio.reduction.readings import checked, of_kind, place
from gonio.reduction.steps.dark import darks, times
from gonio.verification.checks.outcome import COVERAGE, Detail, Outcome

Values = npt.NDArray[np.float64]
ONE, OTHER, BOTH = "A", "B", "A+B"
NAMES = (ONE, OTHER, BOTH)
HOW = f"read {ONE}, {OTHER} and {BOTH} one after another at each level, named so in the column `filter`"


def linearity(raw: xr.Dataset) -> Outcome:
    """The nonlinearity of a decade, the mean over the levels of readings behind the filters A, B and A+B.

    Readings are taken in threes in the order of time. Raises ValueError where there are none, three do not belong
    together, or a signal without its dark is not above zero.
    """
    raw = checked(raw)
    dark = darks(raw)
    net = raw["signal"].values - dark.value
    monitor = raw["monitor"].values
    levels = _levels(raw)
    if np.isfinite(monitor[levels]).all():
        net = net / monitor
        scale = monitor
    else:
        scale = np.ones(len(net))
    for row in levels.ravel()[~(net[levels.ravel()] > 0)].tolist():
        raise ValueError(f"{place(raw, row)}: the signal without dark is {net[row]:.4g}, not above zero: more light")
    noise = raw["sd"].values / np.sqrt(raw["samples"].values) / scale
    one, other, both = net[levels].T
    ratio = both / (one + other)
    of_decade = np.log10(one + other) - (one * np.log10(one) + other * np.log10(other)) / (one + other)
    # a dark that is wrong shifts all three, and NL by one part of V(A+B)
    of_dark = np.sqrt(np.sum((dark.weights * dark.sizes[:, None]) ** 2, axis=0))[levels[:, 2]] / scale[levels[:, 2]]
    u_one, u_other, u_both = noise[levels].T
    spread = ratio * total([u_both / both, np.hypot(u_one, u_other) / (one + other), of_dark / both])
    slopes, errors = (ratio - 1) / of_decade, spread / of_decade
    slope, error = _mean(slopes, errors)
    level = float(np.sqrt(both.min() * both.max()))
    differ = len(slopes) > 1 and bool((np.abs(slopes - slope) > COVERAGE * np.hypot(errors, error)).any())
    notes = ("the levels differ by more than their uncertainty: one number for a decade does not describe it",)
    unit = raw["signal"].attrs["units"]
    return Outcome(
        slope,
        error,
        len(levels),
        "nonlinearity a of a decade",
        f"correct it: gonio reduce --nonlinearity {slope:.3g},{level:.3g} --uncertainty nonlinearity={error:.2g}",
        details=tuple(
            Detail(f"V(A+B)/(V(A)+V(B)) at {v:.3g} {unit}", float(r), float(u))
            for v, r, u in zip(both, ratio, spread, strict=True)
        ),
        notes=notes if differ else (),
    )


def _levels(raw: xr.Dataset) -> npt.NDArray[np.intp]:
    """The rows (levels, 3) of A, B and A+B; ValueError where readings of one are missing."""
    filters = np.char.upper(np.char.replace(raw["filter"].values.astype(str), " ", ""))
    rows = np.setdiff1d(np.flatnonzero(np.isin(filters, NAMES)), of_kind(raw, "dark"))
    if not len(rows):
        raise ValueError(f"there are no readings behind the filters {ONE}, {OTHER} and {BOTH}: {HOW}")
    rows = rows[np.argsort(times(raw)[rows], kind="stable")]
    out = []
    for start in range(0, len(rows), len(NAMES)):
        three = rows[start : start + len(NAMES)]
        by_name = {str(filters[row]): int(row) for row in three}
        if len(by_name) < len(NAMES):
            raise ValueError(f"{place(raw, int(three[0]))}: a level begins that lacks one of its three readings: {HOW}")
        out.append([by_name[name] for name in NAMES])
    return np.array(out, dtype=np.intp)


def _mean(values: Values, errors: Values) -> tuple[float, float]:
    """The mean weighted by uncertainties, with the larger of what they and the scatter of the values make of it."""
    known = np.isfinite(errors).all() and (errors > 0).all()
    weights = 1 / errors**2 if known else np.ones(len(values))
    mean = float(weights @ values / weights.sum())
    spreads = [float(1 / np.sqrt(weights.sum()))] if known else []
    if len(values) > 1:
        spreads.append(float(np.sqrt(weights @ (values - mean) ** 2 / weights.sum() / (len(values) - 1))))
    return mean, max(spreads, default=float("nan"))
