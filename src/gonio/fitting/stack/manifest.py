"""The manifest of a fit of many blocks: what the run is, which blocks are written, and who computed which how often.

It is a folder in the store of the results, a Zarr group whose attributes declare the run. Of block 12 the file
`0000012.json` is there if and only if the block is written: it is made under another name, synchronised to the disk and
renamed after the block's own chunks are. `0000012.started` has a line for every time that a computation began.
"""

import json
import math
import os
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from gonio.portable import synchronise

FOLDER = "manifest"


@dataclass(frozen=True)
class BlockGrid:
    """Lanes in blocks of a regular grid: `dims` and `shape` of the lanes, and how many of each a block holds."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    chunk: tuple[int, ...]

    @classmethod
    def of(cls, lanes: Mapping[str, int], most: int) -> "BlockGrid":
        """BlockGrid of at most so many lanes: the last dimensions whole, the first ones cut."""
        if most < 1:
            raise ValueError(f"a block holds at least one lane, and --block is {most}")
        room, chunk = most, []
        for size in reversed(tuple(lanes.values())):
            chunk.append(max(1, min(size, room)))
            room //= chunk[-1]
        return cls(tuple(lanes), tuple(lanes.values()), tuple(reversed(chunk)))

    @property
    def counts(self) -> tuple[int, ...]:
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    @property
    def lanes(self) -> int:
        return math.prod(self.shape)

    def __len__(self) -> int:
        return math.prod(self.counts)

    def place(self, block: int) -> tuple[int, ...]:
        """Where the block stands in the grid, as the name of its chunks has it."""
        at = []
        for count in reversed(self.counts):
            block, k = divmod(block, count)
            at.append(k)
        return tuple(reversed(at))

    def region(self, block: int) -> dict[str, slice]:
        """The lanes of a block, by dimension."""
        parts = zip(self.dims, self.place(block), self.chunk, self.shape, strict=True)
        return {dim: slice(k * c, min((k + 1) * c, n)) for dim, k, c, n in parts}

    def size(self, block: int) -> int:
        return math.prod(s.stop - s.start for s in self.region(block).values())

    def words(self, block: int) -> str:
        where = ", ".join(f"{dim} {s.start} to {s.stop - 1}" for dim, s in self.region(block).items())
        return f"block {block} ({where})"


@dataclass(frozen=True)
class Record:
    """What the mark of a written block says: who computed it, when, and what came of its lanes.

    `worst` is the lane of the largest cost, by coordinate, with its cost and status; `peak_megabytes` the most memory
    that the process had taken by then.
    """

    block: int
    lanes: int
    host: str
    process: int
    started: float
    written: float
    seconds: float
    peak_megabytes: float
    statuses: dict[str, int] = field(default_factory=dict)
    worst: dict[str, Any] | None = None


@dataclass(frozen=True)
class Manifest:
    """The manifest of the store at `out`."""

    out: Path

    @property
    def folder(self) -> Path:
        return self.out / FOLDER

    def run(self) -> dict[str, Any] | None:
        """The declared run, None where the store is none of ours."""
        try:
            attributes = json.loads((self.folder / "zarr.json").read_text(encoding="utf-8"))["attributes"]
            declared: dict[str, Any] = attributes["run"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return declared

    def _mark(self, block: int) -> Path:
        return self.folder / f"{block:07d}.json"

    def _starts(self, block: int) -> Path:
        return self.folder / f"{block:07d}.started"

    def is_written(self, block: int) -> bool:
        return self._mark(block).exists()

    def written(self) -> set[int]:
        """The blocks that are there."""
        return self._with(".json")

    def begun(self) -> set[int]:
        """The blocks of which a computation has begun, whatever came of it."""
        return self._with(".started")

    def _with(self, suffix: str) -> set[int]:
        if not self.folder.is_dir():
            return set()
        names = [entry.name.removesuffix(suffix) for entry in os.scandir(self.folder) if entry.name.endswith(suffix)]
        return {int(name) for name in names if name.isdigit()}

    def record(self, block: int) -> Record:
        return Record(**json.loads(self._mark(block).read_text(encoding="utf-8")))

    def records(self) -> Iterator[Record]:
        return (self.record(block) for block in sorted(self.written()))

    def starts(self, block: int) -> list[tuple[float, str, int]]:
        """When (seconds since 1970), on which host and in which process computations of the block began."""
        if not self._starts(block).exists():
            return []
        lines = self._starts(block).read_text(encoding="utf-8").splitlines()
        return [(float(when), host, int(process)) for when, host, process in map(str.split, lines)]

    def start(self, block: int) -> float:
        """Note that a computation begins, and when."""
        now = time.time()
        with self._starts(block).open("a", encoding="utf-8") as file:
            file.write(f"{now!r} {socket.gethostname()} {os.getpid()}\n")
        return now

    def mark(self, record: Record) -> None:
        """Mark a block as written, at once or not at all; its chunks must be on the disk."""
        final = self._mark(record.block)
        temporary = self.folder / f"{final.name}.{socket.gethostname()}.{os.getpid()}"
        with temporary.open("w", encoding="utf-8") as file:
            json.dump(asdict(record), file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(final)
        synchronise(self.folder)


def plain(value: Any) -> Any:
    """A declaration as JSON has it: mappings, lists, texts, finite numbers; all else by its words."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(v) for v in value]
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return repr(value)


def difference(before: Any, now: Any, at: str = "") -> str:
    """The first thing in which two declarations differ, in words; empty where they are the same."""
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in dict.fromkeys([*before, *now]):
            name = f"{at} {key}".strip()
            if key not in before or key not in now:
                was, is_now = (_said(which[key]) if key in which else "not given" for which in (before, now))
                return f"its {name} was {was}, and is {is_now} now"
            if found := difference(before[key], now[key], name):
                return found
        return ""
    return "" if before == now else f"its {at} was {_said(before)}, and is {_said(now)} now"


def _said(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else value
    return text if len(text) <= 60 else f"{text[:57]}..."


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
