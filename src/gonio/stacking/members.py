"""Which files a stack is made of, in which order, and what each is called in it."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gonio.files import FormatError
from gonio.formats import recognise
from gonio.outside import printable


@dataclass(frozen=True)
class Member:
    """One file of a stack. asked: whether it was named itself, and not found in a folder that was named."""

    path: Path
    asked: bool


def members(paths: Iterable[str | Path]) -> list[Member]:
    """The files that are meant, each once: those named in the order given, those of a folder in natural order.

    A folder that is a scan itself, such as a Zarr store, is one member. Hidden files of a folder are passed over.
    Raises FormatError for a path that is not there or a folder without a file; ValueError for a file named twice.
    """
    found: list[Member] = []
    for path in map(Path, paths):
        if not path.is_dir() or _is_scan(path):
            found.append(Member(path, True))
            continue
        entries = sorted((p for p in path.iterdir() if not p.name.startswith(".")), key=lambda p: natural(p.name))
        if not entries:
            raise FormatError(path, "is a folder without a file: name one that holds scans")
        found += [Member(entry, False) for entry in entries]
    if not found:
        raise ValueError("there is no file to stack: name files of scans, or a folder of them")
    seen: set[Path] = set()
    for member in found:
        if (resolved := member.path.resolve()) in seen:
            raise ValueError(f"{member.path} is given twice: name every scan once")
        seen.add(resolved)
    return found


def _is_scan(folder: Path) -> bool:
    """Whether a folder is a file of some format, as a Zarr store is."""
    try:
        recognise(folder)
    except FormatError:
        return False
    return True


def natural(name: str) -> Any:
    """The key by which names are sorted as people number them: s2 before s10, whatever the capitals."""
    parts = re.split(r"(\d+)", name.casefold())
    return [int(part) if k % 2 else part for k, part in enumerate(parts)], name


def names(paths: Sequence[Path]) -> list[str]:
    """What the scans are called: the names of their files without suffix, or all paths as given where two are alike.

    Characters that cannot be printed become escapes. Raises ValueError where two paths are alike in that as well.
    """
    found = [printable(path.stem) for path in paths]
    if len(set(found)) < len(found):
        found = [printable(path.as_posix()) for path in paths]
    if twice := [name for name, count in Counter(found).items() if count > 1]:
        raise ValueError(f"two files are called {twice[0]}: rename one of them")
    return found
