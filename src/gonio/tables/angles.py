"""Angles of a table in degrees, and the directions that they are."""

import math
from dataclasses import dataclass

import numpy as np

from gonio.measured.dataset import HORIZON
from gonio.tables import vocabulary as v
from gonio.tables.gather import Gathered
from gonio.tables.request import Asker, Target

CIRCLE = 2.0 * math.pi
DIGITS = 6  # of an angle in degrees that was converted: tables have no more, and 1.3962634 rad is 80 deg
NOISE = 9  # of a sum of angles, against the last bit of floating point
MOST = 1e6  # of an angle in any unit; a larger azimuth has lost its digits to rounding
NEAR = 1e-3  # rad: how near to a multiple of a quarter of pi an angle in radians is written


@dataclass(frozen=True)
class Directions:
    """Angles in degrees: theta_r is signed where there is no phi. `how` says for each how it was found."""

    theta_i: np.ndarray
    theta_r: np.ndarray
    phi: np.ndarray | None
    phi_i: np.ndarray | None
    how: dict[str, str]
    notes: list[str]


def in_degrees(found: Gathered, asker: Asker) -> dict[str, tuple[np.ndarray, str]]:
    """The angles by target in degrees, each with how its unit is known.

    An angle without a unit is in degrees where one of all that have none exceeds 2 pi. FormatError where none does,
    and where one of them is written as radians are.
    """
    angles = {t: found.data[t] for t in v.ANGLES if t in found.data}
    for target, values in angles.items():
        if (beyond := np.abs(values) > MOST).any():
            row = int(beyond.argmax())
            raise asker.wrong(f"{target} is {values[row]:g}, which is no angle", int(found.lines[row]))
    unsaid = {t: a for t, a in angles.items() if not found.sources[t].unit and np.any(a)}
    large = any((np.abs(a) > CIRCLE).any() for a in unsaid.values())
    for target, values in unsaid.items():
        if not large or _written_in_radians(values):
            raise _ask_unit(target, unsaid, found, asker)
    out = {}
    for target, values in angles.items():
        unit = found.sources[target].unit
        if unit in ("", "deg"):
            how = "" if unit else "deg, as angles exceed 2 pi" if target in unsaid else "all 0"
            out[target] = (values, how)
        else:
            out[target] = (
                np.round(values * v.UNITS[unit].size, DIGITS) + 0.0,
                f"from {unit}, rounded to 1e-{DIGITS} deg",
            )
    return out


def _ask_unit(target: str, unsaid: dict[str, np.ndarray], found: Gathered, asker: Asker) -> Exception:
    """The question for the unit of an angle: with the likelier one for all columns that have none."""
    line, source = int(found.lines[0]), found.sources[target]
    what = f"{target} ({source.text}) has no unit, and its values may be degrees or radians"
    if not source.key:
        return asker.wrong(f"{what}: write the unit into the file, as in 10 deg", line)
    together = np.concatenate([np.abs(a) for a in unsaid.values()])
    unit = "rad" if together.max() <= CIRCLE and (together != np.round(together)).any() else "deg"
    columns = {found.sources[t].key: Target(t, unit) for t in unsaid if found.sources[t].key}
    return asker.ask(f"{what}; if they are {'radians' if unit == 'rad' else 'degrees'}", line, columns=columns)


def _written_in_radians(values: np.ndarray) -> bool:
    """Whether angles all fit into a circle of radians and the largest is a multiple of pi/4, which no degrees are."""
    largest = float(np.abs(values).max())
    steps = largest / (math.pi / 4)
    return (
        largest <= CIRCLE + NEAR
        and round(steps) > 0
        and abs(steps - round(steps)) < NEAR
        and largest != round(largest, 1)
    )


def directions(found: Gathered, asker: Asker) -> Directions:
    """The directions of all values. Raises FormatError with the lines of angles outside the hemisphere."""
    degrees = in_degrees(found, asker)
    _refuse_exchanged(degrees, found, asker)
    angles = {target: values for target, (values, _) in degrees.items()}
    how = {target: said for target, (_, said) in degrees.items() if said}
    notes: list[str] = []
    theta_i = angles["theta_i"] if "theta_i" in angles else np.round(90.0 - angles["elevation_i"], NOISE)
    if "theta_i" not in angles:
        how["elevation_i"] = _and(how.get("elevation_i", ""), "theta_i = 90 deg - elevation_i")
    phi = _phi(angles, how)
    theta_r = _theta_r(angles, theta_i, phi is not None, how, asker, int(found.lines[0]))
    _refuse_outside("theta_i", theta_i, 0.0, found, asker)
    _refuse_outside("theta_r", theta_r, -90.0, found, asker)
    if phi is not None:
        below = theta_r < 0
        if below.any():
            notes.append(f"theta_r below 0 at {below.sum()} values: these are on the other side, at phi + 180 deg")
        phi = (phi + np.where(below, 180.0, 0.0) + (180.0 if asker.request.flip else 0.0)) % 360.0
        theta_r = np.abs(theta_r)
    if asker.request.flip:
        notes.append("directions turned to the other side of the normal, as --flip says")
    phi_i = angles.get("phi_i")
    if phi_i is not None and np.unique(phi_i % 360.0).size == 1:
        notes.append(f"phi_i is {phi_i[0]:g} deg at all values: the surface was not turned")
        phi_i = None
    return Directions(theta_i, theta_r + 0.0, phi, None if phi_i is None else phi_i % 360.0, how, notes)


def _and(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second


def _phi(angles: dict[str, np.ndarray], how: dict[str, str]) -> np.ndarray | None:
    if "phi" in angles:
        return angles["phi"]
    if "phi_r" not in angles:
        return None
    source = angles.get("phi_i", 0.0)
    how["phi_r"] = _and(
        how.get("phi_r", ""),
        f"phi = phi_r - {'phi_i' if 'phi_i' in angles else '0, as no azimuth of the source is there'}",
    )
    return np.round(angles["phi_r"] - source, NOISE) % 360.0


def _theta_r(
    angles: dict[str, np.ndarray], theta_i: np.ndarray, has_phi: bool, how: dict[str, str], asker: Asker, line: int
) -> np.ndarray:
    """theta_r, signed; `--flip` changes the sign of what the table counts, where no azimuth has the sides."""
    sign = -1.0 if asker.request.flip and not has_phi else 1.0
    target = next(t for t in v.REFLECTED if t in angles)
    values = angles[target]
    if target in ("specular_offset", "arm") and has_phi:
        raise asker.wrong(f"{target} is an angle in the plane of incidence, and the table has an azimuth too", line)
    formulas = {
        "theta_r": (sign * values, ""),
        "elevation_r": (sign * (90.0 - values), "theta_r = 90 deg - elevation_r"),
        "specular_offset": (theta_i + sign * values, f"theta_r = theta_i {'-' if sign < 0 else '+'} specular_offset"),
        "arm": (
            sign * values - theta_i,
            f"theta_r = {'-' if sign < 0 else ''}arm - theta_i, the arm counted from the source",
        ),
    }
    theta_r, formula = formulas[target]
    if formula:
        how[target] = _and(how.get(target, ""), formula)
    return np.round(theta_r, NOISE) + 0.0 if target != "theta_r" else theta_r


def _refuse_outside(name: str, values: np.ndarray, lowest: float, found: Gathered, asker: Asker) -> None:
    outside = ~((values >= lowest) & (values <= HORIZON))
    if not outside.any():
        return
    rows = np.flatnonzero(outside)
    target = next((t for t in (v.INCIDENT if name == "theta_i" else v.REFLECTED) if t in found.sources), name)
    what = f"{name} is {values[rows[0]]:g} deg, outside {lowest:g} to 90, at {len(rows)} of {len(values)} values"
    source = found.sources[target].text if target in found.sources else ""
    remedy = "is that column another angle (--columns), in another unit, or does it count the other way (--flip)?"
    raise asker.wrong(f"{what} ({target} from {source}): {remedy}", int(found.lines[rows[0]]))


_EXCHANGED = {"theta_i": "phi_i", "phi_i": "theta_i", "theta_r": "phi_r", "phi_r": "theta_r", "phi": "theta_r"}


def _refuse_exchanged(degrees: dict[str, tuple[np.ndarray, str]], found: Gathered, asker: Asker) -> None:
    """FormatError where polar angles exceed the hemisphere and azimuths do not: some programs name them so."""
    if not {"theta_i", "theta_r", "phi_i"} <= set(degrees) or not {"phi", "phi_r"} & set(degrees):
        return

    def beyond(target: str, lowest: float) -> bool:
        values = degrees[target][0]
        return bool(((values < lowest) | (values > HORIZON)).any())

    azimuth = "phi" if "phi" in degrees else "phi_r"
    if not (beyond("theta_i", 0.0) or beyond("theta_r", -90.0)) or beyond("phi_i", 0.0) or beyond(azimuth, -90.0):
        return
    sources = [found.sources[t] for t in ("theta_i", "phi_i", "theta_r", azimuth)]
    if not all(source.key for source in sources):
        return
    columns = {source.key: Target(_EXCHANGED[source.target], source.unit) for source in sources}
    what = (
        "the columns named theta are beyond the hemisphere and those named phi are within it: if this table calls the "
        "polar angle phi and the azimuth theta"
    )
    raise asker.ask(what, int(found.lines[0]), columns=columns)
