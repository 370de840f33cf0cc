"""`gonio fit-stack` killed again and again: `make bench-crash`, a quarter of an hour; writes benchmarks/crash.json.

A stack of 200 000 simulated scans is fitted once without disturbance. Then the same command is run on two workers, and
at random moments a worker is killed (SIGKILL), then the whole run, three times each; the last run goes to the end. The
results must be the same to the last bit, and no block may be computed once more after it was written.
"""

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path
from typing import Any

import psutil

from dask_bench import MODEL, SCANS, THETA_I, THETA_R, command, results, write_stack
from figures import machine
from gonio.fitting.stack.manifest import Manifest

RECORD = Path(__file__).resolve().parent / "crash.json"
ROUNDS = 3


def begun(stack: Path, out: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen(command(stack, out, "--workers", "2"), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def wait_for(manifest: Manifest, blocks: int, run: subprocess.Popen[bytes]) -> None:
    """Until so many blocks are written; what the run said where it ends before."""
    while len(manifest.written()) < blocks:
        if run.poll() is not None:
            raise RuntimeError(run.communicate()[1].decode())
        time.sleep(0.005)


def workers(run: subprocess.Popen[bytes], manifest: Manifest) -> list[psutil.Process]:
    """The processes of a run that have begun a block."""
    at_work = {process for block in manifest.begun() for _, _, process in manifest.starts(block)}
    return [child for child in psutil.Process(run.pid).children(recursive=True) if child.pid in at_work]


def killed(stack: Path, out: Path, draw: random.Random, goals: tuple[int, int]) -> list[dict[str, Any]]:
    """One run of which a worker is killed, then the whole; each some moment after so many blocks are written."""
    manifest, run, told = Manifest(out), begun(stack, out), []
    for what, goal in zip(("worker", "run"), goals, strict=True):
        wait_for(manifest, goal, run)
        time.sleep(draw.uniform(0, 1))
        if what == "worker":
            draw.choice(workers(run, manifest)).send_signal(signal.SIGKILL)
        else:
            left = psutil.Process(run.pid).children(recursive=True)
            run.send_signal(signal.SIGKILL)
            run.communicate()
            psutil.wait_procs(left, timeout=60)
            alive = [p.pid for p in left if p.is_running() and p.status() != psutil.STATUS_ZOMBIE]
            if alive:
                raise RuntimeError(f"processes {alive} outlive the run by a minute")
        told.append({"killed": what, "blocks_written": len(manifest.written())})
    return told


def finished(stack: Path, out: Path) -> float:
    """A run to the end, how long it took [s]."""
    started = time.perf_counter()
    _, said = (run := begun(stack, out)).communicate()
    if run.returncode:
        raise RuntimeError(said.decode())
    return round(time.perf_counter() - started, 1)


def main(scans: int = SCANS) -> int:
    draw = random.Random(2026)
    with tempfile.TemporaryDirectory() as name:
        stack, plain, out = (Path(name) / part for part in ("stack.zarr", "plain.zarr", "out.zarr"))
        write_stack(stack, scans)
        undisturbed = finished(stack, plain)
        blocks = len(Manifest(plain).written())
        goals = sorted(draw.sample(range(1, blocks * 4 // 5), 2 * ROUNDS))
        kills = []
        for k in range(ROUNDS):
            kills += killed(stack, out, draw, (goals[2 * k], goals[2 * k + 1]))
            print(kills[-2:], flush=True)
        there = {r.block: r for r in Manifest(out).records()}
        finished(stack, out)
        records = {r.block: r for r in Manifest(out).records()}
        starts = {block: Manifest(out).starts(block) for block in records}
        after = [b for b, r in records.items() if any(when > r.written for when, _, _ in starts[b])]
        record = {
            "machine": machine(),
            "date": date.today().isoformat(),
            "model": MODEL,
            "scans": scans,
            "directions": len(THETA_I) * len(THETA_R),
            "blocks": blocks,
            "seconds_undisturbed": undisturbed,
            "kills": kills,
            "bitwise_equal": results(out) == results(plain),
            "all_blocks_written": len(records) == blocks,
            "kept_as_they_were": there.items() <= records.items(),
            "computations": sum(map(len, starts.values())),
            "blocks_computed_after_they_were_written": after,
            "peak_MB": round(max(r.peak_megabytes for r in records.values())),
        }
    RECORD.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(json.dumps(record, indent=2))
    good = record["bitwise_equal"] and record["all_blocks_written"] and record["kept_as_they_were"] and not after
    return int(not good)


if __name__ == "__main__":
    os.environ["OMP_NUM_THREADS"] = "1"
    sys.exit(main(*map(int, sys.argv[1:])))
