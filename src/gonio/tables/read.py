"""Any table as a scan: the parts put together, and the mapping that was found, for people and for the history."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.files import FormatError
from gonio.measured.dataset import is_degree, make_scan
from gonio.measured.polarimetry.degree import labelled
from gonio.tables import vocabulary as v
from gonio.tables.angles import Directions, directions
from gonio.tables.gather import Gathered, gathered
from gonio.tables.headings import Constant, constants, wavelengths
from gonio.tables.layouts import Part, parts, texts
from gonio.tables.lobes import source_side
from gonio.tables.quantities import Meaning, converted, meaning
from gonio.tables.request import Asker, Request, Target, request
from gonio.tables.source import Sheet, number, sheets

VISIBLE = (150.0, 20_000.0)  # a wavelength without a unit in this range is in nm


@dataclass(frozen=True)
class Table:
    """A table that was read: the scan, and how: the layout, the mapping by target, and what has to be said."""

    scan: xr.Dataset
    how: str
    layout: str
    mapping: list[dict[str, str]]
    notes: list[str]
    warnings: list[str]
    is_stated: bool  # whether names, units and quantity are all stated in the headings of one long table

    @property
    def lines(self) -> list[str]:
        """The mapping for people, one line a target."""
        said = [
            f"{one['target']}: {one['from']}"
            + (f" [{one['unit']}]" if one["unit"] else "")
            + (f" ({one['how']})" if one["how"] else "")
            for one in self.mapping
        ]
        return [f"{self.layout} table: {self.how}", *said, *self.notes]


def read_table(
    path: str | Path,
    *,
    columns: Mapping[str, str] | str | None = None,
    layout: str = "",
    rows: str = "",
    values: str = "",
    quantity: str = "",
    flip: bool = False,
    sheet: str = "",
) -> xr.Dataset:
    """Read a scan from any table: text such as CSV, or a workbook (.xlsx, .xls, .ods).

    Whatever the headings and units do not settle has to be said; docs/tables.md says how tables are understood.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping or str
        What columns are, by their heading or number: `{"AOI": "theta_i", "U": "uncertainty:k=2"}`, or the text that
        `gonio import --columns` takes.
    layout : str
        `long`, `matrix`, `blocks` or `sheets`.
    rows : str
        `theta_i` or `theta_r`, the angle of a matrix's rows.
    values : str
        A pattern of the headings of several columns of values, one a wavelength: `*nm`.
    quantity : str
        `brdf`, `ccbsdf`, `reflectance-factor`, `radiant-intensity`, `log10-brdf` or `signal`; `:percent` after it
        where the values are in percent.
    flip : bool, optional
        Whether directions count to the other side of the normal.
    sheet : str
        The sheet of a workbook with several.

    Returns
    -------
    xarray.Dataset
        A scan as `gonio.read` gives it, with the meaning of each column in its history.

    Raises
    ------
    FormatError
        A ValueError: something is not certain. It names the line, and the argument or command that settles it.

    """
    asked = request(columns=columns, layout=layout, rows=rows, values=values, quantity=quantity, flip=flip, sheet=sheet)
    return understood(Path(path), asked).scan


def understood(path: Path, asked: Request) -> Table:
    """A file as a table. Raises FormatError."""
    found = sheets(path)
    if asked.sheet:
        known = ", ".join(repr(s.name) for s in found)
        found = [s for s in found if s.name == asked.sheet]
        if not found:
            raise FormatError(path, f"has no sheet {asked.sheet!r}; there are {known}", "line 1")
    asker = Asker(path, asked)
    tables = [(s, parts(s, Asker(path, asked, s.name))) for s in found]
    some = [(s, of) for s, of in tables if of]
    if not some:
        what = "no table is there: no row of headings above rows of numbers"
        raise asker.wrong(f"{what}; name the columns by --columns 1=theta_i,2=theta_r,3=brdf", found[0].rows[0].line)
    if len(some) > 1:
        _by_sheet(some, asker)
    for part in some[0][1] if len(some) == 1 else []:
        part.constants = {c.target: c for c in constants(part.sheet)} | part.constants
    return assembled([part for _, of in some for part in of], some[0][0].how, asker, len(some))


def _by_sheet(some: list[tuple[Sheet, list[Part]]], asker: Asker) -> None:
    """Give the tables of each sheet what its name states. FormatError where no name tells them apart."""
    stated = {s.name: {c.target: c for c in constants(s.name)} for s, _ in some}
    if not any(stated.values()) and all(number(s.name) is not None for s, _ in some):
        stated = {s.name: {"theta_i": Constant("theta_i", number(s.name) or 0.0, "", s.name)} for s, _ in some}
    if not any(stated.values()):
        degrees = {s.name: constants(f"theta_i {s.name}") for s, _ in some}
        if all(len(c) == 1 for c in degrees.values()):
            stated = {
                name: {"theta_i": Constant("theta_i", c[0].value, c[0].unit, name)} for name, c in degrees.items()
            }
    for sheet, of in some:
        for part in of:
            part.constants = stated[sheet.name] | part.constants
    own = [tuple(sorted((c.target, c.value) for p in of for c in p.constants.values())) for _, of in some]
    if len(set(own)) < len(own) or not all(own):
        names = ", ".join(repr(s.name) for s, _ in some[:8])
        what = f"the sheets {names} hold tables, and nothing says by which angle they differ; to read the first"
        raise asker.ask(what, some[0][1][0].line, sheet=some[0][0].name)


def assembled(some: list[Part], how: str, asker: Asker, of_sheets: int = 1) -> Table:
    """Tables of one kind as one scan."""
    found = gathered(some, asker)
    titles = list(texts(some))
    of = meaning(found, titles, asker)
    where = directions(found, asker)
    ready = converted(found, of, where.theta_r, asker)
    if not np.any(np.nan_to_num(ready.brdf)):
        raise asker.wrong("every value is zero or missing", int(found.lines[0]))
    notes = [*where.notes, *ready.notes, *_wavelength(found, titles, asker)]
    sets = {name: found.data[name] for name in (*v.TEXTS, "wavelength") if name in found.data}
    if found.sources["brdf"].mode and "mode" not in sets:
        sets["mode"] = np.full(len(found.lines), found.sources["brdf"].mode)
        notes.append("the values are of transmission, as the heading says (BTDF)")
    layout = _layout(some, of_sheets)
    mapping = _mapping(found, where, of)
    notes += [f"kept and not used: {', '.join(map(repr, found.further))}"] if found.further else []
    notes += [f"left out: {', '.join(found.ignored)}"] if found.ignored else []
    table = Table(xr.Dataset(), how, layout, mapping, notes, [], _is_stated(some, found, of, layout))
    variables: dict[str, Any] = {name: (values, "1") for name, values in found.further.items()}
    if of.quantity == "signal":
        variables["signal"] = (found.data["brdf"], "1")  # as read, for `gonio reduce`
    variables |= {"mask": (_mask(found, asker), "1")} if "mask" in found.data else {}
    if "uncertainty_systematic" in ready.uncertainties:
        variables["uncertainty_systematic"] = (ready.uncertainties["uncertainty_systematic"], of.unit)
    scan = make_scan(
        where.theta_i,
        where.theta_r,
        ready.brdf,
        where.phi,
        phi_i=where.phi_i,
        uncertainty=ready.uncertainties.get("uncertainty"),
        unit=of.unit,
        coordinates=sets,
        variables=variables | {"line": (found.lines, "1")},
        provenance="\n".join(dict.fromkeys(t.lstrip("#%!/ ") for t in titles)),
        history="\n".join([f"read from {asker.path.name} as a {table.lines[0]}", *table.lines[1:]]),
    )
    scan = asker.checked(lambda: labelled(scan)) if is_degree(scan) else scan
    return Table(scan, how, layout, mapping, notes, source_side(scan, asker), table.is_stated)


def _layout(some: list[Part], of_sheets: int) -> str:
    if of_sheets > 1:
        return f"{some[0].kind} (one of {of_sheets} sheets)" if some[0].kind == "matrix" else "sheets"
    return "blocks" if len(some) > 1 else some[0].kind


def _wavelength(found: Gathered, titles: list[str], asker: Asker) -> list[str]:
    """Wavelengths in nm, taken from the text above where it names exactly one; returns what has to be said."""
    if "wavelength" not in found.data:
        named = set().union(*map(wavelengths, titles)) if titles else set()
        if len(named) != 1:
            return [f"took no wavelength from the text above the table, which names {len(named)}"] if named else []
        found.data["wavelength"] = np.full(len(found.lines), named.pop())
        return [f"took the wavelength {found.data['wavelength'][0]:g} nm from the text above the table"]
    source, values = found.sources["wavelength"], found.data["wavelength"]
    said = []
    if not source.unit:
        if not ((values >= VISIBLE[0]) & (values <= VISIBLE[1])).all():
            what = f"{source.text} is a wavelength without a unit; if it is in um"
            raise asker.ask(what, int(found.lines[0]), columns={source.key or "wavelength": Target("wavelength", "um")})
        said = [f"wavelengths of {values.min():g} to {values.max():g} without a unit are taken as nm"]
    found.data["wavelength"] = np.round(values * (v.UNITS[source.unit].size if source.unit else 1.0), 9)
    if not (found.data["wavelength"] > 0).all():
        row = int(np.argmin(found.data["wavelength"]))
        raise asker.wrong(f"wavelength is {values[row]:g}, not positive", int(found.lines[row]))
    return said


def _mask(found: Gathered, asker: Asker) -> np.ndarray:
    values = found.data["mask"]
    if bad := np.flatnonzero(~((values >= 0) & (values <= 127) & (values == np.round(values)))).tolist():
        raise asker.wrong(f"mask is {values[bad[0]]:g}, not a whole number from 0 to 127", int(found.lines[bad[0]]))
    return values.astype(np.int8)


def _mapping(found: Gathered, where: Directions, of: Meaning) -> list[dict[str, str]]:
    """For each target where it comes from, its unit, and how that is known."""
    out = []
    for target, source in found.sources.items():
        unit, how = source.unit, where.how.get(target, "")
        if target in v.ANGLES and not unit:
            unit = "deg"
        if target == "brdf":
            percent = " in percent" if of.percent else ""
            unit, how = of.unit.replace("sr-1", "1/sr"), f"{v.QUANTITIES[of.quantity].title}{percent}, {of.how}"
        elif target in v.UNCERTAINTIES and source.coverage != 1:
            how = f"divided by k = {source.coverage:g}"
        out.append({"target": target, "from": source.text, "unit": unit, "how": how})
    return out


def _is_stated(some: list[Part], found: Gathered, of: Meaning, layout: str) -> bool:
    """Whether everything is stated in the headings of one long table: names, units and the quantity."""
    if layout != "long" or some[0].kind != "long" or of.how.startswith("assumed") or found.ignored:
        return False
    sources = found.sources
    with_unit = [t for t in (*v.ANGLES, "wavelength", "brdf", *v.UNCERTAINTIES) if t in sources]
    without = ["brdf"] * (of.quantity in ("log10-brdf", "dolp")) + [*v.UNCERTAINTIES] * (of.quantity == "dolp")
    if not all(sources[t].unit or t in without for t in with_unit):
        return False
    plain = of.quantity == "reflectance-factor" or sources["brdf"].kind in (v.ABSOLUTE, v.RELATIVE)
    return bool(sources["brdf"].quantity) and (plain or of.quantity in ("log10-brdf", "dolp"))
