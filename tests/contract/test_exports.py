"""Promises that every model and every sampler keeps in every language; adding a model adds no test code."""

import ctypes
import json
import subprocess
import zlib

import numpy as np
import pytest

from gonio import catalogue
from gonio.exporting.source import DOUBLE, PAIRS, identifier, pairs
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets import c, javascript
from gonio.exporting.targets.python import run_python
from gonio.geometry import Geometry
from gonio.model import Model, declarations, sampler_of
from gonio.symbols.formula import density_of, draw_of
from programs import RUNS

MODELS = list(catalogue.values())
DRAWN = {
    identifier(f"{model.name}_{weight}"): (sampler_of(term), term)
    for model in MODELS
    for weight, term in model.terms.items()
    if sampler_of(term) is not None
}
every_model = pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
GEOMETRY = pairs()
VECTORS = np.stack(np.broadcast_arrays(*GEOMETRY), axis=-1)


def subjects(model: Model) -> list[Subject]:
    """Default shapes with equal weights, and a set of values anywhere between the bounds."""
    random = np.random.default_rng(zlib.crc32(model.name.encode()))
    shape = {k: random.uniform(p.lower, p.upper) for k, p in model.shape.items()}
    weights = {w: random.uniform(0.1, 1) for w in model.weights}
    return [of_model(model, dict.fromkeys(model.weights, 0.3)), of_model(model, weights | shape)]


def assert_equal(found, model: Model, subject: Subject, some: slice = slice(None)) -> None:
    """Some hundred operations of relative error 1e-16 each, and sums in another order."""
    expected = np.asarray(subject.brdf(GEOMETRY))[some]
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(found, expected, rtol=DOUBLE, atol=1e-290, err_msg=f"{model.name} {subject.values}")


def test_the_pairs_have_what_formulas_fail_at():
    """The normal, the mirror direction, opposition, grazing, and directions below the horizon."""
    g = GEOMETRY
    assert len(VECTORS) == PAIRS
    assert g.z_i.max() == 1.0
    assert (np.hypot(g.x_i + g.x_r, g.y_i + g.y_r) < 1e-12).sum() >= 19
    assert (np.asarray(g.cos_beta) > 1 - 1e-12).sum() >= 10
    assert ((g.z_i > 0) & (g.z_i < 1e-3)).any()
    assert (g.z_i <= 0).sum() >= 5
    assert (g.z_r < 0).sum() >= 5
    np.testing.assert_allclose(np.linalg.norm(VECTORS.reshape(-1, 3), axis=1), 1, rtol=1e-12)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The C files of all models, as the target writes them, in one library."""
    if not (program := c.compiler()):
        pytest.skip("no C compiler is here")
    folder = tmp_path_factory.mktemp("c")
    for model in MODELS:
        name = identifier(model.name)
        (folder / f"{name}.h").write_text("\n".join(c.source(subjects(model)[0], name, name)) + "\n")
    every = "".join(f'#include "{identifier(m.name)}.h"\n' for m in MODELS)
    (folder / "all.c").write_text(every)
    return ctypes.CDLL(str(c.compiled(program, folder / "all.c", folder / "all.so")))


@pytest.mark.xdist_group("exports")
@every_model
def test_c(model, library):
    name, three = identifier(model.name), ctypes.c_double * 3
    fixed, free = library[name], library[f"{name}_with"]
    fixed.restype = free.restype = ctypes.c_double
    first, second = subjects(model)
    values = (ctypes.c_double * len(model.parameters))(*(second.values[n] for n in model.parameters))
    rows = [(three(*row[:3]), three(*row[3:])) for row in VECTORS.tolist()]
    assert_equal([fixed(*row) for row in rows], model, first)
    assert_equal([free(values, *row) for row in rows], model, second)


@pytest.fixture(scope="module")
def by_node(tmp_path_factory) -> dict[str, list[list[float]]]:
    """What the JavaScript modules of all models give: f of both sets of values, and the sum of weighted terms."""
    if not (program := javascript.node()):
        pytest.skip("no Node is here")
    folder = tmp_path_factory.mktemp("js")
    lines = [f"const pairs = {json.dumps(VECTORS.reshape(-1, 2, 3).tolist())};", "const found = {};"]
    lines.append("const word = (v) => (Number.isFinite(v) ? v : String(v));")
    for model in MODELS:
        name = identifier(model.name)
        text = "\n".join(javascript.lines_of(subjects(model)[0], name))
        (folder / f"{name}.mjs").write_text(text + "\n")
        values = [subjects(model)[1].values[n] for n in model.parameters]
        lines += [
            f'import * as {name}_ from "./{name}.mjs";',
            f"found.{name} = [pairs.map((p) => word({name}_.{name}(p[0], p[1]))),",
            f"  pairs.map((p) => word({name}_.f({json.dumps(values)}, p[0], p[1]))),",
            f"  pairs.map((p) => word({name}_.terms({json.dumps(values)}, p[0], p[1])",
            f"    .reduce((s, t, k) => s + {json.dumps(values)}[k] * t, 0)))];",
        ]
    (folder / "all.mjs").write_text("\n".join([*lines, "console.log(JSON.stringify(found));"]))
    done = subprocess.run([program, str(folder / "all.mjs")], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.xdist_group("exports")
@every_model
def test_javascript(model, by_node):
    first, second = subjects(model)
    fixed, free, terms = (np.array(values, dtype=float) for values in by_node[identifier(model.name)])
    assert_equal(fixed, model, first)
    assert_equal(free, model, second)
    assert_equal(terms, model, second)


@every_model
def test_numpy_and_python(model):
    """Python takes a tenth of a second for a nested quadrature of 8 112 nodes, so of that model it gets every tenth."""
    some = slice(None, None, 10 if model.name == "modified-beckmann-kirchhoff" else 1)
    few = Geometry(*(np.asarray(component)[some] for component in GEOMETRY))
    for subject in subjects(model):
        assert_equal(run_python(subject, GEOMETRY, arrays=True), model, subject)
        assert_equal(run_python(subject, few), model, subject, some)


def rows_of(name: str, *more: np.ndarray) -> np.ndarray:
    """Two sets of shape parameters beside directions."""
    term = DRAWN[name][1]
    random = np.random.default_rng(zlib.crc32(name.encode()))
    declared = declarations(term).values()
    sets = [[p.default for p in declared], [random.uniform(p.lower, p.upper) for p in declared]]
    columns = np.stack(more, axis=-1)
    return np.concatenate([np.hstack([np.tile(one, (len(columns), 1)), columns]) for one in sets])


def light() -> np.ndarray:
    """Incident directions above the horizon, the normal too."""
    return np.stack([GEOMETRY.x_i, GEOMETRY.y_i, GEOMETRY.z_i])[:, GEOMETRY.z_i > 1e-3][:, :100]


@pytest.mark.xdist_group("exports")
@pytest.mark.parametrize("language", RUNS)
def test_samplers_draw(language, tmp_path):
    """Directions that every declared sampler draws, from numbers off the very ends of 0..1."""
    w_i = light()
    u, v = np.random.default_rng(3).uniform(1e-4, 1 - 1e-4, (2, w_i.shape[1]))
    formulas = {name: draw_of(sampler, term) for name, (sampler, term) in DRAWN.items()}
    rows = {name: rows_of(name, *w_i, u, v) for name in DRAWN}
    found = RUNS[language](formulas, rows, tmp_path)
    for name, (sampler, term) in DRAWN.items():
        shape = {k: rows[name][:, j] for j, k in enumerate(declarations(term))}
        expected = np.stack(sampler.draw(*rows[name][:, len(shape) :].T, **shape), axis=-1)
        # components of a unit vector: an absolute error
        np.testing.assert_allclose(found[name], expected, rtol=0, atol=DOUBLE, err_msg=name)


@pytest.mark.xdist_group("exports")
@pytest.mark.parametrize("language", RUNS)
def test_samplers_density(language, tmp_path):
    above = (GEOMETRY.z_i > 1e-3) & (GEOMETRY.z_r > 1e-3)
    columns = [np.asarray(component)[above] for component in GEOMETRY]
    formulas = {name: density_of(sampler, term) for name, (sampler, term) in DRAWN.items()}
    rows = {name: rows_of(name, *columns) for name in DRAWN}
    found = RUNS[language](formulas, rows, tmp_path)
    for name, (sampler, term) in DRAWN.items():
        shape = {k: rows[name][:, j] for j, k in enumerate(declarations(term))}
        with np.errstate(all="ignore"):
            expected = np.asarray(sampler.density(Geometry(*rows[name][:, len(shape) :].T), **shape))
        np.testing.assert_allclose(found[name][:, 0], expected, rtol=DOUBLE, atol=1e-290, err_msg=name)
