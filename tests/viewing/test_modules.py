"""The JavaScript that the page is given of a model, run by Node: as the page calls it, it equals NumPy to 1e-12."""

import json
import zlib

import numpy as np
import pytest

from gonio import catalogue
from gonio.exporting.source import DOUBLE, pairs
from gonio.measured.dataset import make_scan
from gonio.viewing.session import Opened, Session
from viewed import by_node

GEOMETRY = pairs()
VECTORS = np.stack(np.broadcast_arrays(*GEOMETRY), axis=-1).reshape(-1, 2, 3)


def given(model):
    """Default shapes with equal weights, and values anywhere between the bounds."""
    random = np.random.default_rng(zlib.crc32(model.name.encode()))
    weights = {w: random.uniform(0.1, 1) for w in model.weights}
    drawn = weights | {k: random.uniform(p.lower, p.upper) for k, p in model.shape.items()}
    default = dict.fromkeys(model.weights, 0.3) | {k: p.default for k, p in model.shape.items()}
    return [{name: values[name] for name in model.parameters} for values in (default, drawn)]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """By model, of both sets of values: f in three steps, f at once, and the sum of the weighted terms."""
    asked = {name: [list(values.values()) for values in given(model)] for name, model in catalogue.items()}
    script = f"""
    const pairs = {json.dumps(VECTORS.tolist())};
    const found = {{}};
    for (const [name, sets] of Object.entries({json.dumps(asked)})) {{
      const m = await import(`model/${{name}}.js`);
      found[name] = sets.map((values) => {{
        const pre = m.pre(values);  // once, as for a curve, and not changed by what comes after
        const ready = m.termsPre(values);
        const readyIncs = pairs.map(([wi]) => m.termsInc(values, ready, wi));
        const incs = pairs.map(([wi]) => m.inc(values, pre, wi));
        return [
          pairs.map(([wi, wr], k) => m.reflected(values, pre, incs[k], wi, wr)),
          pairs.map(([wi, wr]) => m.f(values, wi, wr)),
          pairs.map(([wi, wr], k) => total(m, values, m.termsReflected(values, ready, readyIncs[k], wi, wr))),
        ];
      }});
      found[name].push(m.declaration.parameters.map((p) => p.name));
    }}
    function total({{ declaration: {{ weights, parameters }} }}, values, terms) {{
      const names = parameters.map((p) => p.name);
      return terms.reduce((sum, t, k) => sum + values[names.indexOf(weights[k])] * t, 0);
    }}
    answer(found);
    """
    session = Session([Opened("a", make_scan([30.0, 30.0], [-20.0, 20.0], [0.1, 0.2]))], model="lambert")
    return by_node(session, script, tmp_path_factory.mktemp("models"))


@pytest.mark.parametrize("model", catalogue.values(), ids=lambda model: model.name)
def test_the_module_of_a_model_equals_numpy(model, found):
    *both, names = found[model.name]
    assert names == list(model.parameters)  # the order in which the page gives values
    for values, computed in zip(given(model), both, strict=True):
        expected = np.asarray(model(GEOMETRY, values))
        assert np.isfinite(expected).all()
        for way in computed:
            np.testing.assert_allclose(np.array(way, dtype=float), expected, rtol=DOUBLE, atol=1e-290)
