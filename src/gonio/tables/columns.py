"""Which column of a long table is what: by what the user says, then by its heading, and never by guess."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from gonio.door.text import clip
from gonio.tables import vocabulary as v
from gonio.tables.headings import Heading, parsed
from gonio.tables.layouts import Part
from gonio.tables.request import Asker, Target
from gonio.tables.source import number

NUMBERED = 180.0  # no angle is larger: headings that are numbers above this may be wavelengths in nm
LONGEST_KEY = 40  # characters of a heading by which a command names a column
DOLP = "dolp"  # the quantity of degrees of polarisation
FURTHER = "further"  # the target of a column that is kept and takes no part


@dataclass(frozen=True)
class Column:
    """One column and what it is: its place from 0, its heading, and by what its target is known."""

    place: int
    heading: Heading
    target: str
    channel: str = ""
    of: str = ""  # of an uncertainty in percent: relative, or percentage points
    by_user: bool = False
    is_twice: bool = False  # whether another column has the same heading

    @property
    def name(self) -> str:
        """How a message calls it."""
        return repr(clip(self.heading.text)) if self.heading.text else f"number {self.place + 1}"

    @property
    def key(self) -> str:
        """How `--columns` names it."""
        usual = 0 < len(self.heading.text) <= LONGEST_KEY and self.heading.text.isprintable()
        return self.heading.text if usual and not self.is_twice else str(self.place + 1)


def columns(part: Part, asker: Asker) -> list[Column]:
    """Every column of a long table that is not wholly empty. Raises FormatError where one is not certain."""
    return _Columns(part, asker).found()


class _Columns:
    """The columns of one table on their way to what they are."""

    def __init__(self, part: Part, asker: Asker) -> None:
        self.part, self.asker, self.request = part, asker, asker.request
        self.places = [k for k in range(part.width) if any(c is not None for c in part.column(k)) or part.headings[k]]

    def found(self) -> list[Column]:
        sniffed = [self._sniffed(k) for k in self.places]
        said = self._said(sniffed)
        found = [said.get(c.place, c) for c in sniffed]
        found = self._without_rivals(self._values_by_pattern(found))
        found = _without_degrees(self._channels(found))
        self._refuse_unclear(found)
        self._refuse_twice(found)
        found = self._with_weak(found)
        self._refuse_lacking(found)
        return self._further(found)

    def _sniffed(self, k: int) -> Column:
        unit = self.part.units[k] if k < len(self.part.units) else ""
        heading = parsed(self.part.headings[k], unit) if self.part.headings[k] else Heading("")
        if heading.target in v.TEXTS and heading.target != "channel" and heading.unit:
            heading = replace(heading, target="")
        twice = self.part.headings.count(self.part.headings[k]) > 1
        return Column(k, heading, "" if heading.weak else heading.target, is_twice=twice)

    def _said(self, sniffed: list[Column]) -> dict[int, Column]:
        """The columns that `--columns` names, by place."""
        found = {}
        for name, target in self.request.columns.items():
            same = [c for c in sniffed if c.heading.text == name]
            same = same or [c for c in sniffed if v.plain(c.heading.text).casefold() == v.plain(name).casefold()]
            if not same and name.isdecimal():
                same = [c for c in sniffed if c.place == int(name) - 1]
            if len(same) != 1:
                known = ", ".join(repr(clip(c.heading.text)) for c in sniffed[:8] if c.heading.text) or "none"
                what = (
                    "is twice among the headings: name it by its number"
                    if same
                    else f"is no heading; there are {known}"
                )
                raise self.asker.wrong(f"--columns names {clip(name)!r}, which {what}", self.part.line)
            found[same[0].place] = _as_said(same[0], target)
        return found

    def _values_by_pattern(self, found: list[Column]) -> list[Column]:
        """Where `--values` names a pattern: the columns with such headings are the values, and no others are."""
        pattern = self.request.values
        if not pattern:
            return found
        chosen = [c for c in found if c.heading.text and fnmatchcase(c.heading.text.casefold(), pattern.casefold())]
        chosen = [c for c in chosen if not c.by_user and c.heading.target not in v.UNCERTAINTIES]
        if not chosen:
            known = ", ".join(repr(clip(c.heading.text)) for c in found[:8])
            raise self.asker.wrong(f"--values {pattern!r} fits none of the headings {known}", self.part.line)
        places = {c.place for c in chosen}
        out = [
            c if c.by_user or c.target not in v.VALUES else replace(c, target="")
            for c in found
            if c.place not in places
        ]
        out += [self._as_value(c, len(chosen)) for c in chosen]
        return sorted(out, key=lambda c: c.place)

    def _as_value(self, column: Column, of: int) -> Column:
        heading = column.heading
        value = number(heading.text) if heading.wavelength is None else None
        if value is not None:
            unit = self.request.values_unit or ("nm" if value > NUMBERED else "")
            if not unit:
                what = f"the heading {heading.text!r} is a wavelength without a unit"
                raise self.asker.ask(what, self.part.line, values_unit="um")
            heading = replace(heading, wavelength=value * v.UNITS[unit].size)
        target = heading.target if heading.target in v.VALUES else "brdf"
        channel = heading.text if heading.wavelength is None and of > 1 else ""
        kept = heading if heading.target in v.VALUES else replace(heading, quantity="")
        return Column(column.place, replace(kept, target=target, weak=False), target, channel, by_user=True)

    def _without_rivals(self, found: list[Column]) -> list[Column]:
        """Where the user names the column of a target, another whose heading names it too is left out."""
        said = {c.target for c in found if c.by_user}
        if said & set(v.VALUES):
            said |= set(v.VALUES)
        for group in (v.INCIDENT, v.REFLECTED, ("phi", "phi_r")):
            said |= set(group) if said & set(group) else set()
        return [replace(c, target=v.IGNORE) if c.target in said and not c.by_user else c for c in found]

    def _channels(self, found: list[Column]) -> list[Column]:
        """Columns called R, G and B, where all three stand and no other column has values."""
        by_name = {c.heading.text.strip().casefold(): c for c in found if not c.by_user}
        for names in v.COLOURS:
            if set(names) <= set(by_name) and not any(
                c.target in v.VALUES and c not in by_name.values() for c in found
            ):
                places = {by_name[n].place: by_name[n].heading.text.strip() for n in names}
                return [
                    replace(c, target="brdf", heading=Heading(c.heading.text, "brdf"), channel=places[c.place])
                    if c.place in places
                    else c
                    for c in found
                ]
        return found

    def _refuse_unclear(self, found: list[Column]) -> None:
        for c in found:
            if c.target == v.IGNORE:
                continue
            if c.heading.other_unit and not c.by_user and c.target:
                unit = (
                    "sr-1" if c.target in (*v.VALUES, *v.UNCERTAINTIES) else "nm" if c.target == "wavelength" else "deg"
                )
                what = f"the heading {c.name} has {clip(c.heading.other_unit)!r} where a unit is known; if it is {unit}"
                raise self.asker.ask(what, self.part.line, columns={c.key: Target(c.target, unit)})
            if c.target in v.UNCERTAINTIES and c.heading.coverage == 0 and not c.by_user:
                what = (
                    f"the heading {c.name} says not by which factor k the uncertainty was multiplied; if k is 2 "
                    "(write k=1 for a standard uncertainty)"
                )
                raise self.asker.ask(what, self.part.line, columns={c.key: Target(c.target, c.heading.unit, 2.0)})

    def _refuse_twice(self, found: list[Column]) -> None:
        """Two columns of one meaning, such as two that may both be the BRDF."""
        values = [c for c in found if c.target in v.VALUES]
        sets = [(c.heading.wavelength, c.channel) for c in values]
        mixed = any((w is None and not ch) for w, ch in sets)
        if len(values) > 1 and (mixed or len(set(sets)) < len(sets)):
            raise self._rivals(values, "the values")
        groups = [v.INCIDENT, v.REFLECTED, ("phi", "phi_r"), *((t,) for t in ("phi_i", "wavelength", *v.TEXTS, "mask"))]
        for group in groups:
            rivals = [c for c in found if c.target in group]
            if len(rivals) > 1:
                raise self._rivals(rivals, group[0])
        for target in v.UNCERTAINTIES:
            rivals = [c for c in found if c.target == target]
            of = [c.heading.wavelength for c in rivals]
            if len(rivals) > 1 and (None in of or len(set(of)) < len(of)):
                raise self._rivals(rivals, target)

    def _rivals(self, rivals: list[Column], what: str) -> Exception:
        listed = " and ".join(c.name for c in rivals[:4])
        first = rivals[0]
        others = {c.key: Target(v.IGNORE) for c in rivals[1:]}
        said = f"the columns {listed} may each be {what}; if it is the first"
        return self.asker.ask(
            said, self.part.line, columns={first.key: Target(first.target, first.heading.unit), **others}
        )

    def _with_weak(self, found: list[Column]) -> list[Column]:
        """A name such as `angle` or `value` has its meaning where no other column has it and no second has the name."""
        targets = {c.target for c in found} | set(self.part.constants)
        groups = {"theta_r": v.REFLECTED, "brdf": v.VALUES}
        for target, group in groups.items():
            weak = [c for c in found if not c.target and c.heading.weak and c.heading.target == target]
            needed = target != "theta_r" or targets & set(v.INCIDENT)
            if len(weak) == 1 and needed and not targets & set(group):
                found = [replace(c, target=target) if c is weak[0] else c for c in found]
        return found

    def _refuse_lacking(self, found: list[Column]) -> None:
        """What no column and no line above says, with the columns that may be it."""
        targets = {c.target for c in found} | set(self.part.constants)
        lacking = [group[0] for group in (v.INCIDENT, v.REFLECTED, v.VALUES) if not targets & set(group)]
        free = [c for c in found if not c.target and self._has_numbers(c)]
        if lacking:
            raise self._lacking(lacking, free)
        for c in free:
            if c.heading.kind in (v.ANGLE, v.LENGTH) or not c.heading.text:
                what = f"the column {c.name} is not understood and may be an angle or a wavelength; to leave it out"
                raise self.asker.ask(what, self.part.line, columns={c.key: Target(v.IGNORE)})

    def _has_numbers(self, column: Column) -> bool:
        return any(isinstance(c, float) for c in self.part.column(column.place))

    def _lacking(self, lacking: list[str], free: list[Column]) -> Exception:
        names = " and ".join(lacking)
        shown = ", ".join(c.name for c in free[:8])
        if all(number(c.heading.text) is not None for c in free) and free and lacking == ["brdf"]:
            what = "no column is the values: the headings that are numbers may be wavelengths; if they are"
            return self.asker.ask(what, self.part.line, values="[0-9]*")
        if not shown or len(free) < len(lacking):
            headings = ", ".join(clip(h) for h in self.part.headings[:8] if h) or "none"
            what = f"no column is {names} (headings: {headings}), and no line above the table says it"
            return self.asker.wrong(f"{what}: name the columns by --columns HEADING={lacking[0]}", self.part.line)
        proposed = {c.key: Target(name) for c, name in zip(free, lacking, strict=False)}
        what = f"no heading says which column is {names}; not understood: {shown}; if they are these in this order"
        return self.asker.ask(what, self.part.line, columns=proposed)

    def _further(self, found: list[Column]) -> list[Column]:
        return [c if c.target else replace(c, target=FURTHER) for c in found]


def _as_said(column: Column, said: Target) -> Column:
    """A column as the user says it is; what the user leaves open, the heading may say."""
    heading = column.heading
    same_kind = heading.unit and (
        (said.name in v.ANGLES and heading.kind == v.ANGLE)
        or (said.name == "wavelength" and heading.kind == v.LENGTH)
        or (said.name in (*v.VALUES, *v.UNCERTAINTIES) and heading.kind not in (v.ANGLE, v.LENGTH))
    )
    unit = said.unit or (heading.unit if same_kind else "")
    quantity = heading.quantity if said.name in v.VALUES else ""
    coverage = said.coverage if said.coverage is not None else heading.coverage or 1.0
    is_relative = heading.is_relative and said.name in v.UNCERTAINTIES
    new = replace(heading, target=said.name, unit=unit, quantity=quantity, coverage=coverage, is_relative=is_relative)
    new = replace(new, weak=False, other_unit="")
    return replace(column, heading=new, target=said.name, of=said.of, by_user=True)


def values_of(found: list[Column]) -> Iterator[Column]:
    """The columns of values."""
    return (c for c in found if c.target in v.VALUES)


def _without_degrees(found: list[Column]) -> list[Column]:
    """Beside other values those of degrees of polarisation, and their uncertainties, are further columns."""
    values = [c for c in found if c.target in v.VALUES]
    if all(c.heading.quantity == DOLP for c in values):
        return found

    def is_of_degrees(c: Column) -> bool:
        of_it = c.heading.quantity == DOLP or (c.target in v.UNCERTAINTIES and DOLP in v.squeezed(c.heading.text))
        return of_it and not c.by_user

    return [replace(c, target="") if is_of_degrees(c) else c for c in found]
