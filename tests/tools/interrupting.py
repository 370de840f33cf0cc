"""Commands of gonio that are asked to end at random moments: `make interrupt`, most of an hour.

Each command of COMMANDS gets SIGINT, as Ctrl-C sends it, and SIGTERM, to its whole process group and to its main
process alone, at random moments after it has taken over the signals from Python; every other time twice. Afterwards it
must have said one line on standard error and ended with exit code 128 and the signal's number within LIMIT seconds.
No process of its session, no temporary file and no output that is not whole may be left. The program writes
benchmarks/interrupts.json with machine and date, and its exit code is 1 where a trial failed.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from places import ROOT

RECORD = ROOT / "benchmarks" / "interrupts.json"
SCAN = ROOT.parent / "shared" / "data" / "scans" / "ualoft_anoblack_nite_steel.csv"
GONIO = "from gonio.app.cli import main; main()"
LIMIT = 5.0  # s from the signal until the process and all that it started must be gone
LONGEST = 20.0  # s after the start within which moments are drawn, where the command takes longer
FIRST = 1.5  # s, the time of imports, in which every other moment is drawn
SLOW = 60.0  # s for Python to start on a busy machine
AGAIN = 4  # times that a moment is drawn anew because the command had ended before it
SIGNALS = (signal.SIGINT, signal.SIGTERM)


def _read_json(path: Path) -> None:
    json.loads(path.read_text(encoding="utf-8"))


def _read_scan(path: Path) -> None:
    import gonio

    gonio.read(path)


def _read_figure(path: Path) -> None:
    from matplotlib.image import imread

    imread(path)


def _read_fit(path: Path) -> None:
    from gonio.fitting import Solution

    _read_json(path / "fit.json")
    Solution.load(path / "solution.nc")
    for name in ("curves", "residuals", "components"):
        _read_figure(path / f"{name}.png")


def _read_store(path: Path) -> None:
    """A store of results may be there with some of its blocks; each that is marked has its values."""
    import numpy as np
    import xarray as xr

    from gonio.fitting.stack.manifest import Manifest

    manifest = Manifest(path)
    assert not (manifest.folder / "lock").exists(), "the lock is left"
    with xr.open_zarr(path) as found:
        for record in manifest.records():
            lanes = found.isel({"sample": slice(record.block * BLOCK, (record.block + 1) * BLOCK)})
            assert np.isfinite(lanes["cost"].values).all(), f"block {record.block} is marked and empty"


BLOCK = 16


@dataclass(frozen=True)
class Command:
    """A command line with {scan} and {stack} in it, what it writes, and the reader that tells whether that is whole."""

    words: str
    out: str
    read: Callable[[Path], None]

    def argv(self, given: dict[str, Path]) -> list[str]:
        """The process to start, in the folder where the output goes."""
        return [sys.executable, "-c", GONIO, *self.words.format(**given).split()]


COMMANDS = {
    "fit": Command("fit {scan} --model torrance-sparrow --out fit", "fit", _read_fit),
    "fit --bootstrap": Command(
        "fit {scan} --model torrance-sparrow --bootstrap 400 --json fit.json", "fit.json", _read_json
    ),
    "compare --models all": Command("compare {scan} --models all --workers 2 --json all.json", "all.json", _read_json),
    "fit-stack": Command("fit-stack {stack} --model lambert --out fits.zarr --workers 1", "fits.zarr", _read_store),
    "fit-stack --block": Command(
        f"fit-stack {{stack}} --model lambert --out fits.zarr --workers 2 --block {BLOCK}", "fits.zarr", _read_store
    ),
    "convert --fill": Command(
        "convert {scan} filled.pbsdf.csv --fill ggx --to tidy-csv", "filled.pbsdf.csv", _read_scan
    ),
    "plot": Command("plot {scan} --models torrance-sparrow,ggx --out plot.png", "plot.png", _read_figure),
}


@dataclass(frozen=True)
class Trial:
    """Which signal goes where, after how many seconds, and whether it comes twice."""

    command: str
    number: signal.Signals
    to_group: bool
    moment: float
    again: float | None = None

    def words(self) -> str:
        """The trial in words, for a failure."""
        where = "the group" if self.to_group else "the main process"
        twice = "" if self.again is None else f" and {self.again:.3f} s later again"
        return f"{self.command}: {self.number.name} to {where} after {self.moment:.3f} s{twice}"


@dataclass
class Outcome:
    """What came of a trial: the seconds until all was gone, what is wrong, and whether the command had ended before."""

    seconds: float
    wrong: list[str]
    too_late: bool = False


def members(session: int) -> list[int]:
    """The processes of a session that have not ended, by Linux's /proc."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # gone meanwhile
                continue
            if int(fields[3]) == session and fields[0] not in "ZX":
                found.append(int(entry.name))
    return found


@contextmanager
def heard() -> Iterator[None]:
    """Processes that start within the block hear Ctrl-C.

    A shell that started this program in the background has told it to ignore the signal, which is inherited.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def is_prepared(process: int) -> bool:
    """Whether a process catches SIGTERM, which Python by itself does not."""
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("SigCgt:"):
            return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def started(argv: list[str], folder: Path) -> subprocess.Popen[bytes]:
    """The command at work in `folder/work`, in a session of its own, with its signals taken over."""
    for name in ("work", "tmp"):
        (folder / name).mkdir()
    paths = os.pathsep.join([str(ROOT / "src"), *filter(None, sys.path)])
    with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
        process = subprocess.Popen(
            argv,
            stdout=out,
            stderr=err,
            cwd=folder / "work",
            env=os.environ | {"PYTHONPATH": paths, "TMPDIR": str(folder / "tmp"), "COLUMNS": "80"},
            start_new_session=True,
        )
    end = time.monotonic() + SLOW
    while process.poll() is None and not is_prepared(process.pid):
        assert time.monotonic() < end, "Python does not start"
        time.sleep(0.001)
    return process


def tried(trial: Trial, given: dict[str, Path]) -> Outcome:
    """Start the command, send the signal, and look at what is left."""
    command = COMMANDS[trial.command]
    with tempfile.TemporaryDirectory(prefix="gonio-interrupt-") as name:
        folder = Path(name)
        process = started(command.argv(given), folder)
        try:
            time.sleep(trial.moment)
            too_late = process.poll() is not None
            sent = time.monotonic()
            for pause in (0.0, trial.again):
                if pause is not None and not too_late:
                    time.sleep(pause)
                    _send(process, trial)
            code: int | str
            try:
                code = process.wait(timeout=max(sent + LIMIT - time.monotonic(), 0.1))
            except subprocess.TimeoutExpired:
                code = f"none after {LIMIT:g} s"
            while (left := members(process.pid)) and time.monotonic() < sent + LIMIT:
                time.sleep(0.005)
            seconds = time.monotonic() - sent
        finally:
            for member in members(process.pid):
                os.kill(member, signal.SIGKILL)
            process.wait()
        # It had done all its work when the signal came, and was about to end.
        ended = code == 0 and (folder / "err").read_text() == _notices((folder / "err").read_text())
        wrong = [] if ended else [*_wrong_words(folder, code, trial.number)]
        wrong += [f"{len(left)} processes are left"] * bool(left)
        wrong += _wrong_files(folder, command, whole=ended)
        return Outcome(seconds, wrong, too_late or ended)


def _send(process: subprocess.Popen[bytes], trial: Trial) -> None:
    with suppress(ProcessLookupError):
        (os.killpg if trial.to_group else os.kill)(process.pid, trial.number)


def _notices(text: str) -> str:
    """The lines by which fit-stack tells where it fits, as without a signal: with bokeh they name a dashboard."""
    told = (" on this machine\n", " on this machine; ")
    return "".join(line for line in text.splitlines(keepends=True) if any(words in line for words in told))


def _wrong_words(folder: Path, code: int | str, number: signal.Signals) -> Iterator[str]:
    if code != 128 + number:
        yield f"exit code {code}"
    said = (folder / "err").read_text(errors="replace")
    own = [line for line in said.splitlines(keepends=True) if line not in _notices(said)]
    # What was fitted by then is told below, a line for each model.
    first, told = own[:1], own[1:] if own and own[0].startswith("stopped: ") else []
    is_one = len(own) == 1 + len(told) and all(line.startswith("  ") for line in told)
    if not is_one or not first[0].startswith(("gonio: stopped by ", "stopped: ")) or not own[-1].endswith("\n"):
        yield f"standard error has {own!r:.1500}"


def _wrong_files(folder: Path, command: Command, whole: bool) -> Iterator[str]:
    for part, allowed in (("work", {command.out}), ("tmp", set())):
        if surplus := {path.name for path in (folder / part).iterdir()} - allowed:
            yield f"{sorted(surplus)} are left in {part}"
    out = folder / "work" / command.out
    if out.exists() or whole:
        try:
            command.read(out)
        except Exception as error:
            yield f"{command.out} is not whole: {error!r:.300}"


def seconds_of(command: Command, given: dict[str, Path]) -> float:
    """How long the command takes from when it has taken over the signals; what is wrong with it as AssertionError."""
    with tempfile.TemporaryDirectory(prefix="gonio-interrupt-") as name:
        process = started(command.argv(given), Path(name))
        begun = time.monotonic()
        assert process.wait() == 0, (Path(name) / "err").read_text()
        seconds = time.monotonic() - begun
        assert not (wrong := list(_wrong_files(Path(name), command, whole=True))), wrong
        return seconds


def trials(name: str, longest: float, moments: int, draw: random.Random) -> Iterator[Trial]:
    """Both signals to both addressees at so many moments each: by turns in the first seconds, and at any time."""
    for number in SIGNALS:
        for to_group in (True, False):
            for k in range(moments):
                end = min(FIRST, longest) if k % 2 else longest
                again = draw.uniform(0, 0.3) if k % 4 > 1 else None
                yield Trial(name, number, to_group, draw.uniform(0, end), again)


def until_running(trial: Trial, given: dict[str, Path]) -> Outcome:
    """The outcome at the trial's moment, or at an earlier one where the command had ended by then."""
    for k in range(AGAIN):
        moment = trial.moment * 0.8**k
        outcome = tried(Trial(trial.command, trial.number, trial.to_group, moment, trial.again), given)
        if not outcome.too_late or outcome.wrong:
            break
    return outcome


def row_of(name: str, given: dict[str, Path], asked: argparse.Namespace, failures: list[str]) -> dict[str, Any]:
    """All trials of a command, what failed in words; counts and times."""
    seconds, tally, slowest = seconds_of(COMMANDS[name], given), Counter[str](), 0.0
    drawn = list(trials(name, min(seconds, LONGEST), asked.moments, random.Random(f"{asked.seed} {name}")))
    with ThreadPoolExecutor(asked.together) as pool:
        outcomes = pool.map(until_running, drawn, [given] * len(drawn))
        for trial, outcome in zip(drawn, outcomes, strict=True):
            slowest = max(slowest, outcome.seconds)
            tally.update(trials=1, failures=bool(outcome.wrong), after_the_end=outcome.too_late)
            if outcome.wrong:
                failures.append(f"{trial.words()}: {'; '.join(outcome.wrong)}")
                print(failures[-1], flush=True)
    return dict(tally) | {"seconds_undisturbed": round(seconds, 1), "slowest_end_s": round(slowest, 2)}


def inputs(folder: Path) -> dict[str, Path]:
    """The measured scan, and a stack of 160 simulated ones in the folder."""
    import stacks

    stacks.write_stack(folder / "stack.zarr", {"sample": 10 * BLOCK})
    return {"scan": SCAN, "stack": folder / "stack.zarr"}


def main() -> int:
    """Try every command; 1 where a trial failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=20, help="for each command, signal and addressee")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--commands", default=",".join(COMMANDS))
    parser.add_argument("--together", type=int, default=2, help="trials at the same time")
    asked = parser.parse_args()
    if not SCAN.exists():
        print(f"there is no scan {SCAN}")
        return 1
    from figures import machine

    rows, failures = {}, list[str]()
    with tempfile.TemporaryDirectory(prefix="gonio-interrupt-") as name, heard():
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(Path(name) / "compiled")
        given = inputs(Path(name))
        for command in asked.commands.split(","):
            rows[command] = row_of(command, given, asked, failures)
            print(command, rows[command], flush=True)
    record: dict[str, Any] = {
        "machine": machine(),
        "date": date.today().isoformat(),
        "seed": asked.seed,
        "moments": asked.moments,
        "limit_s": LIMIT,
        "commands": rows,
        "failures": failures,
    }
    RECORD.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    return int(bool(failures))


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT / "benchmarks"))
    sys.exit(main())
