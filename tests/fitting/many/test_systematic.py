"""Fits of many scans count every cause of systematic uncertainty, as the fit of each scan alone does."""

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, fit_many, simulate
from gonio.fitting import solution_of
from gonio.fitting.certainty.covariance import systematic_shifts
from gonio.fitting.fitting import fit
from gonio.measured.causes import with_causes
from gonio.measured.stack import one_scan

pytest.importorskip("jax", reason="the extra `batch` is not installed")
# Two layouts of fits, with a weight of each point, are compiled: by one process, once.
pytestmark = [pytest.mark.xdist_group("systematic"), pytest.mark.usefixtures("quick_compilation")]

GGX = catalogue["ggx"]
TRUTH = {"rho_s": 0.3, "rho_d": 0.2, "width": 0.25, "index": 1.5, "extinction": 0.0}
HELD = {"index": 1.5, "extinction": 0.0}
ALIKE = 1e-6  # of the largest shift by a cause
AT_MINIMUM = 1e-5  # exact at the minimum, which a search meets to some 1e-6 of a value
SEARCHED = 1e-4  # two searches end at one minimum to some 1e-6 of a value


def scans(count=3):
    """Scans of a coating with three causes: of scale, of the dark, and of the arm's zero."""
    out = []
    for seed in range(count):
        scan = simulate(
            GGX, TRUTH | {"width": 0.2 + 0.05 * seed}, [20.0, 50.0], np.arange(-70.0, 71, 10), noise=0.01, seed=seed
        )
        value, theta_r = scan["brdf"].values, np.radians(scan["theta_r"].values)
        shifts = {"filter": 0.02 * value, "dark": np.full(len(value), -1e-4), "zero": 1e-3 * value * np.tan(theta_r)}
        out.append(with_causes(scan, {name: (1 + seed) * one for name, one in shifts.items()}))
    return out


def stacked(some):
    return xr.concat(some, dim="sample", data_vars="all", coords="minimal", compat="override", combine_attrs="override")


@pytest.mark.parametrize(
    ("weighting", "options"),
    [
        ("uncertainty", {}),
        # the bounds hold the width of some lanes, which no cause then moves
        ("log", {"grouped": {"rho_s": "theta_i"}, "bounds": {"width": (0.01, 0.22)}}),
    ],
)
def test_every_cause_moves_the_values_as_in_a_fit_of_one_scan(weighting, options):
    each = scans()
    stack = stacked(each)
    options = {"held": HELD, "weighting": weighting, **options}
    fits = fit_many(Problem(GGX, one_scan(stack, ("sample",)), **options), stack)
    assert fits["cause"].values.tolist() == ["filter", "dark", "zero"]
    for k, scan in enumerate(each):
        problem, lane = Problem(GGX, scan, **options), solution_of(fits.isel(sample=k))
        free = ~lane.dataset["held"].values
        pinned, found = lane.dataset["at_bound"].values[free], lane.dataset["shift_by_cause"].values[:, free]
        at_lane = systematic_shifts(problem, lane.vector(problem.names), pinned)
        assert lane.causes == tuple(at_lane)
        for one, expected in zip(found, at_lane.values(), strict=True):
            np.testing.assert_allclose(one, expected, rtol=ALIKE, atol=ALIKE * np.abs(expected).max())
        alone = fit(problem)
        for name, ends in alone.intervals(0.95).items():
            assert lane.intervals(0.95)[name] == pytest.approx(ends, rel=SEARCHED), name


def test_a_common_factor_moves_the_weights_by_it_and_no_width():
    stack = stacked(scans())
    fits = fit_many(Problem(GGX, one_scan(stack, ("sample",)), held=HELD, weighting="uncertainty"), stack)
    by = fits["shift_by_cause"].sel(cause="filter").isel(sample=1)
    for name in ("rho_s", "rho_d"):
        value = fits["value"].isel(sample=1).sel(parameter=name)
        assert float(by.sel(parameter=name)) == pytest.approx(0.04 * float(value), rel=AT_MINIMUM)
    assert abs(float(by.sel(parameter="width"))) < 1e-7


def test_a_total_alone_is_one_cause_and_gaps_take_no_part():
    some = [scan.drop_vars(["systematic", "cause"]) for scan in scans()]
    some[1]["brdf"].values[3] = np.nan  # and its uncertainty may then be anything
    some[1]["uncertainty_systematic"].values[3] = np.nan
    some[2]["uncertainty_systematic"].values[3] = np.nan  # of a value in use
    stack = stacked(some)
    fits = fit_many(Problem(GGX, one_scan(stack, ("sample",)), held=HELD, weighting="uncertainty"), stack)
    for k in (0, 1):
        alone = fit(Problem(GGX, some[k], held=HELD, weighting="uncertainty"))
        found = fits["uncertainty_systematic"].isel(sample=k).values
        np.testing.assert_allclose(found, alone.dataset["uncertainty_systematic"].values, rtol=SEARCHED)
    assert np.isnan(fits["uncertainty_systematic"].isel(sample=2).values).all()
    assert not solution_of(fits.isel(sample=2)).has_systematic


def test_a_stack_that_states_none_has_none():
    stack = stacked(scans())
    problem = Problem(GGX, one_scan(stack, ("sample",)), held=HELD, weighting="uncertainty")
    plain = fit_many(problem, stack.drop_vars(["systematic", "cause", "uncertainty_systematic"]))
    assert "shift_by_cause" not in plain
    assert "cause" not in plain.coords
    assert fit_many(problem, stack.isel(sample=[]))["shift_by_cause"].shape == (0, 3, 5)
    assert "shift_by_cause" not in fit_many(problem, stack.isel(sample=[]), covariance="")
