"""Shaders proved: compiled by glslangValidator, and run through OpenGL by moderngl, where these are installed."""

import functools
import importlib
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gonio.exporting.source import DOUBLE, pairs
from gonio.exporting.subject import Subject
from gonio.exporting.target import Proof
from gonio.files import temporary_folder
from gonio.geometry import Geometry

VERSIONS = ("300 es", "430")
SINGLE = 1e-5  # relative error of single precision after some hundred operations
DIM = 1e-6  # of the largest value: below this, lobes have lost their digits
_TIMES = 10  # a shader may err by so much more than NumPy in single precision: functions differ in their last digits
COMPILER = "glslangValidator"


def proof_of(subject: Subject, module: str, call: str, uniforms: Mapping[str, float] | None = None) -> Proof:
    """A module of GLSL, compiled and run where that is possible; call: an expression of the vectors w_i and w_r.

    Raises ValueError for a module that does not compile.
    """
    names = list(uniforms or {})
    compiled = shutil.which(COMPILER) is not None
    if compiled:
        for version in VERSIONS:
            compile_glsl([shader(module, call, version, names)])
    if (context := opengl()) is None:
        done = f"compiled by {COMPILER}, and " if compiled else ""
        return formula_alone(subject, f"{done}moderngl, which runs it, is not installed")
    geometry = rounded(pairs())
    found = run_glsl(context, module, call, geometry, VERSIONS[-1], uniforms)
    error, limit = single_error(subject, geometry, found)
    return Proof(f"run by OpenGL ({context.info['GL_RENDERER']})", error, limit)


def formula_alone(subject: Subject, why: str) -> Proof:
    """Where the language cannot be run: the same program, printed in Python."""
    from gonio.exporting.targets.python import run_python

    geometry = pairs()
    error = largest_error(run_python(subject, geometry), np.asarray(subject.brdf(geometry)))
    return Proof(f"{why}: the same formula, printed in Python, was run instead", error, DOUBLE)


def single_error(subject: Subject, geometry: Geometry, found: np.ndarray) -> tuple[float, float]:
    """The largest relative error where the BRDF is not DIM, and what it may be: as NumPy's in single precision."""
    expected = np.asarray(subject.brdf(geometry))
    single = Geometry(*(np.asarray(g, dtype=np.float32) for g in geometry))
    with np.errstate(all="ignore"):
        same = np.asarray(subject.brdf(single), dtype=float)
    return largest_error(found, expected), max(SINGLE, _TIMES * largest_error(same, expected))


def largest_error(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest relative error of values above DIM times the largest, and of the others that of DIM itself."""
    scale = np.maximum(np.abs(expected), DIM * np.max(np.abs(expected)))
    return float(np.max(np.abs(found - expected) / scale))


def rounded(geometry: Geometry) -> Geometry:
    """Directions as single precision holds them."""
    return Geometry(*(np.asarray(g, dtype=np.float32).astype(float) for g in np.broadcast_arrays(*geometry)))


def shader(module: str, call: str, version: str, uniforms: Sequence[str] = ()) -> str:
    """A vertex shader that has the value of an expression for a pair of directions."""
    return "\n".join(
        [
            f"#version {version}",
            "in vec3 w_light;",
            "in vec3 w_view;",
            "out float value;",
            *(f"uniform float {name};" for name in uniforms),
            module,
            "void main() {",
            "    vec3 w_i = w_light;",
            "    vec3 w_r = w_view;",
            f"    value = {call};",
            "    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);",
            "}",
            "",
        ]
    )


def compile_glsl(shaders: Sequence[str]) -> None:
    """Compile vertex shaders; ValueError with what the compiler says of one that it refuses."""
    with temporary_folder() as folder:
        files = [folder / f"shader{k}.vert" for k in range(len(shaders))]
        for file, text in zip(files, shaders, strict=True):
            file.write_text(text, encoding="utf-8")
        done = subprocess.run([COMPILER, *map(str, files)], capture_output=True, text=True, check=False)
    if done.returncode:
        errors = [line for line in done.stdout.splitlines() if line.startswith("ERROR")]
        raise ValueError(f"{COMPILER} refuses the shader: {errors[0] if errors else done.stdout}")


@functools.cache
def opengl() -> Any:
    """A context of OpenGL without a window; None where moderngl or a driver is missing."""
    try:
        moderngl: Any = importlib.import_module("moderngl")
        context = moderngl.create_standalone_context(backend="egl", require=430)
        context.simple_framebuffer((1, 1)).use()  # Mesa draws nothing without one, not even into a buffer
        return context
    except Exception:  # whatever a driver raises, there is none
        return None


def run_glsl(
    context: Any, module: str, call: str, geometry: Geometry, version: str, uniforms: Mapping[str, Any] | None = None
) -> np.ndarray:
    """What an expression of w_i and w_r is in a module of GLSL for every pair of directions."""
    single = [n for n in uniforms or {} if not re.search(rf"uniform float {n}\b", module)]
    program = context.program(vertex_shader=shader(module, call, version, single), varyings=["value"])
    for name, value in (uniforms or {}).items():
        if name in program:
            length = program[name].array_length  # a driver leaves out the end of an array that no one reads
            program[name].write(np.atleast_1d(np.asarray(value, dtype="f4"))[:length].tobytes())
    rows = np.stack(np.broadcast_arrays(*geometry), axis=-1).reshape(-1, 6).astype("f4")
    given, found = context.buffer(rows.tobytes()), context.buffer(reserve=4 * len(rows))
    content = [(given, "3f 3f", *(n if n in program else "" for n in ("w_light", "w_view")))]
    context.vertex_array(program, content).transform(found, mode=context.POINTS, vertices=len(rows))
    return np.frombuffer(found.read(), dtype="f4").astype(float)
