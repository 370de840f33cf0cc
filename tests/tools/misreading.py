"""Readers that take too much; a module of their own, so that a process that calls one imports little."""

import time
from pathlib import Path


def slow(path: Path) -> None:
    """Takes longer than anybody waits."""
    time.sleep(60)


def greedy(path: Path) -> int:
    """Takes 8 GB."""
    return len(bytearray(2**33))
