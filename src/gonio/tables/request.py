"""What the user says of a table, and the command line that says it: every question of a reader ends in one."""

import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from gonio.door.text import clip
from gonio.files import FormatError
from gonio.options import one_of
from gonio.tables import vocabulary as v

LAYOUTS = ("long", "matrix", "blocks", "sheets")
ROWS = ("theta_i", "theta_r")
_TARGET = "|".join(sorted(v.TARGETS, key=len, reverse=True))
_COLUMN = re.compile(rf"\s*(.+?)\s*=\s*({_TARGET}|\w+)((?::[^,:]+)*)\s*(?:,|$)", re.I)
RELATIVE, POINTS = "relative", "points"  # what an uncertainty in percent is of


class Target(NamedTuple):
    """What the user says a column is: the target, its unit, and for an uncertainty its factor k and what % is of."""

    name: str
    unit: str = ""
    coverage: float | None = None
    of: str = ""

    def text(self) -> str:
        """As `--columns` takes it."""
        k = "" if self.coverage is None else f":k={self.coverage:g}"
        return self.name + (f":{self.unit}" if self.unit else "") + k + (f":{self.of}" if self.of else "")


@dataclass(frozen=True)
class Request:
    """The flags of `gonio import`, read and checked; empty where the table itself is to say it.

    columns: by heading, or by number from 1. values: a pattern of headings, and the unit of the wavelengths in them.
    """

    columns: Mapping[str, Target] = field(default_factory=dict)
    layout: str = ""
    rows: str = ""
    values: str = ""
    values_unit: str = ""
    quantity: str = ""
    percent: bool = False
    flip: bool = False
    sheet: str = ""

    def command(self, path: Path | str, **changes: Any) -> str:
        """The command line that says all this and `changes`."""
        new = replace(self, **({"columns": {**self.columns, **changes.pop("columns", {})}} | changes))
        words = ["gonio", "import", str(path)]
        if new.columns:
            words += ["--columns", ",".join(f"{name}={target.text()}" for name, target in new.columns.items())]
        values = new.values + (f":{new.values_unit}" if new.values_unit else "")
        quantity = (new.quantity + ":percent" if new.quantity else "percent") if new.percent else new.quantity
        flags = {"layout": new.layout, "rows": new.rows, "values": values, "quantity": quantity, "sheet": new.sheet}
        for flag, value in flags.items():
            words += [f"--{flag}", value] if value else []
        words += ["--flip"] * new.flip
        return " ".join(shlex.quote(word) for word in [*words, "--out", "scan.csv"])


@dataclass(frozen=True)
class Asker:
    """Makes the errors of one table: what is wrong, where, and the command line that settles it.

    path: of the file, or what stands for it where there is none.
    """

    path: Path
    request: Request
    sheet: str = ""

    def wrong(self, what: str, line: int = 1) -> FormatError:
        """An error that no flag mends."""
        return FormatError(self.path, what, self._place(line))

    def ask(self, what: str, line: int = 1, **changes: Any) -> FormatError:
        """An error that ends in the command line with these changes, each the answer to what is asked."""
        return FormatError(self.path, f"{what}: {self.request.command(self.path, **changes)}", self._place(line))

    def checked(self, made: Callable[[], Any]) -> Any:
        """What a function gives; its ValueError as an error of the table."""
        try:
            return made()
        except ValueError as error:
            raise self.wrong(str(error)) from None

    def _place(self, line: int) -> str:
        return f"line {line}" + (f" of sheet {clip(self.sheet)!r}" if self.sheet else "")


def request(
    *,
    columns: Mapping[str, str] | str | None = None,
    layout: str = "",
    rows: str = "",
    values: str = "",
    quantity: str = "",
    flip: bool = False,
    sheet: str = "",
) -> Request:
    """The flags as they are written. Raises ValueError with what each may be."""
    if layout and layout not in LAYOUTS:
        raise ValueError(f"layout {layout!r} is none of {one_of(LAYOUTS)}")
    if rows and rows not in ROWS:
        raise ValueError(f"rows {rows!r} is neither {one_of(ROWS)}: say which angle the rows of a matrix hold")
    pattern, unit = _with_unit(values)
    name, percent = _quantity(quantity)
    return Request(_columns(columns), layout, rows, pattern, unit, name, percent, flip, sheet)


def _with_unit(values: str) -> tuple[str, str]:
    pattern, _, unit = values.rpartition(":")
    if pattern and (known := v.unit_of(unit)) and v.UNITS[known].kind == v.LENGTH:
        return pattern, known
    return values, ""


def _quantity(text: str) -> tuple[str, bool]:
    name, _, extra = text.strip().lower().partition(":")
    known = one_of([*v.QUANTITIES, "percent"])
    if extra and v.unit_of(extra) != "percent":
        raise ValueError(f"quantity {text!r}: after the colon only percent may stand")
    if v.unit_of(name) == "percent":
        return "", True
    if name and name not in v.FLAGS:
        raise ValueError(f"quantity {text!r} is none of {known}")
    if extra and v.FLAGS[name] in ("log10-brdf", "signal"):
        raise ValueError(f"quantity {text!r}: {v.FLAGS[name]} is not in percent")
    return v.FLAGS.get(name, ""), bool(extra)


def _columns(columns: Mapping[str, str] | str | None) -> dict[str, Target]:
    if columns is None:
        return {}
    if isinstance(columns, Mapping):
        return {str(name): target(str(name), str(said)) for name, said in columns.items()}
    found: dict[str, Target] = {}
    at, text = 0, columns.strip()
    while at < len(text):
        pair = _COLUMN.match(text, at)
        if pair is None:
            raise ValueError(f"columns {text[at:]!r} is not of the form HEADING=NAME or HEADING=NAME:UNIT, by commas")
        found[pair[1]] = target(pair[1], pair[2] + pair[3])
        at = pair.end()
    return found


def target(heading: str, said: str) -> Target:
    """What `theta_i`, `theta_i:rad`, `uncertainty:percent:k=2` say of a column."""
    name, *rest = (part.strip() for part in said.split(":"))
    if name not in v.TARGETS:
        raise ValueError(f"columns {heading!r}: {name!r} is none of {', '.join(v.TARGETS)}")
    unit, coverage, of = "", None, ""
    for part in rest:
        if factor := re.fullmatch(r"k\s*=\s*(\d+(?:\.\d+)?)", part):
            coverage = float(factor[1])
        elif part.lower() in (RELATIVE, POINTS):
            of = part.lower()
        elif known := v.unit_of(part):
            unit = known
        else:
            raise ValueError(f"columns {heading!r}: {part!r} is no unit that is known: {', '.join(v.UNITS)}")
    kinds = {v.ANGLE} if name in v.ANGLES else {v.LENGTH} if name == "wavelength" else set()
    if unit and kinds and v.UNITS[unit].kind not in kinds:
        raise ValueError(f"columns {heading!r}: {name} is not in {unit}")
    if ((coverage or of) and name not in v.UNCERTAINTIES) or coverage == 0:
        raise ValueError(
            f"columns {heading!r}: only an uncertainty has a factor k above 0, or is {RELATIVE} or {POINTS}"
        )
    return Target(name, unit, coverage, of)
