"""The heading of a column taken apart: what it names, in which unit, of which quantity and at which wavelength."""

import re
from dataclasses import dataclass

from gonio.tables import vocabulary as v

_BRACKETS = re.compile(r"[\[({<]([^\[\](){}<>]*)[\])}>]")
_COVERAGE = re.compile(r"k\s*=\s*(\d+(?:[.,]\d+)?)")
_NUMBER = r"[-+]?\d+(?:[.,]\d+)?"
_WAVELENGTH = re.compile(
    r"(?<![\d.,])([1-9]\d*(?:[.,]\d+)?|0[.,]\d+)[\s_]*(nm|um|μm|microns?|nanomet(?:er|re)s?|micromet(?:er|re)s?)(?!\w)"
)
LONGEST = 200  # characters of a heading or of a line that states something
UNCLEAR = "?"  # the quantity of a name that may be several


@dataclass(frozen=True)
class Heading:
    """What the heading of a column says.

    target: of `vocabulary.TARGETS`, empty where the name is not understood. unit: of `vocabulary.UNITS`, empty where
    none is stated. quantity: of `vocabulary.QUANTITIES`, empty where none is stated, `?` where the name may be several.
    wavelength: nm. coverage: the factor k of an uncertainty, 0 for an expanded one without its k. weak: whether the
    target holds only where no other column has it. other_unit: what stands where a unit should and is none.
    """

    text: str
    target: str = ""
    unit: str = ""
    quantity: str = ""
    wavelength: float | None = None
    coverage: float = 1.0
    is_relative: bool = False
    weak: bool = False
    other_unit: str = ""

    @property
    def kind(self) -> str:
        """The kind of the unit; empty where none is stated."""
        return v.UNITS[self.unit].kind if self.unit else ""

    @property
    def mode(self) -> str:
        """Transmission where the name says so (BTDF), else empty."""
        return "transmission" if self.target == "brdf" and "btdf" in v.squeezed(self.text) else ""


def parsed(text: str, unit_below: str = "") -> Heading:
    """The heading of a column; `unit_below` is the unit that a row of units gives it."""
    if len(text) > LONGEST:
        return Heading(text)
    rest, coverage = v.plain(text).strip(), 1.0
    units: list[str] = [unit_below] if unit_below else []
    other = ""
    for inner in _BRACKETS.findall(rest):
        content = inner.strip().removeprefix("in ").strip()
        factor = _COVERAGE.fullmatch(content)
        if factor:
            coverage = float(factor[1].replace(",", "."))
        elif unit := v.unit_of(content):
            units.append(unit)
        else:
            other = content
            continue
        rest = re.sub(rf"[\[({{<]{re.escape(inner)}[\])}}>]", " ", rest, count=1)
    wavelength = None
    if at := _WAVELENGTH.search(rest.casefold()):
        wavelength = float(at[1].replace(",", ".")) * v.UNITS[v.unit_of(at[2])].size
        rest = rest[: at.start()] + " " + rest[at.end() :]
    if factor := _COVERAGE.search(rest):
        coverage = float(factor[1].replace(",", "."))
        rest = rest[: factor.start()] + rest[factor.end() :]
    if not units:
        rest, unit = _without_suffix(rest)
        units = [unit] if unit else []
    unit = units[0] if len(set(units)) == 1 else ""
    has_k = _COVERAGE.search(v.plain(text)) is not None
    found = _named(text, rest, coverage if has_k else None, wavelength)
    if unit == "a.u." and found.target in v.UNCERTAINTIES and re.search(r"\brel(ative|\.)?(?!\w)", text, re.I):
        return Heading(text, found.target, "", coverage=found.coverage, is_relative=True)
    outside = _BRACKETS.sub(" ", rest)
    if not found.target and other and (named := _named(text, outside, None, wavelength)).target:
        return Heading(text, named.target, "", named.quantity, wavelength, other_unit=other)
    return Heading(text, found.target, unit, found.quantity, wavelength, found.coverage, found.is_relative, found.weak)


def _without_suffix(name: str) -> tuple[str, str]:
    """A name without the unit at its end, and the unit: `theta_i_deg`, `AOI, deg`, `AOI/deg`, `log10(BRDF/sr-1)`."""
    text = re.sub(r"\bper[\s_]+sr$", "persr", name.strip().rstrip(")]} "), flags=re.I)
    lower = text.casefold()
    for spelling in v.SUFFIXES:
        if not lower.endswith(spelling):
            continue
        before = text[: len(text) - len(spelling)]
        apart = not before or not before[-1].isalnum() or not spelling[0].isalnum()
        if apart and before.strip(" _,/;:.-"):
            return _without_in(before.rstrip(" _,/;:")), v.unit_of(spelling)
    return name, ""


def _without_in(name: str) -> str:
    """A name without the word before its unit, as in `AOI in deg`, unless that word is a part of it: `elev_in_rad`."""
    shorter = re.sub(r"[\s_]in$", "", name, flags=re.I)
    known = v.NAMES | v.QUANTITY_NAMES | v.WEAK_NAMES
    is_part = v.squeezed(name) in known and (name[len(shorter) :].startswith("_") or v.squeezed(shorter) not in known)
    return name if is_part else shorter


def _named(text: str, rest: str, coverage: float | None, wavelength: float | None) -> Heading:
    """What a name alone, without unit and wavelength, says."""
    name = v.squeezed(rest)
    if name in v.QUANTITY_NAMES:
        quantity = v.QUANTITY_NAMES[name]
        return Heading(text, "signal" if quantity == "signal" else "brdf", quantity=quantity)
    if name in v.EXPANDED_NAMES or (rest.strip(" _()").startswith("U") and v.NAMES.get(name) == "uncertainty"):
        # A capital U is an expanded uncertainty (GUM) unless the heading gives its k, or goes on as a word.
        is_word = v.squeezed(rest).startswith("unc")
        return Heading(text, "uncertainty", coverage=(coverage or 0.0) if not is_word else coverage or 1.0)
    if name in v.RELATIVE_NAMES:
        return Heading(text, "uncertainty", coverage=coverage or 1.0, is_relative=True)
    if name in v.NAMES:
        return Heading(text, v.NAMES[name], coverage=1.0 if coverage is None else coverage)
    if name in v.UNCLEAR_NAMES:
        return Heading(text, "brdf", quantity=UNCLEAR)
    if name in v.WEAK_NAMES:
        return Heading(text, v.WEAK_NAMES[name], weak=True)
    if not name and wavelength is not None:
        return Heading(text, "brdf")
    return Heading(text)


@dataclass(frozen=True)
class Constant:
    """One number that holds for all rows below it: an incidence angle, an azimuth or a wavelength, and its text."""

    target: str
    value: float
    unit: str
    text: str


CONSTANTS = (*v.INCIDENT, *v.AZIMUTHS, "wavelength")
_PAIR = re.compile(rf"\s*([^\d=:,;+-][^=:,;]*?)\s*[=:,;]?\s*({_NUMBER})\s*([^\s\d,;=:]*)\s*(?:[,;]|$)\s*")


def constants(text: str) -> list[Constant]:
    """The constants of a line that states nothing else, as `AOI = 10 deg, wavelength 650 nm` or `650 nm`; else none."""
    if len(text) > LONGEST:
        return []
    found, at, line = [], 0, v.plain(text).strip().strip("#%!*[](){} ,;\t")
    if wavelength := _WAVELENGTH.fullmatch(line.casefold()):
        return [Constant("wavelength", float(wavelength[1].replace(",", ".")), v.unit_of(wavelength[2]), text.strip())]
    while at < len(line):
        pair = _PAIR.match(line, at)
        if pair is None:
            return []
        heading = parsed(pair[1])
        unit = v.unit_of(pair[3]) if pair[3] else heading.unit
        kind = v.LENGTH if heading.target == "wavelength" else v.ANGLE
        if heading.target not in CONSTANTS or (pair[3] and not unit) or (unit and v.UNITS[unit].kind != kind):
            return []
        found.append(Constant(heading.target, float(pair[2].replace(",", ".")), unit, text.strip()))
        at = pair.end()
    return found


def wavelengths(text: str) -> set[float]:
    """The wavelengths [nm] that a line of text names."""
    return {
        float(a.replace(",", ".")) * v.UNITS[v.unit_of(u)].size
        for a, u in _WAVELENGTH.findall(v.plain(text[:LONGEST]).casefold())
    }


_UNIT_WORDS = {
    "percent": re.compile(r"%|\bper ?cent\b|\bprozent\b", re.I),
    "a.u.": re.compile(
        r"\ba\.\s?u\.|\barb(itrary|\.)?\s?u(nits?|\.)|\brelative (?:units?|values?|data|brdf|bsdf)\b|\brel\.\s?u", re.I
    ),
    "sr-1": re.compile(r"\b1\s?/\s?sr\b|\bsr\s?\^?\{?-1|/\s?sr\b|\bper sr\b", re.I),
}


def units(text: str) -> set[str]:
    """The units of values that a line of text names: percent, a.u. or sr-1."""
    return {unit for unit, words in _UNIT_WORDS.items() if words.search(v.plain(text[:LONGEST]))}


def is_of_units(text: str) -> bool:
    """Whether a line of text begins with the word unit."""
    return re.match(r"\W*(units?|einheit)\b", text, re.I) is not None


def quantities(text: str) -> set[str]:
    """The quantities that a line of text names in one to three words."""
    words = re.findall(r"[^\s,;:=()\[\]]+", v.plain(text[:LONGEST]))
    spans = ("".join(words[i : i + n]) for n in (1, 2, 3) for i in range(len(words) - n + 1))
    named = {v.QUANTITY_NAMES[s] for span in spans if (s := v.squeezed(span)) in v.QUANTITY_NAMES and len(s) > 2}
    return named - {"signal"}
