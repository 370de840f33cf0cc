"""FRED: scripts in its BASIC that add a scatter model, and that print FRED's values beside gonio's.

Names of structures and calls are those of FRED's help (help.photonengr.com, Scripting Reference Manual:
T_ABGSCATTER, T_HARVEYSHACKSCATTER, T_SCATTERSCRIPTEX, ScatterEval). No script can be run here; the user runs the second
one, which shows at 20 directions whether FRED computes what gonio does.
"""

import functools
import re
from collections.abc import Iterator, Mapping

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.source import proved
from gonio.exporting.stand_in import StandIn
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.cards import (
    ABG_CARD,
    BINOMIAL_CARD,
    HARVEY_SHACK_CARD,
    Card,
    evaluated,
    excess,
    names,
    remarks,
    scatter,
)
from gonio.geometry import Geometry
from gonio.outside import printable

LIMIT = 1e-9  # of values that are read back from 12 digits
CARDS = {card.model: card for card in (ABG_CARD, HARVEY_SHACK_CARD, BINOMIAL_CARD)}
STRUCTURES = {
    "abg": ("AbgScatter", {"Acoef": "A", "Bcoef": "B", "G": "g"}),
    "harvey-shack": ("HarveyShackScatter", {"b0": "b0", "L": "L", "S": "S"}),
}
# theta_i, theta_r, phi [deg] at which both programs are compared: about the mirror direction, aside and backwards
COMPARED = tuple(
    (theta_i, theta_r, phi)
    for theta_i in (5.0, 30.0, 60.0, 75.0)
    for theta_r, phi in ((theta_i, 180.0), (theta_i + 2.0, 180.0), (40.0, 180.0), (20.0, 90.0), (50.0, 0.0))
)
_SCRIPT = """
Sub EvalScatter( ByRef t As T_SCATTERSCRIPTEX )
CONSTANTS
    Dim inward As Double, outward As Double, shift2 As Double, shift As Double, v As Double, lobe As Double
    Dim power As Double, sx As Double, sy As Double, sz As Double, rx As Double, ry As Double, rz As Double
    inward = t.g_Xspec * t.g_Xnrml + t.g_Yspec * t.g_Ynrml + t.g_Zspec * t.g_Znrml
    outward = t.g_Xscat * t.g_Xnrml + t.g_Yscat * t.g_Ynrml + t.g_Zscat * t.g_Znrml
    sx = t.g_Xspec - inward * t.g_Xnrml
    sy = t.g_Yspec - inward * t.g_Ynrml
    sz = t.g_Zspec - inward * t.g_Znrml
    rx = t.g_Xscat - outward * t.g_Xnrml
    ry = t.g_Yscat - outward * t.g_Ynrml
    rz = t.g_Zscat - outward * t.g_Znrml
    shift2 = (rx - sx) * (rx - sx) + (ry - sy) * (ry - sy) + (rz - sz) * (rz - sz)
    shift = Sqr(shift2)
    v = sx * rx + sy * ry + sz * rz
    lobe = Log(1 + d * shift2) / (2 * Log(10))
    power = b01 * shift + b02 * shift2 + c0 * lobe
    power = power + v * (b10 + b11 * shift + b12 * shift2 + c1 * lobe)
    power = power + v * v * (b20 + b21 * shift + b22 * shift2 + c2 * lobe)
    t.g_BSDF = scale * Exp(Log(10) * power)
End Sub
"""


def chosen(subject: Subject) -> tuple[Card, StandIn]:
    """The model of FRED's that the subject is, or that comes nearest to it."""
    if subject.model.name in CARDS:
        card = CARDS[subject.model.name]
        return card, card.of(subject)
    found = {card.model: card.of(subject) for card in (HARVEY_SHACK_CARD, ABG_CARD)}
    best = min(found, key=lambda name: found[name].numbers["log10_rmse"])
    return CARDS[best], found[best]


def make(subject: Subject, request: Request) -> Made:
    """The content of the two scripts."""
    card, found = chosen(subject)
    shown = found.subject
    weight = shown.model.weights[0]
    if any(values[weight] < 0 for values in shown.sets.values()):
        raise ValueError(f"{weight} is negative, and FRED takes no such scatter: fit it with bounds, or another model")
    what = f"{request.name}: {shown.model.title}, for FRED."
    told = remarks(subject, found) + excess(scatter(shown))
    comment = [
        *heading(shown, what),
        "",
        *told,
        "Not run in FRED: run the second script too, which compares both programs.",
    ]
    script = (
        list(_extended(shown, request.name)) if card is BINOMIAL_CARD else list(_structures(card, shown, request.name))
    )
    second = f"{request.out.stem}_check{request.out.suffix}"
    compare = [f"FRED's values of {request.name} beside those of gonio, at {len(COMPARED)} directions.", *_COMPARING]
    told += ("not run in FRED: its second script prints FRED's values beside those of gonio",)
    return Made(
        {
            request.out.name: _text(comment, list(script)),
            second: _text(compare, list(_comparison(shown, request.name))),
        },
        told,
        found.numbers,
    )


_COMPARING = (
    "Run it after the model is in the document. Every ratio has to be 1.000. The surface normal is z; where every",
    "value differs, FRED may count z the other way: change the sign of the third number of each direction.",
    "The arguments of ScatterPrepareForEval could not be looked up: see FRED's help if it asks for some.",
)


def _text(comment: list[str], lines: list[str]) -> str:
    return "\n".join([*(f"' {printable(line)}".rstrip() for line in comment), *lines]) + "\n"


def _number(value: float) -> str:
    return f"{value:.12G}"


def _quoted(text: str) -> str:
    """A string of BASIC, which doubles quotes and has no other escape."""
    return '"' + printable(text).replace('"', '""') + '"'


def _structures(card: Card, subject: Subject, name: str) -> Iterator[str]:
    """A script that adds a scatter model for every set."""
    structure, members = STRUCTURES[card.model]
    yield from ("", "Sub Main", f"    Dim t As T_{structure.upper()}", "    Dim n As Long")
    for label, called in names(subject, name).items():
        yield f"    Init{structure} t"
        yield f"    t.Name = {_quoted(called)}"
        yield f"    t.Description = {_quoted(subject.origin)}"
        for member, parameter in members.items():
            yield f"    t.{member} = {_number(subject.sets[label][parameter])}"
        yield from ("    t.ApplyRefl = True", "    t.ApplyTrans = False", "    t.HaltIncident = True")
        yield f"    n = Add{structure}(t)"
    yield from ("    Update", "End Sub")


def _extended(subject: Subject, name: str) -> Iterator[str]:
    """The text of an extended scripted scatter model, for the dialog."""
    constants = [f"    Const {p} As Double = {_number(v)}" for p, v in subject.values.items()]
    yield f"' In FRED: a new scatter model of type Extended Scripted, called {name}; this is its script."
    yield "' FRED's own binomial is not used: its coefficients could not be compared with these."
    yield from _SCRIPT.replace("CONSTANTS", "\n".join(constants)).rstrip().splitlines()


def _comparison(subject: Subject, name: str) -> Iterator[str]:
    yield from ("", "Sub Main", "    Dim id As Long")
    yield '    Print "theta_i theta_r phi, FRED, gonio, FRED / gonio"'
    for label, called in names(subject, name).items():
        yield f"    id = FindScatter({_quoted(called)})"
        yield "    ScatterPrepareForEval"
        for angles in COMPARED:
            g = Geometry.from_degrees(*angles)
            value = float(subject.brdf(g, label))
            told = _quoted(" ".join(f"{a:g}" for a in angles))
            directions = (round(float(c), 12) for c in g)  # without the rounding errors of cosines that are 0
            yield f"    Compare id, {told}, {', '.join(_number(n) for n in (*directions, value))}"
    yield "End Sub"
    yield from (
        "",
        "' (xi, yi, zi) leads to the light and (xr, yr, zr) to the viewer.",
        "Sub Compare( ByVal id As Long, ByVal angles As String, ByVal xi As Double, ByVal yi As Double, _",
        "    ByVal zi As Double, ByVal xr As Double, ByVal yr As Double, ByVal zr As Double, _",
        "    ByVal expected As Double )",
        "    Dim found As Double",
        "    found = ScatterEval(id, -xi, -yi, -zi, -xi, -yi, zi, xr, yr, zr)",
        "    Print angles, found, expected, found / expected",
        "End Sub",
    )


def read(text: str, members: Mapping[str, str]) -> list[dict[str, float]]:
    """The numbers that a script assigns, by the names of the model, for each scatter model that it adds."""
    found: list[dict[str, float]] = []
    for line in text.splitlines():
        if line.strip().startswith(("Init", "Sub EvalScatter")):
            found.append({})
        assigned = re.fullmatch(r" +(?:t\.(\w+)|Const (\w+) As Double) = ([-+.\dE]+)", line)
        if assigned and found and (name := assigned[1] or assigned[2]) in members:
            found[-1][members[name]] = float(assigned[3])
    return found


def compared(text: str) -> tuple[Geometry, np.ndarray]:
    """The directions and values of the second script."""
    rows = [line.split(", ")[2:] for line in text.splitlines() if line.strip().startswith("Compare id, ")]
    columns = np.array(rows, dtype=float).T
    return Geometry(*columns[:6]), columns[6]


def check(subject: Subject, request: Request) -> Proof:
    """Both scripts read back: the numbers of the first in FRED's formula, which the second has to agree with."""
    card, found = chosen(subject)
    shown = found.subject
    members = STRUCTURES[card.model][1] if card.model in STRUCTURES else {p: p for p in shown.model.parameters}
    blocks = read(request.out.read_text(encoding="utf-8"), members)
    how = "no FRED is here: the numbers of both scripts were read back and put into FRED's formula"
    proofs = [
        proved(shown.one(label), how, functools.partial(evaluated, card, values), LIMIT)
        for label, values in zip(shown.sets, blocks, strict=True)
    ]
    second = request.out.with_name(f"{request.out.stem}_check{request.out.suffix}").read_text(encoding="utf-8")
    g, values = compared(second)
    each = len(COMPARED)
    for k, block in enumerate(blocks):
        part = slice(k * each, (k + 1) * each)
        again = evaluated(card, block, Geometry(*(c[part] for c in g)))
        proofs.append(Proof(how, float(np.max(np.abs(values[part] / again - 1))), LIMIT))
    return max(proofs, key=lambda p: p.error)


FRED = Target(
    name="fred",
    title="FRED",
    suffixes=(".frs",),
    writes="a script that adds the scatter model, and one that compares FRED's values with gonio's",
    make=make,
    check=check,
)
