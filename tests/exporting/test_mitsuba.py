"""The plugin for Mitsuba 3 without Mitsuba: its formula and lobes run by Dr.Jit. tests/crosscheck runs its class."""

import ast
import dataclasses

import numpy as np
import pytest

from gonio import Geometry, catalogue, export
from gonio.exporting.entry import write
from gonio.exporting.source import pairs
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets.mitsuba.fallback import fallback
from gonio.exporting.targets.mitsuba.precision import needs_double, relative_error
from gonio.exporting.targets.mitsuba.target import defined, plugin, run
from gonio.model import declarations, sampler_of
from gonio.optics.sampling import COSINE

scalar = pytest.importorskip("drjit", reason="Dr.Jit is not installed").scalar

SLOW = ("modified-beckmann-kirchhoff",)  # a nested quadrature takes seconds in NumPy and in Dr.Jit
PROVED = (  # those that tests/crosscheck runs in Mitsuba
    *("ggx", "gonio-best", "cauchy-lorentz", "student-t", "abg", "ward", "disney", "beckmann", "oren-nayar"),
    *("generalised-harvey-shack", "torrance-sparrow", "phong"),
)


def values_of(model):
    return dict.fromkeys(model.weights, 0.3)


def written(name, tmp_path, **values):
    model = catalogue[name]
    file = tmp_path / "coating_mitsuba.py"
    done = export(model, file, to="mitsuba", values=values or values_of(model))
    return done, file.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [name for name in catalogue if name not in SLOW])
def test_every_model_is_valid_python_and_computes_the_model(name, tmp_path):
    done, text = written(name, tmp_path)
    ast.parse(text)
    proof = done.prove()
    assert "Dr.Jit" in proof.how
    assert proof.error <= 2e-6
    shares = done.numbers.values()
    assert sum(shares) == pytest.approx(1, abs=1e-3)
    assert done.numbers["share of the cosine"] >= 0.1 - 1e-9


@pytest.mark.parametrize("name", PROVED)
def test_single_precision_is_enough_or_the_file_says_so(name, tmp_path):
    """At directions that single precision holds: 1e-5 of the value, or of a millionth of the largest one."""
    done, _ = written(name, tmp_path)
    model = catalogue[name]
    geometry = Geometry(*(np.asarray(c, dtype=np.float32).astype(float) for c in pairs()))
    expected = np.asarray(model(geometry, values_of(model)))
    error = relative_error(run(done.files[0], geometry, array=scalar.ArrayXf), expected, expected)
    assert error <= 1e-5 or defined(done.files[0])["PRECISE"]
    assert relative_error(run(done.files[0], geometry), expected, expected) <= 2e-6


def test_a_lambertian_of_one_half_comes_back(tmp_path):
    done, _ = written("lambert", tmp_path, rho=0.5)
    above = Geometry.from_degrees([0.0, 30.0, 80.0], [0.0, 70.0, 10.0], 120.0)
    np.testing.assert_allclose(run(done.files[0], above), 0.5 / np.pi, rtol=1e-8)
    np.testing.assert_array_equal(run(done.files[0], Geometry.from_degrees([30.0], [95.0])), 0.0)
    module = defined(done.files[0])
    assert module["DRAWN"] == []
    assert module["COSINE"] == 1.0


@pytest.mark.parametrize("name", PROVED)
def test_lobes_are_drawn_as_gonio_draws_them(name, tmp_path):
    done, _ = written(name, tmp_path)
    module, model = defined(done.files[0]), catalogue[name]
    values = {n: scalar.ArrayXf64(numbers) for n, numbers in module["VALUES"].items()}
    declared = [(w, t) for w, t in model.terms.items() if sampler_of(t) not in (None, COSINE)]
    u, v = np.random.default_rng(1).random((2, 50))
    light = [np.full(50, c) for c in (0.48, 0.36, 0.8)]
    w_i = [scalar.ArrayXf64(c) for c in light]
    lobes = {label.removeprefix("share of ").split(" and ")[0]: k for k, label in enumerate(done.numbers)}
    for weight, term in declared:
        _, draw, density = module["DRAWN"][lobes[weight]]
        shape = {n: np.asarray(done.subject.values[n]) for n in declarations(term)}
        known = sampler_of(term).draw(*light, u, v, **shape)
        drawn = draw(values, w_i, [scalar.ArrayXf64(u), scalar.ArrayXf64(v)])
        for found, expected in zip(drawn, known, strict=True):
            np.testing.assert_allclose(np.asarray(found), expected, atol=2e-6)  # erfinv of Dr.Jit has seven digits
        g = Geometry(*light, *known)
        found = np.asarray(density(values, w_i, [scalar.ArrayXf64(np.ascontiguousarray(c)) for c in known]))
        expected = np.asarray(sampler_of(term).density(g, **shape))
        above = known[2] > 0.01
        np.testing.assert_allclose(np.broadcast_to(found, above.shape)[above], expected[above], rtol=1e-6)


@pytest.mark.parametrize(
    ("printed", "changed"),
    [("return term_rho_s", "return 1.01 * term_rho_s"), ("/ 2.0", "/ 2.001"), ("'rho_s': [0.3]", "'rho_s': [0.31]")],
)
def test_a_changed_file_is_not_proved(printed, changed, tmp_path):
    done, text = written("ggx", tmp_path)
    assert printed in text
    done.files[0].write_text(text.replace(printed, changed), encoding="utf-8")
    with pytest.raises(ValueError, match="mistake in gonio"):
        done.prove()


def test_hostile_text_stays_in_the_heading(tmp_path):
    hostile = 'x"""\nimport os\nos.abort()\n"""\\'
    subject = dataclasses.replace(
        of_model(catalogue["lambert"], {"rho": 0.5}), origin=hostile, facts={hostile: hostile}
    )
    file = tmp_path / "a.py"
    write(subject, file, "mitsuba", name='b"; import os')
    tree = ast.parse(file.read_text(encoding="utf-8"))
    imports = [n.names[0].name for n in ast.walk(tree) if isinstance(n, ast.Import)]
    assert imports == ["math", "drjit", "mitsuba"]
    assert ast.get_docstring(tree)


def test_channels_and_wavelengths_are_kept(tmp_path):
    sets = {
        c: {"rho_s": 0.1, "rho_d": 0.2, "width": w, "index": 1.5, "extinction": 0.0}
        for c, w in zip("RGB", (0.1, 0.2, 0.4), strict=True)
    }
    done = write(Subject(catalogue["ggx"], sets, "channel"), tmp_path / "a.py", "mitsuba")
    module = defined(done.files[0])
    assert (module["BY"], module["LABELS"]) == ("channel", ["R", "G", "B"])
    assert module["VALUES"]["width"] == [0.1, 0.2, 0.4]
    assert done.prove().error <= 2e-6
    assert not any("channel" in remark for remark in done.remarks)
    spectral = dict(zip(("450.0", "550.0", "650.0"), sets.values(), strict=True))
    done = write(Subject(catalogue["ggx"], spectral, "wavelength"), tmp_path / "b.py", "mitsuba")
    assert any("interpolated" in remark for remark in done.remarks)
    other = dict(zip(("s", "p"), sets.values(), strict=False))
    done = write(Subject(catalogue["ggx"], other, "channel"), tmp_path / "c.py", "mitsuba")
    assert any("'channel'" in remark for remark in done.remarks)


def test_a_wrong_channel_is_found(tmp_path):
    sets = {c: {"rho": r} for c, r in zip("RGB", (0.1, 0.2, 0.4), strict=True)}
    done = write(Subject(catalogue["lambert"], sets, "channel"), tmp_path / "a.py", "mitsuba")
    text = done.files[0].read_text(encoding="utf-8")
    done.files[0].write_text(text.replace("[0.1, 0.2, 0.4]", "[0.1, 0.2, 0.3]"), encoding="utf-8")
    with pytest.raises(ValueError, match="mistake in gonio"):
        done.prove()


def test_names_are_those_of_mitsuba():
    assert plugin("black_paint_2") == "gonio-black-paint-2"
    assert plugin("coating_mitsuba") == "gonio-coating"
    assert plugin("_2_layers") == "gonio-2-layers"


def test_a_narrow_lobe_without_sampler_gets_one():
    """Of a width of two thousandths: the cosine finds it once in a hundred thousand samples."""
    term = catalogue["binomial"].terms["scale"]
    shape = {n: p.default for n, p in declarations(term).items()} | {"c0": -3.0, "d": 2e5}
    found = fallback(term, shape)
    assert found.share > 0
    assert found.noise < 3


def test_digits_decide_on_precision():
    assert needs_double(of_model(catalogue["oren-nayar"], {"scale": 0.5}))
    assert not needs_double(of_model(catalogue["ggx"], {"rho_s": 0.5}))


def test_polarisation_is_left_out_with_a_word(tmp_path):
    done, _ = written("priest-mueller", tmp_path)
    assert any("olarisation is left out" in remark for remark in done.remarks)
