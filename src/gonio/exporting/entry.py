"""`gonio.export`: one call from a model, a fit or a scan to a file for another program."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.comparison.answer import fit
from gonio.completion import Corrected
from gonio.exporting.registry import targets
from gonio.exporting.source import identifier, refuse_suffix
from gonio.exporting.subject import Subject, of_model, of_solution
from gonio.exporting.target import WORST, Content, Made, Proof, Request, Target
from gonio.files import refuse_existing, replacing
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.outside import nearest


@dataclass(frozen=True)
class Exported:
    """What was written: the files, what a user has to know of them, and numbers that say how good they are."""

    target: Target
    files: tuple[Path, ...]
    remarks: tuple[str, ...]
    numbers: Mapping[str, Any]
    subject: Subject
    request: Request

    def prove(self) -> Proof:
        """Compare the written file with the model, with what is installed here.

        Raises ValueError where they differ by more than the target allows, and where nothing can run the file.
        """
        path = self.files[0]
        if self.target.check is None:
            raise ValueError(f"{path}: nothing here can run a file for {self.target.title}: leave --check out")
        proof = self.target.check(self.subject, self.request)
        if not proof.holds:
            raise ValueError(
                f"{path}: {proof.how}, it differs from the model by {proof.error:.2g} at most, where {proof.limit:.2g} "
                "is allowed: this is a mistake in gonio; do not use the file, and report it"
            )
        return proof


def export(
    of: Model | Solution | Corrected | xr.Dataset,
    path: str | Path,
    *,
    to: str = "",
    values: Mapping[str, float] | None = None,
    select: Mapping[str, str] | None = None,
    scale: float | None = None,
    worst: float = WORST,
    force: bool = False,
) -> Exported:
    """Write a model, a fit, or the best fit of a scan for another program.

    Parameters
    ----------
    of : Model, Solution, Corrected or xarray.Dataset
        A model of the catalogue or of your own, with `values`; a fit; a fit corrected by what its scan says beyond it
        (`gonio.completion.Corrected`), for tables alone; or a scan, to which the best model is fitted.
    path : str or Path
        The file to write. In source code a fit is called by its name, and a model by its own.
    to : str
        The target, one of `gonio.exporting.targets()`; without it the one that has this suffix.
    values : mapping, optional
        Weights and shape parameters of a model by name; shape parameters left out take their defaults.
    select : mapping, optional
        Which set of a fit: `{"channel": "R"}`.
    scale : float, optional
        1/sr for a unit of relative data.
    worst : float
        Largest relative root mean square error of a table; a larger one is refused.
    force : bool
        Whether files that exist are replaced.

    Returns
    -------
    Exported
        The files, what to know of them, and `prove()`, which compares them with the model.

    Raises
    ------
    FileExistsError
        A file exists, and `force` is not set.
    ValueError
        There is no such target, it cannot take the model or a corrected one, or the data are relative and no scale is
        given.

    Examples
    --------
    >>> import gonio
    >>> done = gonio.export(gonio.catalogue["ggx"], "coating.h", values={"rho_s": 0.8, "width": 0.2})
    >>> done.target.name, done.prove().holds
    ('c', True)

    """
    if isinstance(of, Model):
        if select:
            raise ValueError("select chooses a set of a fit, and a model has none: leave it out")
        return write(of_model(of, values or {}, scale=scale), path, to, worst=worst, force=force)
    if values:
        raise ValueError("values belong to a model, and a fit has its own: leave them out")
    solution = fit(of) if isinstance(of, xr.Dataset) else of
    subject = of_solution(solution, scale=scale, select=select)
    return write(subject, path, to, Path(path).stem, worst, force)


def write(
    subject: Subject, path: str | Path, to: str = "", name: str = "", worst: float = WORST, force: bool = False
) -> Exported:
    """The same for a Subject; name: what it is called in source code, else as its model."""
    path = Path(path)
    target = chosen(to, path)
    if subject.corrected is not None and not target.is_table:
        tables = ", ".join(t.name for t in targets().values() if t.is_table and not t.refused)
        raise ValueError(
            f"{target.title} takes the formula of a model, and what a scan says beyond it is in no formula: leave out "
            f"--correct, or write a table: --to {tables}"
        )
    request = Request(path, identifier(name or subject.model.name), worst)
    refuse_suffix(path, target.suffixes, target.title)
    refuse_existing(path, force)
    made = target.make(subject, request)
    return Exported(target, _written(made, path, force), made.remarks, made.numbers, subject, request)


def chosen(to: str, path: Path) -> Target:
    """The target of that name, or the one that has the suffix; ValueError where several have it or none."""
    if to:
        if to not in targets():
            known = ", ".join(t.name for t in targets().values() if not t.refused)
            raise ValueError(f"no target is called {to!r}; {nearest(to, targets())}; all: {known}")
        target = targets()[to]
        if target.refused:
            raise ValueError(f"{target.title}: {target.refused}")
        return target
    fitting = [t for t in targets().values() if path.suffix.lower() in t.suffixes[:1] and not t.refused]
    if len(fitting) != 1:
        names = ", ".join(t.name for t in fitting or targets().values())
        raise ValueError(f"{path}: its suffix does not say for which program: name one by --to: {names}")
    return fitting[0]


def _written(made: Made, path: Path, force: bool) -> tuple[Path, ...]:
    """All files, none of which is there unless all can be written."""
    files = {path.with_name(file): content for file, content in made.files.items()}
    for file in files:
        refuse_existing(file, force)
    for file, content in files.items():
        _write(file, content, force)
    return tuple(files)


def _write(path: Path, content: Content, force: bool) -> None:
    with replacing(path, force) as temporary:
        if isinstance(content, bytes):
            temporary.write_bytes(content)
        else:
            temporary.write_text(content, encoding="utf-8")
