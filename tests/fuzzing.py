"""Damaged and hostile files of every format, by the hundred thousand: `make fuzz` writes docs/fuzzing.md.

A file is read as users read it, with `gonio.read`, in a process of its own. Good outcomes are a Dataset that is valid,
and a FormatError of one line that names the file and a place in it. Anything else is a failure: another exception, a
warning, a Dataset with an angle out of range, more than 2 s of processor time or 200 MB of memory. Each input follows
from seed and number alone, so that a failure can be made again: `--only NUMBER`.
"""

import argparse
import functools
import gc
import importlib
import json
import mmap
import os
import pkgutil
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

import gonio
from gonio.files import FormatError
from gonio.measured import formats as registry
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import DIRECTIONS, HORIZON, SETS, unit

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))  # as pytest does, also for a program

import samples  # noqa: E402
from mutations import choice, mutated  # noqa: E402

SHARED = ROOT.parent / "shared" / "data" / "files"
RECORD, PAGE = ROOT / "benchmarks" / "fuzzing.json", ROOT / "docs" / "fuzzing.md"
INPUTS = 200_000
LONGEST = 2.0  # s of processor time for one file
STUCK = 20.0  # s without a sign of life, after which a worker is ended
MOST_MEMORY = 200.0  # MB that reading one file may take
ADDRESSES = 4 * 2**30  # bytes of address space beyond what a worker starts with: a reader must not take the machine
CHUNK = 500  # inputs that a worker does at a stretch
LONGEST_MESSAGE = 1000
EASY = 20_000  # bytes; a file that is larger is drawn less often, and gets fewer inputs in a quick run
SAVED = 3  # failing inputs kept of one kind
ALLOWED = ("is empty", "no such file", "is a directory", "is not a regular file")  # these have no place


@dataclass(frozen=True)
class Seed:
    """A valid file, or a directory of files; the name of a single file's content is empty."""

    name: str
    files: dict[str, bytes]

    @property
    def size(self) -> int:
        return sum(map(len, self.files.values()))


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


# Seeds


def modules() -> dict[str, str]:
    """The module of every format, by the format's name."""
    found = {}
    for module in pkgutil.iter_modules(registry.__path__):
        contents = vars(importlib.import_module(f"{registry.__name__}.{module.name}"))
        found |= {f.name: module.name for f in registry.formats().values() if f in contents.values()}
    return found


def _content(path: Path) -> Seed:
    if path.is_dir():
        return Seed(
            path.name, {str(p.relative_to(path)): p.read_bytes() for p in sorted(path.rglob("*")) if p.is_file()}
        )
    return Seed(path.name, {"": path.read_bytes()})


@functools.cache
def _real_files() -> list[tuple[str, Path]]:
    """Every file beside the project with the format that it is recognised as."""
    found = []
    for path in sorted(p for p in SHARED.rglob("*") if p.is_file()):
        try:
            found.append((registry.recognise(path).name, path))
        except FormatError:
            continue
    return found


@functools.lru_cache(maxsize=1)  # a format may have 35 MB of them
def seeds(name: str) -> list[Seed]:
    """The valid files of a format: its samples, and the real ones beside the project."""
    module = modules()[name]
    found = []
    if any(entry.name == module for entry in pkgutil.iter_modules(samples.__path__)):
        with tempfile.TemporaryDirectory() as folder:
            written = importlib.import_module(f"samples.{module}").samples(Path(folder))
            found = [_content(path) for path in written if registry.recognise(path).name == name]
    # Of what any file is recognised as, because it has no signature, not every file is a sample.
    real = (
        [path for kind, path in _real_files() if kind == name] if registry.formats()[name].rank < registry.LAST else []
    )
    found += [_content(path) for path in real]
    if not found:
        raise LookupError(
            f"no file to damage: write tests/samples/{module}.py, whose samples(folder) writes {name} files"
        )
    return found


def damaged(name: str, seed: int, number: int) -> tuple[Seed, list[str]]:
    """Input `number` of a format, and what was done to the file that it comes from."""
    rng = np.random.default_rng((seed, number))
    known = seeds(name)
    weights = [1.0 / max(s.size, EASY // 10) for s in known]
    chosen, other = (known[choice(rng, weights)] for _ in range(2))
    part = list(chosen.files)[int(len(chosen.files) * rng.random())]
    strange = next(iter(other.files.values()))
    data, done = mutated(rng, chosen.files[part], strange)
    files: dict[str, Any] = {**chosen.files, part: data}
    if part and rng.random() < 0.05:
        del files[part]
        done = [f"without {part}"]
    return Seed(chosen.name, files), [chosen.name, *done]


def put(made: Seed, folder: Path) -> Path:
    """Write an input; what was there is unlinked first, because a Dataset may still be mapped onto it."""
    path = folder / made.name
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    for name, data in made.files.items():
        target = path / name if name else path
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            file.write(data)
    if not made.files:
        path.mkdir()
    return path


# Outcomes


def wrong_with_dataset(scan: Any) -> str:
    """What is wrong with a Dataset that a reader returned; empty where nothing is."""
    if missing := [n for n in ("brdf", *DIRECTIONS[:3]) if n not in scan.variables]:
        return f"has no {missing}"
    unit(scan)
    brdf = scan["brdf"]
    if brdf.dtype.kind != "f" or np.isinf(brdf.values).any():
        return f"brdf is infinite, or {brdf.dtype}"
    finite = np.isfinite(brdf.values)
    if not brdf.values[finite].any():
        return "no value of brdf is there and not zero"
    for name in (n for n in DIRECTIONS if n in scan.coords):
        angle = scan[name]
        if not set(angle.dims) <= set(brdf.dims):
            return f"{name} is over {angle.dims}, brdf over {brdf.dims}"
        low, high = (0.0, HORIZON) if name.startswith("theta") else (-np.inf, np.inf)
        good = np.isfinite(angle.values) & (angle.values >= low) & (angle.values <= high)
        if not good.all() and not _over(good, angle.dims, brdf)[finite].all():
            return f"{name} is not finite, or not within {low:g} to {high:g}, where brdf is finite"
    return _wrong_with_axes(scan) or _wrong_with_rest(scan)


def _over(values: Any, dims: tuple, brdf: Any) -> Any:
    """Values over some dimensions of brdf, spread over all of them."""
    order = [d for d in brdf.dims if d in dims]
    turned = np.transpose(values, [dims.index(d) for d in order])
    return np.broadcast_to(turned.reshape([brdf.sizes[d] if d in dims else 1 for d in brdf.dims]), brdf.shape)


def _wrong_with_axes(scan: Any) -> str:
    axes = {a for system in SYSTEMS.values() for a in system.axes}
    for dim in scan["brdf"].dims:
        if dim in axes and dim in scan.coords:
            values = scan[dim].values
            if not np.isfinite(values).all() or len(np.unique(values)) < len(values):
                return f"the axis {dim} has gaps or repeats"
        elif dim != "direction" and dim not in SETS and dim not in axes:
            return f"brdf has the strange dimension {dim}"
    return ""


def _wrong_with_rest(scan: Any) -> str:
    if "wavelength" in scan.coords:
        wavelength = scan["wavelength"].values.astype(float)
        if not (np.isfinite(wavelength) & (wavelength > 0)).all():
            return "a wavelength is not finite and positive"
    for name in ("uncertainty", "uncertainty_systematic"):
        if name in scan and np.isinf(scan[name].values.astype(float)).any():
            return f"{name} is infinite"
    return ""


def wrong_with_error(error: FormatError, path: Path) -> str:
    """What is wrong with a refusal; empty where it names the file and a place in one line that can be printed."""
    text = str(error)
    if str(path) not in text:
        return "does not name the file"
    if not text.isprintable():
        return "is not one line of printable characters"
    if len(text) > LONGEST_MESSAGE + len(str(path)):
        return f"is {len(text)} characters long"
    if not error.where.startswith(("line ", "byte ")) and not any(words in text for words in ALLOWED):
        return f"names no place (where is {error.where!r})"
    return ""


class TooLong(BaseException):
    """The alarm; no `except Exception` of a reader catches it."""


def attempt(path: Path, name: str) -> tuple[str, str, bool]:
    """Read a file: read, refused or failed; why; and whether it was recognised as the format `name`."""
    reached = False
    try:
        found = registry.recognise(path)
        reached = found.name == name
        scan = gonio.read(path)
        wrong = wrong_with_dataset(scan)
        return ("failed", f"Dataset of {found.name}: {wrong}", reached) if wrong else ("read", "", reached)
    except FormatError as error:
        wrong = wrong_with_error(error, path)
        text = str(error).replace(str(path), "FILE")[:200]
        return ("failed", f"FormatError {wrong}: {text!r}", reached) if wrong else ("refused", "", reached)
    except TooLong as error:
        return "failed", f"takes over {LONGEST:g} s at {_last_lines(error)}", reached
    except Exception as error:
        return "failed", f"{type(error).__name__} at {_last_lines(error)}: {str(error)[:160]!r}", reached


def _last_lines(error: BaseException) -> str:
    """The last places in gonio that an error came through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if f"{os.sep}gonio{os.sep}" in f.filename] or frames
    return " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in reversed(ours[-2:]))


# The worker's side: one process that reads jobs from standard input and says what came of each


class Memory:
    """The growth of peak memory [MB] over one file, by resetting the kernel's high-water mark where it allows that."""

    def __init__(self) -> None:
        try:
            self._reset: Any = open("/proc/self/clear_refs", "wb", buffering=0)  # noqa: SIM115 - for the process's life
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
        started = time.process_time()
        try:
            signal.setitimer(signal.ITIMER_PROF, LONGEST)
            try:
                outcome, why, reached = attempt(path, name)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
        except TooLong:  # the alarm rang between the reader's return and here
            outcome, why, reached = "failed", f"takes over {LONGEST:g} s", True
        seconds, grown = time.process_time() - started, self.memory.grown()
        if outcome != "failed":
            if grown > MOST_MEMORY:
                outcome, why = "failed", f"takes {grown:.0f} MB"
            elif self.ignored:
                outcome, why = "failed", self.ignored[0][:200]
        tally.inputs += 1
        tally.reached += reached
        tally.read += outcome == "read"
        tally.refused += outcome == "refused"
        tally.slowest, tally.peak = max(tally.slowest, seconds), max(tally.peak, grown)
        if outcome == "failed":
            tally.failures.append({"number": number, "done": done, "why": why})

    def serve(self) -> None:
        for line in sys.stdin:
            job = json.loads(line)
            tally = Tally()
            for number in range(job["first"], job["last"]):
                self.one(job["format"], job["seed"], number, tally)
            gc.collect()  # files that only a cycle kept open say so now
            print(json.dumps(vars(tally)), flush=True)


# The parent's side


class Process:
    """A worker as its parent sees it: started anew when it hangs or dies, and the input at fault is a failure."""

    def __init__(self) -> None:
        room = Path("/dev/shm")
        self.folder = Path(tempfile.mkdtemp(prefix="gonio-fuzz-", dir=room if room.is_dir() else None))
        (self.folder / "sign").write_bytes(bytes(8))
        self.process: subprocess.Popen[str] | None = None

    def _start(self) -> subprocess.Popen[str]:
        command = [sys.executable, "-X", "faulthandler", __file__, "--worker", str(self.folder)]
        surroundings = os.environ | {
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join(sys.path),
        }
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=surroundings,
        )

    def _at_work(self) -> int:
        return int(struct.unpack("q", (self.folder / "sign").read_bytes())[0])

    def run(self, name: str, seed: int, first: int, last: int) -> Iterator[Tally]:
        """The tallies of inputs `first` to `last`, one for each stretch that a worker did without dying."""
        while first < last:
            self.process = self.process or self._start()
            (self.folder / "sign").write_bytes(struct.pack("q", first - 1))
            assert self.process.stdin is not None
            print(
                json.dumps({"format": name, "seed": seed, "first": first, "last": last}),
                file=self.process.stdin,
                flush=True,
            )
            said = self._answer()
            if said:
                tally = Tally()
                tally.add(json.loads(said))
                yield tally
                return
            culprit = max(self._at_work(), first)
            code = self._end()
            yield from self.run(name, seed, first, culprit)
            why = f"the process ended with {code}" if code is not None else f"no end after {STUCK:g} s"
            yield Tally(
                inputs=1, reached=1, failures=[{"number": culprit, "done": damaged(name, seed, culprit)[1], "why": why}]
            )
            first = culprit + 1

    def _answer(self) -> str:
        """The worker's line, or nothing where it died or shows no sign of life."""
        assert self.process is not None
        assert self.process.stdout is not None
        at, since = self._at_work(), time.monotonic()
        while True:
            if select.select([self.process.stdout], [], [], 0.5)[0]:
                return self.process.stdout.readline()
            if self._at_work() != at:
                at, since = self._at_work(), time.monotonic()
            elif time.monotonic() - since > STUCK + 40 * (at < 0):
                return ""

    def _end(self) -> int | None:
        """End the worker: its exit code where it had died by itself."""
        assert self.process is not None
        try:
            code: int | None = self.process.wait(timeout=1)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            code = None
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()
        self.process = None
        return code

    def close(self) -> None:
        if self.process:
            self.process.kill()
            self._end()
        shutil.rmtree(self.folder, ignore_errors=True)


def saved(name: str, seed: int, number: int) -> Path:
    """An input as a file in the temporary folder, for a closer look."""
    folder = Path(tempfile.gettempdir()) / "gonio-fuzz" / f"{name}-{seed}-{number}"
    folder.mkdir(parents=True, exist_ok=True)
    return put(damaged(name, seed, number)[0], folder)


def kinds(failures: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Failures by what went wrong, the numbers and quotations in it left out."""
    found: dict[str, list[dict[str, Any]]] = {}
    for failure in failures:
        found.setdefault(failure["why"].split(": ", 1)[0], []).append(failure)
    return found


def report(name: str, seed: int, failures: list[dict[str, Any]]) -> str:
    """A few lines a kind of failure, with files to look at."""
    lines = []
    for found in sorted(kinds(failures).values(), key=len, reverse=True):
        lines.append(f"{name}: {len(found)} x {found[0]['why']}")
        lines += [f"    {saved(name, seed, f['number'])} ({', '.join(f['done'])})" for f in found[:SAVED]]
    return "\n".join(lines)


def fuzz(
    names: list[str], inputs: int, seed: int, workers: int, said: Callable[[str, Tally], None]
) -> dict[str, Tally]:
    """So many inputs of each format over several workers; `said` hears of every stretch."""
    jobs = [(n, first, min(first + CHUNK, inputs)) for n in names for first in range(0, inputs, CHUNK)][::-1]
    tallies = {name: Tally() for name in names}
    lock = threading.Lock()

    def work() -> None:
        process = Process()
        try:
            while True:
                with lock:
                    if not jobs:
                        return
                    name, first, last = jobs.pop()
                for tally in process.run(name, seed, first, last):
                    with lock:
                        tallies[name].add(vars(tally))
                        said(name, tally)
        finally:
            process.close()

    threads = [threading.Thread(target=work, daemon=True) for _ in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return tallies


def _row(tally: Tally, seed: int) -> dict[str, Any]:
    return {
        "inputs": tally.inputs,
        "reached": tally.reached,
        "read": tally.read,
        "refused": tally.refused,
        "failures": len(tally.failures),
        "kinds": {why: len(found) for why, found in kinds(tally.failures).items()},
        "slowest_ms": round(1000 * tally.slowest),
        "peak_MB": round(tally.peak),
        "seed": seed,
        "date": date.today().isoformat(),
        "machine": f"{os.cpu_count()} cores, Python {sys.version.split()[0]}",
    }


HEAD = """# Damaged and hostile files

`make fuzz` changes valid files of every format, by seed, and reads each as users do. Bytes are flipped, cut, put in, repeated, swapped,
truncated and joined; counts become 2^62, -1, 0 and 2^31; numbers become `1e999`, `nan`, `-1`, `1,5` and nothing; braces are opened a
million deep; XML entities are declared that grow to gigabytes; there are byte-order marks, mixed line ends, decimal commas and UTF-16.

Good outcomes are a Dataset that is valid (angles finite and in range, no infinities, not all zero) and one line that names the file and
the line or byte. Anything else is a failure: another exception, a warning, over 2 s of processor time, over 200 MB of memory. *reached*
is the share that was still recognised as the format; the rest were some other format's, or none's, and are held to the same.

| format | inputs | reached | read | refused | failures | slowest ms | peak MB | date | machine |
|---|---|---|---|---|---|---|---|---|---|
"""


def page(record: dict[str, Any]) -> str:
    rows = [
        f"| {name} | {r['inputs']} | {r['reached'] / max(r['inputs'], 1):.0%} | {r['read']} | {r['refused']} | {r['failures']} "
        f"| {r['slowest_ms']} | {r['peak_MB']} | {r['date']} | {r['machine']} |"
        for name, r in sorted(record.items())
    ]
    return HEAD + "\n".join(rows) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=INPUTS, help="of each format")
    parser.add_argument("--formats", default="all", help="names, separated by commas")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=PAGE, help="the page; its numbers go to benchmarks/fuzzing.json")
    parser.add_argument("--only", type=int, help="write one input of one format as a file, read it here, and stop")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.worker:
        Worker(chosen.worker).serve()
        return 0
    names = list(registry.formats()) if chosen.formats == "all" else chosen.formats.split(",")
    names = [registry.formats()[name].name for name in names]
    if chosen.only is not None:
        path = saved(names[0], chosen.seed, chosen.only)
        print(path, *attempt(path, names[0]))
        return 0
    tallies = _with_progress(names, chosen)
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    record |= {name: _row(tally, chosen.seed) for name, tally in tallies.items()}
    RECORD.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    chosen.out.write_text(page(record), encoding="utf-8")
    print(page({name: record[name] for name in names}).split("\n\n")[-1])
    for name, tally in tallies.items():
        if tally.failures:
            print(report(name, chosen.seed, tally.failures))
    return int(any(tally.failures for tally in tallies.values()))


def _with_progress(names: list[str], chosen: argparse.Namespace) -> dict[str, Tally]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[said]}"), TimeRemainingColumn())
    found: Counter[str] = Counter()
    with Progress(*columns) as bar:
        tasks = {name: bar.add_task(name, total=chosen.inputs, said="") for name in names}

        def said(name: str, tally: Tally) -> None:
            found[name] += len(tally.failures)
            bar.update(tasks[name], advance=tally.inputs, said=f"{found[name]} failures")

        return fuzz(names, chosen.inputs, chosen.seed, chosen.workers, said)


if __name__ == "__main__":
    sys.exit(main())
