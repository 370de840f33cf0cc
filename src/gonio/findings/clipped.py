"""Values that the instrument could not tell apart: a saturated peak, and a floor."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.curves import Curve
from gonio.measured.check import Finding, Severity, places

Values = npt.NDArray[np.float64]

RUN = 3  # neighbours of exactly one value; two as well where their own neighbours differ, as those of no symmetrical
LOPSIDED, EXACT = 1e-3, 1e-4  # lobe do: by how much of the peak, and the last digit of such values over the peak
PEAKED = 1.1  # a plateau over the median of its curve; a flat curve has no peak that could be cut off
ROUNDING = 3.0  # last digits by which a curve falls beside a plateau; a round top that was rounded falls by about one
ABRUPT = (
    0.01  # of a plateau of the signal, by which it falls beside it: f cos(theta_r) of a matt surface has a round top
)
DIGITS = 5  # significant: to which the signal f cos(theta_r) of values in six digits is one number
SMALLEST = 1e-290  # whose last digits are still numbers; the wings of computed lobes fall below
USUAL = 80.0  # deg: beyond it formats and instruments write fillers for what was not measured
LEAST, SHARE = 5, 0.02  # values at the floor, and their part of a set
TIES = 3.0  # over the ties at any other value, which rounding alone gives
GRADUAL = (
    1e-3  # above the least value, relative: a computed lobe on a constant has values there, a cut curve hardly any
)
HALF = 0.5  # of the values: so many are as well a matt part that a program made constant


class Top(NamedTuple):
    """The plateau at the largest value of a curve.

    level, run: its value and how many have it. shoulders: the values beside it, one where the scan ends with it. least:
    the least f on it. digit: the last digit of the curve's values.
    """

    level: float
    run: int
    shoulders: tuple[float, ...]
    least: float
    digit: float

    @property
    def is_cut(self) -> bool:
        """Whether the plateau alone shows that the peak was cut off."""
        if self.run >= RUN:
            return True
        lopsided = len(self.shoulders) == 2 and abs(np.diff(self.shoulders)[0]) > LOPSIDED * self.level
        return self.run == RUN - 1 and lopsided and self.digit <= EXACT * self.level


def saturated(flat: xr.Dataset, curves: list[Curve]) -> list[Finding]:
    """`saturated` where peaks end in a plateau: in f, or in f cos(theta_r), which the detector sees."""
    for of, signal in (("f", False), ("f cos(theta_r)", True)):
        tops = [top for curve in curves if (top := _top(curve, signal)) is not None]
        cut = [top for top in tops if (top.run >= RUN if signal else top.is_cut)]
        level = max((top.level for top in tops), default=0.0)
        alike = [top for top in tops if top.level == level]
        if not cut and not signal and _cut_alike(alike):
            cut = alike
        if cut:
            count, least = sum(top.run for top in cut), min(top.least for top in cut)
            what = (
                f"{count} values at the top of {len(cut)} peak{'s' * (len(cut) > 1)} are one number in {of}: "
                "the detector was saturated"
            )
            remedy = f"measure again with less light, or mask them: --saturation {least:.6g}"
            where = places(flat, flat["brdf"].values >= least)
            return [Finding(Severity.WARNING, what, remedy, where, "saturated")]
    return []


def _top(curve: Curve, signal: bool) -> Top | None:
    """The plateau at the largest value of a curve; None for a curve without a peak, or whose top was only rounded."""
    f = curve.values
    if len(f) < 2 * RUN or not f.max() > PEAKED * max(float(np.median(f)), 0.0):
        return None
    seen = rounded(f * np.cos(np.radians(curve.theta_r))) if signal else f
    k = int(np.argmax(seen))
    others = np.flatnonzero(seen != seen[k])
    before, after = others[others < k], others[others > k]
    first, last = (before[-1] + 1 if before.size else 0), (after[0] - 1 if after.size else len(f) - 1)
    run, on = int(last - first + 1), f[first : last + 1]
    if 2 * run > len(f) or (signal and np.ptp(on) == 0):
        return None
    shoulders = tuple(float(seen[at]) for at in (first - 1, last + 1) if 0 <= at < len(f))
    digit = float(np.diff(np.unique(seen)).min())
    if run > 1 and seen[k] - min(shoulders) <= max(ROUNDING * digit, ABRUPT * float(seen[k]) if signal else 0.0):
        return None
    return Top(float(seen[k]), run, shoulders, float(on.min()), digit)


def _cut_alike(tops: list[Top]) -> bool:
    """Whether peaks of several curves end at one level, one of them in a plateau, and are no copies of one lobe."""
    if len(tops) < 2 or max(top.run for top in tops) < 2:
        return False
    shoulders = [sorted(top.shoulders) for top in tops]
    within = LOPSIDED * tops[0].level
    copies = all(len(s) == len(shoulders[0]) and np.allclose(s, shoulders[0], 0, within) for s in shoulders)
    symmetrical = all(np.ptp(s) <= within for s in shoulders)
    return not copies and not symmetrical


def floor(flat: xr.Dataset) -> list[Finding]:
    """`floor` where many values are the least one: in f, or in f cos(theta_r), which the detector sees."""
    theta_r = flat["theta_r"].values.astype(float)
    inner = np.flatnonzero(theta_r <= USUAL)
    f = flat["brdf"].values[inner].astype(float)
    seeing: dict[str, Callable[[], Values]] = {
        "f": lambda: f,
        "f cos(theta_r)": lambda: rounded(f * np.cos(np.radians(theta_r[inner]))),
    }
    for of, see in seeing.items():
        values = see()
        at = _at_floor(values)
        if at is not None:
            most = float(f[at].max())
            what = (
                f"{at.sum()} of {len(f)} values within {USUAL:g} deg are one least number, {values[at][0]:.4g}, in {of}"
            )
            remedy = (
                f"if that is the instrument's noise floor, mask them: --floor {_above(most)}; else they pull a fit "
                "in logarithms down or up to it"
            )
            where = np.zeros(len(theta_r), dtype=bool)
            where[inner[at]] = True
            severity = Severity.NOTE if at.mean() > HALF else Severity.WARNING
            return [Finding(severity, what, remedy, places(flat, where), "floor")]
    return []


def _at_floor(values: Values) -> npt.NDArray[np.bool_] | None:
    """Which values are the least one, where they are more than rounding explains; None where they are not."""
    if np.count_nonzero(values == values.min(initial=np.inf)) < max(LEAST, SHARE * len(values)):
        return None
    distinct, counts = np.unique(values, return_counts=True)
    if len(distinct) < LEAST:
        return None
    if counts[0] < TIES * counts[1:].max():
        return None
    at = values == distinct[0]
    ends = int(np.count_nonzero(np.diff(at)))
    gradual = int(np.count_nonzero((values > distinct[0]) & (values <= distinct[0] * (1 + GRADUAL))))
    return None if distinct[0] > 0 and gradual >= max(ends, 1) else at


def rounded(values: Values) -> Values:
    """Values to DIGITS significant digits."""
    size = np.abs(values)
    exponent = np.floor(np.log10(np.where(size > SMALLEST, size, 1.0)))
    unit = 10.0 ** (exponent - DIGITS + 1)
    return np.round(values / unit) * unit


def _above(value: float) -> str:
    """A number of six digits just above a value."""
    return f"{value + max(abs(value) * 2e-6, 1e-300):.7g}" if value else "1e-300"
