"""Measurements that are killed, and measurements on a full disk, in a process of their own: for test_journal.py.

It kills its own forks, which costs no start of Python for each, and prints what became of the journals.
"""

import json
import os
import random
import resource
import signal
import tempfile
import time
from pathlib import Path
from typing import Any

from gonio.acquisition import Conditions, Layout, grid, read_journal
from gonio.door.records import sound_lines
from simulated_benches import bench, measure

KILLS = 20
PLAN = grid([20, 40], range(-60, 60, 4), layout=Layout(dark_every=50), conditions=Conditions(dwell=0.1))
FEW = grid([20], range(0, 60, 10), layout=Layout(dark_every=3), conditions=Conditions(dwell=0.1))
SIZES = (1200, 2011, 3302)  # bytes that the journal of FEW may have: in its first records, in the middle, near the end


def killed(path: Path) -> dict[str, Any]:
    """SIGKILL at random moments of a measurement, often with garbage behind what it wrote, until KILLS have hit."""
    chance = random.Random(7)
    kills = lost = 0
    known: list[str] = []
    while kills < KILLS:
        child = os.fork()
        if not child:
            try:
                measure(path, bench(), PLAN)
            finally:
                os._exit(0)
        limit = len(known) + chance.randint(1, 8)
        while _lines(path) < limit and not os.waitpid(child, os.WNOHANG)[0]:
            time.sleep(chance.random() * 0.002)
        os.kill(child, signal.SIGKILL)
        kills += os.WIFSIGNALED(os.waitpid(child, 0)[1])
        if chance.random() < 0.3:
            with path.open("ab") as file:
                file.write(chance.randbytes(chance.randint(1, 60)))
        texts = sound_lines(path).texts
        lost += texts[: len(known)] != known
        known = texts
    measure(path, bench(), PLAN)
    content = read_journal(path)
    steps = [record["step"] for record in content.records if record.get("done") and record["step"] is not None]
    return {
        "kills": kills,
        "lost": lost + (sound_lines(path).texts[: len(known)] != known),
        "complete": content.is_complete,
        "doubled": len(steps) - len(set(steps)),
        "sessions": content.sessions,
    }


def _lines(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def full(path: Path, size: int) -> dict[str, Any]:
    """A measurement whose journal finds room for so many bytes, and goes on when there is more."""
    on = bench()
    said = error = ""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    try:
        measure(path, on, FEW)
    except OSError as caught:
        said, error = str(caught), type(caught).__name__
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    lines = sound_lines(path)
    out = {"said": said, "error": error, "tail": len(lines.tail), "shutter_open": on.shutter.is_open}
    measure(path, bench(), FEW)
    return (
        out
        | {"kept": sound_lines(path).texts[: len(lines.texts)] == lines.texts, "records": len(lines.texts)}
        | {"complete_afterwards": read_journal(path).is_complete}
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        trials = {"killed": killed(Path(folder) / "killed.jsonl")}
        trials |= {"full": [full(Path(folder) / f"{size}.jsonl", size) for size in SIZES]}
    print(json.dumps(trials))
