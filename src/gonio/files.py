"""Files: the error that names the place of a fault, and writing to a temporary name that is then renamed."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gonio.portable import give_usual_rights


class FormatError(ValueError):
    """A file that cannot be read: its path, where in it (a line or a byte offset), and what is wrong or was expected.

    What is quoted from the file may hold characters that cannot be printed: they are escaped, a form feed as in Python.
    """

    def __init__(self, path: str | Path, what: str, where: str = "") -> None:
        what = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in what)
        self.path, self.where, self.what = Path(path), where, what
        super().__init__(f"{path}, {where}: {what}" if where else f"{path}: {what}")


def refuse_existing(path: Path, force: bool) -> None:
    """FileExistsError with the remedy when `path` is there and `force` is not given."""
    if path.exists() and not force:
        raise FileExistsError(f"{path} exists: choose another name, or --force to overwrite it")


@contextmanager
def replacing(path: str | Path, force: bool = False) -> Iterator[Path]:
    """A temporary path beside `path` that takes its name when the block ends well and vanishes when it does not.

    It is an empty file; the block may put a directory in its place. Raises FileExistsError where `path` exists and
    `force` is False, or where it is a directory that does not look like the one that was written.
    """
    path = Path(path)
    refuse_existing(path, force)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        if temporary.is_dir():
            _replace_by_directory(temporary, path)
        else:
            give_usual_rights(temporary)
            temporary.replace(path)
    finally:
        if temporary.is_dir():
            shutil.rmtree(temporary)
        temporary.unlink(missing_ok=True)


def _replace_by_directory(temporary: Path, path: Path) -> None:
    """Give the directory its name; what had the name is put aside, back where that fails, and deleted at the end.

    Of two directories the old one must be empty or share a name with the new one, lest other things are lost.
    """
    if not path.exists():
        temporary.replace(path)
        return
    held = {entry.name for entry in path.iterdir()} if path.is_dir() else set()
    if held and held.isdisjoint(entry.name for entry in temporary.iterdir()):
        raise FileExistsError(f"{path} is a directory of other files: choose another name")
    aside = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.stem}."))
    try:
        path.rename(aside / path.name)
        try:
            temporary.rename(path)
        except OSError:
            (aside / path.name).rename(path)
            raise
    finally:
        shutil.rmtree(aside)
