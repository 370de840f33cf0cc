"""GLSL: functions for WebGL 2 and for OpenGL, with the numbers in the text or as uniforms."""

import unicodedata
from collections.abc import Sequence

from gonio.exporting.heading import heading
from gonio.exporting.languages.c import rows
from gonio.exporting.languages.glsl import GLSL_LANGUAGE
from gonio.exporting.source import programmed
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.shaders.functions import Functions
from gonio.exporting.targets.shaders.proof import proof_of
from gonio.model import Model
from gonio.symbols.formula import formula_of
from gonio.symbols.program import staged

_DASHES = {0x2010: "-", 0x2013: "-", 0x2014: "-", 0x2212: "-"}
PRECISION = ["#ifdef GL_ES", "precision highp float;", "#endif"]


def with_numbers(subject: Subject, name: str) -> list[str]:
    """`float NAME(vec3 w_i, vec3 w_r)`, 1/sr, of the values of a subject, which are constants of the shader."""
    functions = functions_of(subject.model, name)
    _, numbers = programmed(subject)
    return [
        *_constant(f"{functions.stem}_values", numbers["values"], _meanings(subject)),
        *(_constant(f"{functions.stem}_pre", numbers["pre"], []) if numbers["pre"] else []),
        *functions.lines(),
    ]


def with_uniforms(model: Model, name: str) -> list[str]:
    """The same of any values: NAME_values and NAME_pre are uniforms.

    NAME_values takes the weights and shape parameters in the order of `model.parameters`, and NAME_pre, which some
    models do not have, what `gonio.exporting.source.programmed` gives for them, or `pre(values)` of the JavaScript
    module of the model.
    """
    functions = functions_of(model, name)
    count = len(staged(functions.formula).carried["parameters"])
    return [
        f"uniform float {functions.stem}_values[{len(model.parameters)}];",
        *([f"uniform float {functions.stem}_pre[{count}];"] if count else []),
        *functions.lines(),
    ]


def functions_of(model: Model, name: str) -> Functions:
    """The functions of a model whose values are in the array NAME_values."""
    known = GLSL_LANGUAGE.identifier(name)
    stem = known.rstrip("_") or "model"
    places = {p: f"{stem}_values[{k}]" for k, p in enumerate(model.parameters)}
    return Functions(GLSL_LANGUAGE, formula_of(model), known, places)


def commented(subject: Subject, what: str, comment: str = "//") -> list[str]:
    """The heading of a file as comments in ASCII, as some drivers take no more.

    No text can leave its comment: a line has no break, and no backslash at its end that would continue it.
    """
    lines = "\n".join(heading(subject, what)).translate(_DASHES).splitlines()
    return [f"{comment} {_ascii(line)}".rstrip(" \\") for line in lines]


def _ascii(line: str) -> str:
    """Letters without their accents, and a question mark for what has no letter of its own."""
    letters = (c for c in unicodedata.normalize("NFKD", line) if not unicodedata.combining(c))
    return "".join(letters).encode("ascii", "replace").decode()


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    name = GLSL_LANGUAGE.identifier(request.name)
    what = f"{name}: {subject.model.title}, as GLSL. float {name}(vec3 w_i, vec3 w_r)"
    lines = [*commented(subject, what), "", *PRECISION, "", *with_numbers(subject, request.name)]
    return Made({request.out.name: "\n".join(lines) + "\n"})


def check(subject: Subject, request: Request) -> Proof:
    """The file, compiled and run where that is possible."""
    name = GLSL_LANGUAGE.identifier(request.name)
    return proof_of(subject, request.out.read_text(encoding="utf-8"), f"{name}(w_i, w_r)")


def _constant(name: str, numbers: Sequence[float], meanings: Sequence[str]) -> list[str]:
    size = len(numbers)
    head = f"const float {name}[{size}] = float[{size}]("
    texts = [GLSL_LANGUAGE.literal(number) for number in numbers]
    if not meanings:
        content = rows(numbers, GLSL_LANGUAGE)
        return [head, *content[:-1], content[-1].rstrip(","), ");"]
    commas = [","] * (size - 1) + [""]
    return [head, *(f"    {t}{c} // {m}" for t, c, m in zip(texts, commas, meanings, strict=True)), ");"]


def _meanings(subject: Subject) -> list[str]:
    return [f"{p}, {subject.unit(p)}" for p in subject.model.parameters]


GLSL_TARGET = Target(
    name="glsl",
    title="GLSL",
    suffixes=(".glsl", ".frag", ".vert", ".comp"),
    writes="functions for WebGL 2 and OpenGL: float NAME(vec3 w_i, vec3 w_r)",
    make=make,
    check=check,
)
