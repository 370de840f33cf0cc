"""WGSL: functions for WebGPU."""

from collections.abc import Sequence

from gonio.exporting.languages.c import rows
from gonio.exporting.languages.wgsl import WGSL_LANGUAGE
from gonio.exporting.source import programmed
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.shaders.functions import Functions
from gonio.exporting.targets.shaders.glsl import commented
from gonio.exporting.targets.shaders.proof import formula_alone
from gonio.symbols.formula import formula_of


def with_numbers(subject: Subject, name: str) -> list[str]:
    """`fn NAME(w_i: vec3<f32>, w_r: vec3<f32>) -> f32`, 1/sr, of the values of a subject."""
    known = WGSL_LANGUAGE.identifier(name)
    stem = known.rstrip("_") or "model"
    places = {p: f"{stem}_values[{k}]" for k, p in enumerate(subject.model.parameters)}
    _, numbers = programmed(subject)
    return [
        *_constant(f"{stem}_values", numbers["values"]),
        *(_constant(f"{stem}_pre", numbers["pre"]) if numbers["pre"] else []),
        *Functions(WGSL_LANGUAGE, formula_of(subject.model), known, places).lines(),
    ]


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    name = WGSL_LANGUAGE.identifier(request.name)
    what = f"{name}: {subject.model.title}, as WGSL. fn {name}(w_i: vec3<f32>, w_r: vec3<f32>) -> f32"
    return Made({request.out.name: "\n".join([*commented(subject, what), "", *with_numbers(subject, name)]) + "\n"})


def check(subject: Subject, request: Request) -> Proof:  # noqa: ARG001
    """Nothing here runs WGSL: its formula is."""
    return formula_alone(subject, "nothing here runs WGSL")


def _constant(name: str, numbers: Sequence[float]) -> list[str]:
    kind = f"array<f32, {len(numbers)}>"
    return [f"const {name}: {kind} = {kind}(", *rows(numbers, WGSL_LANGUAGE), ");"]


WGSL_TARGET = Target(
    name="wgsl",
    title="WGSL",
    suffixes=(".wgsl",),
    writes="functions for WebGPU: fn NAME(w_i: vec3<f32>, w_r: vec3<f32>) -> f32",
    make=make,
    check=check,
)
