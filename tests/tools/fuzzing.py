"""Damaged and hostile files of every format, by the hundred thousand: `make fuzz` writes benchmarks/fuzzing.json.

A file is recognised and read as `gonio.read` does, in a process of its own. Good outcomes are a Dataset that is valid,
and a FormatError of one line that names the file and a place in it. Anything else is a failure: another exception, a
warning, a Dataset with an angle out of range, more than 2 s of processor time or 200 MB of memory. Fits, stacks and
scans go through every door (`doors`), height maps through `gonio.read_heights`. Each input follows from seed and number
alone, so that a failure can be made again: `--only NUMBER`. docs/pages/fuzzing.py makes a page of the results.
"""

import argparse
import json
import os
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # as pytest does
sys.path.insert(0, str(Path(__file__).resolve().parent))

from gonio import formats as registry
from outcomes import EVERY_DOOR, HEIGHTS, TABLE, attempt
from places import ROOT
from seeds import EASY, damaged, put, seeds
from workers import Process, Tally, Worker

RECORD = ROOT / "benchmarks" / "fuzzing.json"
INPUTS = 200_000
QUICK_DOORS = 80
QUICK = 250  # inputs of each format in `make test`, fewer where all its files are large
CHUNK = 500  # inputs that a worker does at a stretch
SAVED = 3  # failing inputs kept of one kind
SHOWN = ("inputs", "reached", "read", "refused", "failures", "slowest_ms", "peak_MB")


def quick(name: str) -> int:
    """How many inputs a quick run gives to a format; fewer to files that go through every door, which takes longer."""
    if name in (*EVERY_DOOR, TABLE):
        return QUICK_DOORS
    smallest = min(s.size for s in seeds(name))
    return max(QUICK * EASY // max(smallest, EASY), 20)


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

    with ThreadPoolExecutor(workers) as threads:
        for done in [threads.submit(work) for _ in range(workers)]:
            done.result()
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


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=INPUTS, help="of each format")
    parser.add_argument("--formats", default="all", help="names, separated by commas")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=RECORD, help="JSON file; other names in it stay")
    parser.add_argument("--only", type=int, help="write one input of one format as a file, read it here, and stop")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.worker:
        Worker(chosen.worker).serve()
        return 0
    others = (*EVERY_DOOR, TABLE, *HEIGHTS)
    names = [*registry.formats(), *others] if chosen.formats == "all" else chosen.formats.split(",")
    names = [name if name in others else registry.formats()[name].name for name in names]
    if chosen.only is not None:
        path = saved(names[0], chosen.seed, chosen.only)
        print(path, *attempt(path, names[0]))
        return 0
    lacking = [name for name in names if not _has_seeds(name)]
    names = [name for name in names if name not in lacking]
    tallies = _with_progress(names, chosen)
    rows = {name: _row(tally, chosen.seed) for name, tally in tallies.items()}
    record = json.loads(chosen.out.read_text(encoding="utf-8")) if chosen.out.exists() else {}
    chosen.out.write_text(json.dumps(record | rows, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    for name, row in rows.items():
        print(f"{name}:", ", ".join(f"{row[key]} {key}" for key in SHOWN))
    for name, tally in tallies.items():
        if tally.failures:
            print(report(name, chosen.seed, tally.failures))
    return int(bool(lacking) or any(tally.failures for tally in tallies.values()))


def _has_seeds(name: str) -> bool:
    try:
        return bool(seeds(name))
    except LookupError as error:
        print(error)
        return False


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
