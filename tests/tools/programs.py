"""Printed formulas, run by what is installed: a C compiler, Node, Python itself."""

import ctypes
import json
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from gonio.exporting.languages.c import C_LANGUAGE
from gonio.exporting.languages.javascript import JAVASCRIPT
from gonio.exporting.languages.language import Language, Writer
from gonio.exporting.languages.python import NUMPY, PRELUDE, PYTHON
from gonio.exporting.targets.c import compiled, compiler
from gonio.exporting.targets.javascript import node
from gonio.symbols.formula import Formula

Rows = np.ndarray  # a row of inputs for each evaluation
Run = Callable[[Mapping[str, Formula], Mapping[str, Rows], Path], dict[str, np.ndarray]]


def inputs(formula: Formula) -> list[str]:
    return [name for level in formula.inputs for name in level]


def _inside(writer: Writer, formula: Formula, assignment: str) -> tuple[list[str], list[str]]:
    """Inputs from an array `x`, the statements and the results."""
    places = [f"{assignment.format(writer.language.identifier(n))}x[{k}]" for k, n in enumerate(inputs(formula))]
    statements, results = writer.whole(formula)
    end = ";" if assignment.startswith("const") else ""
    return [*(f"{place}{end}" for place in places), *statements], results


def in_c(formulas: Mapping[str, Formula], rows: Mapping[str, Rows], folder: Path) -> dict[str, np.ndarray]:
    if not (program := compiler()):
        pytest.skip("no C compiler is here")
    writer, functions = Writer(C_LANGUAGE), []
    for name, formula in formulas.items():
        statements, results = _inside(writer, formula, "const double {} = ")
        unused = [f"(void){writer.language.identifier(n)};" for n in inputs(formula)]
        given = [f"y[{k}] = {r};" for k, r in enumerate(results)]
        functions += [f"void {name}(const double *x, double *y) {{", *statements, *unused, *given, "}"]
    file = folder / "formulas.c"
    file.write_text("\n".join(["#include <math.h>", *writer.shared(), *functions, ""]))
    library = ctypes.CDLL(str(compiled(program, file, folder / "formulas.so")))
    found = {}
    for name, formula in formulas.items():
        ready = np.ascontiguousarray(rows[name], dtype=float)
        out = np.empty((len(ready), len(formula.outputs)))
        for x, y in zip(ready, out, strict=True):
            library[name](x.ctypes.data_as(ctypes.c_void_p), y.ctypes.data_as(ctypes.c_void_p))
        found[name] = out
    return found


def in_node(formulas: Mapping[str, Formula], rows: Mapping[str, Rows], folder: Path) -> dict[str, np.ndarray]:
    if not (program := node()):
        pytest.skip("no Node is here")
    writer, functions = Writer(JAVASCRIPT), []
    for name, formula in formulas.items():
        statements, results = _inside(writer, formula, "const {} = ")
        functions += [f"function {name}(x) {{", *statements, f"return [{', '.join(results)}];", "}"]
    calls = [f"{name}: rows.{name}.map((x) => {name}(x).map(word))" for name in formulas]
    (folder / "rows.json").write_text(json.dumps({name: rows[name].tolist() for name in formulas}))
    text = [
        'import { readFileSync } from "node:fs";',
        *writer.shared(),
        *functions,
        "const word = (v) => (Number.isFinite(v) ? v : String(v));",
        f"const rows = JSON.parse(readFileSync({json.dumps(str(folder / 'rows.json'))}));",
        f"console.log(JSON.stringify({{{', '.join(calls)}}}));",
    ]
    (folder / "formulas.mjs").write_text("\n".join(text))
    done = subprocess.run([program, str(folder / "formulas.mjs")], capture_output=True, text=True, check=True)
    return {name: np.array(v, dtype=float) for name, v in json.loads(done.stdout).items()}


def in_python(formulas: Mapping[str, Formula], rows: Mapping[str, Rows], folder: Path) -> dict[str, np.ndarray]:
    functions = _module(PYTHON, ["import math", PRELUDE], formulas)
    return {name: np.array([functions[name](x) for x in rows[name].tolist()]) for name in formulas}


def in_numpy(formulas: Mapping[str, Formula], rows: Mapping[str, Rows], folder: Path) -> dict[str, np.ndarray]:
    functions, found = _module(NUMPY, ["import numpy as np"], formulas), {}
    for name in formulas:
        with np.errstate(all="ignore"):
            columns = functions[name](rows[name].T)
        found[name] = np.stack(np.broadcast_arrays(*columns, rows[name][:, 0])[:-1], axis=-1)
    return found


def _module(language: Language, head: Sequence[str], formulas: Mapping[str, Formula]) -> dict[str, Callable]:
    writer, functions = Writer(language), []
    for name, formula in formulas.items():
        statements, results = _inside(writer, formula, "{} = ")
        functions += [f"def {name}(x):", *(f"    {s}" for s in statements), f"    return ({', '.join(results)},)", ""]
    module: dict[str, Callable] = {}
    exec("\n".join([*head, *writer.shared(), *functions]), module)
    return module


RUNS: dict[str, Run] = {"C": in_c, "JavaScript": in_node, "Python": in_python, "NumPy": in_numpy}
