"""The manifest of a fit of many blocks: what the run is, which blocks are written, and who computed which how often.

It is a folder in the store of the results, and a Zarr group whose attributes declare the run. Of block 12 it holds

    0000012.started    a line (time, host, process) for every time that a computation of the block began
    0000012.json       the mark that the block is written, with its Record

The chunks of the block are synchronised to the disk first (`store.write`). Then the mark is written under another name,
synchronised, and renamed. A rename happens whole or not at all, so a mark is never there without the results that it
vouches for, whenever the process or the machine dies. A block without a mark is computed again and overwritten.

There is one file for each block, and no common index, so that processes on several machines never write to the same
file and need no locks.
"""

import hashlib
import inspect
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

from gonio.files import FormatError
from gonio.processes.portable import synchronise

FOLDER = "manifest"


@dataclass(frozen=True)
class BlockGrid:
    """The lanes of a stack cut into blocks by a regular grid; blocks are numbered in C order.

    dims, shape: names and sizes of the lane dimensions. chunk: the size of a block along each of them; blocks at the
    end of a dimension may be smaller. The blocks are also the chunks of the Zarr arrays of the results, and Zarr cuts
    an array by a regular grid alone.
    """

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    chunk: tuple[int, ...]

    @classmethod
    def of(cls, lanes: Mapping[str, int], most: int) -> "BlockGrid":
        """Blocks of at most `most` lanes that keep the last dimensions whole and cut the first ones.

        lanes: size by dimension. A block is then a run of consecutive lanes in C order. ValueError for `most` below 1.
        """
        if most < 1:
            raise ValueError(f"a block holds at least one lane, and --block is {most}: give 1 or more")
        room, chunk = most, []
        for size in reversed(tuple(lanes.values())):
            chunk.append(max(1, min(size, room)))  # 1 for an empty dimension, since `counts` divides by it
            room //= chunk[-1]  # how many such rows still fit; 1 once a dimension is cut
        return cls(tuple(lanes), tuple(lanes.values()), tuple(reversed(chunk)))

    @property
    def counts(self) -> tuple[int, ...]:
        """How many blocks there are along each dimension."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    @property
    def lanes(self) -> int:
        """How many lanes there are in all."""
        return math.prod(self.shape)

    def __len__(self) -> int:
        """How many blocks there are."""
        return math.prod(self.counts)

    def place(self, block: int) -> tuple[int, ...]:
        """The index of a block along each dimension, which is also its part of the name of its chunks' files."""
        indices = []
        for count in reversed(self.counts):
            block, k = divmod(block, count)
            indices.append(k)
        return tuple(reversed(indices))

    def region(self, block: int) -> dict[str, slice]:
        """The lanes of a block, by dimension."""
        parts = zip(self.dims, self.place(block), self.chunk, self.shape, strict=True)
        return {dim: slice(k * c, min((k + 1) * c, n)) for dim, k, c, n in parts}

    def size(self, block: int) -> int:
        """How many lanes a block holds."""
        return math.prod(s.stop - s.start for s in self.region(block).values())

    def words(self, block: int) -> str:
        """A block for messages, with the range of its lanes: people know samples, and not the numbers of blocks."""
        where = ", ".join(f"{dim} {s.start} to {s.stop - 1}" for dim, s in self.region(block).items())
        return f"block {block} ({where})"


@dataclass(frozen=True)
class Record:
    """What the mark of a written block says: who computed it, when, and how the fits of its lanes ended.

    block: its number. lanes: how many it holds. host, process: where it was computed.
    started, written: when the computation began and when the chunks were on the disk [s since 1970].
    seconds: how long reading and fitting took [s], without writing.
    peak_megabytes: the most memory [MB] that the process had used by then, for other blocks too.
    run: the digest of the run that computed it, by which a mark of another run is known.
    statuses: how many lanes ended with which status. worst: the lane of the largest cost, by coordinate, with its cost
    and status; None where no lane has a cost. undetermined: in how many lanes the data do not determine a value, by its
    name, where there are such. A summary of the whole run is made of these, without opening the results.
    """

    block: int
    lanes: int
    host: str
    process: int
    started: float
    written: float
    seconds: float
    peak_megabytes: float
    run: str = ""
    statuses: dict[str, int] = field(default_factory=dict)
    worst: dict[str, Any] | None = None
    undetermined: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Manifest:
    """The manifest of the store at `out`. It holds no state of its own: every question is answered from the disk.

    Several processes and machines write to the folder at once, so what was read a moment ago may be out of date.
    """

    out: Path

    @property
    def folder(self) -> Path:
        """The folder of the manifest, a Zarr group in the store of the results."""
        return self.out / FOLDER

    def run(self) -> dict[str, Any] | None:
        """The declared run; None where `out` is not there, or is something else than a store of results."""
        try:
            attributes = json.loads((self.folder / "zarr.json").read_text(encoding="utf-8"))["attributes"]
            declared: dict[str, Any] = attributes["run"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return declared

    def digest(self) -> str:
        """The digest of the declared run; empty where there is none."""
        declared = self.run()
        return "" if declared is None else digest_of(declared)

    def _mark(self, block: int) -> Path:
        return self.folder / f"{block:07d}.json"

    def _starts(self, block: int) -> Path:
        return self.folder / f"{block:07d}.started"

    def is_written(self, block: int) -> bool:
        """Whether the results of a block are on the disk."""
        return self._mark(block).exists()

    def written(self) -> set[int]:
        """The blocks whose results are on the disk."""
        return self._blocks_with(".json")

    def begun(self) -> set[int]:
        """The blocks of which a computation has begun, whether or not it ended."""
        return self._blocks_with(".started")

    def _blocks_with(self, suffix: str) -> set[int]:
        """The blocks that have a file of this suffix; the names of other files, such as zarr.json, are not numbers."""
        if not self.folder.is_dir():
            return set()
        names = [entry.name.removesuffix(suffix) for entry in os.scandir(self.folder) if entry.name.endswith(suffix)]
        return {int(name) for name in names if name.isdigit()}

    def record(self, block: int) -> Record:
        """The record of a written block.

        Raises FileNotFoundError for a block that is not written, FormatError for a damaged mark.
        """
        path = self._mark(block)
        try:
            return Record(**json.loads(path.read_text(encoding="utf-8")))
        except (ValueError, TypeError) as error:
            what = "is no mark of a written block: remove it, and the same command computes the block again"
            raise FormatError(path, what, "line 1") from error

    def records(self) -> Iterator[Record]:
        """The records of all written blocks, in the order of their numbers."""
        return (self.record(block) for block in sorted(self.written()))

    def starts(self, block: int) -> list[tuple[float, str, int]]:
        """When (seconds since 1970), on which host and in which process computations of the block began."""
        if not self._starts(block).exists():
            return []
        lines = self._starts(block).read_text(encoding="utf-8").splitlines(keepends=True)
        # A power cut may have left the last line torn, because it is not synchronised.
        whole = (line.split() for line in lines if line.endswith("\n") and len(line.split()) == 3)
        return [(float(when), host, int(process)) for when, host, process in whole]

    def start(self, block: int) -> float:
        """Note that a computation of a block begins in this process; the time [s since 1970].

        A line is added and none is replaced, so that the notes of earlier processes stay. Unlike the mark it is not
        synchronised, because the lines only count attempts.
        """
        now = time.time()
        with self._starts(block).open("a", encoding="utf-8") as file:
            file.write(f"{now!r} {socket.gethostname()} {os.getpid()}\n")
        return now

    def mark(self, record: Record) -> None:
        """Mark a block as written, whole or not at all. The caller must have synchronised the block's chunks before."""
        final = self._mark(record.block)
        # Named by host and process: two workers that compute the same block must not write to the same file.
        temporary = self.folder / f"{final.name}.{socket.gethostname()}.{os.getpid()}"
        with temporary.open("w", encoding="utf-8") as file:
            json.dump(asdict(record), file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(final)
        synchronise(self.folder)  # the new name is an entry of the folder, which has to be on the disk too


def digest_of(declared: Any) -> str:
    """The SHA-256 of a declaration as `plain` gives it, the same before and after it was stored."""
    return hashlib.sha256(json.dumps(declared).encode()).hexdigest()


def plain(value: Any) -> Any:
    """A declaration as JSON can hold it: mappings, lists, texts and finite numbers; anything else as its repr.

    A declaration is compared with one that was read back from JSON. So tuples become lists, as JSON has no tuples, and
    NaN becomes a text, as it would otherwise differ from itself. A function, such as g1, is known by its module and
    name, since its repr holds an address in memory, which another process does not have.
    """
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
    if inspect.isfunction(value) and value.__name__ != "<lambda>":
        return f"{value.__module__}.{value.__qualname__}"
    return repr(value)


def difference(before: Any, now: Any, at: str = "") -> str:
    """The first entry in which two declarations differ, in words; empty where they are the same.

    at: the names of the mappings that lead to these declarations, for the message.
    """
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in dict.fromkeys([*before, *now]):
            name = f"{at} {key}".strip()
            if key not in before or key not in now:
                was, is_now = (_clipped(which[key]) if key in which else "not given" for which in (before, now))
                return f"its {name} was {was}, and is {is_now} now"
            if inner := difference(before[key], now[key], name):
                return inner
        return ""
    return "" if before == now else f"its {at} was {_clipped(before)}, and is {_clipped(now)} now"


def _clipped(value: Any) -> str:
    """A value of a declaration for a message of one line, at most 60 characters long."""
    text = json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else value
    return text if len(text) <= 60 else f"{text[:57]}..."


def now() -> str:
    """The time in UTC, in ISO 8601 to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
