"""Would a test see a wrong sign, cosine or prefactor in any term? Breaks each in turn; `make mutation`.

Writes benchmarks/mutation.json, of which docs/pages/mutation.py makes a page.

Every place of every function that a term of the catalogue runs, and of geometry.py, is changed once: a `sign` (plus
and minus exchanged, a minus dropped, a comparison turned), a `cosine` (the two directions exchanged, or tilt and local
incidence, x and y, sine and cosine) or a `prefactor` (a number or constant doubled, an exponent raised by one, times
and over exchanged). The change is made in a forked process, by giving the loaded functions the code of the changed
source, so nothing on disk is touched. There the tests that run the function are run, quickest first, until one fails.
Where none does, the change must at least alter a value over random shapes and directions, poles included, or it is no
error; where it alters none by SLIGHT, no formula is wrong. What else fails no test survives: exit status 1.

The functions of a model and of a test are those that were seen to run; no list of models, terms or tests is kept. Only
tests that hold values against something independent count: COUNTED, less SELF. Needs fork: Linux or macOS.
"""

import argparse
import ast
import gc
import importlib
import json
import math
import os
import platform
import random
import select
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import numpy as np
import pytest

import gonio
from gonio import Geometry, catalogue
from gonio.model import Model

HERE = Path(__file__).resolve().parent
RECORD = HERE.parent.parent / "benchmarks" / "mutation.json"
PACKAGE = Path(gonio.__file__).resolve().parent
COUNTED = ("reference", "contract/test_models.py", "test_geometry.py")
SELF = (  # these compare a model with itself, or say nothing of its values
    "test_libraries_agree",
    "test_float32_stays_float32",
    "test_compiles_maps_and_differentiates",
    "test_torch_differentiates",
    "test_weights_are_linear",
    "test_declaration_is_complete",
)
OUTCOMES = ("killed", "equivalent", "slight", "survived")
KINDS = ("sign", "cosine", "prefactor")
QUICK = 0.25  # s: tests up to here are run before it is asked whether a value changes
LONGEST = 300  # s for one change
NODES = 4000  # of a quadrature that several tests use and that takes seconds to make: made once, before forking
SHAPES = 24  # random shapes of a model, besides its defaults
SAME = 1e-9  # relative change of a value that counts as none
SLIGHT = 1e-6  # and that says that it is how something is computed, not what: a node more, another floor of a guard

Key = tuple[str, int]  # file below the package and first line of an outermost function


# ----------------------------------------------------------------------------------------------------------------------
# Which functions run


@cache
def parsed(file: str) -> ast.Module:
    return ast.parse((PACKAGE / file).read_text(encoding="utf-8"))


@cache
def functions(file: str) -> dict[int, ast.FunctionDef]:
    """The outermost functions and methods of a file, by first line as code objects count it: decorators included."""
    tree = parsed(file)
    bodies = [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))]
    found = [node for body in bodies for node in body if isinstance(node, ast.FunctionDef)]
    return {min([node.lineno, *(d.lineno for d in node.decorator_list)]): node for node in found}


def owner(code: CodeType) -> Key | None:
    """The outermost function that holds this code, None outside the physics. Samplers are no terms."""
    path = Path(code.co_filename)
    if not path.is_relative_to(PACKAGE):
        return None
    file = path.relative_to(PACKAGE).as_posix()
    if (file != "geometry.py" and file.split("/")[0] not in ("optics", "models")) or file.endswith("sampling.py"):
        return None
    for first, node in functions(file).items():
        if first <= code.co_firstlineno <= (node.end_lineno or first):
            return file, first
    return None


class Running:
    """Context in which every function of the physics that runs is noted."""

    def __enter__(self) -> "Running":
        self._codes: dict[int, CodeType] = {}
        forget()
        sys.setprofile(lambda frame, event, _: self._codes.setdefault(id(frame.f_code), frame.f_code))
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)
        self.keys = {key for code in self._codes.values() if (key := owner(code))}


def forget() -> None:
    """Clear the caches of the physics, so that what ran before hides no change."""
    for name, module in list(sys.modules.items()):
        if name.startswith(("gonio.optics.", "gonio.models.", "gonio.geometry")):
            for value in list(vars(module).values()):
                if hasattr(value, "cache_clear"):
                    value.cache_clear()


# ----------------------------------------------------------------------------------------------------------------------
# Where and how they are changed


@dataclass(frozen=True)
class Mutant:
    """One change: its kind, the function, and the how-manieth of the function's places it is."""

    kind: str
    key: Key
    index: int
    line: int
    was: str
    now: str

    def __str__(self) -> str:
        return f"{self.kind:9} {self.key[0]}:{self.line}  {self.was}  ->  {self.now}"


FLIPPED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
}  # fmt: skip
EXCHANGED = [("cos_alpha", "cos_beta"), ("slope_x", "slope_y"), ("sin", "cos"), ("sinh", "cosh"), ("x", "y")]
EXCHANGED += [(f"x_{end}", f"y_{end}") for end in "ir"]
OF_GEOMETRY = set(dir(Geometry))
NO_NUMBER = {"axis", "dtype", "shape"}  # keywords of array functions


def counterparts(name: str, known: set[str]) -> Iterator[str]:
    """What a name may be confused with: the same of the other direction, and the pairs of EXCHANGED."""
    for ends in (("_i", "_r"), ("_r", "_i"), ("_i_deg", "_r_deg"), ("_r_deg", "_i_deg")):
        if name.endswith(ends[0]) and name.removesuffix(ends[0]) + ends[1] in known:
            yield name.removesuffix(ends[0]) + ends[1]
    for pair in EXCHANGED:
        if name in pair and pair[1 - pair.index(name)] in known:
            yield pair[1 - pair.index(name)]


def changes(node: ast.AST, parent: ast.AST, field: str, local: set[str], module: Any) -> Iterator[tuple[str, ast.AST]]:
    """Every change of this one node, with its kind."""
    copy = lambda **fields: type(node)(**{f: getattr(node, f, None) for f in node._fields} | fields)  # noqa: E731
    load = isinstance(getattr(node, "ctx", None), ast.Load)
    raised = isinstance(parent, ast.BinOp) and isinstance(parent.op, ast.Pow) and field == "right"
    number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
    if isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in FLIPPED:
        kind = "sign" if isinstance(node.op, ast.Add | ast.Sub) else "prefactor"
        yield kind, copy(op=FLIPPED[type(node.op)]())
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in FLIPPED:
        yield "sign", copy(ops=[FLIPPED[type(node.ops[0])]()])
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "sign", node.operand
    elif isinstance(node, ast.Attribute) and load:
        called = isinstance(node.value, ast.Name) and node.value.id in ("xp", "math")
        known = {"sin", "cos", "sinh", "cosh"} if called or isinstance(parent, ast.Call) else OF_GEOMETRY
        for other in counterparts(node.attr, known):
            yield "cosine", copy(attr=other)
        if ast.unparse(node) == "math.pi" and not raised:
            yield "prefactor", twice(node)
    elif isinstance(node, ast.Name) and load and field != "func":
        for other in counterparts(node.id, local):
            yield "cosine", copy(id=other)
        value = getattr(module, node.id, None) if node.id not in local else None
        if type(value) in (int, float) and not raised:
            yield "prefactor", twice(node)
        elif isinstance(value, list) and {type(v) for v in value} <= {int, float}:
            yield "prefactor", ast.parse(f"[2 * each for each in {node.id}]", mode="eval").body
    elif number and not raised:
        yield "prefactor", ast.Constant(2 * node.value or 1.0)
    if raised:
        yield "prefactor", ast.BinOp(node, ast.Add(), ast.Constant(1))


def twice(node: ast.AST) -> ast.AST:
    return ast.BinOp(ast.Constant(2), ast.Mult(), node)


def places(key: Key) -> Iterator[tuple[str, ast.AST, ast.AST, Callable[[], None]]]:
    """Every change of a function: kind, the node, what stands in its place, and how to put it there in the tree."""
    function = functions(key[0])[key[1]]
    stored = {n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    local = stored | {n.arg for n in ast.walk(function) if isinstance(n, ast.arg)}
    module = importlib.import_module("gonio." + key[0].removesuffix(".py").replace("/", "."))

    def walk(parent: ast.AST) -> Iterator[tuple[str, ast.AST, ast.AST, Callable[[], None]]]:
        for field, value in ast.iter_fields(parent):
            several = value if isinstance(value, list) else [value]
            for index, node in enumerate(several):
                if not isinstance(node, ast.AST) or skipped(parent, field, node):
                    continue

                def put(new: ast.AST, at: tuple = (parent, field, value, index)) -> None:
                    where, name, held, position = at
                    if isinstance(held, list):
                        held[position] = new
                    else:
                        setattr(where, name, new)

                for kind, new in changes(node, parent, field, local, module):
                    yield kind, node, new, lambda put=put, new=new: put(new)
                yield from walk(node)

    for statement in function.body:
        holder = ast.Module(body=[statement], type_ignores=[])
        yield from walk(holder)


def skipped(parent: ast.AST, field: str, node: ast.AST) -> bool:
    """What computes nothing: annotations, decorators, defaults, subscripts, axes, errors."""
    if isinstance(node, ast.arguments | ast.Raise) or field in ("annotation", "returns", "decorator_list", "slice"):
        return True
    return isinstance(node, ast.keyword) and node.arg in NO_NUMBER


def mutants(key: Key) -> list[Mutant]:
    return [
        Mutant(kind, key, index, node.lineno, short(node), short(new))
        for index, (kind, node, new, _) in enumerate(places(key))
    ]


def short(node: ast.AST, longest: int = 70) -> str:
    text = " ".join(ast.unparse(ast.fix_missing_locations(node)).split())
    return text if len(text) <= longest else text[: longest - 2] + ".."


def install(mutant: Mutant, live: dict[str, list[FunctionType]]) -> None:
    """Give every loaded function of the file the code that the changed source compiles to."""
    file = mutant.key[0]
    _, node, new, put = list(places(mutant.key))[mutant.index]
    for part in ast.walk(new):
        ast.copy_location(part, node)
    put()
    found: dict[tuple[str, int], CodeType] = {}
    waiting = [compile(ast.fix_missing_locations(parsed(file)), str(PACKAGE / file), "exec", dont_inherit=True)]
    while waiting:
        code = waiting.pop()
        found[code.co_qualname, code.co_firstlineno] = code
        waiting += [c for c in code.co_consts if isinstance(c, CodeType)]
    changed = 0
    for function in live[file]:
        old = function.__code__
        new_code = found[old.co_qualname, old.co_firstlineno]
        changed += new_code.co_code != old.co_code or new_code.co_consts != old.co_consts
        changed += new_code.co_names != old.co_names or new_code.co_varnames != old.co_varnames
        function.__code__ = new_code
    if not changed:
        raise RuntimeError(f"no loaded function holds {mutant}")
    forget()


def loaded() -> dict[str, list[FunctionType]]:
    """The function objects of the physics by file, closures and wrapped ones too."""
    found: dict[str, list[FunctionType]] = {}
    for thing in gc.get_objects():
        if isinstance(thing, FunctionType) and Path(thing.__code__.co_filename).is_relative_to(PACKAGE):
            found.setdefault(Path(thing.__code__.co_filename).relative_to(PACKAGE).as_posix(), []).append(thing)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Whether a value changes


def directions(seed: int) -> list[tuple[np.ndarray, ...]]:
    """theta_i, theta_r, phi, phi_i [deg]: anywhere; normal, mirror and retro; grazing. Each group has its own scale."""
    rng = np.random.default_rng(seed)
    n = 200
    anywhere = rng.uniform(0, 89, n), rng.uniform(0, 89, n), rng.uniform(0, 360, n), rng.uniform(0, 360, n)
    poles = np.array(
        [(0, 0, 180), (0, 50, 180), (50, 0, 180), (30, 30, 180), (70, 70, 180), (30, 30, 0), (70, 70, 0), (40, 40, 90)]
    ).T.astype(float)
    grazing = np.array([(90, 90, 180), (90, 90, 0), (90, 40, 180), (40, 90, 120), (89.9, 89.9, 180)]).T
    turned = [(*np.hstack([group, group]), np.repeat([0.0, 37.0], group.shape[1])) for group in (poles, grazing)]
    return [anywhere, *turned]


def shapes(model: Model, seed: int) -> list[dict[str, np.ndarray]]:
    """The defaults, and random values within the bounds: half of them even, half closer to the lower bound."""
    rng = np.random.default_rng(seed)
    out = [{name: p.default for name, p in model.shape.items()}]
    for k in range(SHAPES):
        u = rng.uniform(0, 1, len(model.shape)) ** (1 if k % 2 else 3)
        out.append(
            {name: p.lower + (p.upper - p.lower) * x for (name, p), x in zip(model.shape.items(), u, strict=True)}
        )
    return [{name: np.asarray(value) for name, value in shape.items()} for shape in out]


def of_model(model: Model, geometries: list[Geometry], seed: int) -> Iterator[np.ndarray]:
    """Values of every term, one array at a time."""
    basis = model.mueller_basis if model.polarised else model.basis
    with np.errstate(all="ignore"):
        for shape in shapes(model, seed):
            for geometry in geometries:
                yield from (np.asarray(value) for value in basis(geometry, shape).values())


def of_geometry(seed: int) -> Iterator[np.ndarray]:
    """Everything that a Geometry says of itself, made in both ways."""
    with np.errstate(all="ignore"):
        for theta_i, theta_r, phi, phi_i in directions(seed):
            for g in (Geometry.from_degrees(theta_i, theta_r, phi, phi_i), Geometry.in_plane(theta_i, theta_r - 40)):
                yield from g
                for name, value in vars(Geometry).items():
                    if hasattr(value, "attrname"):
                        yield np.asarray(getattr(g, name))


def change(found: Iterator[np.ndarray], expected: list[np.ndarray]) -> float:
    """Largest change of a value, relative to itself and a thousandth of the largest beside it; inf where none comes."""
    most = 0.0
    try:
        for a, b in zip(found, expected, strict=True):
            if a.dtype == bool or a.shape != b.shape or not np.array_equal(np.isfinite(a), np.isfinite(b)):
                if not np.array_equal(a, b, equal_nan=True):
                    return math.inf
                continue
            sound = np.isfinite(b)
            size = np.abs(b[sound])
            scale = size + 1e-3 * np.max(size, initial=0.0)
            moved = np.abs(a[sound] - b[sound])
            most = max(most, float(np.max(np.divide(moved, scale, where=scale > 0, out=1e9 * moved), initial=0.0)))
    except Exception:  # a change that raises is seen by whoever calls it
        return math.inf
    return most


# ----------------------------------------------------------------------------------------------------------------------
# Running tests in forks


def forked(tasks: list[Any], job: Callable[[Any], Any], jobs: int) -> Iterator[tuple[Any, Any]]:
    """`job` of every task, each in a process of its own, as they end; None where the process died or took too long."""
    waiting, running = list(reversed(tasks)), {}
    while waiting or running:
        while waiting and len(running) < jobs:
            task = waiting.pop()
            out, into = os.pipe()
            if pid := os.fork():
                os.close(into)
                running[out] = pid, task, b""
                continue
            signal.alarm(LONGEST)
            nowhere = os.open(os.devnull, os.O_RDWR)
            for stream in (1, 2):
                os.dup2(nowhere, stream)
            try:
                told = {"result": job(task)}
            except BaseException:
                told = {"error": traceback.format_exc()}
            os.write(into, json.dumps(told).encode())
            os._exit(0)
        for out in select.select(list(running), [], [])[0]:
            pid, task, data = running[out]
            if piece := os.read(out, 1 << 16):
                running[out] = pid, task, data + piece
                continue
            os.close(out)
            os.waitpid(pid, 0)
            del running[out]
            told = json.loads(data) if data else {"result": None}
            if "error" in told:
                raise RuntimeError(f"{task}: {told['error']}")
            yield task, told["result"]


class Runner:
    """A pytest plugin that, in place of running the collected tests, runs the whole check on them."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.failed: list[str] = []
        self.passed = False

    def pytest_sessionstart(self) -> None:
        """Hypothesis draws the same examples every time, keeps none and takes its time."""
        from hypothesis import settings  # not before pytest is there to rewrite its asserts

        settings.register_profile("mutation", derandomize=True, database=None, deadline=None)
        settings.load_profile("mutation")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.failed.append(report.nodeid)

    def run(self, item: pytest.Item) -> bool:
        """Whether a test passes; it is torn down fully, so any order will do."""
        self.failed.clear()
        item.ihook.pytest_runtest_protocol(item=item, nextitem=None)
        return not self.failed

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            raise session.Interrupted("the tests cannot be collected")
        self.items = [item for item in session.items if getattr(item, "originalname", item.name) not in SELF]
        self.passed = check(self)
        return True

    def watch(self, index: int) -> dict[str, Any]:
        started = time.perf_counter()
        with Running() as seen:
            passed = self.run(self.items[index])
        return {"passed": passed, "seconds": time.perf_counter() - started, "keys": sorted(seen.keys)}


@dataclass
class Result:
    """What came of one change: killed (by which test), equivalent, slight or survived (by how much a value changes)."""

    outcome: str
    note: str = ""


def check(runner: Runner) -> bool:
    """Break every place, write the record; whether nothing survived."""
    options, items = runner.options, runner.items
    started = time.perf_counter()
    legendre = np.polynomial.legendre
    legendre.leggauss = cache(legendre.leggauss)
    legendre.leggauss(NODES)
    geometries = [Geometry.from_degrees(*angles) for angles in directions(options.seed)]
    of_models: dict[str, set[Key]] = {}
    expected: dict[str, list[np.ndarray]] = {}
    for name, model in catalogue.items():
        with Running() as seen:
            expected[name] = list(of_model(model, geometries, options.seed))
        of_models[name] = {key for key in seen.keys if key[0] != "geometry.py"}
    with Running() as seen:
        expected["geometry"] = list(of_geometry(options.seed))
    of_models["geometry"] = {key for key in seen.keys if key[0] == "geometry.py"}
    keys = sorted(set().union(*of_models.values()))

    say(f"{len(keys)} functions; watching {len(items)} tests")
    failing: list[str] = []
    cost: dict[int, float] = {}
    running: dict[Key, list[int]] = {key: [] for key in keys}
    for index, seen_by in forked(list(range(len(items))), runner.watch, options.jobs):
        if seen_by is None or not seen_by["passed"]:
            say(f"does not count, fails before any change: {items[index].nodeid}")
            failing.append(items[index].nodeid)
            continue
        cost[index] = seen_by["seconds"]
        for key in map(tuple, seen_by["keys"]):
            if key in running:
                running[key].append(index)
    for tests in running.values():
        tests.sort(key=lambda index: cost[index])

    chosen = choose([mutant for key in keys for mutant in mutants(key)], options)
    live = loaded()

    def judge(mutant: Mutant) -> tuple[str, str]:
        install(mutant, live)
        tests = running[mutant.key]
        quick = [t for t in tests if cost[t] <= QUICK]
        for test in quick:
            if not runner.run(items[test]):
                return "killed", items[test].nodeid
        moved = max(
            change(of_geometry(options.seed), expected[name])
            if name == "geometry"
            else change(of_model(catalogue[name], geometries, options.seed), expected[name])
            for name, of in of_models.items()
            if mutant.key in of
        )
        if moved <= SAME:
            return "equivalent", ""
        for test in tests[len(quick) :]:
            if not runner.run(items[test]):
                return "killed", items[test].nodeid
        return "survived" if moved > SLIGHT else "slight", f"changes a value by {moved:.1g} of itself"

    results: dict[Mutant, Result] = {}
    for mutant, verdict in forked(chosen, judge, options.jobs):
        results[mutant] = Result(*verdict) if verdict else Result("killed", "it ended the process, or took too long")
        if results[mutant].outcome == "survived" or options.verbose:
            say(f"{results[mutant].outcome:10} {mutant}  {results[mutant].note}")
        if len(results) % 100 == 0:
            say(f"{len(results)} of {len(chosen)} after {time.perf_counter() - started:.0f} s")
    minutes = (time.perf_counter() - started) / 60
    if target := options.out or (None if options.only else RECORD):
        whole = record(results, of_models, options) | {"tests": len(cost), "minutes": round(minutes, 1)}
        target.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    outcomes = Counter(result.outcome for result in results.values())
    say(f"{len(results)} changes in {minutes:.1f} min: {dict(outcomes)}")
    return not outcomes["survived"] and not failing


def choose(every: list[Mutant], options: argparse.Namespace) -> list[Mutant]:
    """All places, or a seeded number of each kind and function."""
    every = [m for m in every if options.only in f"{m.key[0]}:{functions(m.key[0])[m.key[1]].name}"]
    if not options.sample:
        return every
    rng = random.Random(options.seed)
    groups: dict[tuple[Key, str], list[Mutant]] = {}
    for mutant in every:
        groups.setdefault((mutant.key, mutant.kind), []).append(mutant)
    return [m for group in groups.values() for m in rng.sample(group, min(options.sample, len(group)))]


def say(text: str) -> None:
    print(text, flush=True)


# ----------------------------------------------------------------------------------------------------------------------
# What is kept


def record(
    results: dict[Mutant, Result], of_models: dict[str, set[Key]], options: argparse.Namespace
) -> dict[str, Any]:
    """How many changes came to what, by kind and by model, and every change that no test saw."""
    unseen = sorted(
        (m for m, result in results.items() if result.outcome != "killed"), key=lambda m: (m.key, m.line, m.index)
    )
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}"
    return {
        "machine": f"{os.cpu_count()} cores, {platform.machine()}, {versions}",
        "date": date.today().isoformat(),
        "sample": options.sample,
        "only": options.only,
        "seed": options.seed,
        "directions": sum(len(group[0]) for group in directions(options.seed)),
        "same": SAME,
        "slight": SLIGHT,
        "counted": COUNTED,
        "not_counted": SELF,
        "all": counts(list(results.values())),
        "kinds": {kind: counts([r for m, r in results.items() if m.kind == kind]) for kind in KINDS},
        "models": {name: counts([r for m, r in results.items() if m.key in keys]) for name, keys in of_models.items()},
        "unseen": [
            {"outcome": results[m].outcome, "place": f"{m.key[0]}:{m.line}", "kind": m.kind, "was": m.was, "now": m.now}
            | ({"note": results[m].note} if results[m].note else {})
            for m in unseen
        ],
    }


def counts(results: list[Result]) -> dict[str, int]:
    outcomes = Counter(result.outcome for result in results)
    return {"changes": len(results)} | {outcome: outcomes[outcome] for outcome in OUTCOMES}


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="N places of each kind and function only")
    parser.add_argument("--seed", type=int, default=1, help="of the shapes, the directions and the sample")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time")
    parser.add_argument(
        "--only", default="", metavar="TEXT", help="functions whose file:name has it; writes no file without --out"
    )
    parser.add_argument("--out", type=Path, help="the JSON file to write, also with --only")
    parser.add_argument("--verbose", action="store_true", help="print every change and the test that saw it")
    runner = Runner(parser.parse_args())
    tests = [str(HERE.parent / name) for name in COUNTED]
    status = pytest.main(["-q", "-s", "-p", "no:cacheprovider", "--no-header", *tests], plugins=[runner])
    return 0 if status == 0 and runner.passed else 1


if __name__ == "__main__":
    sys.exit(main())
