"""The measurement itself: what the journal lacks of the plan, reading by reading, with the shutter closed at the end.

After a stop the axes go home, and dark and check direction are read again before anything else: drift is then known
piece by piece, and never bridged over a gap in time. Whatever fails is tried again, each attempt is a record, and when
nothing helps the measurement ends with one line; the same command goes on from there.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from gonio.acquisition.device import Bench, DeviceError, Reading, reconnect
from gonio.acquisition.journal import Journal
from gonio.acquisition.plan import DIRECTED, Plan, Step
from gonio.outside import printable
from gonio.processes.ending import unbroken, undone

ATTEMPTS = 3  # of everything that a device may fail at
PAUSE = 1.0  # s before another attempt
MONITOR_SHARE = 0.1  # of the dwell, for which the monitor is read before and after the detector
FINER = 0.3  # of a more sensitive range: a signal below that is read again in it
TARGETS = {"standard": "standard", "background": "trap", "incident": "none"}  # other kinds look at the sample

Result = TypeVar("Result")
Record = dict[str, Any]


def run(plan: Plan, bench: Bench, journal: Journal) -> Iterator[Record]:
    """Take the readings that the open journal lacks, and yield each record when it is on the disk.

    The shutter is closed when the iteration ends, however it does, and also where a signal ends the program. Raises
    ValueError, before anything moves, where the bench cannot take a step; DeviceError where a device fails ATTEMPTS
    times; OSError where the journal cannot be written.
    """
    bench.refuse(plan.steps)
    bench.refuse_filter(plan.conditions.filter)
    measurement = _Measurement(plan, bench, journal)
    with undone(bench.close_shutter):
        try:
            yield from measurement.all()
        except BaseException as error:
            bench.close_shutter()
            _note_the_end(journal, bench, error)
            raise


def _note_the_end(journal: Journal, bench: Bench, error: BaseException) -> None:
    """Say in the journal why the measurement ended, where it can still be written."""
    what = type(error).__name__ if isinstance(error, GeneratorExit | KeyboardInterrupt) else printable(str(error))
    try:
        journal.append({"event": "stopped", "t_utc": bench.clock.utc(), "note": what})
    except OSError:
        return  # the disk is full, and that is what is raised


@dataclass
class _Measurement:
    """One session of it: the state of the bench as far as it is known."""

    plan: Plan
    bench: Bench
    journal: Journal
    range: float = math.nan
    target: str = ""
    filter: str | None = None
    at: dict[str, float] = field(default_factory=dict)  # positions read back [deg]

    def all(self) -> Iterator[Record]:
        """The readings that are left, after those of a session that begins again."""
        todo = [k for k in range(len(self.plan.steps)) if k not in self.journal.content.done]
        if not todo:
            return
        again = bool(self.journal.content.records)
        session = self.journal.content.sessions
        self._do(self._close)
        self.journal.append({"event": "session", "session": session, "t_utc": self.bench.clock.utc()})
        self._begin()
        if again:
            checks = [step for step in self.plan.steps if step.kind == "check"][:1]
            for step in [Step("dark"), *checks]:
                yield from self._step(step, None, session)
        for k in todo:
            yield from self._step(self.plan.steps[k], k, session)
        self._do(self._close)
        self.journal.append({"event": "complete", "t_utc": self.bench.clock.utc()})

    def _begin(self) -> None:
        """Home the axes that can be, and take the least sensitive range, which nothing overloads."""
        for name, axis in self.bench.stage.axes.items():
            if (home := getattr(axis, "home", None)) is not None:
                self._do(home, name)
            self.at[name] = self._do(axis.position, name)
        self._take_range(max(self.bench.detector.ranges))

    def _do(self, act: Callable[[], Result], name: str = "") -> Result:
        """The result of a call of a device; after ATTEMPTS failures the DeviceError that names it."""
        said = ""
        for attempt in range(ATTEMPTS):
            if attempt:
                self.bench.clock.sleep(PAUSE)
                for device in (d for n, d in self.bench.devices().items() if n == name):
                    reconnect(device)
            try:
                return act()
            except Exception as error:  # a driver raises what it likes
                said = printable(str(error)) or type(error).__name__
                self._tell(f"{name + ': ' if name else ''}{said}")
        raise DeviceError(
            f"{name + ': ' if name else ''}{said} ({ATTEMPTS} attempts); the measurement is stopped, mend it and run "
            "the same command to go on"
        )

    def _tell(self, what: str) -> None:
        self.journal.append({"event": "failure", "t_utc": self.bench.clock.utc(), "note": what})

    def _step(self, step: Step, number: int | None, session: int) -> Iterator[Record]:
        """The records of one step; the last one has `done`."""
        about = {"step": number, "kind": step.kind, "session": session}
        if step.kind == "dark":
            self._do(self._close, "shutter")
            ranges = sorted(self.bench.detector.ranges)
            for k, largest in enumerate(ranges):
                self._take_range(largest)
                yield from self._read(about, step, fixed=True, is_last=k == len(ranges) - 1)
            return
        self._prepare(step)
        yield from self._read(about, step, fixed=False, is_last=True)

    def _prepare(self, step: Step) -> None:
        """Everything in its place, then the shutter open; closed while somebody puts another target there."""
        bench = self.bench
        if bench.targets is not None and (target := TARGETS.get(step.kind, "sample")) != self.target:
            self._do(self._close, "shutter")
            self._do(partial(bench.targets.select, target), "target")
            self.target = target
        wanted = self.plan.conditions.filter if step.kind == "incident" else ""
        if bench.filters is not None and wanted != self.filter:
            self._do(partial(bench.filters.select, wanted), "filter")
            self.filter = wanted
        moves = bench.stage.positions(step)
        if any(abs(self.at[name] - to) > bench.tolerance for name, to in moves.items()):
            for name, to in moves.items():
                self._do(partial(self._move, name, to), name)
            bench.clock.sleep(self.plan.conditions.settle)
        self._do(self._open, "shutter")

    def _close(self) -> None:
        with unbroken():
            self.bench.close_shutter()

    def _open(self) -> None:
        with unbroken():
            self.bench.shutter.open()
        if not self.bench.shutter.is_open:
            raise DeviceError("does not open")

    def _move(self, name: str, to: float) -> None:
        """Move an axis and read its position back: a stage that misses says nothing by itself."""
        axis = self.bench.stage.axes[name]
        axis.move(to)
        self.at[name] = axis.position()
        if not abs(self.at[name] - to) <= self.bench.tolerance:  # not a number either
            raise DeviceError(f"is at {self.at[name]:.4f} deg instead of {to:.4f}")

    def _take_range(self, largest: float) -> None:
        if largest != self.range:
            self._do(partial(self.bench.detector.set_range, largest), "detector")
            self.range = largest

    def _read(self, about: Record, step: Step, fixed: bool, is_last: bool) -> Iterator[Record]:
        """Readings until one is good: an overload is repeated in a larger range, a weak signal in a finer one.

        fixed: the range stays. A signal that overloads the largest range is kept with its flag.
        """
        ranges = sorted(self.bench.detector.ranges)
        failures, attempt, was_over = 0, 0, 0.0
        while True:
            reading, monitor, note = self._attempt()
            is_good = not note
            larger = [r for r in ranges if r > self.range]
            finer = [r for r in ranges if was_over < r < self.range and abs(reading.value) < FINER * r]
            to = self.range
            if is_good and not fixed and reading.overload and larger:
                to, note, was_over = larger[0], "overload: again in a larger range", self.range
            elif is_good and not fixed and not reading.overload and finer:
                to, note = finer[0], "weak: again in a finer range"
            is_done = is_good and to == self.range
            yield self.journal.append(
                about
                | self._record(step, reading, monitor, attempt, note)
                | {"failed": not is_good, "done": is_done and is_last}
            )
            if is_done:
                return
            attempt += 1
            failures += not is_good
            if failures >= ATTEMPTS:
                raise DeviceError(
                    f"detector: {note} ({ATTEMPTS} attempts at the step {step}); the measurement is stopped, mend it "
                    "and run the same command to go on"
                )
            if not is_good:
                self.bench.clock.sleep(PAUSE)
                reconnect(self.bench.detector)
                self.range, to = math.nan, self.range  # a device that was connected anew has a range of its own
            self._take_range(to)

    def _attempt(self) -> tuple[Reading, float, str]:
        """One reading with its monitor, the mean of before and after; and what is wrong with it."""
        dwell = self.plan.conditions.dwell
        nothing = Reading(math.nan, math.nan, 0, self.bench.detector.unit, self.range)
        try:
            before = self._monitor(dwell)
            reading = self.bench.detector.read(dwell)
            monitor = (before + self._monitor(dwell)) / 2
        except Exception as error:  # a driver raises what it likes
            return nothing, math.nan, printable(str(error)) or type(error).__name__
        if not math.isfinite(reading.value):
            return reading, monitor, f"the reading is {reading.value}, not a number"
        if self.bench.monitor is not None and not math.isfinite(monitor):
            return reading, monitor, "the monitor's reading is not a number"
        return reading, monitor, ""

    def _monitor(self, dwell: float) -> float:
        return math.nan if self.bench.monitor is None else self.bench.monitor.read(MONITOR_SHARE * dwell).value

    def _record(self, step: Step, reading: Reading, monitor: float, attempt: int, note: str) -> Record:
        bench = self.bench
        direction = bench.stage.direction(self.at) if step.kind in DIRECTED else None
        return {
            "t_utc": bench.clock.utc(),
            "t_mono": bench.clock.monotonic(),
            "stage": dict(self.at),
            "direction": direction,
            "value": reading.value,
            "sd": reading.sd,
            "n": reading.samples,
            "unit": reading.unit,
            "range": reading.range,
            "dwell": self.plan.conditions.dwell,
            "filter": self.filter or "",
            "target": self.target,
            "overload": reading.overload,
            "monitor": monitor,
            "temperature": reading.temperature,
            "shutter": "open" if step.kind != "dark" else "closed",
            "attempt": attempt,
            "note": note,
        }
