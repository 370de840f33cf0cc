"""Would a test see a mistake in the tracer or in a printer? Breaks each place in turn; `make mutation-printers`.

Writes benchmarks/printers.json, which docs/pages/printers.py makes a page of. The record is written after each file,
and a file that has not changed since it was tried whole is not tried again: the run can be stopped and taken up later.

Every place of gonio.symbols and of the languages of gonio.exporting is changed once: operands exchanged, an operator or
a comparison turned, a condition denied, a number raised by one, a word of a language or of a template replaced by
another. The change is made in a forked process, by importing the changed source, so nothing on disk is touched. Where
all that is printed stays the same to the letter, the change is no error (equivalent). Else the tests are run, of models
that together have every operation. Where none fails, values are computed at directions and shapes that no test has,
in C, JavaScript, Python and NumPy: equal values are another spelling of the same (respelled), others survived. Of the
languages of OWN no values are computed but by their tests: what these do not see survived. gonio.symbols.evaluate
prints nothing, so its tests alone say whether a change is seen.
"""

import argparse
import ast
import copy
import functools
import hashlib
import importlib
import importlib.abc
import importlib.util
import io
import itertools
import json
import os
import platform
import random
import resource
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gonio
from gonio import Geometry, catalogue
from gonio.model import Model, sampler_of

ROOT = Path(__file__).resolve().parents[2]
RECORD = ROOT / "benchmarks" / "printers.json"
PACKAGE = Path(gonio.__file__).resolve().parent
BROKEN = ("symbols", "exporting/languages")
KEPT = "tests/exporting/test_kept.py"
TESTS = (KEPT, "tests/symbols", "tests/contract/test_exports.py")  # the quickest first
# What is run by tests of its own, and by no run of RUNS.
OWN = {
    "drjit": (KEPT, "tests/exporting/test_drjit.py"),
    "radiance": ("tests/exporting/test_radiance.py",),
    **dict.fromkeys(("osl", "wgsl", "shading", "single"), (KEPT, "tests/exporting/test_shaders.py")),
    "glsl": ("tests/exporting/test_shaders.py",),
    "evaluate": ("tests/symbols",),
}
COMPUTES = ("evaluate",)  # what prints nothing: that the text stays the same says nothing of a change
# Together they have every operation: quadratures, special functions, stacks, powers, choices.
CHOSEN = (
    *("lambert", "ggx", "gonio-best", "cauchy-lorentz-reciprocal", "student-t", "exponential-power", "he-torrance"),
    *("priest-mueller", "rayleigh-rice", "beckmann", "abg", "hapke", "ross-li", "disney"),
)
OUTCOMES = ("killed", "equivalent", "respelled", "survived")
IMPORTED_ONCE = ("hypothesis", "xarray", "zarr")  # by every test; so no fork has to
LONGEST = 60  # s of processor time for one change, whose tests take 20: other work must not make a change seem noticed
PRINTING = 10  # s of processor time for all texts, which take two: where nothing is named twice, they have no end
WALL = 3600  # s on the clock, for a change that waits for ever
FURTHER = 300  # pairs of directions that no test has

OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult,
    ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
WORDS = {"+": "-", "-": "+", "*": "/", "/": "*", "<": "<=", "<=": "<", "&&": "||", "||": "&&", "and": "or", "or": "and",
         "&": "|", "|": "&", "sin": "cos", "cos": "sin", "exp": "expm1", "log": "log1p", "sqrt": "abs", "erf": "erfc",
         "x_i": "x_r", "y_i": "x_i", "z_r": "z_i", "mul": "add", "add": "mul", "sub": "add", "div": "mul"}  # fmt: skip


def changes(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Line, kind and changed tree, for every place."""
    places = [n for n in ast.walk(tree) if isinstance(n, ast.AST)]
    docstrings = {id(n.body[0].value) for n in places if _has_docstring(n)}  # type: ignore[attr-defined]
    annotations = {id(m) for n in places for m in _annotated(n)}
    for place, node in enumerate(places):
        if id(node) in docstrings or id(node) in annotations:
            continue
        for kind in _kinds(node):
            changed = copy.deepcopy(tree)
            if _change(list(ast.walk(changed))[place], kind):
                yield getattr(node, "lineno", 0), kind, ast.fix_missing_locations(changed)


def _has_docstring(node: ast.AST) -> bool:
    body = getattr(node, "body", None)
    return isinstance(body, list) and bool(body) and isinstance(body[0], ast.Expr) and _is_text(body[0].value)


def _annotated(node: ast.AST) -> Iterator[ast.AST]:
    """What says of what type something is, or what an error says: no value follows from it."""
    for field in ("annotation", "returns"):
        if (found := getattr(node, field, None)) is not None:
            yield from ast.walk(found)
    if isinstance(node, ast.Raise):
        yield from ast.walk(node)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _kinds(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.BinOp | ast.Compare | ast.BoolOp):
        yield "operator"
    if isinstance(node, ast.BinOp):
        yield "operands"
    if isinstance(node, ast.Call) and len(node.args) > 1:
        yield "operands"
    if isinstance(node, ast.If | ast.IfExp):
        yield "condition"
    if isinstance(node, ast.Constant):
        yield "word" if isinstance(node.value, str) else "number"


def _change(node: Any, kind: str) -> bool:
    """Change one place; whether there was anything to change."""
    if kind == "operator":
        if isinstance(node, ast.Compare):
            turned = OPERATORS.get(type(node.ops[0]))
            node.ops[0] = turned() if turned else node.ops[0]
        else:
            turned = OPERATORS.get(type(node.op))
            node.op = turned() if turned else node.op
        return turned is not None
    if kind == "operands":
        if isinstance(node, ast.BinOp):
            node.left, node.right = node.right, node.left
        else:
            node.args[0], node.args[1] = node.args[1], node.args[0]
        return True
    if kind == "condition":
        node.test = ast.UnaryOp(ast.Not(), node.test)
        return True
    if isinstance(node.value, bool):
        node.value = not node.value
    elif isinstance(node.value, int | float):
        node.value = node.value + 1
    elif isinstance(node.value, str) and node.value.strip() in WORDS:
        node.value = node.value.replace(node.value.strip(), WORDS[node.value.strip()])
    else:
        return False
    return True


class Changed(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module from a changed tree."""

    def __init__(self, module: str, tree: ast.Module, file: str) -> None:
        self.module, self.tree, self.file = module, tree, file

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        return importlib.util.spec_from_loader(name, self, origin=self.file) if name == self.module else None

    def exec_module(self, module: Any) -> None:
        exec(compile(self.tree, self.file, "exec"), module.__dict__)


def texts() -> Iterator[str]:
    """All that is printed of the chosen models, in every language, model by model."""
    from gonio.exporting.languages.language import Writer
    from gonio.exporting.languages.python import PRELUDE
    from gonio.symbols.formula import density_of, draw_of, formula_of
    from gonio.symbols.program import staged, whole

    writers = [Writer(language) for language in languages()]
    yield PRELUDE
    for own in (writer.language for writer in writers):
        yield f"{own.identifier('width')} {own.let('x', '1', False)} {own.let('x', '1', True)}"
    for name in CHOSEN:
        programs = [staged(formula_of(catalogue[name], terms=terms)) for terms in (False, True)]
        for _, sampler, term in samplers(catalogue[name]):
            programs += [whole(draw_of(sampler, term)), whole(density_of(sampler, term))]
        stages = [stage for program in programs for stage in program.stages]
        for writer in writers:
            for stage in stages:
                try:
                    yield spaced([*writer.stage(stage), *writer.results(stage)])
                except NotImplementedError:  # a language without loops
                    yield f"no loop for {name}"
    for writer in writers:
        try:
            yield spaced(writer.shared())
        except NotImplementedError:  # a language without arrays
            yield "no arrays"


def spaced(lines: list[str]) -> str:
    return " ".join("\n".join(lines).split())


def samplers(model: Model) -> Iterator[tuple[str, Any, Any]]:
    for weight, term in model.terms.items():
        if (sampler := sampler_of(term)) is not None:
            yield weight, sampler, term


def languages() -> list[Any]:
    import pkgutil

    import gonio.exporting.languages as package
    from gonio.exporting.languages.language import Language

    found: dict[str, Any] = {}
    for module in pkgutil.iter_modules(package.__path__):
        contents = vars(importlib.import_module(f"{package.__name__}.{module.name}"))
        found |= {v.name: v for v in contents.values() if isinstance(v, Language)}
    return [found[name] for name in sorted(found)]


def values_differ() -> bool:
    """Whether a value differs from the model's at directions and shapes that no test has."""
    from gonio.symbols.formula import formula_of
    from programs import RUNS, inputs

    draw = np.random.default_rng(20261130)
    z, azimuth = draw.uniform(0.05, 1, (2, FURTHER)), draw.uniform(0, 2 * np.pi, (2, FURTHER))
    sine = np.sqrt(1 - z**2)
    g = Geometry(sine[0] * np.cos(azimuth[0]), sine[0] * np.sin(azimuth[0]), z[0],
                 sine[1] * np.cos(azimuth[1]), sine[1] * np.sin(azimuth[1]), z[1])  # fmt: skip
    formulas, rows, expected = {}, {}, {}
    for name in CHOSEN:
        model = catalogue[name]
        values = dict.fromkeys(model.weights, 0.4)
        values |= {k: draw.uniform(p.lower, p.upper) for k, p in model.shape.items()}
        key = name.replace("-", "_")
        formulas[key], expected[key] = formula_of(model), np.asarray(model(g, values))
        columns = [np.broadcast_to({**values, **g._asdict()}[n], FURTHER) for n in inputs(formulas[key])]
        rows[key] = np.stack(columns, axis=-1)
    with tempfile.TemporaryDirectory() as folder:
        for run in RUNS.values():
            found = run(formulas, rows, Path(folder))
            for key, right in expected.items():
                if not np.allclose(found[key][:, 0], right, rtol=1e-9, atol=1e-300):
                    return True
    return False


def outcome(module: str, tree: ast.Module, file: str, baseline: list[str]) -> str:
    """What becomes of a change, in this process, which ends afterwards."""
    sys.meta_path.insert(0, Changed(module, tree, file))
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (PRINTING, LONGEST))
        printed = Path(file).stem not in COMPUTES
        if printed and all(was == now for was, now in itertools.zip_longest(baseline, texts())):
            return "equivalent"
    except Exception:
        return "killed"
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
    own = OWN.get(Path(file).stem)
    if not passed(own or TESTS):
        return "killed"
    return "survived" if own or values_differ() else "respelled"


class Few(dict[str, Model]):
    """The chosen models, and the others by name alone."""

    def __missing__(self, name: str) -> Model:
        return catalogue[name]


def passed(tests: tuple[str, ...]) -> bool:
    """Whether the tests pass, where they go through the chosen models; a test that names another one gets that."""
    import gonio.models

    few = Few({name: catalogue[name] for name in CHOSEN})
    gonio.catalogue = few  # type: ignore[attr-defined]
    gonio.models.catalogue = few  # type: ignore[attr-defined]
    options = ["-x", "-q", "-p", "no:cacheprovider", "-W", "ignore"]
    return pytest.main([*options, *(str(ROOT / t) for t in tests)]) == 0


def refuse_failing_tests() -> None:
    """Tests that fail without a change would seem to see every one."""
    for tests in {TESTS, *OWN.values()}:
        if (child := os.fork()) == 0:
            os._exit(int(not passed(tests)))
        if os.waitpid(child, 0)[1]:
            raise SystemExit(f"{', '.join(tests)}: fails without any change")


def in_a_fork(module: str, file: str, baseline: list[str], tree: ast.Module) -> str:
    """The same in a process of its own; a change that runs too long is noticed by that."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
        try:
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                found = outcome(module, tree, file, baseline)
        except BaseException:
            found = "killed"
        os.write(write, found.encode())
        os._exit(0)
    os.close(write)
    end = time.monotonic() + WALL
    while time.monotonic() < end:
        if os.waitpid(child, os.WNOHANG)[0]:
            found = os.read(read, 20).decode() or "killed"
            os.close(read)
            return found
        time.sleep(0.02)
    os.killpg(child, 9)
    os.waitpid(child, 0)
    os.close(read)
    return "killed"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sample", type=int, default=0, help="try so many places of each file; 0 is all")
    parser.add_argument("--only", default="", help="files whose name has this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="changes that are tried at once")
    parser.add_argument("--again", action="store_true", help="also files that have not changed since they were tried")
    asked = parser.parse_args()
    for name in IMPORTED_ONCE:
        importlib.import_module(name)
    for name in [m for m in sys.modules if m.startswith(("gonio.symbols", "gonio.exporting"))]:
        del sys.modules[name]
    refuse_failing_tests()
    baseline = _baseline()
    for path in sorted(p for folder in BROKEN for p in (PACKAGE / folder).glob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if asked.only not in name or path.name == "__init__.py":
            continue
        if not asked.again and _tried_whole(name, path):
            continue
        row = of_one_file(name, path, asked.sample, asked.jobs, baseline)
        RECORD.write_text(json.dumps(joined(_recorded(), row), indent=1) + "\n", encoding="utf-8")
        print(name, {o: row[o] for o in OUTCOMES}, f"{row['minutes']:.1f} min", flush=True)
        for one in row["unseen"]:
            print(one)
    return int(_recorded()["all"]["survived"] > 0)


def of_one_file(name: str, path: Path, sample: int, jobs: int, baseline: list[str]) -> dict[str, Any]:
    """What became of the changes in one file."""
    start = time.monotonic()
    source = path.read_text(encoding="utf-8")
    every = list(changes(ast.parse(source)))
    if sample:
        every = random.Random(1).sample(every, min(sample, len(every)))
    module = "gonio." + name.removesuffix(".py").replace("/", ".")
    tried = functools.partial(in_a_fork, module, str(path), baseline)
    with ThreadPoolExecutor(jobs) as at_once:
        outcomes = list(at_once.map(tried, (tree for _, _, tree in every)))
    count = Counter(outcomes)
    unseen = [
        {"line": line, "kind": kind, "outcome": found, "text": source.splitlines()[line - 1].strip() if line else ""}
        for (line, kind, _), found in zip(every, outcomes, strict=True)
        if found in ("respelled", "survived")
    ]
    return {
        "file": name,
        "changes": len(every),
        **{o: count[o] for o in OUTCOMES},
        "sample": sample,
        "date": date.today().isoformat(),
        "minutes": round((time.monotonic() - start) / 60, 1),
        "sha256": hashlib.sha256(source.encode()).hexdigest(),
        "unseen": unseen,
    }


def _recorded() -> dict[str, Any]:
    if not RECORD.exists():
        return {"rows": []}
    found: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8"))
    return found


def _tried_whole(name: str, path: Path) -> bool:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return any(r["file"] == name and r["sample"] == 0 and r["sha256"] == digest for r in _recorded()["rows"])


def joined(old: dict[str, Any], row: dict[str, Any]) -> dict[str, Any]:
    """The record with one file tried again; files that are no more leave it."""
    rows = [r for r in old["rows"] if r["file"] != row["file"] and (PACKAGE / r["file"]).exists()]
    rows = sorted([*rows, row], key=lambda one: one["file"])
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}"
    return {
        "date": max(r["date"] for r in rows),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}, {versions}",
        "minutes": sum(r["minutes"] for r in rows),
        "models": list(CHOSEN),
        "all": {k: sum(r[k] for r in rows) for k in ("changes", *OUTCOMES)},
        "rows": rows,
    }


def _baseline() -> list[str]:
    """What is printed without a change, made in a fork so that this process imports none of it."""
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        try:
            with os.fdopen(write, "w", encoding="utf-8") as out:
                json.dump(list(texts()), out)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    os.close(write)
    with os.fdopen(read, encoding="utf-8") as text:
        printed = text.read()
    if os.waitpid(child, 0)[1] or not printed:
        raise SystemExit("nothing is printed without a change")
    found: list[str] = json.loads(printed)
    return found


if __name__ == "__main__":
    sys.exit(main())
