"""What a measurement needs of hardware: Protocols that any class with these methods fulfils, and the bench of them.

Nothing here is a driver. A class of ten lines about a laboratory's own library is one; those of `drivers` are about
PyMeasure. Whatever a device raises is a failed attempt: it is tried again, then the measurement ends with the shutter
closed.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, runtime_checkable

from gonio.acquisition.plan import Step
from gonio.outside import printable

UNITS = ("W", "A", "V", "counts")
BEAM = 180.0  # deg from the source: the arm in the direct beam


class DeviceError(OSError):
    """A device did not do what it was told; one line with its name and what it said or reached."""


class Reading(NamedTuple):
    """What a detector read: mean and standard deviation of so many samples, in its unit, in a range.

    range: the largest signal of the range. overload: whether a sample reached it. temperature: of the detector [degC].
    """

    value: float
    sd: float
    samples: int
    unit: str
    range: float
    overload: bool = False
    temperature: float = math.nan


@runtime_checkable
class Axis(Protocol):
    """A rotation stage. `move` returns when it has settled, or raises."""

    name: str
    limits: tuple[float, float]

    def position(self) -> float:
        """Where it is [deg], read back from the device."""
        ...

    def move(self, to: float) -> None:
        """Go to a position [deg]."""
        ...


@runtime_checkable
class Detector(Protocol):
    """A power meter, a photocurrent amplifier, a lock-in. It keeps the range that it is given."""

    unit: str
    ranges: Sequence[float]  # the largest signal of each range, from the most sensitive on

    def read(self, seconds: float) -> Reading:
        """The mean over a time [s]."""
        ...

    def set_range(self, largest: float) -> None:
        """Take the range of that largest signal, one of `ranges`."""
        ...


@runtime_checkable
class Shutter(Protocol):
    """What lets the light through. Its connection should be its own: it is closed while others may hang."""

    @property
    def is_open(self) -> bool:
        """Read back from the device where that can be."""
        ...

    def open(self) -> None:
        """Let light through."""
        ...

    def close(self) -> None:
        """Let none through; it may be closed already."""
        ...


@runtime_checkable
class Selector(Protocol):
    """What has several positions by name: filters in the beam, or what lies in the sample's place."""

    names: Sequence[str]

    def select(self, name: str) -> None:
        """Go to one of `names`."""
        ...


@runtime_checkable
class Filter(Selector, Protocol):
    """Filters, of which the transmittance is known; `select("")` takes all of them out of the beam."""

    def transmittance(self, name: str) -> tuple[float, float]:
        """Of one filter at the wavelength in use, with its standard uncertainty."""
        ...


class Clock(Protocol):
    """Time as the measurement sees it."""

    def utc(self) -> float:
        """Seconds since 1970 (Unix time)."""
        ...

    def monotonic(self) -> float:
        """Seconds from any moment on."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...


class SystemClock:
    """The time of this machine."""

    def utc(self) -> float:
        """Seconds since 1970."""
        return time.time()

    def monotonic(self) -> float:
        """Seconds that no setting of the clock changes."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)


class Stage(Protocol):
    """Axes, and how their positions and the directions of light depend on each other."""

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The axes by name."""
        ...

    def positions(self, step: Step) -> dict[str, float]:
        """Where the axes go for a step [deg], in the order in which they move; ValueError where they cannot."""
        ...

    def direction(self, positions: Mapping[str, float]) -> tuple[float, float, float]:
        """theta_i, theta_r (from 0 on) and phi [deg] of positions that were read back."""
        ...


@dataclass(frozen=True)
class InPlane:
    """A fixed source, a table that turns the sample, and an arm that turns the detector about it (guo2023, Fig 4).

    With the table at a and the arm at b from the source, theta_i = a - a0 and theta_r = (b - b0) - (a - a0), signed.
    tolerance [deg]: by how much a position may miss; a table nearer than that to the normal counts as theta_i = 0.
    """

    table: Axis
    arm: Axis
    table_zero: float = 0.0
    arm_zero: float = 0.0
    tolerance: float = 0.05

    @property
    def axes(self) -> Mapping[str, Axis]:
        """The two axes."""
        return {"table": self.table, "arm": self.arm}

    def positions(self, step: Step) -> dict[str, float]:
        """The table first, since it is slow; ValueError for a direction out of the plane."""
        if step.kind == "dark":
            return {}
        if step.kind == "incident":
            return {"arm": BEAM + self.arm_zero}
        theta_i, theta_r, phi = step.direction
        if math.remainder(phi, 180.0) and theta_r:
            raise ValueError(f"the step {step} lies out of the plane of incidence, and this stage has no axis for that")
        signed = theta_r if math.remainder(phi, 360.0) else -theta_r
        return {"table": theta_i + self.table_zero, "arm": theta_i + signed + self.arm_zero}

    def direction(self, positions: Mapping[str, float]) -> tuple[float, float, float]:
        """In plane, with phi 180 on the forward side and 0 on that of the source."""
        theta_i = positions["table"] - self.table_zero
        theta_r = positions["arm"] - self.arm_zero - theta_i
        if abs(theta_i) <= self.tolerance:
            theta_i = max(theta_i, 0.0)
        if theta_i < 0:  # the other side of the normal: forward is where theta_r is negative
            theta_i, theta_r = -theta_i, -theta_r
        return theta_i, abs(theta_r), 180.0 if theta_r >= 0 else 0.0


@dataclass
class Bench:
    """The devices of a measurement, and what is known of the instrument.

    instrument: plain data for the journal's head and the attributes of the readings: `aperture_radius`, `distance`,
    `field_of_view` [mm], `fill`, `standard`, `operator`, whatever is stated.
    """

    stage: Stage
    detector: Detector
    shutter: Shutter
    monitor: Detector | None = None
    filters: Filter | None = None
    targets: Selector | None = None
    instrument: Mapping[str, Any] = field(default_factory=dict)
    clock: Clock = field(default_factory=SystemClock)
    tolerance: float = 0.05  # deg, by which a position read back may miss

    def devices(self) -> dict[str, Any]:
        """Every device by what it is called in messages."""
        named = {"detector": self.detector, "shutter": self.shutter, "monitor": self.monitor}
        named |= {"filter": self.filters, "target": self.targets, **self.stage.axes}
        return {name: device for name, device in named.items() if device is not None}

    def refuse(self, steps: Sequence[Step]) -> None:
        """ValueError, before anything moves, where this bench cannot take a step."""
        for step in steps:
            for name, to in self.stage.positions(step).items():
                low, high = self.stage.axes[name].limits
                if not low <= to <= high:
                    raise ValueError(
                        f"the step {step} moves the {name} to {to:g} deg, outside {low:g} to {high:g}: plan without it"
                    )
            for kind, target in (("standard", "standard"), ("background", "trap"), ("incident", "none")):
                if step.kind == kind and not (self.targets and target in self.targets.names):
                    raise ValueError(
                        f"the plan has steps of {kind}, and this bench has no target {target!r}: "
                        "name targets in the bench, or plan without"
                    )

    def refuse_filter(self, name: str) -> None:
        """ValueError where the bench has no filter of that name; an empty one is none."""
        if name and not (self.filters and name in self.filters.names):
            known = ", ".join(self.filters.names) if self.filters else "none"
            raise ValueError(
                f"the plan has the filter {printable(name)!r}, and this bench has {known}: mend one of them"
            )

    def described(self, filter_name: str) -> dict[str, Any]:
        """What is known of the instrument, with the transmittance of one filter: what a journal's head holds."""
        known = dict(self.instrument)
        if self.filters is not None and filter_name:
            tau, u = self.filters.transmittance(filter_name)
            known |= {"filter_transmittance": tau, "filter_transmittance_uncertainty": u}
        return known

    def close_shutter(self) -> None:
        """Close the shutter, whatever else goes on; DeviceError where it stays open.

        It may be called by the thread that ends the program, while the main thread is stopped anywhere.
        """
        said = ""
        for _ in range(3):
            try:
                self.shutter.close()
                if not self.shutter.is_open:
                    return
            except Exception as error:  # what a driver raises is its own
                said = f" ({type(error).__name__}: {printable(str(error))})"
                reconnect(self.shutter)
        raise DeviceError(f"THE SHUTTER MAY BE OPEN: it does not say that it is closed{said}; close it by hand")


def reconnect(device: Any) -> None:
    """Have a device that can do so open its connection anew; what that raises says nothing new."""
    again = getattr(device, "reconnect", None)
    if again is not None:
        try:
            again()
        except Exception:  # the next call says it
            return
