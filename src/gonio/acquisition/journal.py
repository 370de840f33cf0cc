"""The journal of a measurement: lines that are only ever appended, each on the disk before the next reading begins.

A line is eight hexadecimal digits, the CRC-32 (that of zlib, which the standard library has) of the JSON behind
them. It is written by one call and then fsynced. On opening, lines are read up to the first that is not whole: what
follows goes to NAME.torn, and the journal goes on. The first line holds the plan, so that no journal is continued under
another.
"""

import errno
import json
import math
import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gonio.acquisition.plan import Plan, plan_of
from gonio.door.records import line_of, sound_lines
from gonio.files import FormatError, naming, refuse_no_folder
from gonio.processes.portable import lock, synchronise

FORMAT = "gonio journal 1"
NUMBERS = ("range", "dwell", "attempt", "session", "n")  # of a record of a reading
MISSING = ("value", "sd", "monitor", "temperature")  # numbers that may be null
TEXTS = ("kind", "unit", "filter", "note")
RIGHTS = 0o666  # less what the user's mask takes away


@dataclass
class Content:
    """What a journal holds: its head, its plan, and its records in their order. `torn`: bytes after the last whole."""

    head: Mapping[str, Any]
    plan: Plan
    records: list[dict[str, Any]]
    torn: int = 0

    @property
    def done(self) -> set[int]:
        """The steps of the plan, counted from 0, that have their reading."""
        return {record["step"] for record in self.records if record.get("done") and record.get("step") is not None}

    @property
    def sessions(self) -> int:
        """How often the measurement was begun or taken up again."""
        return sum(record.get("event") == "session" for record in self.records)

    @property
    def is_complete(self) -> bool:
        """Whether nothing of the plan is left."""
        return len(self.done) == len(self.plan.steps)


def read_journal(path: str | Path) -> Content:
    """What a journal holds, without changing it: another process may be writing it. FormatError where it is none."""
    path = Path(path)
    lines = sound_lines(path)
    if not lines.texts:
        raise FormatError(path, "holds no whole line of a journal", "line 1")
    try:
        head, *records = (json.loads(text) for text in lines.texts)
        if head.get("format") != FORMAT:
            raise ValueError(f"its format is {head.get('format')!r}, expected {FORMAT!r}")
        plan = plan_of(head["plan"])
        if plan.sha256 != head["plan_sha256"]:
            raise ValueError("its plan is not that of its checksum")
        if not isinstance(head["instrument"], dict):
            raise TypeError("its instrument is no table")
        if not isinstance(name := head.get("plan_name", ""), str):
            raise TypeError("the name of its plan is no text")
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise FormatError(path, f"is no journal of gonio: {error}", "line 1") from error
    for number, record in enumerate(records, start=2):
        if wrong := _wrong(record, len(plan.steps)):
            raise FormatError(path, f"is no record of a measurement: {wrong}", f"line {number}")
    return Content(head, replace(plan, name=name), records, len(lines.tail))


def _wrong(record: Any, steps: int) -> str:
    """What is wrong with a record whose checksum is right; empty for one that a measurement wrote."""
    if not isinstance(record, dict) or not _is_number(record.get("t_utc")):
        return "it has no time"
    if "kind" not in record:
        return "" if isinstance(record.get("event"), str) else "it has neither kind nor event"
    lacks = [name for name in NUMBERS if not _is_number(record.get(name))]
    lacks += [name for name in MISSING if not (name in record and (record[name] is None or _is_number(record[name])))]
    lacks += [name for name in TEXTS if not isinstance(record.get(name), str)]
    step, direction = record.get("step"), record.get("direction")
    if step is not None and not (isinstance(step, int) and 0 <= step < steps):
        lacks.append("step")
    if direction is not None and not (isinstance(direction, list) and [*map(_is_number, direction)] == [True] * 3):
        lacks.append("direction")
    return f"its {lacks[0]} is {record.get(lacks[0])!r}" if lacks else ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclass
class Journal(AbstractContextManager["Journal"]):
    """A journal that is open for one process alone; use it in a `with` block.

    plan, instrument: what it must be of; `instrument` is plain data. Raises ValueError, with the difference, where the
    file is the journal of another plan or instrument; OSError where another process has it open.
    """

    path: Path
    plan: Plan
    instrument: Mapping[str, Any] = field(default_factory=dict)
    content: Content = field(init=False)
    _file: int = field(init=False, default=-1)
    _length: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        self.path = Path(self.path)

    def __enter__(self) -> "Journal":
        refuse_no_folder(self.path)
        is_new = not self.path.exists()
        with naming(self.path):
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), RIGHTS)
        try:
            if not lock(self._file):
                raise OSError(f"{self.path} is being written by another process: wait for it, or name another file")
            self._recover(is_new)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _recover(self, is_new: bool) -> None:
        lines = sound_lines(self.path)
        if not lines.texts and lines.tail and not _is_own(lines.tail):
            raise FormatError(self.path, "is no journal of gonio: name another file", "line 1")
        if lines.texts:
            self.content = read_journal(self.path)
            self._refuse_others()
        if lines.tail:
            self._keep_tail(lines.tail, lines.length)
        self._length = lines.length
        if not lines.texts:
            head: dict[str, Any] = {"format": FORMAT, "plan_sha256": self.plan.sha256, "plan": self.plan.record}
            head |= {"plan_name": self.plan.name} if self.plan.name else {}
            head["instrument"] = _plain(self.instrument)
            self.content = Content(head, self.plan, [])
            self._write(head)
        if is_new:
            with naming(self.path):
                synchronise(self.path.resolve().parent)

    def _refuse_others(self) -> None:
        theirs = self.content.plan
        if theirs.sha256 != self.plan.sha256:
            raise ValueError(
                f"{self.path} is the journal of another plan: {self.plan.difference(theirs)} (there is the journal); "
                "name another journal, or that plan"
            )
        before, now = self.content.head.get("instrument", {}), json.loads(_text(self.instrument))
        if before != now:
            name = next(n for n in {**before, **now} if before.get(n) != now.get(n))
            raise ValueError(
                f"{self.path} was measured with another instrument: {name} is {now.get(name)} here and "
                f"{before.get(name)} in the journal; name another journal, or mend the bench"
            )

    def _keep_tail(self, tail: bytes, length: int) -> None:
        """Put what a crash tore into NAME.torn, behind what is there, and cut the journal to what is whole."""
        torn = self.path.with_name(self.path.name + ".torn")
        with naming(torn):
            file = os.open(torn, os.O_WRONLY | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), RIGHTS)
            try:
                _write_whole(file, tail)
                os.fsync(file)
            finally:
                os.close(file)
        with naming(self.path):
            os.ftruncate(self._file, length)
            os.fsync(self._file)

    def append(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Put a record on the disk, NaN as null, and return it as it stands there.

        Raises OSError, such as for a full disk, with the name of the journal; the journal then ends before the record.
        """
        whole = {"i": len(self.content.records), **_plain(record)}
        self._write(whole)
        self.content.records.append(whole)
        return whole

    def _write(self, record: Mapping[str, Any]) -> None:
        line = line_of(_text(record))
        with naming(self.path):
            try:
                _write_whole(self._file, line)
                os.fsync(self._file)
            except OSError:
                os.ftruncate(self._file, self._length)
                raise
        self._length += len(line)


def _is_own(tail: bytes) -> bool:
    """Whether bytes without a whole line are the beginning of a journal that a crash cut short."""
    return (
        b"\n" not in tail and all(byte in b"0123456789abcdef" for byte in tail[:8]) and tail[8:10] in (b"", b" ", b" {")
    )


def _write_whole(file: int, data: bytes) -> None:
    """All of it by one call; OSError as of a full disk where only a part found room."""
    if os.write(file, data) < len(data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _plain(data: Any) -> Any:
    """The same data with NaN and infinities as None, which JSON has."""
    if isinstance(data, Mapping):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, Sequence) and not isinstance(data, str):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _text(record: Mapping[str, Any]) -> str:
    return json.dumps(_plain(record), separators=(",", ":"), allow_nan=False)
