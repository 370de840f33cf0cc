"""Values of a table as a BRDF: which quantity they are, and the conversion of values and uncertainties.

    ccbsdf              f cos(theta_r)                       f = value / cos(theta_r)
    reflectance-factor  pi f                                 f = value / pi
    radiant-intensity   f cos(theta_r), per incident power   f = value / cos(theta_r)
    log10-brdf          log10 f                              f = 10^value,   u(f) = f ln 10 u(value)
    signal              proportional to f cos(theta_r)       f = value / cos(theta_r), in a.u.
    dolp                degree of linear polarisation        stays as it is, with the unit 1

An uncertainty has the factor of its value. In percent it is relative to the value; a stated factor k is divided out.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gonio.measured.dataset import ABSOLUTE, DEGREE, RELATIVE
from gonio.tables import vocabulary as v
from gonio.tables.gather import Gathered, Source
from gonio.tables.headings import UNCLEAR, is_of_units, quantities, units
from gonio.tables.request import POINTS, Asker, Target

GRAZING = 1e-6  # the cosine of theta_r below which nothing can be divided by it


@dataclass(frozen=True)
class Meaning:
    """What the values are: the quantity, whether in percent, the unit of the BRDF that follows, and how it is known."""

    quantity: str
    percent: bool
    unit: str
    how: str


class Converted(NamedTuple):
    """The BRDF and its uncertainties by target, and what has to be said."""

    brdf: np.ndarray
    uncertainties: dict[str, np.ndarray]
    notes: list[str]


def meaning(found: Gathered, titles: list[str], asker: Asker) -> Meaning:
    """Which quantity the values are: by the user, the heading, the text above the table; else a BRDF, which is said."""
    source, line = found.sources["brdf"], int(found.lines[0])
    request = asker.request
    above = set().union(*map(quantities, titles)) if titles else set()
    if request.quantity:
        name, how = request.quantity, "as --quantity says"
    elif source.quantity == UNCLEAR:
        likely = v.QUANTITIES[_likely(source.text)].title
        what = f"{source.text} may be one of several quantities ({', '.join(v.QUANTITIES)}); if it is the {likely}"
        raise asker.ask(what, line, quantity=_likely(source.text))
    elif source.quantity:
        name, how = source.quantity, "as the heading says"
    elif request.percent:
        name, how = "reflectance-factor", "as values in percent are"
    elif len(above) > 1:
        what = f"the text above the table names {' and '.join(sorted(above))}; if the values are the first"
        raise asker.ask(what, line, quantity=min(above))
    elif above:
        name, how = above.pop(), "as the text above the table says"
    else:
        name, how = "brdf", "assumed, as nothing says it: --quantity says otherwise"
    if not source.unit:
        source = replace(source, unit=_unit_above(name, titles, source, asker, line))
    percent = request.percent or source.kind == v.PERCENT
    return _with_unit(name, percent, how, source, asker, line)


def _unit_above(name: str, titles: list[str], source: Source, asker: Asker, line: int) -> str:
    """The unit that a line above the table states together with the quantity, or after the word unit; else empty."""
    lines = [title for title in titles if name in quantities(title) or is_of_units(title)]
    stated = set().union(*map(units, lines)) if lines else set()
    if len(stated) > 1:
        what = f"the text above the table names {' and '.join(sorted(stated))} as the unit of {source.text}"
        raise asker.wrong(f"{what}: write the right one into a heading", line)
    return stated.pop() if stated else ""


def _likely(text: str) -> str:
    name = text.casefold()
    return (
        "log10-brdf"
        if "log" in name or "ln" in name
        else "radiant-intensity"
        if "intens" in name
        else "reflectance-factor"
    )


def _with_unit(name: str, percent: bool, how: str, source: Source, asker: Asker, line: int) -> Meaning:
    """The meaning with the unit of the BRDF: 1/sr unless the table states another, or the quantity is relative."""
    kind = source.kind
    if kind in (v.ANGLE, v.LENGTH):
        raise asker.wrong(f"{source.text} is in {source.unit}, which is no unit of a {name}", line)
    if name == "dolp":
        if kind not in ("", v.ONE, v.PERCENT):
            raise asker.wrong(f"{source.text} is in {source.unit}, and a degree of polarisation has no unit", line)
        return Meaning(name, percent, DEGREE, how)
    if name == "signal" and kind == v.ABSOLUTE:
        raise asker.ask(f"{source.text} is a signal in 1/sr; if it is BRDF times cos(theta_r)", line, quantity="ccbsdf")
    if name == "brdf" and kind == v.SIGNAL:
        raise asker.ask(f"{source.text} is in the unit of a detector's signal; if it is one", line, quantity="signal")
    if name == "reflectance-factor" and kind == v.ABSOLUTE:
        raise asker.ask(
            f"{source.text} is in 1/sr, which no reflectance factor is; if it is the BRDF", line, quantity="brdf"
        )
    if name not in ("reflectance-factor", "log10-brdf", "signal") and percent and not asker.request.percent:
        what = f"{source.text} is in percent, which no {name} is; if it is a reflectance factor"
        raise asker.ask(what, line, quantity="reflectance-factor", percent=True)
    if name == "log10-brdf" and percent:
        raise asker.wrong(f"{source.text} is a logarithm in percent: --quantity says what it is", line)
    per_incident = any(word in v.squeezed(source.text) for word in v.PER_INCIDENT)
    if name == "signal" or kind in (v.RELATIVE, v.SIGNAL):
        return Meaning(name, percent, RELATIVE, f"{how}; relative, and stays so")
    if name == "radiant-intensity" and kind != v.ABSOLUTE and not per_incident:
        return Meaning(name, percent, RELATIVE, f"{how}; not per incident power, so relative, and stays so")
    if name in ("brdf", "ccbsdf") and not kind and not how.startswith("assumed"):
        how += "; 1/sr, as no unit is stated"
    return Meaning(name, percent, ABSOLUTE, how)


def converted(found: Gathered, of: Meaning, theta_r: np.ndarray, asker: Asker) -> Converted:
    """Values and uncertainties as those of a BRDF, NaN where none follows."""
    values = found.data["brdf"] * (0.01 if of.percent else 1.0)
    notes: list[str] = []
    factor = np.ones(len(values))
    if of.quantity == "reflectance-factor":
        factor /= math.pi
    elif of.quantity in ("ccbsdf", "radiant-intensity", "signal"):
        cosine = np.cos(np.radians(theta_r))
        steep = np.abs(cosine) < GRAZING
        factor = np.divide(1.0, cosine, out=np.full(len(values), np.nan), where=~steep)
        if lost := int((steep & np.isfinite(values)).sum()):
            notes.append(f"{lost} values at theta_r = 90 deg are gaps: no BRDF follows from one times cos(theta_r)")
    with np.errstate(over="ignore"):
        brdf = 10.0**values if of.quantity == "log10-brdf" else values * factor
    if beyond := np.flatnonzero(np.isinf(brdf)).tolist():
        what = f"the BRDF of {values[beyond[0]]:g} is not finite: is that the {v.QUANTITIES[of.quantity].title}?"
        raise asker.wrong(what, int(found.lines[beyond[0]]))
    uncertainties = {
        target: _uncertainty(found, target, of, brdf, factor, asker)
        for target in v.UNCERTAINTIES
        if target in found.data
    }
    return Converted(brdf, uncertainties, notes)


def _uncertainty(
    found: Gathered, target: str, of: Meaning, brdf: np.ndarray, factor: np.ndarray, asker: Asker
) -> np.ndarray:
    source, values = found.sources[target], found.data[target] / found.sources[target].coverage
    in_percent = source.kind == v.PERCENT
    if in_percent and of.percent and not (source.of or source.is_relative):
        what = f"{source.text} in percent may be relative or percentage points ({POINTS}), as the values are in percent"
        said = Target(target, "percent", source.coverage if source.coverage != 1 else None, "relative")
        raise asker.ask(f"{what}; if it is relative", int(found.lines[0]), columns={source.key: said})
    if source.is_relative or (in_percent and source.of != POINTS):
        return values * (0.01 if in_percent else 1.0) * np.abs(brdf)
    wrong = {RELATIVE: (v.ABSOLUTE,), ABSOLUTE: (v.RELATIVE,)}.get(of.unit, (v.ABSOLUTE, v.RELATIVE))
    if source.kind in (v.ANGLE, v.LENGTH, *wrong):
        what = f"{source.text} is in {source.unit}, which is no unit of the uncertainty of values in {of.unit}"
        raise asker.wrong(what, int(found.lines[0]))
    if source.kind == v.ABSOLUTE and of.quantity in ("reflectance-factor", "log10-brdf") and of.unit == ABSOLUTE:
        return values  # it is in the unit of the BRDF already
    if of.quantity == "log10-brdf":
        return values * math.log(10.0) * brdf
    return values * np.abs(factor) * (0.01 if of.percent else 1.0)
