"""Files: the error that names the place in one, and writing to a temporary name that is then renamed."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class FormatError(ValueError):
    """A file that cannot be read: which, where in it (a line or a byte offset), what was expected."""

    def __init__(self, path: str | Path, what: str, where: str = "") -> None:
        self.path, self.where, self.what = Path(path), where, what
        super().__init__(f"{path}, {where}: {what}" if where else f"{path}: {what}")


def refuse_existing(path: Path, force: bool) -> None:
    """FileExistsError with the remedy when `path` is there and `force` is not given."""
    if path.exists() and not force:
        raise FileExistsError(f"{path} exists: choose another name, or --force to overwrite it")


@contextmanager
def replacing(path: str | Path, force: bool = False) -> Iterator[Path]:
    """A temporary path beside `path` that takes its name when the block ends well and vanishes when it does not.

    Raises FileExistsError where `path` exists and `force` is False.
    """
    path = Path(path)
    refuse_existing(path, force)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
