"""What a target declares: its program, the files that it writes, and how what it wrote is proved."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gonio.exporting.subject import Subject

Content = str | bytes
WORST = 0.1  # relative root mean square error of a table above which it is refused


@dataclass(frozen=True)
class Request:
    """What is asked of a target: the file to write, the name inside it, and the largest error of a table.

    `worst` is the relative root mean square error above which a table is refused.
    """

    out: Path
    name: str
    worst: float = WORST


@dataclass(frozen=True)
class Made:
    """What a target makes: the content of its files, and what a user has to know of them.

    Attributes
    ----------
    files : mapping
        Content by file name; the first is the file that was asked for, the others stand beside it.
    remarks : tuple
        Sentences: what was left out, clipped or approximated.
    numbers : mapping
        Numbers that say how good it is, such as `log10_rmse`, by name.

    """

    files: Mapping[str, Content]
    remarks: tuple[str, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Proof:
    """What was done to prove a written file, and the largest error that was found, relative to the model.

    `limit` is what the error may be; `how` says what was run, or why nothing could be.
    """

    how: str
    error: float
    limit: float

    @property
    def holds(self) -> bool:
        """Whether the error is within its limit; NaN is not."""
        return self.error <= self.limit


Make = Callable[["Subject", Request], Made]
Check = Callable[["Subject", Request], Proof]


@dataclass(frozen=True)
class Target:
    """A program that takes models, and what gonio writes for it.

    Attributes
    ----------
    name, title : str
        What `--to` takes, and the program as people call it.
    suffixes : tuple
        Of the files, the usual one first; any other is refused. Empty where any will do.
    writes : str
        What is written, in a few words.
    make : callable
        The content of the files, for a Subject and a Request. ValueError, with the remedy, for what the program cannot
        take.
    check : callable
        Proves the files that were written, with what is installed.
    refused : str
        Why nothing can be written for this program, and what to do; empty where it can be.
    is_table : bool
        Whether values are written, of anything that has a BRDF, and not the formula of a model.

    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    writes: str
    make: Make
    check: Check | None = None
    refused: str = ""
    is_table: bool = False
