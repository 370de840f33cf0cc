"""Where sun and observer are over time, as a CSV table; every column has its unit in its name.

One of three tables:

    sun_altitude_deg, sun_azimuth_deg, altitude_deg, azimuth_deg, height_km     what an observer on the ground sees
    sun_x, sun_y, sun_z, observer_x_km, observer_y_km, observer_z_km            vectors from the body, in its frame
    theta_i_deg, theta_r_deg, phi_deg, distance_km                              angles of one facet with the normal z

Lengths may be in m (`height_m`). Vectors may come with position_x_km, .. from the Earth's centre to the body, and with
altitude_deg over the observer's horizon. `time` is anything; magnitude_mag and magnitude_std_mag are observed.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.door.text import head, lines, number
from gonio.files import FormatError
from gonio.outside import nearest, printable
from gonio.photometry.vectors import Sight, from_horizon

Values = npt.NDArray[np.float64]

HORIZON = ("sun_altitude_deg", "sun_azimuth_deg", "altitude_deg", "azimuth_deg", "height_m")
SUN = ("sun_x", "sun_y", "sun_z")
OBSERVER = ("observer_x_m", "observer_y_m", "observer_z_m")
POSITION = ("position_x_m", "position_y_m", "position_z_m")
SINGLE = ("theta_i_deg", "theta_r_deg", "phi_deg", "distance_m")
TIME, MEASURED, SPREAD = "time", "magnitude_mag", "magnitude_std_mag"
NUMBERS = (*HORIZON, *SUN, *OBSERVER, *POSITION, *SINGLE, MEASURED, SPREAD)
ALL = (*dict.fromkeys((TIME, *NUMBERS, *(n[:-2] + "_km" for n in NUMBERS if n.endswith("_m")))),)
REMEDY = "give sun_altitude_deg, sun_azimuth_deg, altitude_deg, azimuth_deg and height_km; or vectors; or angles"


@dataclass(frozen=True)
class Pass:
    """Sun, observer and Earth over time, and what was observed.

    sun, observer (times, 3); position (times, 3) and altitude (times,) [deg] are None where the table has none.
    time: as the table has it, numbers from 1 where it has none. measured, spread (times,) [mag]: NaN where there is
    none. unused: columns that mean nothing here.
    """

    sun: Values
    observer: Values
    position: Values | None
    altitude: Values | None
    time: list[str]
    measured: Values
    spread: Values
    unused: tuple[str, ...]


def read_pass(path: str | Path) -> Pass:
    """The table of a file. Raises FormatError with the line and the column of what is wrong, or what lacks."""
    path = Path(path)
    names, rows = _table(path)
    columns = {name: [row[k] for _, row in rows] for k, name in enumerate(names)}
    found: dict[str, Values] = {}
    for name in names:
        base, factor = (name[:-3] + "_m", 1e3) if name.endswith("_km") else (name, 1.0)
        if base in NUMBERS:
            gaps = base in (MEASURED, SPREAD)
            words = zip((line for line, _ in rows), columns[name], strict=True)
            values = [np.nan if gaps and not w.strip() else number(path, line, w.strip(), name) for line, w in words]
            if base in found:
                raise FormatError(path, f"has {base} in m and in km: give one", f"line {rows[0][0]}")
            found[base] = factor * np.array(values)
    try:
        sight, altitude = _sight(found)
    except ValueError as error:
        raise FormatError(path, str(error)) from error
    missing = np.full(len(rows), np.nan)
    time = columns.get(TIME, [str(k) for k in range(1, len(rows) + 1)])
    unused = tuple(name for name in names if name not in ALL)
    return Pass(
        sight.sun,
        sight.observer,
        sight.position if sight.position.size else None,
        altitude,
        [word.strip() for word in time],
        found.get(MEASURED, missing),
        found.get(SPREAD, missing),
        unused,
    )


def _table(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The names of the columns, and every row with its line."""
    rows = list(_rows(path))
    if len(rows) < 2:
        raise FormatError(path, "holds no rows: a line with the names of the columns, and one for each time")
    (first, words), *body = rows
    names = [name.strip() for name in words]
    if twice := [name for name in names if names.count(name) > 1]:
        raise FormatError(path, f"has two columns {printable(twice[0])!r}", f"line {first}")
    for line, row in body:
        if len(row) != len(names):
            raise FormatError(path, f"has {len(row)} values, and the table {len(names)} columns", f"line {line}")
    return names, body


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    head(path, 1)  # refuses in its own words what is no text file
    for line, text in lines(path):
        if text.strip() and not text.lstrip().startswith("#"):
            yield line, next(csv.reader([text]))


def _sight(found: dict[str, Values]) -> tuple[Sight, Values | None]:
    """Vectors of whichever table it is, without a position where none is stated; ValueError for none or two."""
    asked = [group for group in (HORIZON, (*SUN, *OBSERVER), SINGLE) if set(group[:-1]) & set(found) - {"altitude_deg"}]
    if len(asked) != 1:
        what = "mixes two kinds of columns" if asked else "names neither sun nor observer"
        close = f" ({nearest(next(iter(found)), ALL)})" if found and not asked else ""
        raise ValueError(f"{what}{close}: {REMEDY}")
    (group,) = asked
    if lacking := [name for name in group if name not in found]:
        raise ValueError(f"has no column {lacking[0]}: {', '.join(group)} belong together")
    if group is HORIZON:
        return from_horizon(*(found[name] for name in HORIZON)), found["altitude_deg"]
    nothing = np.empty((0, 3))
    if group is SINGLE:
        return _of_angles(*(found[name] for name in SINGLE)), None
    sun, observer = (np.stack([found[n] for n in names], axis=1) for names in (SUN, OBSERVER))
    given = [name for name in POSITION if name in found]
    if given and len(given) < len(POSITION):
        raise ValueError(f"has {given[0]} alone: {', '.join(POSITION)} belong together")
    position = np.stack([found[n] for n in POSITION], axis=1) if given else nothing
    return Sight(sun, observer, position), found.get("altitude_deg")


def _of_angles(theta_i: Values, theta_r: Values, phi: Values, distance: Values) -> Sight:
    """Vectors in the frame of a facet whose normal is z, the sun over its x axis."""
    if not (distance > 0).all():
        raise ValueError("a distance is not above 0")
    i, r, p = np.radians([theta_i, theta_r, phi])
    sun = np.stack([np.sin(i), np.zeros_like(i), np.cos(i)], axis=1)
    towards = np.stack([np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)], axis=1)
    return Sight(sun, distance[:, None] * towards, np.empty((0, 3)))
