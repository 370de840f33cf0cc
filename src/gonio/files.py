"""Files: the error that names the place of a fault, and writing to a temporary name that is then renamed."""

import logging
import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path

from gonio.outside import printable
from gonio.processes.ending import unbroken, undone
from gonio.processes.portable import give_usual_rights

TEMPORARY = ".gonio-"  # how the names of temporary files begin
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


def refuse_no_folder(path: Path) -> None:
    """FileNotFoundError with the remedy where the folder that `path` would be written into is not there."""
    folder = path.parent
    if not folder.is_dir():
        what = "is no folder" if folder.exists() else "there is no such folder"
        raise FileNotFoundError(f"{path} cannot be written: {folder}: {what}; make it first, or mend the name")


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
    exists and `force` is False, or where it is a directory that does not look like the one that was written. OSError
    and FormatError of the block, and of reading again what it wrote, have the name `path` and not the temporary one.
    """
    path = Path(path)
    refuse_existing(path, force)
    final = path.resolve() if path.is_symlink() else path
    refuse_no_folder(final)
    is_special = _is_special(final)
    with naming(path) as hidden, ExitStack() as stack:
        folder = stack.enter_context(temporary_folder()) if is_special else final.parent
        # A short name: one made of the final name may be too long where the final name is not.
        temporary = stack.enter_context(_temporary_file(folder, path.suffix[:20]))
        hidden.append(temporary)
        yield temporary
        _settle(temporary, final, is_special)
    _log_written(path)


def _log_written(path: Path) -> None:
    """Tell `logging` of what has its name now; not of what lies in a temporary folder."""
    if not any(part.startswith(TEMPORARY) for part in path.parts):
        logging.getLogger(__name__).info("wrote %s", printable(str(path)))


@contextmanager
def _temporary_file(folder: Path, suffix: str) -> Iterator[Path]:
    """A new hidden file in a folder, removed at the end with whatever took its place."""
    with ExitStack() as stack:
        with unbroken():
            handle, name = tempfile.mkstemp(dir=folder, prefix=TEMPORARY, suffix=suffix)
            os.close(handle)
            stack.enter_context(undone(partial(_remove, Path(name))))
        yield Path(name)


@contextmanager
def temporary_folder(beside: Path | None = None) -> Iterator[Path]:
    """A new hidden folder, where the system keeps temporary ones or in a folder, removed at the end."""
    with ExitStack() as stack:
        with unbroken():
            path = Path(tempfile.mkdtemp(dir=beside, prefix=TEMPORARY))
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
def naming(path: Path) -> Iterator[list[Path]]:
    """Have every error of the block name this file, and none a hidden one: a full disk is told without a name.

    Yields a list for the temporary paths that stand for `path` or hold what will be in it.
    """
    hidden: list[Path] = []
    try:
        yield hidden
    except FormatError as error:  # of reading again what was written
        raise FormatError(_final(error.path, path, hidden), error.what, error.where) from error
    except OSError as error:
        if type(error) is OSError and error.errno is None:  # NumPy counts the bytes that found room, and says no more
            raise OSError(f"{path} could not be written as a whole ({error}): is the disk full?") from error
        if error.errno is not None:  # without one it is a sentence of gonio's
            name = error.filename
            error.filename = str(path if name is None else _final(os.fsdecode(name), path, hidden))
        raise


def _final(name: str | Path, path: Path, hidden: Iterable[Path]) -> Path:
    """The path that a name stands for: one that is hidden, or lies in one, is called as it will be in the end."""
    for temporary in hidden:
        if Path(name).is_relative_to(temporary):
            return path / Path(name).relative_to(temporary)
    return Path(name)


@contextmanager
def filling(folder: Path, force: bool = False) -> Iterator[Path]:
    """A temporary folder whose files are put into `folder` when the block ends well, and none of them when it does not.

    Other files of a folder that is there already stay. Raises FileExistsError where it is there and `force` is False.
    """
    refuse_existing(folder, force)
    if folder.exists() and not folder.is_dir():
        raise FileExistsError(f"{folder} is no folder: choose another name")
    refuse_no_folder(folder)
    with naming(folder) as hidden, temporary_folder(folder.parent) as temporary:
        hidden.append(temporary)
        yield temporary
        with unbroken():
            if folder.exists():
                for entry in temporary.iterdir():
                    entry.replace(folder / entry.name)
            else:
                give_usual_rights(temporary)
                temporary.replace(folder)
    _log_written(folder)


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
