"""Files: the error that names the place of a fault, and writing to a temporary name that is then renamed."""

import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path

from gonio.outside import printable
from gonio.portable import give_usual_rights
from gonio.processes.ending import unbroken, undone

PAUSE = 0.2  # s that a folder is kept from being made again by threads that still write into it


class FormatError(ValueError):
    """A file that cannot be read: its path, where in it (a line or a byte offset), and what is wrong or was expected.

    What is quoted from the file may hold characters that cannot be printed: they are escaped, a form feed as in Python.
    """

    def __init__(self, path: str | Path, what: str, where: str = "") -> None:
        what = printable(what)
        self.path, self.where, self.what = Path(path), where, what
        super().__init__(f"{path}, {where}: {what}" if where else f"{path}: {what}")


def refuse_existing(path: Path, force: bool) -> None:
    """FileExistsError with the remedy when `path` is there and `force` is not given.

    A device or a pipe is no file that could be lost: it is written to.
    """
    if path.exists() and not force and not _is_special(path):
        raise FileExistsError(f"{path} exists: choose another name, or --force to overwrite it")


def refuse_overlap(output: Path, read: Iterable[Path]) -> None:
    """ValueError where an output is one of the paths that are read, lies inside one of them, or holds one."""
    out = output.resolve()
    for path in read:
        given = path.resolve()
        if _is_special(given):
            continue
        how = {out == given: "is", given in out.parents: "lies inside", out in given.parents: "holds"}.get(True)
        if how or (out.exists() and given.exists() and out.samefile(given)):
            raise ValueError(f"the output {output} {how or 'is'} {path}, which is read: choose another name")


def _is_special(path: Path) -> bool:
    """Whether a path is a device, a pipe or a socket."""
    return path.exists() and not path.is_file() and not path.is_dir()


@contextmanager
def replacing(path: str | Path, force: bool = False) -> Iterator[Path]:
    """A temporary path beside `path` that takes its name when the block ends well and vanishes when it does not.

    It is an empty file; the block may put a directory in its place. A symbolic link stays, and what it points to is
    replaced. What is written to a device or a pipe goes there when it is complete. Raises FileExistsError where `path`
    exists and `force` is False, or where it is a directory that does not look like the one that was written; OSError
    with the name `path`, not the temporary one.
    """
    path = Path(path)
    refuse_existing(path, force)
    final = path.resolve() if path.is_symlink() else path
    is_special = _is_special(final)
    with _named(path), ExitStack() as stack:
        folder = final.parent
        if is_special:
            folder = stack.enter_context(temporary_folder())
        folder.mkdir(parents=True, exist_ok=True)
        # A short name: one made of the final name may be too long where the final name is not.
        temporary = stack.enter_context(_temporary_file(folder, path.suffix[:20]))
        try:
            yield temporary
            _settle(temporary, final, is_special)
        except OSError as error:
            if error.filename is not None and Path(os.fsdecode(error.filename)) == temporary:
                error.filename = str(path)
            raise


@contextmanager
def _temporary_file(folder: Path, suffix: str) -> Iterator[Path]:
    """A new hidden file in a folder, removed at the end with whatever took its place."""
    with ExitStack() as stack:
        with unbroken():
            handle, name = tempfile.mkstemp(dir=folder, prefix=".gonio-", suffix=suffix)
            os.close(handle)
            stack.enter_context(undone(partial(_remove, Path(name))))
        yield Path(name)


@contextmanager
def temporary_folder(beside: Path | None = None) -> Iterator[Path]:
    """A new hidden folder, where the system keeps temporary ones or in a folder, removed at the end."""
    with ExitStack() as stack:
        with unbroken():
            path = Path(tempfile.mkdtemp(dir=beside, prefix=".gonio-"))
            stack.enter_context(undone(partial(_remove, path)))
        yield path


def _remove(path: Path) -> None:
    """Remove a file, or a folder into which other threads may still write: what they do then fails."""
    removed = path.with_name(f"{path.name}-removed")
    with suppress(OSError):
        path.rmdir()  # it is empty
    while path.is_dir():
        path.rename(removed)
        with suppress(FileExistsError):  # where a thread has just made the folder again
            path.touch(exist_ok=False)
        shutil.rmtree(removed)
        time.sleep(PAUSE)
    path.unlink(missing_ok=True)
    shutil.rmtree(removed, ignore_errors=True)  # where a signal stopped another call of this in the midst


def _settle(temporary: Path, final: Path, is_special: bool) -> None:
    """Give what was written its name, or send it to a device or a pipe."""
    if is_special:
        if temporary.is_dir():
            raise FileExistsError(f"{final} takes one stream of bytes, and a directory is written: choose another name")
        with temporary.open("rb") as whole, final.open("wb") as there:
            shutil.copyfileobj(whole, there)
    elif temporary.is_dir():
        _replace_by_directory(temporary, final)
    else:
        give_usual_rights(temporary)
        temporary.replace(final)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Have every OSError that names no file name this one: a full disk is told without a name."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(path)
        raise


@contextmanager
def filling(folder: Path, force: bool = False) -> Iterator[Path]:
    """A temporary folder whose files are put into `folder` when the block ends well, and none of them when it does not.

    Other files of a folder that is there already stay. Raises FileExistsError where it is there and `force` is False.
    """
    refuse_existing(folder, force)
    if folder.exists() and not folder.is_dir():
        raise FileExistsError(f"{folder} is no folder: choose another name")
    with _named(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with temporary_folder(folder.parent) as temporary:
            yield temporary
            with unbroken():
                if folder.exists():
                    for entry in temporary.iterdir():
                        entry.replace(folder / entry.name)
                else:
                    give_usual_rights(temporary)
                    temporary.replace(folder)


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
    with temporary_folder(path.parent) as aside, unbroken():
        path.rename(aside / path.name)
        try:
            temporary.rename(path)
        except BaseException:
            (aside / path.name).rename(path)
            raise
