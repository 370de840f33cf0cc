"""The causes of uncertainty that a reduction knows, each declared once: what a new one needs is one entry in CAUSES.

A cause is one number x that shifts many values at once. Its part of the budget is the relative change of every value
for a change of x by its standard uncertainty, (1/f) (df/dx) u(x), with its sign: the sign is common to all values, so
only the relation between values means anything. Sizes follow from the readings and from what the user states.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gonio.outside import nearest
from gonio.reduction.standards import Absolute, Relative
from gonio.reduction.steps.detector import Known
from gonio.reduction.steps.filling import BEAM, OVER, Filling

Values = npt.NDArray[np.float64]
Parts = Mapping[str, Values]
NEIGHBOURS = 10.5  # deg: directions farther apart say nothing of the slope between them


@dataclass(frozen=True)
class Context:
    """What is known of the n readings of a set that are reduced together.

    net (n,): signals without dark and background. brdf (n,): what they became [1/sr]. theta_i, signed (n,): degrees,
    theta_r positive forward. reference: the reading of the standard or the incident beam, without dark; its random
    standard uncertainty; where it was read [deg], NaN for the incident beam. certified: the relative uncertainty of
    the standard's certificate (n,). dark_names, dark_shares (d, n), dark_sizes (d,), dark_reference (d,): of the darks,
    by how much each counts in a reading and in the reference. ranges, filters (n,) with the reference's own.
    elapsed (n,) and the reference's: time from 0 to 1. left: drift that nothing corrects. polarised (n,): f01/f00 as s
    and p readings show it, NaN elsewhere. stray (n,): the signature in each value [1/sr].
    """

    net: Values
    brdf: Values
    theta_i: Values
    signed: Values
    fill: Filling
    how: Absolute | Relative
    reference: float
    reference_uncertainty: float
    reference_at: tuple[float, float]
    certified: Values
    dark_names: tuple[str, ...]
    dark_shares: Values
    dark_sizes: Values
    dark_reference: Values
    ranges: tuple[str, ...]
    reference_range: str
    filters: tuple[str, ...]
    reference_filter: str
    gains: Mapping[str, Known]
    taus: Mapping[str, Known]
    elapsed: Values
    reference_elapsed: float
    left: float
    polarised: Values
    stray: Values

    @cached_property
    def slope_r(self) -> Values:
        """The slope d ln f/d theta_r [1/rad] of every reading, by its neighbours; zero where these are too far away."""
        return np.nan_to_num(_slopes(self.brdf, self.signed, self.theta_i))

    @property
    def lone(self) -> int:
        """How many readings have no neighbour by which the slope over theta_r is known."""
        return int(np.isnan(_slopes(self.brdf, self.signed, self.theta_i)).sum())

    @cached_property
    def slope_i(self) -> Values:
        """The slope d ln f/d theta_i [1/rad], in the same way."""
        return np.nan_to_num(_slopes(self.brdf, self.theta_i, self.signed))

    def weight_change(self, size: float, of: str) -> Values:
        """The change of -ln kappa where the beam's radius, or that of the field of view, grows by `size`."""
        near = {"spot": (size / 2, 0.0), "view": (0.0, size / 2)}[of]
        more, less = (Filling(BEAM, self.fill.radius + s * near[0], self.fill.view + s * near[1]) for s in (1, -1))
        change = np.log(less.weight(self.theta_i, self.signed) / more.weight(self.theta_i, self.signed))
        if isinstance(self.how, Relative):
            change -= np.log(less.weight(*self.reference_at) / more.weight(*self.reference_at))
        return np.asarray(change, dtype=float)


def _slopes(brdf: Values, along: Values, beside: Values) -> Values:
    """The slope of ln f [1/rad] along one angle (n,) [deg], among readings at one value of the other; NaN if alone."""
    out = np.full(len(brdf), np.nan)
    for value in np.unique(np.round(beside, 3)):
        rows = np.flatnonzero((np.abs(beside - value) < 1e-3) & (brdf > 0))
        rows = rows[np.argsort(along[rows], kind="stable")]
        rows = rows[np.unique(np.round(along[rows], 3), return_index=True)[1]]
        if len(rows) < 2:
            continue
        x, y = along[rows], np.log(brdf[rows])
        steps = np.diff(x)
        slopes = np.where(steps < NEIGHBOURS, np.diff(y) / np.radians(steps), np.nan)
        before, after = np.append(np.nan, slopes), np.append(slopes, np.nan)
        left, right = np.append(np.nan, steps), np.append(steps, np.nan)
        # between two neighbours the slope of the parabola through the three; at an end that of the line
        both = (before * right + after * left) / (left + right)
        found = np.where(np.isfinite(both), both, np.where(np.isfinite(before), before, after))
        for row, slope in zip(rows.tolist(), found.tolist(), strict=True):
            out[np.abs(along - along[row]) + np.abs(beside - beside[row]) < 1e-3] = slope
    return out


@dataclass(frozen=True)
class Cause:
    """One cause: name, what it is, type A (by statistics) or B (other), distribution, unit of its size, shape in words.

    parts(context, size) gives the relative change of every value (n,) by name; nothing where the cause is not there.
    size is the standard uncertainty as the user states it, NaN where he states none.
    """

    name: str
    help: str
    type: str
    distribution: str
    unit: str
    shape: str
    parts: Callable[[Context, float], Parts]


def _dark(c: Context, size: float) -> Parts:
    sizes = np.full(len(c.dark_names), size) if math.isfinite(size) else np.nan_to_num(c.dark_sizes)
    shared = zip(c.dark_names, c.dark_shares, c.dark_reference, sizes, strict=True)
    return {name: (of_reference / c.reference - shares / c.net) * u for name, shares, of_reference, u in shared if u}


def _reference(kind: type) -> Callable[[Context, float], Parts]:
    name = "incident" if kind is Absolute else "standard-reading"

    def parts(c: Context, size: float) -> Parts:
        u = size if math.isfinite(size) else c.reference_uncertainty
        return {name: _alike(c, -u / c.reference)} if isinstance(c.how, kind) and u > 0 else {}

    return parts


def _standard(c: Context, size: float) -> Parts:
    if not isinstance(c.how, Relative):
        return {}
    part = _alike(c, size) if math.isfinite(size) else c.certified
    return {"standard": part} if part.any() else {}


def _filter(c: Context, size: float) -> Parts:
    out: dict[str, Values] = {}
    for name, known in c.taus.items():
        of_reference = float(c.reference_filter == name)
        part = (of_reference - (np.array(c.filters) == name)) * known.relative
        out |= {f"filter {name}": part} if part.any() else {}
    if isinstance(c.how, Absolute):
        u = size if math.isfinite(size) else c.how.tau.relative
        return out | ({"filter": _alike(c, u)} if u > 0 else {})
    return out | ({"filter": _alike(c, size)} if math.isfinite(size) else {})


def _of_absolute(name: str, attribute: str, power: float) -> Callable[[Context, float], Parts]:
    def parts(c: Context, size: float) -> Parts:
        if not isinstance(c.how, Absolute) or (known := getattr(c.how, attribute)) is None:
            return {}
        u = size / known.value if math.isfinite(size) else known.relative
        return {name: _alike(c, power * u)} if u > 0 else {}

    return parts


def _constant(name: str) -> Callable[[Context, float], Parts]:
    return lambda c, size: {name: _alike(c, size)} if math.isfinite(size) else {}


def _zero(c: Context, size: float) -> Parts:
    if not math.isfinite(size):
        return {}
    cosine = np.tan(np.radians(c.signed)) if c.fill.kind != OVER else 0.0
    return {"zero": (cosine - c.slope_r) * math.radians(size)}


def _tilt(c: Context, size: float) -> Parts:
    if not math.isfinite(size):
        return {}
    cosine = -np.tan(np.radians(c.theta_i)) if c.fill.kind == OVER else np.tan(np.radians(c.signed))
    return {"tilt": (cosine + c.slope_i - c.slope_r) * math.radians(size)}


def _nonlinearity(c: Context, size: float) -> Parts:
    if not math.isfinite(size):
        return {}
    return {"nonlinearity": -np.log10(np.maximum(np.abs(c.net), 1e-300) / abs(c.reference)) * size}


def _gain(c: Context, size: float) -> Parts:
    if math.isfinite(size):
        raise ValueError("the uncertainty of a gain stands with its ratio: --gain RANGE=RATIO+-UNCERTAINTY")
    out: dict[str, Values] = {}
    for name, known in c.gains.items():
        part = (float(c.reference_range == name) - (np.array(c.ranges) == name)) * known.relative
        out |= {f"gain {name}": part} if part.any() else {}
    return out


def _beam(of: str) -> Callable[[Context, float], Parts]:
    def parts(c: Context, size: float) -> Parts:
        if not math.isfinite(size):
            return {}
        if c.fill.kind != BEAM:
            raise ValueError(f"an uncertainty of {of} belongs to --fill beam:W,R: leave it out for {c.fill.kind}")
        return {of: c.weight_change(size, of)}

    return parts


def _polarisation(c: Context, size: float) -> Parts:
    if not math.isfinite(size):
        return {}
    if not np.isfinite(c.polarised).all():
        raise ValueError("an uncertainty of the polarisation needs readings in s and in p at every direction")
    return {"polarisation": c.polarised * size}


def _stray(c: Context, size: float) -> Parts:
    if not math.isfinite(size):
        return {}
    if not c.stray.any():
        raise ValueError("an uncertainty of the stray light needs the instrument's signature: give --signature")
    with np.errstate(divide="ignore", invalid="ignore"):
        return {"stray": np.where(c.brdf != 0, c.stray / c.brdf * size, 0.0)}


def _drift(c: Context, size: float) -> Parts:
    u = size if math.isfinite(size) else abs(c.left) / math.sqrt(3)
    return {"drift": (c.elapsed - c.reference_elapsed) * u} if math.isfinite(u) and u > 0 else {}


def _alike(c: Context, relative: float) -> Values:
    return np.full(len(c.net), relative)


_ONE_FACTOR = "one factor"
CAUSES: Mapping[str, Cause] = {
    cause.name: cause
    for cause in (
        Cause("dark", "each dark", "A", "normal", "signal", "as 1/signal", _dark),
        Cause("incident", "reading of the incident beam", "A", "normal", "signal", _ONE_FACTOR, _reference(Absolute)),
        Cause(
            "standard-reading", "reading of the standard", "A", "normal", "signal", _ONE_FACTOR, _reference(Relative)
        ),
        Cause("standard", "certificate of the standard", "B", "normal", "1", _ONE_FACTOR, _standard),
        Cause("filter", "transmittance of a filter", "B", "normal", "1", "one factor a filter", _filter),
        Cause(
            "aperture", "radius of the aperture", "B", "normal", "as the radius", _ONE_FACTOR,
            _of_absolute("aperture", "radius", -2.0),
        ),
        Cause(
            "distance", "distance of the aperture", "B", "normal", "as the distance", _ONE_FACTOR,
            _of_absolute("distance", "distance", 2.0),
        ),
        Cause(
            "share", "share of the beam that is seen", "B", "normal", "1", _ONE_FACTOR,
            _of_absolute("share", "share", -1.0),
        ),
        Cause("wavelength", "wavelength of the source", "B", "normal", "1", _ONE_FACTOR, _constant("wavelength")),
        Cause("scale", "any other common factor", "B", "normal", "1", _ONE_FACTOR, _constant("scale")),
        Cause("zero", "zero of the detector's arm", "B", "normal", "deg", "odd about normal", _zero),
        Cause("tilt", "tilt of the sample, or zero of the table", "B", "normal", "deg", "by slope of f", _tilt),
        Cause(
            "nonlinearity", "slope of the detector's nonlinearity", "B", "normal", "1 per decade",
            "log of signal", _nonlinearity,
        ),
        Cause("gain", "ratio of two ranges", "B", "normal", "1", "one factor a range", _gain),
        Cause("spot", "radius of the beam", "B", "normal", "as the radius", "to grazing", _beam("spot")),
        Cause("view", "radius of the field of view", "B", "normal", "as the radius", "to grazing", _beam("view")),
        Cause(
            "polarisation", "degree of polarisation of the source", "B", "normal", "1", "as f01/f00",
            _polarisation,
        ),
        Cause("stray", "signature of the instrument", "B", "normal", "1", "near the mirror", _stray),
        Cause("drift", "drift that nothing corrects", "B", "rectangular", "1", "linear in time", _drift),
    )
}  # fmt: skip


def refuse_unknown(names: Iterable[str]) -> None:
    """ValueError for a cause that is not declared, with the nearest ones."""
    for name in names:
        if name not in CAUSES:
            raise ValueError(f"no cause {name!r}: {nearest(name, CAUSES)}; any other common factor is `scale`")


def declared(name: str) -> Cause:
    """The declaration of a part of a budget by the part's name, such as `dark[12]` or `filter nd3`."""
    head = re.split(r"[\[ ]", name, maxsplit=1)[0]
    if head in CAUSES:
        return CAUSES[head]
    return Cause(name, "as named", "B", "normal", "1", "as stated", lambda c, size: {})


def parts(context: Context, sizes: Mapping[str, float]) -> dict[str, Values]:
    """The relative change of every value (n,) by each part of the budget.

    sizes: standard uncertainties by cause, as the user states them, in place of what the readings say.
    Raises ValueError for a size that is negative, and for one of a cause that these readings do not have.
    """
    refuse_unknown(sizes)
    out: dict[str, Values] = {}
    for name, cause in CAUSES.items():
        size = sizes.get(name, math.nan)
        if size < 0 or math.isinf(size):
            raise ValueError(f"the uncertainty of {name} is {size:g}: give a finite number, 0 or more")
        found = cause.parts(context, size)
        if not found and size > 0:
            raise ValueError(f"the uncertainty of {name} has nothing to act on: {cause.help} takes no part here")
        out |= found
    return out
