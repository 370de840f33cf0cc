"""Devices that PyMeasure speaks to: a power meter, a motion controller, a lock-in amplifier, and any shutter.

Each is opened by its VISA address; further arguments go to PyMeasure's adapter, such as `visa_library`. `reconnect`
opens it anew after a lost connection. PyMeasure is MIT; it comes with the extra `gonio[instruments]`.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from pymeasure.instruments import Instrument, srs
from pymeasure.instruments.newport import ESP300, esp300
from pymeasure.instruments.thorlabs import ThorlabsPM100USB

from gonio.acquisition.device import Clock, DeviceError, Reading, SystemClock

INFINITE = 9e37  # SCPI's number for a value that is too large
FULL = 0.999  # of a range, from which a reading is taken for an overload
READING = 0.003  # s, of one internal reading of a PM100
TIME_CONSTANTS = 5  # of a lock-in, until it has settled
INPUT_OVERLOAD, FILTER_OVERLOAD, OUTPUT_OVERLOAD = 1, 2, 4  # bits of the lock-in's status


class _Opened:
    """An instrument that can be opened anew."""

    def __init__(self, clock: Clock | None, open_one: Callable[[], Any]) -> None:
        self.clock, self._open_one = clock or SystemClock(), open_one
        self.device = self._open()

    def reconnect(self) -> None:
        """Close what is left of the connection, and open another."""
        adapter = getattr(self.device, "adapter", None)
        if adapter is not None:
            adapter.close()
        self.device = self._open()

    def _open(self) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # PyMeasure asks its users which devices speak SCPI
            return self._open_one()


def _statistics(samples: Sequence[float]) -> tuple[float, float]:
    mean = math.fsum(samples) / len(samples)
    variance = math.fsum((sample - mean) ** 2 for sample in samples) / max(len(samples) - 1, 1)
    return mean, math.sqrt(variance)


class PM100(_Opened):
    """A Thorlabs power meter PM100A, PM100D or PM100USB [W], at one wavelength [nm], in fixed ranges [W].

    averages: internal readings in one sample. Autorange is off: it would step in the midst of a scan.
    """

    unit = "W"

    def __init__(
        self,
        address: str,
        wavelength: float,
        ranges: Sequence[float],
        averages: int = 10,
        clock: Clock | None = None,
        **adapter: Any,
    ) -> None:
        self.ranges = tuple(float(r) for r in ranges)
        self.range = max(self.ranges)

        def open_one() -> Any:
            device = ThorlabsPM100USB(address, **adapter)
            device.wavelength = wavelength
            if not abs(device.wavelength - wavelength) < 0.5:  # it shows W for the wavelength that it has
                raise DeviceError(f"has the wavelength {device.wavelength:g} nm, not {wavelength:g}")
            device.write("SENS:POW:RANG:AUTO 0")
            device.write(f"SENS:AVER:COUN {averages}")
            return device

        self._sample_time = averages * READING
        super().__init__(clock, open_one)
        self.set_range(self.range)

    def set_range(self, largest: float) -> None:
        """The range that holds this power; DeviceError where the meter takes a smaller one."""
        self.device.write(f"SENS:POW:RANG:UPP {largest:.6e}")
        taken = float(self.device.values("SENS:POW:RANG:UPP?")[0])
        if not taken >= FULL * largest:
            raise DeviceError(f"takes a range of {taken:g} W instead of {largest:g} W")
        self.range = largest

    def read(self, seconds: float) -> Reading:
        """Samples for so long; the first, which may have begun during a move, is not used."""
        _ = self.device.power
        samples = [float(self.device.power) for _ in range(max(round(seconds / self._sample_time), 1))]
        mean, sd = _statistics(samples)
        is_over = max(map(abs, samples)) >= FULL * self.range
        if max(map(abs, samples)) > INFINITE:
            mean, sd = self.range, 0.0
        return Reading(mean, sd, len(samples), self.unit, self.range, is_over)


class ESP300Axis(_Opened):
    """One axis of a Newport ESP300, ESP301 or compatible controller, in degrees.

    number: of the axis. limits: [deg], which must lie within those of the controller. timeout: of a move [s].
    backlash: [deg] by which a move down goes too far, so that every position is reached from below. homing: whether it
    looks for its home position when a measurement begins or goes on, which turns it freely: see that nothing is in the
    way.
    """

    def __init__(
        self,
        address: str,
        number: int,
        limits: Sequence[float] = (-170.0, 170.0),
        timeout: float = 120.0,
        backlash: float = 0.0,
        homing: bool = False,
        **adapter: Any,
    ) -> None:
        clock: Clock | None = adapter.pop("clock", None)

        self.name = f"ESP300 axis {number}"
        self.limits = (float(limits[0]), float(limits[1]))
        self._timeout, self._backlash, self._homing = timeout, backlash, homing

        def open_one() -> Any:
            device = ESP300(address, **adapter)
            self._axis = esp300.Axis(number, device)
            return device

        super().__init__(clock, open_one)

    def home(self) -> None:
        """Look for the home position, where `homing` is asked for."""
        if self._homing:
            self._axis.home()
            self._wait("home")

    def position(self) -> float:
        """As the controller reads it back."""
        return float(self._axis.position)

    def move(self, to: float) -> None:
        """Go there, from below; DeviceError where the controller says an error, or is not there in time."""
        if not self.limits[0] <= to <= self.limits[1]:
            raise DeviceError(f"{to:g} deg is outside the limits {self.limits[0]:g} to {self.limits[1]:g}")
        if self._backlash and to < self.position():
            self._go(max(to - self._backlash, self.limits[0]))
        self._go(to)

    def _go(self, to: float) -> None:
        self._axis.write(f"PA{to:.4f}")
        self._wait(f"{to:g} deg")

    def _wait(self, where: str) -> None:
        end = self.clock.monotonic() + self._timeout
        while not self._axis.motion_done:
            if self.clock.monotonic() > end:
                self._axis.write("ST")
                raise DeviceError(f"has not stopped after {self._timeout:g} s on its way to {where}")
            self.clock.sleep(0.05)
        if error := int(self.device.error):
            raise DeviceError(f"the controller says error {error} on the way to {where}")


class SR830(_Opened):
    """A lock-in amplifier SR830: its X output [V], in ranges that are its sensitivities [V]."""

    unit = "V"

    def __init__(self, address: str, ranges: Sequence[float], clock: Clock | None = None, **adapter: Any) -> None:
        self.ranges = tuple(float(r) for r in ranges)
        self.range = max(self.ranges)
        super().__init__(clock, lambda: srs.SR830(address, **adapter))
        self.set_range(self.range)

    def set_range(self, largest: float) -> None:
        """The sensitivity of that full scale, and a wait of five time constants."""
        self.device.sensitivity = largest
        if not math.isclose(float(self.device.sensitivity), largest, rel_tol=1e-3):
            raise DeviceError(f"has no sensitivity of {largest:g} V")
        self.range = largest
        self.clock.sleep(TIME_CONSTANTS * float(self.device.time_constant))
        _ = self.device.lia_status  # reading it clears what the change itself caused

    def read(self, seconds: float) -> Reading:
        """One sample a time constant, for so long; they are not independent if taken faster."""
        pause = max(float(self.device.time_constant), 1e-3)
        samples: list[float] = []
        for _ in range(max(int(seconds / pause), 1)):
            self.clock.sleep(pause)
            samples.append(float(self.device.x))
        over = INPUT_OVERLOAD | FILTER_OVERLOAD | OUTPUT_OVERLOAD
        is_over = bool(int(self.device.lia_status) & over) or max(map(abs, samples)) >= FULL * self.range
        mean, sd = _statistics(samples)
        return Reading(mean, sd, len(samples), self.unit, self.range, is_over)


class CommandShutter(_Opened):
    """A shutter that obeys two commands and answers a question; each is text that its manual gives.

    says_open: how the answer begins when the shutter is open. Its connection should be its own: it is closed while
    other devices may hang.
    """

    def __init__(
        self,
        address: str,
        open: str,
        close: str,
        query: str,
        says_open: str,
        clock: Clock | None = None,
        **adapter: Any,
    ) -> None:
        self._commands, self._query, self._says_open = (open, close), query, says_open
        super().__init__(clock, lambda: Instrument(address, "shutter", includeSCPI=False, **adapter))

    @property
    def is_open(self) -> bool:
        """What it answers."""
        return str(self.device.ask(self._query)).strip().startswith(self._says_open)

    def open(self) -> None:
        """Let light through."""
        self.device.write(self._commands[0])

    def close(self) -> None:
        """Let none through."""
        self.device.write(self._commands[1])
