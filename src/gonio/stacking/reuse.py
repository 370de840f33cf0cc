"""Whether a stack was made of the same files before, for a command that is repeated until it ends."""

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from gonio.door.zarr_chunks import METADATA
from gonio.files import FormatError
from gonio.measured.stack_store import FORMAT_2, is_store, open_stack
from gonio.stacking.members import Member, members

MADE_OF = "made_of"  # attribute: the digest of the files of a stack


def digest(found: Sequence[Member]) -> str:
    """The SHA-256 of the places, sizes and times of some files, in their order; their contents are not read."""
    total = hashlib.sha256()
    for member in found:
        state = member.path.stat()
        total.update(repr((str(member.path.resolve()), state.st_size, state.st_mtime_ns)).encode())
    return total.hexdigest()


def is_made_of(store: Path, paths: Iterable[Path]) -> bool:
    """Whether a store is a stack that `stack` made of these files as they are, none changed since."""
    try:
        made_of = open_stack(store).attrs.get(MADE_OF) if is_store(store) else None
        return made_of is not None and made_of == digest(members(paths))
    except (FormatError, FileNotFoundError):  # what is read next says what is wrong
        return False


def is_folder_of_files(path: Path) -> bool:
    """Whether a path is a folder, and no Zarr store."""
    return path.is_dir() and not any((path / name).is_file() for name in (METADATA, *FORMAT_2))
