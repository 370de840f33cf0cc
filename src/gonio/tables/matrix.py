"""Which angle the rows of a matrix hold, and which its columns."""

from dataclasses import dataclass, replace

import numpy as np

from gonio.tables import vocabulary as v
from gonio.tables.headings import Heading, parsed
from gonio.tables.layouts import Part, angle_of, corner
from gonio.tables.request import ROWS, Asker, Target
from gonio.tables.source import number


@dataclass(frozen=True)
class Axis:
    """One axis of a matrix: what it holds, its unit (empty where none is stated), and by what that is known."""

    target: str
    unit: str
    text: str


@dataclass(frozen=True)
class Axes:
    """Both axes, the places of the columns and their angles; and of the cells what the corner says of them."""

    rows: Axis
    columns: Axis
    places: list[int]
    angles: np.ndarray
    unit: str = ""
    quantity: str = ""


def axes(part: Part, asker: Asker) -> Axes:
    """The axes of a matrix, by the user, the names in the corner and above, and the signs. Raises FormatError."""
    places, found = [], []
    for k, text in enumerate(part.headings[1:], start=1):
        value = number(text)
        angle = angle_of(value if value is not None else text) if text else None
        if angle is not None:
            places.append(k)
            found.append(angle)
        elif text or any(c is not None for c in part.column(k)):
            raise asker.wrong(f"the heading {text!r} of a column of the matrix is no angle", part.line)
    angles = np.array([a.value for a in found])
    names = _names(part, asker)
    cell = next((h for h in names if h.target == "brdf"), None)
    above = {v.QUANTITY_NAMES[v.squeezed(a.text)] for a in found if a.text}
    if len(above) > 1:
        raise asker.wrong(
            f"the columns of the matrix are {' and '.join(sorted(above))}: one quantity at a time", part.line
        )
    named = [h for h in names if h.target in (*v.ANGLES, "wavelength")]
    own = next((a for a in found if a.target), None)
    rows, columns = _targets(named, own.target if own else _above(part), part, angles, asker)
    unit = next((h.unit for h in names if h.unit and h.kind in (v.ANGLE, v.LENGTH)), "") or (
        part.units[0] if part.units else ""
    )
    stated = [h for h in (named[1:] or named) if h.unit]
    of_columns = next((a.unit for a in found if a.unit), "") or (
        stated[0].unit if stated and stated[0].kind == v.ANGLE else unit if rows != "wavelength" else ""
    )
    how = "--rows" if asker.request.rows else f"the heading {part.headings[0]!r}" if named else "the signs"
    return Axes(
        Axis(rows, unit, f"the rows of the matrix (by {how})"),
        Axis(columns, of_columns, "the columns of the matrix"),
        places,
        angles,
        cell.unit if cell else "",
        cell.quantity if cell else above.pop() if above else "",
    )


def _names(part: Part, asker: Asker) -> list[Heading]:
    """What the corner names: the rows, and after a stroke the columns; or the values."""
    said = {name.casefold(): target for name, target in asker.request.columns.items()}
    names = []
    for name in corner(part.headings[0] or None):
        heading = parsed(name)
        if target := said.get(name.casefold()) or said.get(part.headings[0].casefold()):
            heading = replace(heading, target=target.name, unit=target.unit or heading.unit)
        elif heading.other_unit and heading.target in v.ANGLES:
            what = f"the corner {name!r} has {heading.other_unit!r} where a unit is known; if it is deg"
            raise asker.ask(what, part.line, columns={name: Target(heading.target, "deg")})
        elif heading.weak and heading.target == "theta_r":
            continue
        names.append(heading)
    return names


def _above(part: Part) -> str:
    """The angle that the line above the headings names alone, which is that of the columns; else empty."""
    heading = parsed(part.titles[-1]) if part.titles else Heading("")
    return heading.target if heading.target in v.ANGLES and not heading.weak else ""


def _targets(named: list[Heading], of_columns: str, part: Part, angles: np.ndarray, asker: Asker) -> tuple[str, str]:
    row_angles = np.array([c for row in part.rows if isinstance(c := row.cells[0], float)])
    if asker.request.rows:
        rows = asker.request.rows
        columns = ROWS[1 - ROWS.index(rows)]
    elif named:
        rows = named[0].target
        columns = named[1].target if len(named) > 1 else of_columns or _other(rows, part)
    elif of_columns:
        columns = of_columns
        rows = _other(columns, part)
    elif (row_angles < 0).any() != (angles < 0).any():
        rows, columns = ("theta_r", "theta_i") if (row_angles < 0).any() else ("theta_i", "theta_r")
    else:
        what = (
            "nothing says whether the rows of the matrix are incidence angles (--rows theta_i) or those of the detector"
        )
        raise asker.ask(what, part.line, layout="matrix", rows="theta_r")
    for target, values in ((rows, row_angles), (columns, angles)):
        if target == "theta_i" and (values < 0).any():
            what = (
                "incidence angles are never below zero, and those of this matrix are; if rows and columns are exchanged"
            )
            raise asker.ask(what, part.line, rows="theta_r" if target == rows else "theta_i")
    if not _are_two(rows, columns, part):
        what = f"the rows of the matrix are {rows or 'unknown'} and its columns {columns or 'unknown'}"
        raise asker.wrong(f"{what}: name both in the corner, as in theta_r/theta_i", part.line)
    return rows, columns


def _other(target: str, part: Part) -> str:
    """The angle of the other axis: that of the other side, or the azimuth where a line above states the incidence."""
    if target in (*v.INCIDENT, "wavelength"):
        return "theta_r"
    return "" if set(part.constants) & set(v.INCIDENT) else "theta_i"


def _are_two(rows: str, columns: str, part: Part) -> bool:
    both = {rows, columns}
    if "wavelength" in both:
        return bool(set(part.constants) & set(v.INCIDENT) and both & set(v.REFLECTED))
    if both & set(v.INCIDENT):
        return bool(both & set(v.REFLECTED))
    return bool(set(part.constants) & set(v.INCIDENT) and both & set(v.REFLECTED) and both & {"phi", "phi_r"})
