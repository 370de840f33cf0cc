"""Figures of results.json: what one is, how two things are timed in turn, and how the file is kept."""

import json
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from typing import Any

RECORD = Path(__file__).resolve().parent / "results.json"
PACKAGES = ("numpy", "scipy", "jax", "mitsuba", "lmfit", "lumos-sat", "dask")


@dataclass(frozen=True)
class Figure:
    """One number of results.json, or none and the reason; `details` are what else was found on the way."""

    name: str
    value: float | None = None
    reason: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.value is None) != bool(self.reason):
            raise ValueError(f"{self.name}: a figure has a value, or a reason why there is none")


@dataclass(frozen=True)
class Timed:
    """Seconds of two things that ran in turn, of the wall clock and of the processor."""

    ours: tuple[float, ...]
    theirs: tuple[float, ...]
    ours_processor: tuple[float, ...]
    theirs_processor: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """Median of theirs over ours: above 1 ours is the faster one."""
        return median(b / a for a, b in zip(self.ours, self.theirs, strict=True))

    @property
    def processor_ratio(self) -> float:
        """The same of processor time, which is what remains on a machine that others use too."""
        return median(b / a for a, b in zip(self.ours_processor, self.theirs_processor, strict=True))

    def details(self) -> dict[str, float]:
        return {
            "ratio": self.ratio,
            "ratio_of_processor_time": self.processor_ratio,
            "seconds": median(self.ours),
            "peer_seconds": median(self.theirs),
        }


def paired(ours: Callable[[], Any], theirs: Callable[[], Any], rounds: int = 9, settled: bool = False) -> Timed:
    """Both in turn, each first in every other round, after one run of each that is not counted.

    `settled` leaves one run out before each that counts: threads of the other one wait busily for some milliseconds.
    """
    ours(), theirs()
    found: dict[Callable[[], Any], list[tuple[float, float]]] = {ours: [], theirs: []}
    for k in range(max(rounds, 5)):
        for work in (ours, theirs) if k % 2 else (theirs, ours):
            if settled:
                work()
            wall, processor = time.perf_counter(), time.process_time()
            work()
            found[work].append((time.perf_counter() - wall, time.process_time() - processor))
    return Timed(*(tuple(row[k] for row in found[work]) for k in (0, 1) for work in (ours, theirs)))


def machine() -> str:
    """Processor, cores and versions."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text(encoding="utf-8").splitlines()
        names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
        vectors = next((w for w in ("avx512f", "avx2") if any(w in line.split() for line in lines)), "")
        cpu = f"{len(names)} x {names[0]}" + f" ({vectors})" * bool(vectors) if names else cpu
    return ", ".join([cpu, f"Python {platform.python_version()}", *_versions()])


def _versions() -> list[str]:
    found = []
    for name in PACKAGES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return found


def read() -> dict[str, Any]:
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def keep(*figures: Figure, **more: Any) -> dict[str, Any]:
    """Write figures, and what else is said of them, into results.json; the others there stay."""
    results = {"machine": "", "date": "", "figures": {}, "reasons": {}, "details": {}} | read()
    results |= {"machine": machine(), "date": date.today().isoformat()} | more
    for one in figures:
        results["figures"][one.name] = one.value
        for place, what in (("reasons", one.reason), ("details", dict(one.details))):
            results[place].pop(one.name, None)
            if what:
                results[place][one.name] = what
        if one.value is not None:
            measured = {"machine": machine(), "date": date.today().isoformat(), "load": round(os.getloadavg()[0], 1)}
            results["details"].setdefault(one.name, {})["measured"] = measured
    temporary = RECORD.with_suffix(".part")
    temporary.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    temporary.replace(RECORD)
    return results
