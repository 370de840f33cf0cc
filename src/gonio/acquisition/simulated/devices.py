"""The devices of the simulated bench: a clock that need not wait, axes, shutter, detector, and what goes wrong."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gonio.acquisition.device import DeviceError, Reading
from gonio.acquisition.simulated.light import WARM_UP, Laser
from gonio.options import one_of

FAULTS = {
    "stall": "a move stops half way, and the axis says so",
    "miss": "a move ends half a degree away, and the axis says nothing",
    "lost": "the detector's connection is lost",
    "nan": "the detector reads what is no number",
    "overload": "the detector is overloaded",
    "interrupt": "somebody presses Ctrl-C during a reading",
    "stuck": "the shutter does not close",
}
ELEMENTARY_CHARGE, BOLTZMANN = 1.602176634e-19, 1.380649e-23  # C, J/K (exact)
START = 1_767_225_600.0  # s since 1970: the first moment of 2026


@dataclass(frozen=True)
class Fault:
    """What goes wrong, one of FAULTS, at which of its occasions (counted from 1), and how often from then on."""

    what: str
    at: int = 1
    times: int = 1

    def __post_init__(self) -> None:
        if self.what not in FAULTS or self.at < 1 or self.times < 1:
            raise ValueError(f"the fault {self.what!r} at {self.at}, {self.times} times: give {one_of(FAULTS)}, from 1")


@dataclass
class Faults:
    """Counts the occasions of each fault, and says when it is time."""

    planned: Sequence[Fault] = ()
    counted: dict[str, int] = field(default_factory=dict)

    def now(self, what: str) -> bool:
        """Whether this occasion is one at which it goes wrong."""
        self.counted[what] = count = self.counted.get(what, 0) + 1
        return any(f.what == what and f.at <= count < f.at + f.times for f in self.planned)


@dataclass
class SimulatedClock:
    """A clock on which no time passes but what is waited for; with `is_real` it is waited for in fact.

    start: in seconds since 1970.
    """

    start: float = START
    is_real: bool = False
    elapsed: float = 0.0

    def utc(self) -> float:
        """Seconds since 1970."""
        return self.start + self.elapsed

    def monotonic(self) -> float:
        """Seconds since the clock was made."""
        return self.elapsed

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        if self.is_real:
            time.sleep(seconds)
        self.elapsed += seconds


@dataclass
class SimulatedAxis:
    """A stage with a speed [deg/s], whose encoder has a resolution [deg]."""

    name: str
    clock: SimulatedClock
    faults: Faults
    limits: tuple[float, float] = (-200.0, 200.0)
    speed: float = 10.0
    resolution: float = 0.001
    true: float = 0.0

    def position(self) -> float:
        """The true position by the steps of the encoder."""
        return round(self.true / self.resolution) * self.resolution

    def move(self, to: float) -> None:
        """Go there, which takes time."""
        if not self.limits[0] <= to <= self.limits[1]:
            raise DeviceError(f"{to:g} deg is beyond its limits")
        if self.faults.now("stall"):
            self.true = (self.true + to) / 2
            raise DeviceError(f"stalled at {self.true:.3f} deg on its way to {to:.3f}")
        self.clock.sleep(abs(to - self.true) / self.speed)
        self.true = to + 0.5 * self.faults.now("miss")


@dataclass
class SimulatedShutter:
    """A shutter that says whether it is open."""

    faults: Faults
    is_open: bool = False

    def open(self) -> None:
        """Let light through."""
        self.is_open = True

    def close(self) -> None:
        """Let none through, unless it is stuck."""
        self.is_open = self.is_open and self.faults.now("stuck")


@dataclass
class SimulatedSelector:
    """Filters or targets by name."""

    names: Sequence[str]
    taus: dict[str, tuple[float, float]] = field(default_factory=dict)
    at: str = ""

    def select(self, name: str) -> None:
        """Go there."""
        if name and name not in self.names:
            raise DeviceError(f"has no {name!r}")
        self.at = name

    def transmittance(self, name: str) -> tuple[float, float]:
        """What is stated of a filter."""
        return self.taus[name]


@dataclass(frozen=True, kw_only=True)
class Electronics:
    """A photodiode and its amplifier, in units of the power that it shows [W].

    ranges: the largest signal of each. responsivity [A/W]. bandwidth [Hz]. rin: noise of the light relative to it, at
    that bandwidth. bits: of the converter. dark, dark_slope [W/h], dark_noise: the dark signal, its drift, and the
    standard deviation of its wandering with the correlation time of hours. offset: of a range, relative to its largest
    signal; ratio: error of a range's gain, relative; both are standard deviations, and drawn once for each range.
    nonlinearity: a in R(P) = P (1 + a log10(P/P0)), with P0 = 1 uW.
    """

    ranges: tuple[float, ...] = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4)
    responsivity: float = 0.4
    bandwidth: float = 15.0
    rin: float = 1e-4
    bits: int = 16
    dark: float = 2e-12
    dark_slope: float = 1e-13
    dark_noise: float = 1e-13
    dark_hours: float = 1.0
    offset: float = 1e-5
    ratio: float = 0.0
    nonlinearity: float = 0.0
    sample_time: float = 0.03
    temperature: float = 25.0


class Wandering:
    """A value that wanders about zero with a standard deviation and a correlation time [s] (Ornstein-Uhlenbeck)."""

    def __init__(self, sd: float, correlation: float, rng: np.random.Generator) -> None:
        self._sd, self._correlation, self._rng = sd, correlation, rng
        self._last, self._value = 0.0, sd * float(rng.standard_normal())

    def at(self, moment: float) -> float:
        """Its value at a moment [s], which is never before the last one that was asked for."""
        kept = math.exp(-max(moment - self._last, 0.0) / self._correlation)
        self._value = kept * self._value + self._sd * math.sqrt(1 - kept**2) * float(self._rng.standard_normal())
        self._last = moment
        return self._value


class SimulatedMonitor:
    """A detector behind a beam splitter: the power of the source in volts, at once and without noise of its own."""

    unit = "V"
    ranges: Sequence[float] = (10.0,)

    def __init__(self, laser: Laser, power: float, clock: SimulatedClock, rng: np.random.Generator) -> None:
        self._laser, self._power, self._clock = laser, power, clock
        self._noise = Wandering(laser.noise, laser.correlation, rng)

    def source(self) -> float:
        """The power of the source at this moment [W]."""
        moment = self._clock.monotonic()
        return self._power * (1 + self._laser.warm_up * math.exp(-moment / WARM_UP)) * (1 + self._noise.at(moment))

    def read(self, seconds: float) -> Reading:
        """1 V for the nominal power."""
        self._clock.sleep(seconds / 2)
        shown = self.source() / self._power
        self._clock.sleep(seconds / 2)
        return Reading(shown, 0.0, 1, self.unit, self.ranges[0])

    def set_range(self, largest: float) -> None:
        """It has one."""


class SimulatedDetector:
    """Power into a signal with dark, noise and the limits of its range."""

    unit = "W"

    def __init__(
        self,
        electronics: Electronics,
        power: Callable[[], float],
        clock: SimulatedClock,
        faults: Faults,
        rng: np.random.Generator,
    ) -> None:
        self.ranges: Sequence[float] = electronics.ranges
        self.range = max(electronics.ranges)
        self._electronics, self._power, self._clock, self._faults, self._rng = electronics, power, clock, faults, rng
        self._dark = Wandering(electronics.dark_noise, 3600 * electronics.dark_hours, rng)
        draws = rng.standard_normal((len(electronics.ranges), 2))
        self._offsets = {
            r: electronics.offset * r * float(d) for r, d in zip(electronics.ranges, draws[:, 0], strict=True)
        }
        self._gains = {
            r: 1 + electronics.ratio * float(d) for r, d in zip(electronics.ranges, draws[:, 1], strict=True)
        }

    def set_range(self, largest: float) -> None:
        """One of `ranges`."""
        if largest not in self.ranges:
            raise DeviceError(f"has no range of {largest:g} {self.unit}")
        self.range = largest

    def read(self, seconds: float) -> Reading:
        """The mean of samples over the time."""
        if self._faults.now("lost"):
            raise ConnectionError("no answer from the detector")
        if self._faults.now("interrupt"):
            raise KeyboardInterrupt
        self._clock.sleep(seconds / 2)  # what drifts is read in the middle of the time, which is its mean
        e, moment = self._electronics, self._clock.monotonic()
        power = self._power()
        bent = power * (1 + e.nonlinearity * math.log10(power / 1e-6)) if power > 0 else 0.0
        dark = e.dark + e.dark_slope * moment / 3600 + self._dark.at(moment)
        mean = self._gains[self.range] * bent + dark + self._offsets[self.range]
        self._clock.sleep(seconds / 2)
        samples = max(int(seconds / e.sample_time), 2)
        spread = self._spread(abs(mean))
        value = mean + spread / math.sqrt(samples) * float(self._rng.standard_normal())
        sd = spread * math.sqrt(float(self._rng.chisquare(samples - 1)) / (samples - 1))
        if self._faults.now("nan"):
            value = math.nan
        if self._faults.now("overload") or value > self.range:
            return Reading(self.range, 2e-4 * spread, samples, self.unit, self.range, True, e.temperature)
        return Reading(value, sd, samples, self.unit, self.range, False, e.temperature)

    def _spread(self, signal: float) -> float:
        """The standard deviation of one sample [W]: shot noise, that of resistor, light and converter."""
        e = self._electronics
        current = e.responsivity * signal
        resistor = 2.0 / (e.responsivity * self.range)  # the largest signal gives 2 V
        step = self.range / 2**e.bits
        variance = (
            2 * ELEMENTARY_CHARGE * e.bandwidth * current
            + 4 * BOLTZMANN * (273.15 + e.temperature) * e.bandwidth / resistor
            + (e.rin * current) ** 2
        )
        return math.sqrt(variance / e.responsivity**2 + step**2 / 12)


def plain(fault: dict[str, Any]) -> Fault:
    """A fault from plain data; ValueError where it has other keys."""
    if unknown := set(fault) - {"what", "at", "times"}:
        raise ValueError(f"a fault has what, at and times, and not {', '.join(sorted(unknown))}")
    return Fault(**fault)
