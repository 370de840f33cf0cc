"""Models as shaders: every one compiled by glslangValidator and run by OpenGL, where these are installed."""

import functools
import inspect
import math
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from gonio import catalogue, export
from gonio.arrays import namespace
from gonio.exporting import targets
from gonio.exporting.languages.glsl import GLSL_LANGUAGE
from gonio.exporting.languages.osl import OSL_LANGUAGE
from gonio.exporting.languages.single import LARGEST, SMALLEST
from gonio.exporting.languages.wgsl import WGSL_LANGUAGE
from gonio.exporting.source import identifier, pairs, programmed
from gonio.exporting.subject import of_model
from gonio.exporting.target import Request
from gonio.exporting.targets.shaders import glsl, proof
from gonio.exporting.targets.shaders.brdf_explorer import CALL, shader_of, slider, sliders
from gonio.model import Model, Parameter
from gonio.symbols.evaluate import evaluate
from gonio.symbols.formula import INCIDENCE, REFLECTION, formula_of

NAMES = ("glsl", "wgsl", "osl", "brdf-explorer")
SUFFIX = {"glsl": ".glsl", "wgsl": ".wgsl", "osl": ".osl", "brdf-explorer": ".brdf"}
# Where single precision loses more digits than the others: Mesa's atan2, its asin and acos, and 8 112 terms of a sum.
WORSE = {"alternate-torrance-sparrow": 4e-5, "oren-nayar": 8e-5, "modified-beckmann-kirchhoff": 2e-4}
GLSLANG = pytest.mark.skipif(
    shutil.which(proof.COMPILER) is None, reason=f"no {proof.COMPILER} (Debian: glslang-tools)"
)


@pytest.fixture(scope="module")
def opengl():
    if (context := proof.opengl()) is None:
        pytest.skip("no moderngl, or no driver that gives it an OpenGL context (Debian: libegl1, libgl1-mesa-dri)")
    return context


def subject_of(model, **values):
    return of_model(model, dict.fromkeys(model.weights, 0.5) | values)


def drawn(model, seed):
    """Values of a model anywhere within their bounds, by their logarithm where these are positive."""
    random = np.random.default_rng(seed)
    values = {name: random.uniform(0.1, 1.0) for name in model.weights}
    for name, p in model.shape.items():
        upper = min(p.upper, 1e3)
        if p.lower > 0:
            values[name] = float(np.exp(random.uniform(math.log(p.lower), math.log(upper))))
        else:
            values[name] = random.uniform(max(p.lower, -1e3), upper)
    return values


@functools.cache
def modules(what):
    """Every model with its numbers, with uniforms, or with sliders: a module, and what is called in it."""
    found = []
    for model in catalogue.values():
        subject, call, uniforms = subject_of(model), "coating(w_i, w_r)", []
        if what == "numbers":
            text = [*glsl.PRECISION, *glsl.with_numbers(subject, "coating")]
        elif what == "uniforms":
            text = [*glsl.PRECISION, *glsl.with_uniforms(model, "coating")]
        else:
            text, call, uniforms = shader_of(subject, "coating"), CALL, [slider(p) for p in model.parameters]
        found.append(("\n".join(text), call, uniforms))
    return found


@GLSLANG
@pytest.mark.parametrize(
    ("what", "version"),
    [("numbers", "300 es"), ("numbers", "430"), ("uniforms", "300 es"), ("sliders", "300 es"), ("sliders", "130")],
)
def test_every_model_compiles(what, version):
    """GLSL ES 3.00 is the strictest; the oldest templates of the BRDF Explorer are in GLSL 1.30."""
    proof.compile_glsl([proof.shader(text, call, version, uniforms) for text, call, uniforms in modules(what)])


@GLSLANG
def test_a_module_that_does_not_compile_is_refused():
    with pytest.raises(ValueError, match="refuses the shader: ERROR"):
        proof.compile_glsl([proof.shader("float f(vec3 a, vec3 b) { return a; }", "f(w_i, w_r)", "300 es")])


@pytest.mark.parametrize("model", catalogue.values(), ids=catalogue.keys())
def test_every_model_runs_as_it_computes(opengl, model):
    """Within 1e-5 wherever the BRDF is above 1e-6 of its largest value, but for three models."""
    geometry = proof.rounded(pairs())
    subject = subject_of(model)
    module = "\n".join(glsl.with_numbers(subject, "coating"))
    found = proof.run_glsl(opengl, module, "coating(w_i, w_r)", geometry, "300 es")
    error = proof.largest_error(found, np.asarray(subject.brdf(geometry)))
    assert error < WORSE.get(model.name, proof.SINGLE)
    assert len(WORSE) <= 4


def test_numbers_as_uniforms_give_the_same(opengl):
    geometry = proof.rounded(pairs())
    for name in ("ggx", "gonio-best", "lambert", "binomial", "student-t"):
        subject = of_model(catalogue[name], {n: 0.9 * v for n, v in subject_of(catalogue[name]).values.items()})
        _, numbers = programmed(subject)
        uniforms = {"coating_values": numbers["values"], "coating_pre": numbers["pre"]}
        module = "\n".join(glsl.with_uniforms(subject.model, "coating"))
        found = proof.run_glsl(opengl, module, "coating(w_i, w_r)", geometry, "300 es", uniforms)
        fixed = "\n".join(glsl.with_numbers(subject, "coating"))
        same = proof.run_glsl(opengl, fixed, "coating(w_i, w_r)", geometry, "300 es")
        np.testing.assert_allclose(found, same, rtol=proof.SINGLE)  # constants may be folded in another order


def test_sliders_of_the_brdf_explorer_move_the_model(opengl):
    geometry = proof.rounded(pairs())
    for name in ("ggx", "sgd", "disney", "harvey-shack", "gonio-best"):
        begun = subject_of(catalogue[name])
        moved = of_model(catalogue[name], {n: v * 0.9 for n, v in begun.values.items()})
        values = {n: v for n, _, _, v in sliders(moved)}
        found = proof.run_glsl(opengl, "\n".join(shader_of(begun, "coating")), CALL, geometry, "430", values)
        assert proof.largest_error(found, np.asarray(moved.brdf(geometry))) < proof.SINGLE, name


def test_no_power_of_a_negative_number():
    """GLSL, WGSL and HLSL leave it undefined: the models guard their bases for values anywhere in their bounds."""
    for model in catalogue.values():
        assert not negative_powers(model), model.name


def test_a_power_of_a_negative_number_is_found():
    def lobe(g, *, n):
        return namespace(g.z_i).pow(g.x_i * g.x_r, n)

    model = Model("lobe", "Lobe", "phong1975", {"k": _with(lobe, n=Parameter(2.5, 1.0, 9.0, "exponent"))})
    assert negative_powers(model)


def _with(function, **parameters):
    """The function, its parameters annotated as a model's are."""
    from typing import Annotated

    from gonio.model import PerSteradian

    function.__annotations__ = {n: Annotated[float, p] for n, p in parameters.items()} | {"return": PerSteradian}
    return function


def negative_powers(model):
    """How many pairs of directions raise a negative number to a power that is not whole."""
    formula = formula_of(model)
    bases = [n.args[0] for n in formula.nodes if n.op == "pow" and not n.axes]
    directions = dict(zip((*INCIDENCE, *REFLECTION), np.broadcast_arrays(*pairs()), strict=True))
    below = 0
    for seed in range(5):
        values = directions | drawn(model, seed)
        below += sum(int(np.sum(base < 0)) for base in evaluate(bases, values))
    return below


@pytest.mark.parametrize("to", NAMES)
def test_half_of_lambert_comes_back(to, tmp_path):
    done = export(catalogue["lambert"], tmp_path / f"half{SUFFIX[to]}", to=to, values={"rho": 0.5})
    result = done.prove()
    assert result.holds, result
    text = done.files[0].read_text()
    assert "3.14159265" in text
    assert "0.5" in text


def test_half_of_lambert_is_half_over_pi(opengl, tmp_path):
    export(catalogue["lambert"], tmp_path / "half.glsl", values={"rho": 0.5})
    geometry = proof.rounded(pairs())
    found = proof.run_glsl(opengl, (tmp_path / "half.glsl").read_text(), "lambert(w_i, w_r)", geometry, "300 es")
    above = (geometry.z_i > 0) & (geometry.z_r > 0)
    np.testing.assert_allclose(found, np.where(above, 0.5 / math.pi, 0.0), rtol=1e-7)


@pytest.mark.parametrize("to", NAMES)
def test_the_wrong_values_are_found(to, tmp_path):
    """The check is of the written file where it can be run, and of the model's formula in any case."""
    done = export(catalogue["ggx"], tmp_path / f"a{SUFFIX[to]}", to=to, values={"rho_s": 0.8, "width": 0.2})
    assert done.prove().holds
    if to not in ("glsl", "brdf-explorer") or proof.opengl() is None:
        return
    text = done.files[0].read_text()
    wrong = text.replace("0.2, // width", "0.3, // width").replace("float width 0.01 1 0.2", "float width 0.01 1 0.3")
    wrong = wrong.replace("cos_r * inc[1]", "cos_r + inc[1]")
    assert wrong != text
    done.files[0].write_text(wrong)
    with pytest.raises(ValueError, match="differs from the model"):
        done.prove()


def test_literals_stay_in_single_precision():
    for language in (GLSL_LANGUAGE, WGSL_LANGUAGE, OSL_LANGUAGE):
        texts = [language.literal(v) for v in (1e-300, -1e-300, 1e300, 0.0, 2.0, 0.1, 1e-5)]
        values = [float(t) for t in texts]
        assert values[:3] == [SMALLEST, -SMALLEST, LARGEST]
        assert np.float32(values[0]) > 0
        assert np.isfinite(np.float32(values[2]))
        np.testing.assert_allclose(values[3:], [0.0, 2.0, 0.1, 1e-5], rtol=1e-9)
        assert all("." in t or "e" in t for t in texts), texts  # 2 is a whole number, which GLSL ES does not convert


# Names of a parameter that a language, or the text around the functions, uses itself.
AWKWARD = (
    *("length", "gamma", "sample", "patch", "inc", "pre", "values", "result", "w_i", "N", "P", "I", "u", "v", "x"),
    *("view", "mix", "step", "select", "fn", "let", "input", "a__b", "gl_x", "irradiance", "closure", "coating"),
)


@GLSLANG
def test_any_name_of_a_parameter_compiles():
    shaders = []
    for name in AWKWARD:
        subject = subject_of(awkward(name))
        call = f"{GLSL_LANGUAGE.identifier('coating')}(w_i, w_r)"
        shaders.append(proof.shader("\n".join(glsl.with_numbers(subject, "coating")), call, "300 es"))
        own = shader_of(subject, "coating")
        shaders.append(proof.shader("\n".join(own), CALL, "300 es", [slider(p) for p in subject.model.parameters]))
    proof.compile_glsl(shaders)


@GLSLANG
@pytest.mark.parametrize("name", ["main", "float", "pow", "reflect", "a__b", "gl_a", "sample_", "texture"])
def test_any_name_of_the_function_compiles(name):
    if name == "main":  # the function of every shader: a name of its own in the file, not in a program
        name = identifier("main_coating")
    functions = glsl.functions_of(catalogue["ggx"], name)
    module = "\n".join(glsl.with_numbers(subject_of(catalogue["ggx"]), name))
    proof.compile_glsl([proof.shader(module, f"{functions.name}(w_i, w_r)", "300 es")])


def awkward(name):
    def lobe(g, **shape):
        return shape[name] * g.cos_i * g.cos_r + shape["other"] * g.cos_beta

    taken = [inspect.Parameter(n, inspect.Parameter.POSITIONAL_OR_KEYWORD) for n in ("g", name, "other")]
    lobe.__signature__ = inspect.Signature(taken)
    parameters = {name: Parameter(0.5, 0.1, 2.0, "a"), "other": Parameter(0.5, 0.1, 2.0, "b")}
    return Model("coating", "Coating", "phong1975", {"k": _with(lobe, **parameters)})


@pytest.mark.parametrize("to", NAMES)
def test_no_text_leaves_its_comment(to, tmp_path):
    """Origins and facts come from files: whatever they hold, each of their lines stays a comment."""
    hostile = "*/ } \\\n#define pow 0\n::end shader\r\u2028float x = 1; // é\\"
    subject = replace(subject_of(catalogue["lambert"]), origin=hostile, facts={"data": hostile})
    made = targets()[to].make(subject, Request(tmp_path / f"a{SUFFIX[to]}", "coating"))
    (text,) = made.files.values()
    plain = targets()[to].make(subject_of(catalogue["lambert"]), Request(tmp_path / f"a{SUFFIX[to]}", "coating"))
    comment = "#" if to == "brdf-explorer" else "//"

    def code(content):
        return [line for line in content.splitlines() if not line.startswith(comment)]

    assert code(text) == code(next(iter(plain.files.values())))
    assert text.isascii()
    assert not re.search(r"\\$", text, re.M)


def test_the_brdf_file_has_its_grammar():
    """Sections and parameter lines as BRDFBase.cpp reads them."""
    model = catalogue["wu-five"]
    made = targets()["brdf-explorer"].make(subject_of(model), Request(_path("a.brdf"), "wu_five"))
    lines = [line for line in made.files["a.brdf"].splitlines() if line.strip() and not line.startswith("#")]
    assert lines[0] == "analytic"
    begin, end = lines.index("::begin parameters"), lines.index("::end parameters")
    assert (begin, lines[end + 1], lines[-1]) == (1, "::begin shader", "::end shader")
    for line, parameter in zip(lines[begin + 1 : end], model.parameters, strict=True):
        kind, name, *numbers = line.split()
        lower, upper, value = map(float, numbers)
        assert (kind, name) == ("float", slider(parameter))
        assert lower <= value <= upper
        if parameter in model.shape:
            np.testing.assert_allclose([lower, upper], [model.shape[parameter].lower, model.shape[parameter].upper])


def test_sliders_that_the_program_needs_itself_are_renamed():
    names = {p for model in catalogue.values() for p in model.parameters}
    renamed = {p for p in names if slider(p) != p}
    assert {"gamma", "length"} <= renamed
    assert all(slider(p) == f"{p}_" for p in renamed)


def _path(name):
    from pathlib import Path

    return Path(name)
