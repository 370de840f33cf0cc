"""Files of scans into a stack: which are read, what must be alike, and what is told of the rest."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.door.zarr_chunks import METADATA
from gonio.files import FormatError, refuse_overlap, replacing
from gonio.formats import read as read_any
from gonio.measured.causes import SYSTEMATIC, causes
from gonio.measured.stack import foreign_dims
from gonio.measured.stack_store import is_store, open_stack
from gonio.outside import printable, shortened
from gonio.stacking.layout import Layout
from gonio.stacking.members import Member, members, names
from gonio.stacking.onto import Onto
from gonio.stacking.refusal import refusal
from gonio.stacking.reuse import MADE_OF, digest
from gonio.stacking.writing import Writer, left_out

Read = Callable[[Path], xr.Dataset]
Progress = Callable[[float, str], None]  # called with the fraction that is done, and the name of the file that is next


def silent(fraction: float, name: str) -> None:
    """No progress is shown."""


@dataclass(frozen=True)
class Stacked:
    """What came of it.

    names: the coordinate `sample`. directions: values of each scan. notes: what the history of the stack says, a line
    each. skipped: files of a folder that are no scans, and why not.
    """

    path: Path
    names: list[str]
    directions: int
    unit: str
    notes: list[str]
    skipped: list[FormatError]


def stack(
    paths: Iterable[str | Path],
    out: str | Path,
    *,
    onto: str | Path | None = None,
    resample: bool = False,
    read: Read = read_any,
    force: bool = False,
    progress: Progress = silent,
) -> Stacked:
    """Write the scans of many files into one Zarr store: `brdf` over `sample` and the dimensions of the first scan.

    Masked values become gaps. Uncertainties are kept where every scan states them, and systematic ones by cause where
    all state the same causes. One chunk of scans is in memory at a time.

    Parameters
    ----------
    paths : iterable of str or Path
        Files of any format that `read` takes, and folders, which stand for all files in them that can be read, in
        natural order of their names. A file of a folder that is no scan is left out, and named in `skipped`.
    out : str or Path
        The store.
    onto : str or Path, optional
        Take every scan at the directions of this file.
    resample : bool
        Take every scan at the directions of the first one; between measured directions by interpolation, whose error
        the history states, and with gaps (NaN) outside.
    read : callable
        How a file is read, `gonio.read` unless another is given.
    force : bool
        Whether a store that exists is replaced.
    progress : callable
        Called with the part that is done, 0 to 1, and a word.

    Returns
    -------
    Stacked
        The path, the coordinate `sample` (names of the files without suffix, or their paths where two are alike), and
        what the history says.

    Raises
    ------
    ValueError
        A scan has other directions, sets or another unit than the first; with the file, the place and the remedy.
    FormatError
        A named file cannot be read; of several such files one ValueError tells all.
    FileExistsError
        `out` exists, and `force` is not set.

    """
    if onto is not None and resample:
        raise ValueError("--onto and --resample name two sets of directions: give one of them")
    out, given = Path(out), [Path(path) for path in paths]
    refuse_overlap(out, [*given, *([Path(onto)] if onto is not None else [])])
    found = members(given)
    _refuse_other_folder(out)
    with replacing(out, force) as temporary:
        temporary.unlink()  # `replacing` makes an empty file, and a store is a folder
        work = _Work(temporary, len(found), read, resample, None if onto is None else _onto(Path(onto), read))
        for k, member in enumerate(found):
            progress(k / len(found), printable(member.path.name))
            work.add(member)
        work.refuse_misfits()
        as_they_are = onto is None and not resample and read is read_any
        return work.finish(out, {MADE_OF: digest(found)} if as_they_are else {})


def _onto(path: Path, read: Read) -> Onto:
    return Onto.of(_read(path, read), path)


def _refuse_other_folder(out: Path) -> None:
    """FileExistsError where `out` is a folder of other things, which `replacing` would find only after the work."""
    if out.is_dir() and any(out.iterdir()) and not (out / METADATA).is_file():
        raise FileExistsError(f"{out} is a directory of other files: choose another name")


def _read(path: Path, read: Read) -> xr.Dataset:
    """A scan; any ValueError names its file. Raises FormatError for a stack of scans too."""
    try:
        scan = open_stack(path) if is_store(path) else None
        if scan is None or not foreign_dims(scan):
            scan = read(path)
    except FormatError:
        raise
    except ValueError as error:
        raise ValueError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from error
    if dims := foreign_dims(scan):
        raise FormatError(path, f"is a stack over {', '.join(dims)} already: a stack is made of single scans")
    return scan


@dataclass
class _Work:
    """A stack that is being made: the scans so far, and what is to be told of them."""

    target: Path
    most: int
    read: Read
    resample: bool
    onto: Onto | None
    writer: Writer | None = None
    paths: list[Path] = field(default_factory=list)
    skipped: list[FormatError] = field(default_factory=list)
    unused: set[str] = field(default_factory=set)
    masked: int = 0
    silent_on_uncertainty: list[Path] = field(default_factory=list)
    causes: dict[Path, frozenset[str]] = field(default_factory=dict)  # of systematic uncertainty, as each file states
    attrs: dict[str, Any] = field(default_factory=dict)
    refused: list[ValueError] = field(default_factory=list)

    def add(self, member: Member) -> None:
        """The next file; one of a folder that is no scan is left out, and one that does not fit is told at the end."""
        try:
            self._add(member.path, _read(member.path, self.read))
        except FormatError as error:
            (self.refused if member.asked else self.skipped).append(error)
        except ValueError as error:
            self.refused.append(error)

    def _add(self, path: Path, scan: xr.Dataset) -> None:
        """The scan of a file; ValueError, with its name, where it does not fit to the first."""
        if self.onto is None and self.resample:
            self.onto = Onto.of(scan, path)
        self.unused |= left_out(scan)
        self.masked += int((scan["mask"].values != 0).sum()) if "mask" in scan else 0
        own = {k: v for k, v in scan.attrs.items() if k in ("Conventions", "provenance", "simulated") and v}
        self.attrs = own if not self.paths else {k: v for k, v in self.attrs.items() if own.get(k) == v}
        apart = SYSTEMATIC in scan
        if self.onto is not None:
            scan = self._at_directions(scan, path)
        if apart and SYSTEMATIC not in scan:  # interpolation is of their total
            self.unused.add(f"{SYSTEMATIC} by cause, of which the total is kept")
        if self.writer is None:
            self.writer = Writer(self.target, Layout(scan, path), self.most)
        taken = self.writer.layout.taken(scan, path)
        if taken.uncertainty is None:
            self.silent_on_uncertainty.append(path)
        self.causes[path] = frozenset(causes(scan))
        self.writer.add(taken)
        self.paths.append(path)

    def _at_directions(self, scan: xr.Dataset, path: Path) -> xr.Dataset:
        assert self.onto is not None
        try:
            return self.onto.taken(scan, path)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error

    def refuse_misfits(self) -> None:
        """ValueError for all files that cannot be in the stack; nothing where each can."""
        if self.refused:
            first = None if self.writer is None else self.writer.layout.path
            raise refusal(self.refused, self.skipped, first, self.most)

    def finish(self, out: Path, attrs: dict[str, str]) -> Stacked:
        """The store complete with these attributes, and what came of it."""
        if self.writer is None:
            first = self.skipped[0]
            raise FormatError(first.path.parent, f"is a folder without a scan that can be read: {first}")
        of, notes = names(self.paths), self._notes()
        self.writer.finish(of, {**self.attrs, **attrs, "history": "\n".join(notes)})
        layout = self.writer.layout
        return Stacked(out, of, layout.points, layout.unit, notes, self.skipped)

    def _notes(self) -> list[str]:
        """What the history says of how the stack came about, and what is not in it."""
        count, silent_ones = len(self.paths), self.silent_on_uncertainty
        notes = [shortened(f"stacked {count} scans: ", [path.name for path in self.paths], "")]
        if self.onto is not None:
            notes.append(self.onto.words)
        if self.masked:
            notes.append(f"{self.masked} masked values are gaps")
        if 0 < len(silent_ones) < count:
            lacking = shortened("", [path.name for path in silent_ones], "", most=80)
            notes.append(f"uncertainties left out: {len(silent_ones)} of {count} scans state none ({lacking})")
        if len(set(self.causes.values())) > 1:
            first = next(iter(self.causes.values()))
            others = [path.name for path, own in self.causes.items() if own != first]
            lacking = shortened("", others, "", most=80)
            notes.append(
                f"systematic uncertainties left out: {len(others)} of {count} scans state other causes ({lacking})"
            )
        if self.unused:
            notes.append(f"variables left out: {', '.join(sorted(self.unused))}")
        if self.skipped:
            files = shortened("", [error.path.name for error in self.skipped], "")
            notes.append(f"no scans, and left out: {len(self.skipped)} of {self.most} files ({files})")
        return [printable(note) for note in notes]  # names of files may hold what no text of a store can
