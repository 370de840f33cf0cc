"""The lock of a store of results: one run at a time, so that no block is written by two.

A run holds a file `lock` in the folder of the manifest, with its host and process in it, and touches it every BEAT
seconds. A lock whose process has ended is taken over. On another machine that cannot be seen, so there a lock is taken
over when it was not touched for STALE seconds.
"""

import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gonio.processes.ending import undone
from gonio.processes.portable import is_running

NAME = "lock"
BEAT, STALE = 20.0, 300.0  # s


def refuse_held(folder: Path) -> None:
    """ValueError where another run holds the lock in a folder."""
    _stale(folder / NAME)


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold the lock in a folder while the block runs; ValueError where another run holds it."""
    lock = folder / NAME
    mine = f"{socket.gethostname()} {os.getpid()} {time.time()!r}\n"
    ended = threading.Event()

    def release() -> None:
        ended.set()
        if _content(lock) == mine:
            lock.unlink(missing_ok=True)

    def beat() -> None:
        while not ended.wait(BEAT):
            with suppress(OSError):
                os.utime(lock)

    with undone(release):
        _take(lock, mine)
        threading.Thread(target=beat, daemon=True).start()
        yield


def _take(lock: Path, mine: str) -> None:
    """Make the lock, in place of one that nobody holds any more."""
    while True:
        try:
            with lock.open("x", encoding="utf-8") as file:
                file.write(mine)
            return
        except FileExistsError:
            stale = _stale(lock)
        # Two runs may find the same lock stale. What one moves aside may be the lock that the other has just made.
        aside = lock.with_name(f"{NAME}.{socket.gethostname()}.{os.getpid()}")
        with suppress(FileNotFoundError):
            lock.rename(aside)
            if _content(aside) != stale:
                with suppress(FileExistsError):
                    os.link(aside, lock)
            aside.unlink()


def _stale(lock: Path) -> str | None:
    """The content of a lock that nobody holds, None where there is no lock; ValueError where a run holds it."""
    content = _content(lock)
    if content is None:
        return None
    words = content.split()
    host, process = (words[0], int(words[1])) if len(words) > 1 and words[1].isdigit() else ("", 0)
    if is_running(process) if host == socket.gethostname() else _age(lock) < STALE:
        who = f"process {process} on {host}" if host else "a run that has just begun"
        raise ValueError(
            f"{lock.parents[1]} is being written by {who}: wait for it or end it; if it is gone, remove {lock}"
        )
    return content


def _content(lock: Path) -> str | None:
    try:
        return lock.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None


def _age(lock: Path) -> float:
    try:
        return time.time() - lock.stat().st_mtime
    except FileNotFoundError:
        return STALE
