"""Python: a module of plain numbers, and one of NumPy's arrays. Neither imports gonio."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.languages.language import Writer
from gonio.exporting.languages.python import NUMPY, PRELUDE, PYTHON
from gonio.exporting.running import executed
from gonio.exporting.source import programmed, proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.files import temporary_folder
from gonio.geometry import Geometry
from gonio.symbols.formula import INCIDENCE, REFLECTION
from gonio.symbols.program import Program, Stage


def lines_of(subject: Subject, name: str, arrays: bool, docstring: Sequence[str] = ()) -> list[str]:
    """The lines of a module with the function NAME(w_i, w_r, values); docstring: other lines than those of Python."""
    language = NUMPY if arrays else PYTHON
    program, numbers = programmed(subject)
    writer = Writer(language, f"_{name}")
    functions = _functions(program, writer, name, arrays)
    values = ", ".join(
        f"{p!r}: {language.literal(v)}" for p, v in zip(subject.model.parameters, numbers["values"], strict=True)
    )
    library = "NumPy" if arrays else "plain Python"
    told = docstring or heading(subject, f"{name}: {subject.model.title}, as {library}.")
    return [
        '"""' + as_docstring(told),
        '"""',
        "",
        "import numpy as np" if arrays else "import math",
        *([] if arrays else PRELUDE.splitlines()),
        "",
        *writer.shared(),
        "",
        f"VALUES = {{{values}}}",
        *functions,
    ]


def as_docstring(lines: Sequence[str]) -> str:
    """Lines for a string of Python in triple quotes, which none of them ends."""
    return "\n".join(lines).replace("\\", "\\\\").replace('"""', "'''")


def _functions(program: Program, writer: Writer, name: str, arrays: bool) -> list[str]:
    parameters, (pre, inc, last) = program.formula.inputs[0], program.stages
    vectors = "arrays (..., 3) of unit vectors that broadcast" if arrays else "unit vectors, three numbers each"
    suffix = ["with np.errstate(all='ignore'):"] if arrays else []
    body = [
        "given = VALUES if values is None else {**VALUES, **values}",
        "pre = _prepare(given)",
        "inc = _incidence(given, pre, w_i)",
        "return _reflected(given, pre, inc, w_i, w_r)",
    ]
    if arrays:
        vectors_first = "w_i, w_r = (np.moveaxis(np.asarray(w, dtype=float), -1, 0) for w in (w_i, w_r))"
        body = [vectors_first, body[0], *suffix, *(f"    {line}" for line in body[1:])]
    return [
        "",
        "",
        *_function("_prepare(values)", writer, pre, parameters, many=True),
        "",
        "",
        *_function("_incidence(values, pre, w_i)", writer, inc, parameters, many=True),
        "",
        "",
        *_function("_reflected(values, pre, inc, w_i, w_r)", writer, last, parameters, many=False),
        "",
        "",
        f"def {name}(w_i, w_r, values=None):",
        f'    """BRDF [1/sr], without the cosine; w_i, w_r: {vectors}. values: other values by name."""',
        *(f"    {line}" for line in body),
    ]


def _function(signature: str, writer: Writer, stage: Stage, parameters: Sequence[str], many: bool) -> list[str]:
    language = writer.language
    places = {p: f"values[{p!r}]" for p in parameters}
    for k in range(3):
        places |= {INCIDENCE[k]: f"w_i[{k}]", REFLECTION[k]: f"w_r[{k}]"}
    inputs = [n for n in (*parameters, *INCIDENCE, *REFLECTION) if n in stage.inputs]
    lines = [f"{language.identifier(n)} = {places[n]}" for n in inputs] + writer.stage(stage)
    results = writer.results(stage)
    lines.append(f"return ({', '.join(results)}{',' if len(results) == 1 else ''})" if many else f"return {results[0]}")
    return [f"def {signature}:", *(f"    {line}" for line in lines)]


def run_python(subject: Subject, geometry: Geometry, arrays: bool = False) -> np.ndarray:
    """What the printed module gives."""
    with temporary_folder() as folder:
        file = folder / "model.py"
        file.write_text("\n".join(lines_of(subject, "model", arrays)), encoding="utf-8")
        return _run(file, "model", geometry, arrays)


def _run(file: Path, name: str, geometry: Geometry, arrays: bool) -> np.ndarray:
    """What a module gives that gonio has just written."""
    function = executed(file)[name]
    vectors = np.stack(np.broadcast_arrays(*geometry), axis=-1)
    if arrays:
        return np.asarray(function(vectors[..., :3], vectors[..., 3:]))
    return np.array([function(row[:3], row[3:]) for row in vectors.reshape(-1, 6).tolist()])


def _target(arrays: bool, name: str, title: str, writes: str) -> Target:
    def make(subject: Subject, request: Request) -> Made:
        return Made({request.out.name: "\n".join(lines_of(subject, request.name, arrays)) + "\n"})

    def check(subject: Subject, request: Request) -> Proof:
        return proved(subject, f"run in {title}", lambda g: _run(request.out, request.name, g, arrays))

    return Target(name, title, (".py",), writes, make, check)


PYTHON_TARGET = _target(
    False, "python", "Python", "a module that needs Python alone: NAME(w_i, w_r) of two unit vectors"
)
NUMPY_TARGET = _target(True, "numpy", "NumPy", "a module that needs NumPy alone: NAME(w_i, w_r) of arrays (..., 3)")
