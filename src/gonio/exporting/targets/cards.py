"""Cards: a page of text with the few numbers that stray-light programs ask for in a dialog, as ABg or Harvey-Shack.

What is typed into a program has to be read by people, so a card is plain text: comments, then a name and a number a
line, in a block for every set.
"""

import functools
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from gonio.exporting.heading import WIDTH, heading
from gonio.exporting.source import identifier, proved
from gonio.exporting.stand_in import REPORTED, StandIn, reflectance, stand_in
from gonio.exporting.subject import ONE, Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.geometry import Geometry
from gonio.models import catalogue
from gonio.outside import printable

DIGITS = 12
ROUNDING = 1e-3  # of a total integrated scatter by random directions
LIMIT = 1e-9  # of values that are read back from DIGITS digits

Values = Mapping[str, float]


@dataclass(frozen=True)
class Card:
    """A model that stray-light programs know by name.

    Attributes
    ----------
    model : str
        Of the catalogue, whose parameters are the numbers of the card.
    formula : tuple
        Lines that say what the numbers mean.
    level : mapping
        Values of a BRDF of 1/sr in every direction, the weight first.
    value : callable
        The BRDF from the numbers of a card, the shift of the direction cosines and the product V of those of the
        scattered and the mirror direction: the formula written once more, to prove what was written.
    limited : bool
        Whether programs refuse a total integrated scatter above 1.

    """

    model: str
    formula: tuple[str, ...]
    level: Values
    value: Callable[[Values, np.ndarray, np.ndarray], np.ndarray]
    limited: bool = False

    def of(self, subject: Subject) -> StandIn:
        """The subject by this model, fitted where it is another one."""
        return stand_in(subject, catalogue[self.model], self.level)


def angles(subject: Subject) -> tuple[float, ...]:
    """The incidence angles [deg] at which a card gives the total integrated scatter: those of the scan."""
    return subject.theta_i or REPORTED


def scatter(subject: Subject) -> dict[str, dict[float, float]]:
    """The total integrated scatter (TIS) of each set at each incidence angle [deg]."""
    return {
        label: {angle: reflectance(subject.model, values, angle) for angle in angles(subject)}
        for label, values in subject.sets.items()
    }


def names(subject: Subject, name: str) -> dict[str, str]:
    """What each set is called in a program."""
    return {label: name if label == ONE else identifier(f"{name}_{label}") for label in subject.sets}


def remarks(original: Subject, found: StandIn) -> tuple[str, ...]:
    """What a user has to know of the stand-in."""
    if found.exact:
        return ()
    model = found.subject.model.name
    return (
        f"{original.model.name} is not {model}: what is written was fitted to it, to {found.numbers['log10_rmse']:.3g} "
        f"rms in the decimal logarithm, and {found.numbers['peak_error']:+.0%} where it is brightest; where that is "
        "too much, write a table in the program's own format, or for OpticStudio --to zemax-dll",
    )


def excess(tis: Mapping[str, Mapping[float, float]]) -> tuple[str, ...]:
    """That a surface gives out more light than it gets, where one does."""
    highest, angle = max((value, angle) for row in tis.values() for angle, value in row.items())
    if highest <= 1 + ROUNDING:
        return ()
    return (
        f"the total integrated scatter is {highest:.4g} at theta_i {angle:g} deg: the surface would give out more "
        "light than it gets, and programs scale or refuse that",
    )


def _number(value: float) -> str:
    return f"{value:.{DIGITS}g}"


def _content(card: Card, subject: Subject, request: Request) -> Made:
    found = card.of(subject)
    shown = found.subject
    tis = scatter(shown)
    highest, label, angle = max((v, label, a) for label, row in tis.items() for a, v in row.items())
    _refuse(card, shown, highest, label, angle)
    what = f"{request.name}: {shown.model.title}, a card for stray-light programs."
    lines = [f"# {line}".rstrip() for line in heading(shown, what)]
    lines += ["#", *(f"# {line}" for line in card.formula)]
    told = remarks(subject, found) + excess(tis)
    lines += [f"# {line}" for remark in told for line in textwrap.wrap(remark, WIDTH, break_on_hyphens=False)]
    for label, name in names(shown, request.name).items():
        lines += ["", *_block(shown, label, name, tis[label])]
    return Made({request.out.name: "\n".join(lines) + "\n"}, told, {**found.numbers, "highest_tis": highest})


def _refuse(card: Card, subject: Subject, highest: float, label: str, angle: float) -> None:
    weight = subject.model.weights[0]
    if any(values[weight] < 0 for values in subject.sets.values()):
        raise ValueError(f"{weight} is negative, and no program takes that: fit it with bounds, or another model")
    if card.limited and highest > 1 + ROUNDING:
        of = f" of {subject.by} {printable(label)}" if label != ONE else ""
        raise ValueError(
            f"the total integrated scatter{of} is {highest:.4g} at theta_i {angle:g} deg, and OpticStudio takes none "
            f"above 1: {weight} is too large, or the model does not describe the surface; write --to zemax-dll instead"
        )


def _block(subject: Subject, label: str, name: str, tis: Mapping[float, float]) -> Iterator[str]:
    wavelength = float(label) if subject.by == "wavelength" else subject.wavelength
    yield f"name {name}"
    yield f"model {subject.model.name}"
    if label != ONE:
        yield f"{subject.by} {printable(label)}"
    yield f"wavelength_um {'not stated' if wavelength is None else _number(wavelength / 1000)}"
    for parameter in subject.model.parameters:
        yield f"{parameter} {_number(subject.sets[label][parameter])}"
    for angle, value in tis.items():
        yield f"TIS_at_{angle:g}_deg {value:.4g}"


def read(text: str, model: str) -> list[dict[str, float]]:
    """The numbers of each block of a card, by the names of the model's parameters."""
    found: list[dict[str, float]] = []
    for line in text.splitlines():
        key, _, value = line.partition(" ")
        if key == "name":
            found.append({})
        elif found and key in catalogue[model].parameters:
            found[-1][key] = float(value)
    return found


def evaluated(card: Card, values: Values, geometry: Geometry) -> np.ndarray:
    """The BRDF that the numbers of a card stand for, by the formula as programs document it."""
    x, y = geometry.x_i + geometry.x_r, geometry.y_i + geometry.y_r
    v = -(geometry.x_i * geometry.x_r + geometry.y_i * geometry.y_r)
    value = card.value(values, np.hypot(x, y), v)
    return np.where(geometry.below, 0.0, value)


def _check(card: Card, subject: Subject, request: Request) -> Proof:
    shown = card.of(subject).subject
    blocks = read(request.out.read_text(encoding="utf-8"), card.model)
    how = "the numbers of the card were read back and put into its formula"
    proofs = [
        proved(shown.one(label), how, functools.partial(evaluated, card, values), LIMIT)
        for label, values in zip(shown.sets, blocks, strict=True)
    ]
    return max(proofs, key=lambda p: p.error)


def _abg(values: Values, shift: np.ndarray, v: np.ndarray) -> np.ndarray:  # noqa: ARG001
    # gonio adds a rounding error of the shift, which alone has no power below 1
    return values["A"] / (values["B"] + np.hypot(shift, 1e-16) ** values["g"])


def _harvey_shack(values: Values, shift: np.ndarray, v: np.ndarray) -> np.ndarray:  # noqa: ARG001
    return values["b0"] * (1 + (shift / values["L"]) ** 2) ** (values["S"] / 2)


def _binomial(values: Values, shift: np.ndarray, v: np.ndarray) -> np.ndarray:
    lobe = np.log10(1 + values["d"] * shift**2) / 2
    rows = [sum(values.get(f"b{j}{k}", 0.0) * shift**k for k in range(3)) + values[f"c{j}"] * lobe for j in range(3)]
    return values["scale"] * 10 ** (rows[0] + v * rows[1] + v**2 * rows[2])


_SHIFT = "where beta and beta_0 are the scattered and the mirror direction projected on the surface"
_LEVEL_ABG = {"A": 2.0, "B": 1.0, "g": 0.0}
_LEVEL_BINOMIAL = {"scale": 1.0} | dict.fromkeys(catalogue["binomial"].shape, 0.0) | {"d": 1.0}

ABG_CARD = Card(
    "abg",
    (
        "BRDF [1/sr] = A / (B + |beta - beta_0|^g),",
        _SHIFT + ".",
        "OpticStudio: Libraries tab, ABg Scatter Catalog: a new entry with this name, wavelength, A, B and g, which",
        "hold for every angle; then Surface Scattering of the object: ABg. The power that it scatters is the TIS.",
    ),
    _LEVEL_ABG,
    _abg,
    limited=True,
)
HARVEY_SHACK_CARD = Card(
    "harvey-shack",
    ("BRDF [1/sr] = b0 (1 + |beta - beta_0|^2 / L^2)^(S/2),", _SHIFT + "."),
    {"b0": 1.0, "L": 1.0, "S": 0.0},
    _harvey_shack,
)
BINOMIAL_CARD = Card(
    "binomial",
    (
        "BRDF [1/sr] = scale 10^P, P = sum over j and k of b_jk V^j D^k + sum over j of c_j V^j log10(1 + d D^2)/2,",
        "with D = |beta - beta_0| and V = beta . beta_0, " + _SHIFT + ".",
        "The constant b_00 of a program is log10(scale). Compare the formula of your program with this one first:",
        "programs number these coefficients differently.",
    ),
    _LEVEL_BINOMIAL,
    _binomial,
)


def _target(name: str, title: str, card: Card) -> Target:
    return Target(
        name=name,
        title=title,
        suffixes=(".txt",),
        writes=f"a card of text with {', '.join(catalogue[card.model].parameters[:3])} .. and the TIS",
        make=lambda subject, request: _content(card, subject, request),
        check=lambda subject, request: _check(card, subject, request),
    )


ABG = _target("abg", "an ABg entry of OpticStudio", ABG_CARD)
HARVEY_SHACK = _target("harvey-shack", "a Harvey-Shack entry", HARVEY_SHACK_CARD)
BINOMIAL = _target("binomial", "a binomial entry", BINOMIAL_CARD)
