"""Small systems of many lanes at once against SciPy's, one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from gonio.fitting.many.sweep import bordered, bounded, sweep, unit_scaled

LANES = 40


def systems(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Designs (lanes, points, n), targets and Gram matrices (n, n, lanes), some columns nearly alike."""
    rng = np.random.default_rng(n)
    design = rng.standard_normal((LANES, 20, n))
    design[: LANES // 4, :, -1] = design[: LANES // 4, :, 0] + 1e-3 * rng.standard_normal((LANES // 4, 20))
    target = rng.standard_normal((LANES, 20))
    return design, target, np.einsum("lpi,lpj->ijl", design, design)


@pytest.mark.parametrize("n", [1, 3, 6])
def test_a_sweep_regresses_on_the_columns_in_use(n):
    design, target, gram = systems(n)
    use = np.random.default_rng(0).random((n, LANES)) < 0.7
    with jax.enable_x64(True):
        scaled, length = unit_scaled(jnp.asarray(gram))
        rhs = jnp.asarray(np.einsum("lpi,lp->il", design, target)) / length
        swept, used = sweep(bordered(scaled, rhs), n, jnp.asarray(use))
        found = np.where(np.asarray(used), np.asarray(swept[:n, n] / length), 0.0)
    np.testing.assert_array_equal(used, use)
    for lane in range(LANES):
        some = use[:, lane]
        expected = np.linalg.lstsq(design[lane][:, some], target[lane], rcond=None)[0]
        # Columns alike to 1e-3 have normal equations of condition 1e6 and more
        np.testing.assert_allclose(found[some, lane], expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("bounds", [(0.0, np.inf), (-0.1, 0.15)])
@pytest.mark.parametrize("n", [1, 3, 6])
def test_bounds_are_kept_as_by_scipy(n, bounds):
    design, target, gram = systems(n)
    with jax.enable_x64(True):
        rhs = jnp.asarray(np.einsum("lpi,lp->il", design, target))
        low, high = (jnp.full((n, LANES), b) for b in bounds)
        found, side = jax.jit(bounded)(jnp.asarray(gram), rhs, low, high, jnp.zeros((n, LANES), dtype=jnp.int32))
    for lane in range(LANES):
        expected = lsq_linear(design[lane], target[lane], bounds, method="bvls", tol=1e-15).x
        costs = [np.sum((design[lane] @ x - target[lane]) ** 2) for x in (np.asarray(found)[:, lane], expected)]
        assert costs[0] <= costs[1] * (1 + 1e-10)  # the same minimum of a convex problem, to rounding
        assert ((np.asarray(found)[:, lane] >= bounds[0]) & (np.asarray(found)[:, lane] <= bounds[1])).all()
        at_bound = np.isin(np.asarray(found)[:, lane], bounds)
        np.testing.assert_array_equal(np.asarray(side)[:, lane] != 0, at_bound)


def test_columns_that_are_one_get_one_value():
    column = np.ones((1, 3, 1))
    gram = np.einsum("lpi,lpj->ijl", np.repeat(column, 2, axis=2), np.repeat(column, 2, axis=2))
    with jax.enable_x64(True):
        scaled, _ = unit_scaled(jnp.asarray(gram))
        _, used = sweep(scaled, 2, jnp.ones((2, 1), dtype=bool))
    assert np.asarray(used)[:, 0].tolist() == [True, False]
