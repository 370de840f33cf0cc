"""Evaluation of many pairs: the same as calling the model, whatever the library, the layout and the parts."""

import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.evaluation import evaluate

MODELS = list(catalogue.values())
GGX = {"rho_s": 0.7, "rho_d": 0.2, "width": 0.3, "index": 1.5, "extinction": 3.0}
COUNT = 200


def unit_vectors(count, seed):
    """Directions that single precision still resolves near the mirror direction, some of them below the horizon."""
    random = np.random.default_rng(seed)
    theta, phi = np.radians(random.uniform(0, 88, count)), np.radians(random.uniform(0, 360, count))
    theta[::17] += np.radians(90)
    return np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)


WI, WO = unit_vectors(COUNT, 1), unit_vectors(COUNT, 2)


def values_of(model):
    return {w: 0.5 + k for k, w in enumerate(model.weights)} | {n: p.default for n, p in model.shape.items()}


def ggx(wi=WI, wo=WO, values=GGX, **settings):
    return evaluate(catalogue["ggx"], wi, wo, values, **settings)


EXPECTED = catalogue["ggx"](Geometry(*WI, *WO), GGX)


EXACT = {"float64": 1e-12, "float32": 2e-5}  # parts of the largest; single precision as the contract of models has it


@pytest.mark.parametrize("precision", EXACT)
@pytest.mark.parametrize(
    ("model", "library"),
    # Compiling takes long, and the contract of models compiles each: with JAX, some stand for all.
    [*((model, "numpy") for model in MODELS), *((model, "jax") for model in MODELS[::4])],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_equals_the_model(model, library, precision):
    values = values_of(model)
    expected = model(Geometry(*WI, *WO), values)
    found = evaluate(model, WI, WO, values, library=library, precision=precision)
    assert found.dtype == precision
    np.testing.assert_allclose(found, expected, rtol=0, atol=EXACT[precision] * np.abs(expected).max())


def layouts():
    """The same pairs in arrays (..., 3), strided, in two dimensions and orders, and broadcasting."""
    joined = np.stack(WI, axis=-1), np.stack(WO, axis=-1)
    yield "components", WI, WO, EXPECTED
    yield "joined", *joined, EXPECTED
    yield "mixed", WI, joined[1], EXPECTED
    yield "strided", tuple(np.repeat(part, 2)[::2] for part in WI), np.repeat(joined[1], 2, axis=0)[::2], EXPECTED
    square = (10, COUNT // 10)
    folded = tuple(part.reshape(square) for part in WI), tuple(np.asfortranarray(p.reshape(square)) for p in WO)
    yield "folded", *folded, EXPECTED.reshape(square)
    crossed = catalogue["ggx"](Geometry(*(part[:7, None] for part in WI), *WO), GGX)
    yield "crossed", tuple(part[:7, None] for part in WI), WO, crossed
    yield "crossed, joined", joined[0][:7, None], joined[1], crossed
    yield "one direction", joined[0][0], joined[1], crossed[0]
    yield "one pair", joined[0][0], joined[1][0], crossed[0, 0]


@pytest.mark.parametrize("settings", [{}, {"chunk": 32}, {"chunk": 7}], ids=["whole", "32", "7"])
@pytest.mark.parametrize("library", ["numpy", "jax", "device"])
@pytest.mark.parametrize("layout", list(layouts()), ids=lambda layout: layout[0])
def test_layouts_and_parts(layout, library, settings):
    """However directions are stored and parts are cut, each pair has its own value."""
    _, wi, wo, expected = layout
    if library != "device":
        found = ggx(wi, wo, library=library, **settings)
        assert isinstance(found, np.ndarray)
    else:
        import jax

        with jax.enable_x64(True):
            there = [
                tuple(map(jax.numpy.asarray, w)) if isinstance(w, tuple) else jax.numpy.asarray(w) for w in (wi, wo)
            ]
            found = ggx(*there, **settings)
            assert isinstance(found, jax.Array)
    assert found.shape == expected.shape
    assert found.dtype == np.float64
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("offset", [0, 1, 4])
@pytest.mark.parametrize("library", ["numpy", "jax"])
def test_parts_that_overlap_cover_every_pair(library, offset, monkeypatch):
    """Large arrays whose memory begins anywhere, in parts that do not divide their number."""
    monkeypatch.setattr("gonio.evaluation.batches.LEAST", 8)
    count = 1000
    wi, wo = (tuple(_beyond(part, offset) for part in unit_vectors(count, seed)) for seed in (3, 4))
    expected = catalogue["ggx"](Geometry(*wi, *wo), GGX)
    out = np.full(count, np.nan)
    assert ggx(wi, wo, library=library, chunk=64, out=out) is out
    np.testing.assert_allclose(out, expected, rtol=1e-12)


def _beyond(values, places):
    """The values in memory that begins some places beyond a boundary of 64 bytes."""
    memory = np.empty(len(values) + 24)
    start = -memory.ctypes.data % 64 // 8 + places
    memory[start : start + len(values)] = values
    return memory[start : start + len(values)]


@pytest.mark.parametrize("library", ["numpy", "jax"])
def test_values_of_each_pair(library):
    """Weights and shape that are arrays broadcast with the pairs."""
    values = GGX | {"width": np.linspace(0.1, 0.9, COUNT), "rho_d": np.array([[0.0], [0.3]])}
    expected = catalogue["ggx"](Geometry(*WI, *WO), values)
    np.testing.assert_allclose(ggx(values=values, library=library, chunk=64), expected, rtol=1e-12)
    assert expected.shape == (2, COUNT)


@pytest.mark.parametrize("library", ["numpy", "jax"])
def test_nan_stays_nan(library):
    wi = tuple(np.where(np.arange(COUNT) == 5, np.nan, part) for part in WI)
    found = ggx(wi, library=library)
    assert np.isnan(found[5])
    np.testing.assert_allclose(np.delete(found, 5), np.delete(EXPECTED, 5), rtol=1e-12)


@pytest.mark.parametrize("library", ["numpy", "jax"])
def test_memory_mapped(library, tmp_path):
    """Directions and result on disk; what is written is what is returned."""
    path = tmp_path / "directions.npy"
    np.save(path, np.stack([np.stack(WI), np.stack(WO)]).astype(np.float32))
    stored = np.load(path, mmap_mode="r")
    out = np.memmap(tmp_path / "brdf", np.float32, "w+", shape=(COUNT,))
    assert ggx(tuple(stored[0]), tuple(stored[1]), library=library, out=out, chunk=48) is out
    out.flush()
    written = np.fromfile(tmp_path / "brdf", np.float32)
    np.testing.assert_allclose(written, EXPECTED, rtol=0, atol=2e-5 * EXPECTED.max())


def test_compiled_once_a_model():
    """Other values and other pairs of the same number compile nothing; a new name of a value does."""
    from gonio.evaluation.batches import _compiled

    model = catalogue["student-t"]
    _compiled.cache_clear()
    values = values_of(model)
    for k in range(3):
        evaluate(model, WI, WO, values | {"c": 2.0 + k, "width": 0.1 + 0.1 * k})
    assert _compiled(model)._cache_size() == 1
    evaluate(model, WI, WO, {n: v for n, v in values.items() if n != "width"})
    assert _compiled(model)._cache_size() == 2


def test_out_of_jax_is_reused():
    import jax

    wi, wo = (tuple(jax.numpy.asarray(part, dtype="float32") for part in w) for w in (WI, WO))
    first = ggx(wi, wo)
    place = first.unsafe_buffer_pointer()
    second = ggx(wi, wo, values=GGX | {"rho_d": 0.0}, out=first)
    assert second.unsafe_buffer_pointer() == place
    assert first.is_deleted()
    with pytest.raises(ValueError, match="out is one of the arguments"):
        ggx(wi, wo, out=wi[0])
    with pytest.raises(ValueError, match="JAX array of shape"):
        ggx(wi, wo, out=np.empty(COUNT, np.float32))
    np.testing.assert_allclose(second, catalogue["ggx"](Geometry(*WI, *WO), GGX | {"rho_d": 0.0}), atol=2e-4)


MISTAKES = [
    ({"wi": np.zeros((4, 2))}, r"wi is an array \(\.\.\., 3\)"),
    ({"wo": (WO[0], WO[1])}, "wo is an array"),
    ({"wi": np.array([[1.0, 2.0, 3.0]])}, "wi has a vector of length 3.742"),
    ({"wo": tuple(90 * part for part in WO)}, "wo has a vector of length 90"),
    ({"values": GGX | {"sigma": 1.0}}, "ggx has no parameter 'sigma'"),
    ({"values": {"width": 0.3}}, "give at least one weight"),
    ({"precision": "float16"}, "precision is float32 or float64, not 'float16'"),
    (
        {"wi": tuple(p.astype(np.float16) for p in WI), "wo": tuple(p.astype(np.float16) for p in WO)},
        "float16",
    ),
    ({"library": "torch"}, "library is 'jax' or 'numpy'"),
    ({"library": "numpy", "device": "gpu"}, "needs library='jax'"),
    ({"device": "abacus"}, "JAX sees no device 'abacus' here, only cpu"),
    ({"chunk": -1}, "chunk"),
    ({"out": np.empty(3)}, r"out must be a NumPy array of shape \(200,\) and precision float64"),
    ({"out": np.empty(COUNT, np.float32)}, "out must be a NumPy array"),
    ({"out": np.empty(2 * COUNT)[::2]}, "C-contiguous"),
    ({"out": WI[0]}, "shares memory"),
]


@pytest.mark.parametrize(("change", "message"), MISTAKES, ids=[message[:20] for _, message in MISTAKES])
def test_mistakes(change, message):
    with pytest.raises(ValueError, match=message):
        ggx(**change)


def test_directions_that_jax_traces():
    import jax

    with pytest.raises(ValueError, match="call the model itself"):
        jax.jit(lambda x: ggx((x, x, x)))(1.0)


def test_without_jax(monkeypatch):
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(ValueError, match=r"pip install 'gonio\[batch\]'"):
        ggx()
    assert ggx(library="numpy").shape == (COUNT,)


def test_no_pairs():
    nothing = (np.empty(0),) * 3
    assert ggx(nothing, nothing).shape == (0,)
    assert ggx(nothing, nothing, library="numpy").shape == (0,)


def test_memory_of_numpy_is_bounded():
    """Two million pairs that broadcasting makes, 16 MB of result: what else is allocated is that of some blocks."""
    many = np.broadcast_to(np.array([0.6, 0.0, 0.8]), (1000, 2000, 3))
    out = np.empty((1000, 2000))
    tracemalloc.start()
    ggx(many, np.array([0.0, 0.0, 1.0]), library="numpy", out=out)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8e6  # 8192 pairs in double precision are 64 kB, and two threads hold some thirty of these
    assert np.ptp(out) == 0


MEASURED = """
import sys
import numpy as np
from gonio import catalogue
from gonio.evaluation import evaluate

def anonymous():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("RssAnon")) / 1e3

values = {"ks": 1.0, "kdd": 0.5, "kid": 0.2}
wi = np.array([0.0, 0.0, 1.0], np.float32)
def run(wo, out):
    evaluate(catalogue["cauchy-lorentz"], wi, wo, values, out=out)

few = np.zeros(2**20, np.float32)
run((few, few, few + 1), few.copy())
before, count = anonymous(), int(sys.argv[3])
on_disk = np.memmap(sys.argv[1], np.float32, "r", shape=(3, count))
run(tuple(on_disk), np.memmap(sys.argv[2], np.float32, "w+", shape=(count,)))
print(anonymous() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc that tells a process's memory")
def test_memory_of_compiled_code_is_bounded(tmp_path):
    """Of 256 MB of directions and 85 MB of result, both on disk, little more than the parts at work is in memory."""
    count = 2**24 + 2**22 + 7
    with (tmp_path / "directions").open("wb") as file:
        file.truncate(2 * 4 * count)
        file.seek(2 * 4 * count)
        np.ones(count, np.float32).tofile(file)
    ran = subprocess.run(
        [sys.executable, "-c", MEASURED, str(tmp_path / "directions"), str(tmp_path / "brdf"), str(count)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(ran.stdout) < 40  # MB: two results of 2 MB, pieces of 2 MB for each component, and JAX's own
