"""Files: the error that names the place of a fault, and writing to a temporary name that is then renamed."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from gonio.outside import printable
from gonio.portable import give_usual_rights


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
    with tempfile.TemporaryDirectory() if is_special else nullcontext() as elsewhere, naming(path) as hidden:
        # A short name: one made of the final name may be too long where the final name is not.
        handle, name = tempfile.mkstemp(dir=elsewhere or final.parent, prefix=".gonio-", suffix=path.suffix[:20])
        os.close(handle)
        temporary = Path(name)
        hidden.append(temporary)
        try:
            yield temporary
            _settle(temporary, final, is_special)
        finally:
            if temporary.is_dir():
                shutil.rmtree(temporary)
            temporary.unlink(missing_ok=True)


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
    with naming(folder) as hidden:
        temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".gonio-"))
        hidden.append(temporary)
        try:
            yield temporary
            if folder.exists():
                for entry in temporary.iterdir():
                    entry.replace(folder / entry.name)
            else:
                give_usual_rights(temporary)
                temporary.replace(folder)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


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
    aside = Path(tempfile.mkdtemp(dir=path.parent, prefix=".gonio-"))
    try:
        path.rename(aside / path.name)
        try:
            temporary.rename(path)
        except OSError:
            (aside / path.name).rename(path)
            raise
    finally:
        shutil.rmtree(aside)
