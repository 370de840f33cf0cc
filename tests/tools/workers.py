"""Processes that read damaged files one after another, and their parent, which outlives whatever a reader does."""

import gc
import json
import mmap
import os
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from outcomes import LONGEST, TooLong, attempt
from seeds import damaged, put, seeds

STUCK = 20.0  # s without a sign of life, after which a worker is ended
SLOW_START = 100.0  # s for a worker to start and to make its seeds
MOST_MEMORY = 200.0  # MB that reading one file may take
ADDRESSES = 4 * 2**30  # bytes of address space beyond what a worker starts with: a reader must not take the machine


@dataclass
class Tally:
    """What became of a format's inputs; `reached` counts those that were still recognised as this format."""

    inputs: int = 0
    reached: int = 0
    read: int = 0
    refused: int = 0
    slowest: float = 0.0  # s
    peak: float = 0.0  # MB
    failures: list[dict[str, Any]] = field(default_factory=list)

    def add(self, other: dict[str, Any]) -> None:
        for name in ("inputs", "reached", "read", "refused"):
            setattr(self, name, getattr(self, name) + other[name])
        self.slowest, self.peak = max(self.slowest, other["slowest"]), max(self.peak, other["peak"])
        self.failures += other["failures"]


class Memory:
    """The growth of peak memory [MB] over one file, by resetting the kernel's high-water mark where it allows that."""

    def __init__(self) -> None:
        try:
            self._reset: Any = Path("/proc/self/clear_refs").open("wb", buffering=0)  # noqa: SIM115 - as long as this
            self._reset.write(b"5")
        except OSError:
            self._reset = None
        self.start()

    @staticmethod
    def _peak() -> float:
        kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return kilobytes / (2**20 if sys.platform == "darwin" else 2**10)

    def start(self) -> None:
        if self._reset:
            self._reset.write(b"5")
        self._before = self._peak()

    def grown(self) -> float:
        return self._peak() - self._before


def _alarm(*_: Any) -> None:
    raise TooLong


def _limit_addresses() -> None:
    """Cap the address space, so that a reader that allocates what a file promises fails before the machine does."""
    try:
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + ADDRESSES, taken + ADDRESSES))
    except (OSError, ValueError):
        pass  # where the system has no such limit, the parent and the memory count remain


class Worker:
    """Does jobs in its own process; `sign` is shared with the parent and holds the number of the input at work."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with (folder / "sign").open("r+b") as file:
            self.sign = mmap.mmap(file.fileno(), 8)
        self.ignored: list[str] = []
        sys.unraisablehook = lambda found: self.ignored.append(f"{type(found.exc_value).__name__}: {found.exc_value}")
        warnings.simplefilter("error")
        signal.signal(signal.SIGPROF, _alarm)
        _limit_addresses()
        self.memory = Memory()

    def one(self, name: str, seed: int, number: int, tally: Tally) -> None:
        struct.pack_into("q", self.sign, 0, number)
        made, done = damaged(name, seed, number)
        path = put(made, self.folder)
        del made
        self.ignored.clear()
        self.memory.start()
        self.longest, self.begun = 0.0, time.process_time()
        try:
            self.begin()
            try:
                outcome, why, reached = attempt(path, name, self.begin)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
        except TooLong:  # the alarm rang between the reader's return and here
            outcome, why, reached = "failed", f"takes over {LONGEST:g} s", True
        seconds, grown = max(self.longest, time.process_time() - self.begun), self.memory.grown()
        if outcome != "failed":
            if grown > MOST_MEMORY:
                outcome, why = "failed", f"takes {grown:.0f} MB"
            elif seconds > LONGEST:
                outcome, why = "failed", f"takes {seconds:.1f} s"
            elif self.ignored:
                outcome, why = "failed", self.ignored[0][:200]
        tally.inputs += 1
        tally.reached += reached
        tally.read += outcome == "read"
        tally.refused += outcome == "refused"
        tally.slowest, tally.peak = max(tally.slowest, seconds), max(tally.peak, grown)
        if outcome == "failed":
            tally.failures.append({"number": number, "done": done, "why": why})

    def begin(self) -> None:
        """Give the next door its own seconds. The alarm rings again, because whoever hears it may not raise it."""
        self.longest = max(self.longest, time.process_time() - self.begun)
        self.begun = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, LONGEST, LONGEST / 10)

    def serve(self) -> None:
        answers, sys.stdout = sys.stdout, sys.stderr  # what a reader prints must not pass for an answer
        for line in sys.stdin:
            job = json.loads(line)
            seeds(job["format"])
            tally = Tally()
            for number in range(job["first"], job["last"]):
                self.one(job["format"], job["seed"], number, tally)
            self.ignored.clear()
            gc.collect()  # files that only a cycle kept open say so now
            if self.ignored:
                tally.failures.append(
                    {"number": job["last"] - 1, "done": [], "why": f"by then {self.ignored[0][:200]}"}
                )
            print(json.dumps(vars(tally)), file=answers, flush=True)


class Process:
    """A worker as its parent sees it: started anew when it hangs or dies, and the input at fault is a failure."""

    def __init__(self) -> None:
        room = Path("/dev/shm")
        self.folder = Path(tempfile.mkdtemp(prefix="gonio-fuzz-", dir=room if room.is_dir() else None))
        (self.folder / "sign").write_bytes(bytes(8))
        with (self.folder / "sign").open("r+b") as file:
            self.sign = mmap.mmap(file.fileno(), 8)
        self.process: subprocess.Popen[str] | None = None

    def _start(self) -> subprocess.Popen[str]:
        program = Path(__file__).with_name("fuzzing.py")
        one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        with (self.folder / "errors").open("w") as errors:
            return subprocess.Popen(
                [sys.executable, "-X", "faulthandler", program, "--worker", self.folder],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=os.environ | one_thread | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )

    def _at_work(self) -> int:
        return int(struct.unpack("q", self.sign[:])[0])

    def run(self, name: str, seed: int, first: int, last: int) -> Iterator[Tally]:
        """The tallies of inputs `first` to `last`, one for each stretch that a worker did without dying.

        Raises RuntimeError with the worker's last words where it dies before the first input.
        """
        while first < last:
            self.process = self.process or self._start()
            self.sign[:] = struct.pack("q", first - 1)
            job = {"format": name, "seed": seed, "first": first, "last": last}
            assert self.process.stdin is not None
            print(json.dumps(job), file=self.process.stdin, flush=True)
            if said := self._answer(first - 1):
                tally = Tally()
                tally.add(json.loads(said))
                yield tally
                return
            culprit, words = self._at_work(), self._end()
            if culprit < first:
                raise RuntimeError(f"no worker for {name}: {words}")
            yield from self.run(name, seed, first, culprit)
            failure = {"number": culprit, "done": damaged(name, seed, culprit)[1], "why": words}
            yield Tally(inputs=1, reached=1, failures=[failure])
            first = culprit + 1

    def _answer(self, before: int) -> str:
        """The worker's line, or nothing where it died or shows no sign of life."""
        assert self.process is not None
        assert self.process.stdout is not None
        at, since = self._at_work(), time.monotonic()
        while True:
            if select.select([self.process.stdout], [], [], 0.5)[0]:
                return self.process.stdout.readline()
            if self._at_work() != at:
                at, since = self._at_work(), time.monotonic()
            elif time.monotonic() - since > (SLOW_START if at == before else STUCK):
                return ""

    def _end(self) -> str:
        """End the worker; what it died of, or that it had to be ended."""
        assert self.process is not None
        try:
            code = self.process.wait(timeout=1)
            words = (self.folder / "errors").read_text(errors="replace").strip().splitlines()
            fatal = next((line for line in words if line.startswith("Fatal")), words[-1] if words else "")
            found = f"the process ends with {code}: {fatal[:200]}"
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            found = f"no end after {STUCK:g} s"
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()
        self.process = None
        return found

    def close(self) -> None:
        if self.process:
            self.process.kill()
            self._end()
        self.sign.close()
        shutil.rmtree(self.folder, ignore_errors=True)
