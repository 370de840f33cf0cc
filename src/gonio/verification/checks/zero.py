"""The zero of the angles by the peaks of a mirror, whose centre lies at theta_r = theta_i where all zeros are right.

An arm that reads b at the normal, and a sample that is tilted by e towards the forward side in the plane of incidence,
shift the peak by b + 2 e at every theta_i alike, so readings of one mounting give the sum alone. With the sample turned
by 180 deg the tilt has the other sign, and both are known. A shift that changes with theta_i is neither.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.reduction.readings import ROW, checked, of_kind
from gonio.reduction.steps.dark import darks
from gonio.verification.checks.outcome import COVERAGE, Detail, Outcome

Values = npt.NDArray[np.float64]
FEWEST = 3  # incidence angles
DECIMALS = 1  # of a degree, to which readings of one incidence angle agree
WIDEST = 10.0  # deg between the halves of a peak: a wider one is not that of a mirror
WRONG_SIDE = 5.0  # deg: of theta_i, from which a peak on the side of the source is not one of noise
TURNED = 180.0
HOW = "scan theta_r of a mirror about theta_i, to below half of the peak on both sides"
SIGNS = "the peaks lie on the side of the source: theta_r has the other sign; forward is positive"
CHANGES = "it changes with theta_i, which neither a zero nor a tilt does: look at the centring of the axes"


class Peak(NamedTuple):
    """The peak at one theta_i and turn of the sample, and its shift from the mirror direction, all in degrees.

    noise, steps: standard uncertainties of the shift by the readings, and by the steps between them.
    """

    theta_i: float
    turn: float
    shift: float
    noise: float
    steps: float

    @property
    def uncertainty(self) -> float:
        """Of both."""
        return float(np.hypot(self.noise, self.steps))

    @property
    def detail(self) -> Detail:
        """The same for the outcome."""
        turned = f", turned by {self.turn:g}" if self.turn else ""
        return Detail(f"theta_i {self.theta_i:g}{turned} deg", self.shift, self.uncertainty)


def zero(data: xr.Dataset) -> Outcome:
    """The mean shift of the peaks [deg] from theta_r = theta_i: the zero of the arm and twice the tilt of the sample.

    data: raw readings, or a scan. The centre of a peak is midway between where it falls to half on either side, on
    straight lines between readings; what the curve may depart from these counts as uncertainty. With readings at phi_i
    0 and 180 deg the number is the zero of the arm alone.
    Raises ValueError for peaks at fewer than three theta_i.
    """
    peaks = _peaks(data)
    if len({peak.theta_i for peak in peaks}) < FEWEST:
        count = len({peak.theta_i for peak in peaks})
        raise ValueError(f"there are peaks of a mirror at {count} theta_i, and {FEWEST} are needed: {HOW}")
    turns = sorted({peak.turn for peak in peaks})
    details = tuple(peak.detail for peak in peaks)
    if any(peak.theta_i > WRONG_SIDE and peak.shift < -peak.theta_i for peak in peaks):
        shift, error = _mean(peaks)
        return Outcome(shift, error, len(peaks), "shift of the mirror's peaks", SIGNS, "deg", details=details)
    slope, of_slope = _slope(peaks)
    reach = max(peak.theta_i for peak in peaks) - min(peak.theta_i for peak in peaks)
    notes = (f"it changes by {slope * reach:.2g} ± {of_slope * reach:.1g} deg from the least theta_i to the largest",)
    changes = abs(slope) > COVERAGE * of_slope
    if turns == [0.0, TURNED]:
        here, there = (_mean([peak for peak in peaks if peak.turn == turn]) for turn in turns)
        arm, tilt = (here[0] + there[0]) / 2, (here[0] - there[0]) / 4
        error = float(np.hypot(here[1], there[1])) / 2
        details += (Detail("tilt of the sample in the plane", tilt, error / 2),)
        remedy = f"gonio reduce --arm-zero {arm:.3f} --tilt {tilt:.3f},0"
        what, number = "zero of the arm", arm
    else:
        number, error = _mean(peaks)
        what = "zero of the arm and twice the tilt of the sample"
        remedy = (
            f"gonio reduce --arm-zero {number:.3f} where it is the arm, or --tilt {number / 2:.3f},0 where it is the "
            "sample; readings with the sample turned by 180 deg (phi_i) tell which"
        )
    return Outcome(
        number,
        error,
        len(peaks),
        what,
        CHANGES if changes else remedy,
        "deg",
        details=details,
        notes=notes if changes else (),
    )


def _peaks(data: xr.Dataset) -> list[Peak]:
    """The peak of every curve that falls to half on both sides, in the order of turn and theta_i."""
    theta_i, signed, turn, signal, noise = _curves(data)
    found = []
    for one in np.unique(turn).tolist():
        for angle in np.unique(theta_i[turn == one]).tolist():
            rows = np.flatnonzero((turn == one) & (theta_i == angle))
            rows = rows[np.argsort(signed[rows], kind="stable")]
            if centre := _centre(signed[rows], signal[rows], noise[rows]):
                found.append(Peak(angle, one, centre[0] - angle, *centre[1:]))
    return found


def _curves(data: xr.Dataset) -> tuple[Values, Values, Values, Values, Values]:
    """theta_i, signed theta_r, turn [deg], signal and its standard uncertainty (n,); of a scan f cos(theta_r)."""
    if ROW in data.dims:
        raw = checked(data)
        rows = of_kind(raw, "sample")
        net = (raw["signal"].values - darks(raw).value)[rows]
        noise = (raw["sd"].values / np.sqrt(raw["samples"].values))[rows]
        some, cosine = raw.isel({ROW: rows}), np.ones(len(rows))
        phi_i = some["phi_i"].values
    else:
        some = dataset.points(data)
        cosine = np.cos(np.radians(some["theta_r"].values.astype(float)))
        net = some["brdf"].values
        noise = some["uncertainty"].values if "uncertainty" in some else np.full(len(net), np.nan)
        phi_i = some["phi_i"].values if "phi_i" in some.coords else np.zeros(len(net))
    theta_r, phi = (some[name].values.astype(float) for name in ("theta_r", "phi"))
    signed = np.where(np.cos(np.radians(phi)) < 0, theta_r, -theta_r)
    plane = (theta_r == 0) | (np.abs(np.sin(np.radians(phi))) < 1e-6)
    theta_i = np.round(some["theta_i"].values.astype(float), DECIMALS)
    turn = np.round(np.nan_to_num(phi_i.astype(float)), DECIMALS) % 360.0
    return theta_i[plane], signed[plane], turn[plane], (net * cosine)[plane], (noise * cosine)[plane]


def _centre(angles: Values, signal: Values, noise: Values) -> tuple[float, float, float] | None:
    """The centre [deg] of a curve's peak, its standard uncertainty by noise, and that by the steps between readings.

    None where the curve does not fall to half on both sides, or is wider than a mirror's. angles (n,): in rising order.
    """
    angles, first = np.unique(angles, return_index=True)  # of repeats the first stands for the direction
    signal, noise = signal[first], noise[first]
    top = int(np.argmax(signal)) if len(signal) else 0
    half = signal[top] / 2 if len(signal) else 0.0
    left = np.flatnonzero(signal[:top] < half)
    right = np.flatnonzero(signal[top:] < half)
    if not (half > 0 and len(left) and len(right)):
        return None
    at, errors, departures = [], [], []
    for a, b in ((int(left[-1]), int(left[-1]) + 1), (top + int(right[0]) - 1, top + int(right[0]))):
        share, slope = (half - signal[a]) / (signal[b] - signal[a]), (signal[b] - signal[a]) / (angles[b] - angles[a])
        at.append(angles[a] + share * (angles[b] - angles[a]))
        errors.append(np.hypot((1 - share) * noise[a], share * noise[b]) / abs(slope))
        departures.append(_departure(signal, a) / abs(slope))
    if at[1] - at[0] > WIDEST:
        return None
    return float(np.mean(at)), float(np.hypot(*errors)) / 2, float(np.hypot(*departures)) / 2


def _departure(signal: Values, a: int) -> float:
    """By how much a curve may depart from the straight line from place a to the next, as a standard uncertainty.

    At most h^2/8 times the largest second derivative in between, of which second differences tell (rectangular).
    """
    around = np.abs(np.diff(signal[max(a - 1, 0) : a + 3], 2))
    return float(around.max(initial=0.0)) / 8 / np.sqrt(3)


def _mean(peaks: Sequence[Peak]) -> tuple[float, float]:
    """The mean shift, with the larger of what noise and what the scatter over theta_i make of its uncertainty.

    That by the steps is not less for several peaks: where each is scanned in the same steps, all err alike.
    """
    shifts, noise, steps = (np.array([getattr(peak, name) for peak in peaks]) for name in ("shift", "noise", "steps"))
    stated = float(np.sqrt(np.sum(noise**2))) / len(shifts)
    scatter = float(np.std(shifts, ddof=1) / np.sqrt(len(shifts))) if len(shifts) > 1 else float("nan")
    return float(shifts.mean()), float(np.hypot(np.fmax(stated, scatter), steps.mean()))


def _slope(peaks: Sequence[Peak]) -> tuple[float, float]:
    """The slope of the shift over theta_i, all turns about their own mean, and its standard uncertainty."""
    theta_i, turn, shifts = (np.array([peak[k] for peak in peaks]) for k in range(3))
    errors = np.array([peak.uncertainty for peak in peaks])
    for one in np.unique(turn):
        theta_i[turn == one] -= theta_i[turn == one].mean()
        shifts[turn == one] -= shifts[turn == one].mean()
    spread = float(theta_i @ theta_i)
    if not spread:
        return 0.0, float("nan")
    slope = float(theta_i @ shifts) / spread
    freedom = max(len(shifts) - len(np.unique(turn)) - 1, 1)
    scatter = float(np.sqrt(np.sum((shifts - slope * theta_i) ** 2) / freedom / spread))
    return slope, float(np.fmax(scatter, np.sqrt(np.sum((theta_i * errors) ** 2)) / spread))
