"""A plan: every reading of a measurement in its order, as data that a person can read, edit and compare.

The file is TOML. Its steps are arrays: `["dark"]`, `["sample", 30.0, -20.0]` with theta_i and signed theta_r [deg], or
`["sample", 30.0, 20.0, 90.0]` with theta_r from 0 to 90 and phi. The SHA-256 of what it says, not of how it is written,
binds a journal to its plan.
"""

import hashlib
import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from gonio.door.text import whole
from gonio.files import FormatError, replacing
from gonio.options import Option, Panel, one_of
from gonio.outside import printable

FORMAT = "gonio plan 1"
LARGEST = 100_000_000  # bytes of a plan: a million directions
KINDS = ("sample", "dark", "background", "incident", "standard", "check")
DIRECTED = ("sample", "background", "standard", "check")  # kinds of readings that have a direction
POLARISATIONS = ("s", "p", "unpolarised", "unknown")
GRAZING = 90.0  # deg: the reduction divides by the cosine


@dataclass(frozen=True)
class Step:
    """One reading to take.

    kind: sample; dark, with the shutter closed; background, with a light trap for the sample; incident, with the
    detector in the beam behind a filter; standard; check, a direction that is repeated to see drift.
    theta_i, theta_r [deg]: theta_r is signed (positive is forward) where phi is None, else from 0 to 90.
    """

    kind: str
    theta_i: float | None = None
    theta_r: float | None = None
    phi: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"a step is {printable(str(self.kind))!r}: give {one_of(KINDS)}")
        if self.kind not in DIRECTED:
            if self.theta_i is not None:
                raise ValueError(f"a step is {self.kind} with angles: it has none")
            return
        if self.theta_i is None or self.theta_r is None:
            raise ValueError(f"a step is {self.kind} without angles: give theta_i and theta_r")
        lowest = -GRAZING if self.phi is None else -1e-12
        if not (0 <= self.theta_i < GRAZING and lowest < self.theta_r < GRAZING):
            raise ValueError(f"the step {self} is outside 0 <= theta_i < 90 and |theta_r| < 90 deg")
        if self.phi is not None and not -360 <= self.phi <= 360:
            raise ValueError(f"the step {self} has an azimuth outside -360 to 360 deg")

    @property
    def row(self) -> list[Any]:
        """The step as the file holds it."""
        return [self.kind, *(float(a) for a in (self.theta_i, self.theta_r, self.phi) if a is not None)]

    def __str__(self) -> str:
        return " ".join(f"{part:g}" if isinstance(part, float) else part for part in self.row)

    @property
    def direction(self) -> tuple[float, float, float]:
        """theta_i, theta_r from 0 on, phi [deg], as a Dataset has them; for kinds that have a direction."""
        assert self.theta_i is not None
        assert self.theta_r is not None
        if self.phi is not None:
            return self.theta_i, self.theta_r, self.phi
        return self.theta_i, abs(self.theta_r), 180.0 if self.theta_r >= 0 else 0.0


@dataclass(frozen=True)
class Skipped:
    """A direction that was asked for and cannot be measured, and why."""

    theta_i: float
    theta_r: float
    phi: float | None
    reason: str

    @property
    def row(self) -> list[Any]:
        """As the file holds it."""
        return [*(float(a) for a in (self.theta_i, self.theta_r, self.phi) if a is not None), self.reason]


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """What holds for every reading of a plan, and how fast the stages are. Raises ValueError beyond the bounds."""

    PANEL: ClassVar = Panel.MEASUREMENT
    wavelength: Annotated[float | None, Option("wavelength of the light", metavar="NM", above=0)] = None
    polarisation: Annotated[
        str, Option("polarisation of the light: s, p, unpolarised or unknown", metavar="STATE", names=POLARISATIONS)
    ] = "unknown"
    dwell: Annotated[float, Option("time of one reading", metavar="S", above=0)] = 1.0
    settle: Annotated[float, Option("wait after a move", metavar="S", lowest=0)] = 0.5
    table_speed: Annotated[float, Option("speed of the sample's table, for the duration", metavar="DEG/S", above=0)] = (
        10.0
    )
    arm_speed: Annotated[float, Option("speed of the detector's arm, for the duration", metavar="DEG/S", above=0)] = (
        10.0
    )
    filter: Annotated[str, Option("filter before the detector for readings of the incident beam", metavar="NAME")] = ""

    def __post_init__(self) -> None:
        if self.polarisation not in POLARISATIONS:
            raise ValueError(
                f"the polarisation is {printable(self.polarisation)!r}: give {one_of(POLARISATIONS)}, of the light"
            )
        for name in ("wavelength", "dwell", "settle", "table_speed", "arm_speed"):
            value = getattr(self, name)
            if value is not None and not (0 < value < float("inf") or (name == "settle" and value == 0)):
                raise ValueError(f"{name} is {value}: give a finite number above 0")


@dataclass(frozen=True)
class Plan:
    """Steps in their order, under which conditions, and what was left out with reasons.

    name: of the file that it was read from, which is no part of what the plan says; empty where there is none.
    """

    conditions: Conditions
    steps: tuple[Step, ...]
    skipped: tuple[Skipped, ...] = ()
    name: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if not self.steps:
            raise ValueError("a plan without steps measures nothing: give it some")

    @property
    def record(self) -> dict[str, Any]:
        """What the plan says, as plain data."""
        stated = {name: value for name, value in asdict(self.conditions).items() if value is not None}
        stated = {name: float(v) if isinstance(v, int) else v for name, v in stated.items()}
        return {
            "format": FORMAT,
            **stated,
            "steps": [step.row for step in self.steps],
            "skipped": [one.row for one in self.skipped],
        }

    @property
    def sha256(self) -> str:
        """Of the canonical form: JSON with sorted keys and no spaces."""
        canonical = json.dumps(self.record, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
        return hashlib.sha256(canonical.encode()).hexdigest()

    @property
    def text(self) -> str:
        """The plan as TOML: whatever JSON writes of texts, numbers and arrays is TOML too, except the character DEL."""
        lines = [
            "# A plan of gonio: steps are kind, theta_i, theta_r (signed, forward is positive), or with phi; in deg"
        ]
        for name, value in self.record.items():
            if isinstance(value, list):
                lines += ["", f"{name} = [", *(f"  {_toml(row)}," for row in value), "]"]
            else:
                lines.append(f"{name} = {_toml(value)}")
        return "\n".join(lines) + "\n"

    def write(self, path: Path, force: bool = False) -> None:
        """Write the plan; FileExistsError where the file is there and `force` is False."""
        with replacing(path, force) as temporary:
            temporary.write_text(self.text, encoding="utf-8")

    @property
    def duration(self) -> float:
        """How long it takes [s]: travel, settling and reading of each step, none repeated; see `travel`."""
        waits = sum(self.conditions.dwell + self.conditions.settle * (moved > 0) for moved in self.travel())
        return waits + sum(self.travel())

    def travel(self) -> Iterator[float]:
        """The time [s] of the moves of each step, from the table facing the source and the arm in the beam's path.

        The table is at theta_i and the arm at theta_i + signed theta_r from the source, 180 deg for the incident beam.
        """
        table, arm = 0.0, 180.0
        for step in self.steps:
            to_table, to_arm = table, arm
            if step.kind in DIRECTED:
                theta_i, theta_r, phi = step.direction
                to_table, to_arm = theta_i, theta_i + (theta_r if phi % 360 == 180 else -theta_r)
            elif step.kind == "incident":
                to_arm = 180.0
            yield abs(to_table - table) / self.conditions.table_speed + abs(to_arm - arm) / self.conditions.arm_speed
            table, arm = to_table, to_arm

    def difference(self, other: "Plan") -> str:
        """In what another plan differs first, in one line; empty where it says the same."""
        mine, theirs = self.record, other.record
        for name in (n for n in {**mine, **theirs} if n not in ("steps", "skipped")):
            if mine.get(name) != theirs.get(name):
                return f"{name} is {mine.get(name)} here and {theirs.get(name)} there"
        for number, (here, there) in enumerate(zip(self.steps, other.steps, strict=False), start=1):
            if here != there:
                return f"step {number} is {here} here and {there} there"
        if len(self.steps) != len(other.steps):
            return f"there are {len(self.steps)} steps here and {len(other.steps)} there"
        return "the skipped directions differ" * (mine["skipped"] != theirs["skipped"])


def _toml(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")


def read_plan(path: str | Path) -> Plan:
    """The plan of a file. Raises FormatError with the place of what is wrong in it."""
    path = Path(path)
    text = whole(path, LARGEST)
    try:
        return replace(plan_of(tomllib.loads(text)), name=path.name)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(path, f"is no TOML: {error}") from error
    except (ValueError, TypeError) as error:
        raise FormatError(path, f"is no plan: {error}") from error


def plan_of(record: Mapping[str, Any]) -> Plan:
    """The plan that plain data describe, as `Plan.record` gives them. ValueError for anything else."""
    if record.get("format") != FORMAT:
        raise ValueError(f'its format is {record.get("format", "not stated")!r}, expected "{FORMAT}"')
    named = {one.name: one.type for one in fields(Conditions)}
    if unknown := set(record) - set(named) - {"format", "steps", "skipped"}:
        raise ValueError(f"it states {', '.join(sorted(map(str, unknown)))}, which no plan has: take it out")
    stated = {name: record[name] for name in named if name in record}
    for name, value in stated.items():
        if isinstance(value, str) != (name in ("polarisation", "filter")) or isinstance(value, bool | list | dict):
            raise ValueError(f"{name} is {value!r}")
    steps = tuple(_step(number, row) for number, row in enumerate(_rows(record, "steps"), start=1))
    skipped = tuple(_skipped(number, row) for number, row in enumerate(_rows(record, "skipped"), start=1))
    return Plan(Conditions(**stated), steps, skipped)


def _rows(record: Mapping[str, Any], name: str) -> list[Any]:
    rows = record.get(name, [])
    if isinstance(rows, list):
        return rows
    raise ValueError(f"{name} is no array")


def _step(number: int, row: Any) -> Step:
    kind, angles = (row[0], row[1:]) if isinstance(row, list) and row else ("", [])
    if not isinstance(kind, str) or len(angles) > 3 or not all(map(_is_number, angles)):
        raise ValueError(f'step {number} is {row!r}, expected ["kind", theta_i, theta_r] or with phi')
    try:
        return Step(kind, *map(float, angles))
    except ValueError as error:
        raise ValueError(f"step {number}: {error}") from error


def _skipped(number: int, row: Any) -> Skipped:
    if not isinstance(row, list) or len(row) not in (3, 4) or not all(map(_is_number, row[:-1])):
        raise ValueError(f"skipped direction {number} is {row!r}, expected [theta_i, theta_r, reason] or with phi")
    *angles, reason = row
    phi = float(angles[2]) if len(angles) > 2 else None
    return Skipped(float(angles[0]), float(angles[1]), phi, str(reason))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
