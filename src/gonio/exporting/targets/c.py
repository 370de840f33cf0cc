"""C: one file that needs <math.h> alone, for whoever calls C: Rust, Fortran, Cython, CUDA, C++."""

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.languages.c import C_LANGUAGE, commented, rows
from gonio.exporting.languages.language import Writer
from gonio.exporting.source import identifier, programmed, proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.files import temporary_folder
from gonio.geometry import Geometry
from gonio.symbols.formula import INCIDENCE, REFLECTION
from gonio.symbols.program import Program, Stage

SEED = {"x_i": "w_i[0]", "y_i": "w_i[1]", "z_i": "w_i[2]", "x_r": "w_r[0]", "y_r": "w_r[1]", "z_r": "w_r[2]"}


def make(subject: Subject, request: Request) -> Made:
    """The content of the file."""
    text = "\n".join(source(subject, request.name, request.out.stem))
    return Made({request.out.name: f"{text}\n"})


def source(subject: Subject, name: str, stem: str) -> list[str]:
    """The lines of the file: NAME(w_i, w_r), and the same for other values or many directions of one incidence."""
    program, numbers = programmed(subject)
    writer = Writer(C_LANGUAGE, name)
    functions = _functions(program, writer, name)
    guard = f"{identifier(stem).upper()}_GONIO"
    return [
        *commented(heading(subject, _what(subject, name))),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <math.h>",
        "",
        "/* Define it as `static inline` where several files of one program include this one. */",
        f"#ifndef {name.upper()}_API",
        f"#define {name.upper()}_API",
        "#endif",
        "",
        *_values(subject, name, numbers["values"]),
        *_array(f"{name}_prepared", numbers["pre"], "What the values give on their own, as NAME_prepare finds it."),
        *writer.shared(),
        *functions,
        "",
        f"#endif /* {guard} */",
    ]


def _what(subject: Subject, name: str) -> str:
    return f"{name}: {subject.model.title}, as C. double {name}(const double w_i[3], const double w_r[3])"


def _values(subject: Subject, name: str, values: Sequence[float]) -> list[str]:
    lines = [f"static const double {name}_values[{len(values)}] = {{"]
    for parameter, value in zip(subject.model.parameters, values, strict=True):
        lines.append(f"    {C_LANGUAGE.literal(value)}, /* {parameter}, {subject.unit(parameter)} */")
    return [*lines, "};", ""]


def _array(name: str, numbers: Sequence[float], meaning: str) -> list[str]:
    content = rows(numbers, C_LANGUAGE) or ["    0.0, /* nothing */"]
    return [f"/* {meaning.replace('NAME', name.removesuffix('_prepared'))} */",
            f"static const double {name}[{max(len(numbers), 1)}] = {{", *content, "};", ""]  # fmt: skip


def _functions(program: Program, writer: Writer, name: str) -> list[str]:
    """The three functions of a program, and those that put them together."""
    parameters, (pre, inc, last) = program.formula.inputs[0], program.stages
    sizes = {level: max(len(nodes), 1) for level, nodes in program.carried.items()}
    count, n_pre, n_inc = len(parameters), sizes["parameters"], sizes["incidence"]
    given = f"const double values[{count}]"
    api = f"{name.upper()}_API "
    light, view = "const double w_i[3]", "const double w_r[3]"
    carried = f"{given}, const double pre[{n_pre}]"
    reflected = f"{api}double {name}_reflected({carried}, const double inc[{n_inc}], {light}, {view})"
    return [
        "",
        "/* What depends on the values alone. */",
        *_function(f"{api}void {name}_prepare({given}, double pre[{n_pre}])", writer, pre, parameters, "pre"),
        "",
        "/* What depends on the light too: once for each incidence. */",
        *_function(
            f"{api}void {name}_incidence({carried}, {light}, double inc[{n_inc}])", writer, inc, parameters, "inc"
        ),
        "",
        "/* The BRDF, 1/sr, for one of many directions of reflection. */",
        *_function(reflected, writer, last, parameters, ""),
        "",
        "/* The BRDF, 1/sr, for other values of the parameters, in the order of the array above. */",
        f"{api}double {name}_with({given}, {light}, {view}) {{",
        f"    double pre[{n_pre}];",
        f"    {name}_prepare(values, pre);",
        *_put_together(name, n_inc, "values, pre"),
        "",
        "/* The BRDF, 1/sr, of unit vectors to the light and to the viewer; z is the surface normal. */",
        f"{api}double {name}({light}, {view}) {{",
        *_put_together(name, n_inc, f"{name}_values, {name}_prepared"),
    ]


def _put_together(name: str, n_inc: int, ready: str) -> list[str]:
    """The end of a function of both directions."""
    return [
        f"    double inc[{n_inc}];",
        f"    {name}_incidence({ready}, w_i, inc);",
        f"    return {name}_reflected({ready}, inc, w_i, w_r);",
        "}",
    ]


def _function(signature: str, writer: Writer, stage: Stage, parameters: Sequence[str], into: str) -> list[str]:
    """One of the three functions: its inputs by name, its statements and what it hands on or returns."""
    inputs = [n for n in (*parameters, *INCIDENCE, *REFLECTION) if n in stage.inputs]
    places = {p: f"values[{k}]" for k, p in enumerate(parameters)} | SEED
    lines = [f"const double {C_LANGUAGE.identifier(n)} = {places[n]};" for n in inputs]
    lines += writer.stage(stage)
    results = writer.results(stage)
    lines += [f"{into}[{k}] = {r};" for k, r in enumerate(results)] if into else [f"return {results[0]};"]
    arguments = [a.strip().rpartition(" ")[2].partition("[")[0] for a in signature.partition("(")[2].split(",")]
    used = " ".join(lines)
    lines += [] if not into else [f"(void){a};" for a in arguments if f"{a.rstrip(')')}[" not in used]
    if not into:
        lines[-1:-1] = [f"(void){a};" for a in arguments if f"{a.rstrip(')')}[" not in used]
    return [f"{signature} {{", *(f"    {line}" for line in lines), "}"]


def compiler() -> str:
    """The C compiler of this machine; empty where there is none."""
    return next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), "")


def check(subject: Subject, request: Request) -> Proof:
    """The written file, compiled by the compiler of this machine, at many pairs of directions."""
    if not (found := compiler()):
        return _formula_alone(subject)
    with temporary_folder() as folder:
        library = compiled(found, request.out, folder / "model.so")
        run = ctypes.CDLL(str(library))[request.name]
        run.restype, run.argtypes = ctypes.c_double, [ctypes.POINTER(ctypes.c_double)] * 2
        return proved(subject, f"compiled by {Path(found).name} and called", lambda g: _called(run, g))


def compiled(program: str, file: Path, library: Path) -> Path:
    """The library that a compiler makes of a file; ValueError with what the compiler says."""
    command = [program, "-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-x", "c", str(file)]
    done = subprocess.run([*command, "-o", str(library), "-lm"], capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError(f"{file}: does not compile: {done.stderr.strip().splitlines()[0]}")
    return library


def _called(run: "ctypes._NamedFuncPointer", geometry: Geometry) -> np.ndarray:
    vectors = np.ascontiguousarray(np.stack(np.broadcast_arrays(*geometry), axis=-1))
    three = ctypes.c_double * 3
    return np.array([run(three(*row[:3]), three(*row[3:])) for row in vectors.tolist()])


def _formula_alone(subject: Subject) -> Proof:
    """Where no compiler is: the same program, printed in Python."""
    from gonio.exporting.targets.python import run_python

    how = "no C compiler is here: the same formula, printed in Python, was run instead"
    return proved(subject, how, lambda g: run_python(subject, g))


C = Target(
    name="c",
    title="C",
    suffixes=(".h", ".c"),
    writes="a C file: double NAME(w_i, w_r), which needs <math.h> alone",
    make=make,
    check=check,
)
