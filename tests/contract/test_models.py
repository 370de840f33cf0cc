"""Promises that every model of the catalogue keeps; adding a model adds no test code."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gonio import Geometry, catalogue
from gonio.model import Model, declarations
from libraries import EVERY_LIBRARY, quickly_compiled

MODELS = list(catalogue.values())

every_model = pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
every_library = pytest.mark.parametrize("library", EVERY_LIBRARY)


def directions(n: int = 200, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random angles [deg] that single precision still resolves near the mirror direction."""
    random = np.random.default_rng(seed)
    return random.uniform(0, 88, n), random.uniform(0, 88, n), random.uniform(0, 360, n)


def values_and_matrices(model: Model, geometry: Geometry, shape: dict[str, Any]) -> dict[str, Any]:
    """Every term, and its Mueller matrix where the model has one."""
    found = model.basis(geometry, shape)
    if model.polarised:
        found |= {f"{weight} matrix": matrix for weight, matrix in model.mueller_basis(geometry, shape).items()}
    return found


def shape_values(draw: st.DrawFn, model: Model) -> dict[str, float]:
    return {name: draw(st.floats(p.lower, p.upper)) for name, p in model.shape.items()}


@st.composite
def models_with_shape(draw: st.DrawFn) -> tuple[Model, dict[str, float]]:
    model = draw(st.sampled_from(MODELS))
    return model, shape_values(draw, model)


angle = st.floats(0, 90)
azimuth = st.floats(0, 360)


@every_model
@every_library
def test_libraries_agree(model, library):
    """All array libraries give NumPy's double-precision values, as parts of the term's largest among the directions."""
    angles = directions()
    expected = values_and_matrices(model, Geometry.from_degrees(*angles), {})
    with library.active():
        shape = {name: library.array(np.full(200, p.default)) for name, p in list(model.shape.items())[:1]}

        def computed(shape, *angles):
            return values_and_matrices(model, Geometry.from_degrees(*angles), shape)

        found = library.call(computed, shape, *map(library.array, angles))
        for weight, value in found.items():
            np.testing.assert_allclose(
                library.back(value),
                expected[weight],
                rtol=0,
                atol=library.precision * float(np.max(np.abs(expected[weight]))),
            )


@every_model
def test_float32_stays_float32(model):
    """Parameters that SciPy hands back as float64 scalars do not widen a float32 geometry."""
    geometry = Geometry.from_degrees(*(a.astype(np.float32) for a in directions()))
    shape = {name: np.float64(p.default) for name, p in model.shape.items()}
    assert all(value.dtype == np.float32 for value in model.basis(geometry, shape).values())


# normal incidence, mirror direction, retro, nearly grazing, and somewhere in between
POLES = np.array([[0.0, 40.0, 40.0, 89.9, 30.0], [0.0, 40.0, 40.0, 89.9, 55.0], [180.0, 180.0, 0.0, 180.0, 120.0]])


def sum_of_terms(model: Model) -> Callable[..., Any]:
    """The BRDF of unit weights as a function of the vector of shape parameters and three angles [deg]."""

    def brdf(vector, *angles):
        basis = model.basis(Geometry.from_degrees(*angles), dict(zip(model.shape, vector, strict=True)))
        return sum(basis.values())

    return brdf


def assert_slopes(model: Model, slopes: np.ndarray) -> None:
    """Derivatives by the shape parameters at the poles are finite and equal to finite differences."""
    brdf = sum_of_terms(model)
    defaults = np.array([p.default for p in model.shape.values()])
    expected = brdf(defaults, *POLES)
    assert np.isfinite(slopes).all()
    for k in range(len(defaults)):
        size = max(abs(defaults[k]), 1e-2)
        step = 1e-6 * size
        ahead, behind = defaults.copy(), defaults.copy()
        ahead[k] += step
        behind[k] -= step
        difference = (brdf(ahead, *POLES) - brdf(behind, *POLES)) / (2 * step)
        # a central difference keeps about ten digits of the value over the step
        scale = np.abs(expected) / size
        np.testing.assert_allclose(slopes[:, k], difference, rtol=1e-6, atol=1e-8 * float(scale.max()))


@every_model
def test_compiles_maps_and_differentiates(model):
    """jit, vmap over parameters and forward derivatives agree with NumPy and finite differences, poles included."""
    import jax
    import jax.numpy as jnp

    brdf = sum_of_terms(model)
    defaults = np.array([p.default for p in model.shape.values()])
    expected = [brdf(vector, *POLES) for vector in (defaults, 1.1 * defaults)]

    def computed(vector, *angles):
        """The value, and its derivatives by each parameter and by each angle, in one pass through the model."""

        def pushed(*push):
            return jax.jvp(brdf, (vector, *angles), push)

        inputs = len(vector) + len(angles)
        by_parameter = jnp.eye(inputs, len(vector))
        by_angle = [jnp.zeros((inputs, a.size)).at[len(vector) + k].set(1.0) for k, a in enumerate(angles)]
        return jax.vmap(pushed, out_axes=(None, 0))(by_parameter, *by_angle)

    with jax.enable_x64(True):
        vectors = jnp.stack([jnp.asarray(defaults), jnp.asarray(defaults) * 1.1])
        mapped = jax.vmap(computed, in_axes=(0, None, None, None))
        values, slopes = quickly_compiled(mapped, vectors, *map(jnp.asarray, POLES))
    np.testing.assert_allclose(values, expected, rtol=1e-12)
    slopes = np.asarray(slopes[0])
    assert np.isfinite(slopes[len(defaults) :]).all()
    assert_slopes(model, slopes[: len(defaults)].T)


@every_model
def test_torch_differentiates(model):
    """PyTorch's reverse derivatives equal finite differences too, and are finite by the angles, poles included."""
    torch = pytest.importorskip("torch", reason="torch is not installed")
    defaults = [p.default for p in model.shape.values()]
    vector = torch.asarray(defaults, dtype=torch.float64)
    angles = [torch.asarray(a) for a in POLES]
    by_vector, *by_angle = torch.func.jacrev(sum_of_terms(model), argnums=(0, 1, 2, 3))(vector, *angles)
    assert all(slope.isfinite().all() for slope in by_angle)
    assert_slopes(model, by_vector.numpy())


@settings(deadline=None, max_examples=200)
@given(models_with_shape(), angle, angle, azimuth, azimuth)
def test_finite_and_non_negative(chosen, theta_i, theta_r, phi, phi_i):
    """Every term is finite and not negative over the declared bounds, grazing angles and turned surfaces included."""
    model, shape = chosen
    for value in model.basis(Geometry.from_degrees(theta_i, theta_r, phi, phi_i), shape).values():
        assert np.isfinite(value)
        assert value >= 0 or "positivity" in model.violates


@settings(deadline=None, max_examples=100)
@given(models_with_shape(), angle, angle, azimuth, azimuth)
def test_reciprocity_as_declared(chosen, theta_i, theta_r, phi, phi_i):
    """Models that do not declare it keep Helmholtz reciprocity term by term, however the surface is turned."""
    model, shape = chosen
    if "reciprocity" in model.violates:
        return
    directions = Geometry.from_degrees(theta_i, theta_r, phi, phi_i)
    there = model.basis(directions, shape)
    back = model.basis(Geometry(*directions[3:], *directions[:3]), shape)
    for weight in model.weights:
        # 1e-6: the tilt of the facet is known to 1e-16, and a narrow lobe turns that into 1e-7 of its far tail
        np.testing.assert_allclose(back[weight], there[weight], rtol=1e-6, atol=1e-280)


@every_model
def test_declared_violations_are_real(model):
    """What a model says that it breaks, it breaks; what it does not say, it keeps. Energy has a test of its own."""
    there = model.basis(Geometry.from_degrees(20.0, 60.0, 180.0), {})
    back = model.basis(Geometry.from_degrees(60.0, 20.0, 180.0), {})
    exchanged = max(abs(float(there[w] - back[w])) for w in model.weights)
    assert (exchanged > 1e-3 * max(map(float, there.values()))) == ("reciprocity" in model.violates)
    spread = Geometry.from_degrees(*directions(2000))
    least = min(float(np.min(value)) for value in model.basis(spread, {}).values())
    assert (least < 0) == ("positivity" in model.violates)


@every_model
def test_weights_are_linear(model):
    """F of a sum of weights is the sum of the f's."""
    geometry = Geometry.from_degrees(*directions(50))
    one = dict.fromkeys(model.weights, 1.0)
    several = {w: k + 2.0 for k, w in enumerate(model.weights)}
    total = {w: one[w] + several[w] for w in model.weights}
    np.testing.assert_allclose(model(geometry, total), model(geometry, one) + model(geometry, several), rtol=1e-12)


@every_model
def test_zero_below_the_horizon_and_nan_stays_nan(model):
    below = Geometry.from_degrees(np.array([30.0, 95.0, np.nan]), np.array([120.0, 20.0, 20.0]), 180.0)
    for value in model.basis(below, {}).values():
        np.testing.assert_array_equal(value[:2], 0.0)
    assert np.isnan(model(below, dict.fromkeys(model.weights, 1.0))[2])


@every_model
def test_declaration_is_complete(model):
    """A source with a title, one-line docstrings, title that fits the table, units on every term."""
    assert model.source is not None
    assert model.source.title
    assert model.sum_of_terms.count("+") == len(model.terms) - 1
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", model.name)
    assert model.confidence in ("confirmed", "reconstructed")
    assert len(model.title) <= (43 if model.confidence == "confirmed" else 43 - len(" (reconstructed)"))
    assert set(model.violates) <= {"positivity", "reciprocity", "energy"}
    for weight, term in model.terms.items():
        assert (term.__doc__ or "").splitlines()[0].endswith(".")
        assert model.term_unit(weight) in ("sr-1", "deg-1", "1")
        for parameter in declarations(term).values():
            assert parameter.help
