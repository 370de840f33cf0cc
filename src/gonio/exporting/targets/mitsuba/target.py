"""The file for Mitsuba 3, and its proof by Dr.Jit alone."""

import ast
import functools
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.languages.language import Writer
from gonio.exporting.running import executed
from gonio.exporting.source import pairs, proved
from gonio.exporting.subject import ONE, Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.exporting.targets.mitsuba.kernel import KERNEL, PRELUDE
from gonio.exporting.targets.mitsuba.lobes import Lobe, anisotropic, lobes
from gonio.exporting.targets.mitsuba.precision import needs_double, relative_error
from gonio.exporting.targets.python import as_docstring, run_python
from gonio.geometry import Geometry
from gonio.symbols.formula import INCIDENCE, NUMBERS, REFLECTION, Formula, formula_of
from gonio.symbols.program import Stage, staged, whole

CONSTANTS = 2e-6  # relative error where constants have nine digits, and a lobe is a thousandth wide
NOISY = 3.0  # standard deviation of one sample over the mean: a picture then takes ten times as many samples
RGB = {"R", "G", "B"}


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    drawn, cosine, noise = lobes(subject)
    text = "\n".join(lines_of(subject, request.name, drawn, cosine)) + "\n"
    numbers = {f"share of {' and '.join(lobe.weights)}": round(lobe.share, 4) for lobe in drawn}
    remarks = tuple(_remarks(subject, request, noise))
    return Made({request.out.name: text}, remarks, numbers | {"share of the cosine": round(cosine, 4)})


def plugin(name: str) -> str:
    """What the BSDF is called in Mitsuba: the model in coating_mitsuba.py is gonio-coating."""
    return f"gonio-{name.removesuffix('_mitsuba').replace('_', '-').strip('-')}"


def _remarks(subject: Subject, request: Request, noise: Mapping[str, float]) -> Iterator[str]:
    yield (
        f"In Python, after mi.set_variant(..): import {request.out.stem}; then 'type': {plugin(request.name)!r} "
        "in a scene"
    )
    for weight, deviation in noise.items():
        if deviation > NOISY:
            yield (
                f"{weight} has no sampler of its own and renders with noise: one sample of it deviates by "
                f"{deviation:.2g} times its mean"
            )
    if subject.model.polarised:
        yield "Polarisation is left out: the plugin depolarises"
    if subject.by == "wavelength":
        yield (
            "Between the fitted wavelengths values are interpolated, and beyond the first and the last one that value "
            "is repeated; rgb and mono variants need the property 'wavelength'"
        )
    elif subject.by and set(subject.sets) != RGB:
        yield f"No variant of Mitsuba has these channels: give the property {subject.by!r} in the scene"


def lines_of(subject: Subject, name: str, drawn: Sequence[Lobe], cosine: float) -> list[str]:
    """The lines of the file: values, the formula in functions of Dr.Jit, and the class."""
    program = staged(formula_of(subject.model))
    writer = Writer(KERNEL, "_gonio")
    functions: list[str] = []
    for signature, stage, many in zip(_SIGNATURES, program.stages, (True, True, False), strict=True):
        functions += _function(signature, writer, stage, subject.model.parameters, many)
    for k, lobe in enumerate(drawn):
        functions += _whole(f"_draw_{k + 1}(values, w_i, numbers)", writer, lobe.draw, True)
        functions += _whole(f"_density_{k + 1}(values, w_i, w_r)", writer, lobe.density, False)
    title = f"{name}: {subject.model.title}, as a BSDF of Mitsuba 3 called {plugin(name)}."
    return [
        '"""' + as_docstring(heading(subject, title)),
        '"""',
        "",
        "import math",
        "",
        "import drjit as dr",
        "",
        *_values(subject, name, cosine),
        "",
        *PRELUDE.splitlines(),
        *writer.shared(),
        *functions,
        "",
        "",
        "# Share of the directions, what draws them, and their density [1/sr].",
        "DRAWN = [",
        *(f"    ({lobe.share!r}, _draw_{k + 1}, _density_{k + 1})," for k, lobe in enumerate(drawn)),
        "]",
        "",
        *surface().splitlines(),
    ]


def _values(subject: Subject, name: str, cosine: float) -> Iterator[str]:
    labels = [] if list(subject.sets) == [ONE] else list(subject.sets)
    yield f"NAME = {plugin(name)!r}"
    yield f"BY, LABELS = {subject.by!r}, {[*map(str, labels)] if labels else ['']!r}"
    yield "# Every value of the model, for each of the LABELS."
    yield "VALUES = {"
    for parameter in subject.model.parameters:
        yield f"    {parameter!r}: {[float(values[parameter]) for values in subject.sets.values()]!r},"
    yield "}"
    yield f"ANISOTROPIC = {anisotropic(subject)}  # whether it matters how the surface is turned"
    yield f"PRECISE = {needs_double(subject)}  # whether the formula needs double precision"
    yield f"COSINE = {cosine!r}  # share of the directions that the cosine draws; lobes draw the others"


@functools.cache
def surface() -> str:
    """The part that is the same for every model: the class that Mitsuba calls.

    It uses what stands above it: NAME, BY, LABELS, VALUES, COSINE, DRAWN, ANISOTROPIC, PRECISE, and the functions
    _prepare, _incidence and _reflected, which take arrays of Dr.Jit alone.
    """
    return (files("gonio.exporting.targets.mitsuba") / "surface.txt").read_text(encoding="utf-8")


_SIGNATURES = ("_prepare(values)", "_incidence(values, pre, w_i)", "_reflected(values, pre, inc, w_i, w_r)")
_PLACES = {
    **{name: f"w_i[{k}]" for k, name in enumerate(INCIDENCE)},
    **{name: f"w_r[{k}]" for k, name in enumerate(REFLECTION)},
    **{name: f"numbers[{k}]" for k, name in enumerate(NUMBERS)},
}


def _whole(signature: str, writer: Writer, formula: Formula, many: bool) -> list[str]:
    return _function(signature, writer, whole(formula).last, formula.inputs[0], many)


def _function(signature: str, writer: Writer, stage: Stage, parameters: Sequence[str], many: bool) -> list[str]:
    places = {p: f"values[{p!r}]" for p in parameters} | _PLACES
    inputs = [n for n in (*parameters, *_PLACES) if n in stage.inputs]
    lines = [f"{KERNEL.identifier(n)} = {places[n]}" for n in inputs] + writer.stage(stage)
    results = writer.results(stage)
    lines.append(f"return [{', '.join(results)}]" if many else f"return {results[0]}")
    return ["", "", f"def {signature}:", *(f"    {line}" for line in lines)]


def check(subject: Subject, request: Request) -> Proof:
    """The written file without its class, run by Dr.Jit in double precision."""
    ast.parse(request.out.read_text(encoding="utf-8"))
    one = subject if len(subject.sets) == 1 else subject.one(next(iter(subject.sets)))
    try:
        import drjit  # noqa: F401
    except ImportError:
        how = "no Dr.Jit is here: the file is valid Python, and the same formula, printed in plain Python, was run"
        return proved(one, how, lambda g: run_python(one, g))
    geometry = pairs()
    errors = [_error(subject, label, run(request.out, geometry, k), geometry) for k, label in enumerate(subject.sets)]
    return Proof("its formula run by Dr.Jit, without Mitsuba", max(errors), CONSTANTS)


def _error(subject: Subject, label: str, found: np.ndarray, geometry: Geometry) -> float:
    expected = np.asarray(subject.brdf(geometry, label), dtype=float)
    return relative_error(found, expected, expected)


def defined(file: Path) -> dict[str, Any]:
    """What the file defines, run without Mitsuba."""
    stand_in = {"variant": lambda: "none", "Float": float, "BSDF": object, "register_bsdf": lambda *_: None}
    return executed(file, {"mitsuba": stand_in})


def run(file: Path, geometry: Geometry, place: int = 0, array: Any = None) -> np.ndarray:
    """The BRDF that the file's functions give for one of its sets, in arrays of Dr.Jit, double precision by default."""
    from drjit import scalar

    Array = array or scalar.ArrayXf64
    module = defined(file)
    w = [Array(np.ascontiguousarray(c)) for c in np.broadcast_arrays(*geometry)]
    values = {name: Array([numbers[place]]) for name, numbers in module["VALUES"].items()}
    ready = module["_prepare"](values)
    found = module["_incidence"](values, ready, w[:3])
    return np.asarray(Array(module["_reflected"](values, ready, found, w[:3], w[3:])))


MITSUBA = Target(
    name="mitsuba",
    title="Mitsuba 3",
    suffixes=(".py",),
    writes="a Python file that registers a BSDF: eval, sample, pdf, and derivatives by every value",
    make=make,
    check=check,
)
