"""Fits of many scans at once give what fits of one give, lane by lane, whatever their neighbours are."""

import functools
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, check
from gonio.fitting import FOR_MANY, Anneal, fit
from gonio.fitting.many import fit_many as batch
from gonio.fitting.many.layout import laid_out
from gonio.fitting.many.reading import blocks
from gonio.fitting.many.results import solution_of
from gonio.fitting.status import STATUSES, Status
from gonio.geometry import Geometry
from gonio.measured.stack import NODE, StackLanes, lane_dims, one_scan

# One process, which compiles each form of a problem once.
pytestmark = [pytest.mark.xdist_group("many fits"), pytest.mark.usefixtures("quick_compilation")]
fit_many = functools.partial(batch.fit_many, block=8)  # one width, so that tests share what is compiled

THETA_I = np.repeat([20.0, 40.0, 60.0], 41)
SIGNED = np.tile(np.linspace(-80, 80, 41), 3)
COORDS = {
    "theta_i": ("direction", THETA_I, {"units": "degree"}),
    "theta_r": ("direction", np.abs(SIGNED), {"units": "degree"}),
    "phi": ("direction", np.where(SIGNED >= 0, 180.0, 0.0), {"units": "degree"}),
}
SMALL = catalogue["torrance-sparrow"]  # compiled in half of the time of the paper's model
GEOMETRY = Geometry.from_degrees(*(COORDS[n][1] for n in ("theta_i", "theta_r", "phi")))


COST = 1e-7  # relative: a search of many ends where a step wins less than 1e-10 of E, one of one scan far beyond


def stack_of(model: str, lanes: int, noise: float = 0.02, seed: int = 1) -> xr.Dataset:
    """Scans simulated with shapes well inside their bounds."""
    rng = np.random.default_rng(seed)
    chosen = catalogue[model]
    shape = {n: p.lower + rng.uniform(0.2, 0.5, (lanes, 1)) * (p.upper - p.lower) for n, p in chosen.shape.items()}
    shape |= {"sigma": rng.uniform(0.1, 0.4, (lanes, 1)), "gamma": rng.uniform(15, 60, (lanes, 1))}
    weights = {w: rng.uniform(0.5, 1.5, (lanes, 1)) for w in chosen.weights}
    values = chosen(GEOMETRY, weights | {n: v for n, v in shape.items() if n in chosen.shape})
    values = values * (1 + noise * rng.standard_normal(values.shape))
    return xr.Dataset({"brdf": (("sample", "direction"), values, {"units": "sr-1"})}, coords=COORDS)


def one(stack: xr.Dataset, lane: int, **options) -> Problem:
    model = options.pop("model", catalogue["cauchy-lorentz"])
    return Problem(model, stack.isel(sample=lane), **options)


def assert_cost(found: xr.Dataset, lane: int, single) -> None:
    assert float(found["cost"][lane]) <= single.cost * (1 + COST)


def assert_same(found: xr.Dataset, lane: int, single) -> None:
    assert_cost(found, lane, single)
    mine = found.isel(sample=lane)
    if float(mine["cost"]) > single.cost * (1 - COST):  # the same minimum
        told = single.dataset["uncertainty"].values > 0
        spread = single.dataset["uncertainty"].values[told]
        away = np.abs(mine["value"].values - single.dataset["value"].values)[told]
        determined = np.isfinite(spread)
        # E agrees to COST: values may differ by sqrt(COST points) standard deviations
        assert (away[determined] <= 3e-3 * spread[determined]).all()
        assert STATUSES[int(mine["status"])] is single.status
        if single.status is Status.NOT_DETERMINED:
            return  # the others' uncertainties are those beside one of many values
        # Those of values that trade off are derivatives along a valley of E, and change with the point along it
        np.testing.assert_allclose(mine["uncertainty"].values[told], spread, rtol=1e-2)


# Two forms of a model of two shape values, which take long to compile, and each option once with a smaller model.
OPTIONS = {
    "free": ("cauchy-lorentz", {}),
    "shape grouped": ("cauchy-lorentz", {"grouped": {"sigma": "theta_i"}}),
    "grouped": ("torrance-sparrow", {"grouped": {"ks": "theta_i"}}),
    "held": ("torrance-sparrow", {"held": {"kd": 0.7}}),
    "nothing but weights": ("torrance-sparrow", {"held": {"sigma": 0.2}}),
    "nothing but shape": ("torrance-sparrow", {"held": {"ks": 1.0, "kd": 1.0}}),
    "bounds": ("torrance-sparrow", {"bounds": {"ks": (0.0, 0.8), "sigma": (0.15, 0.3)}}),
    "floor": ("torrance-sparrow", {"weighting": "relative", "noise_floor": 0.01}),
    "solid angle": ("torrance-sparrow", {"weighting": "solid-angle", "g1": np.cosh}),
}


@pytest.mark.no_cover  # counting the lines of so many searches takes longer than they do
@pytest.mark.parametrize(("model", "options"), OPTIONS.values(), ids=OPTIONS)
def test_each_lane_is_fitted_as_one_scan_is(model, options):
    stack, options = stack_of(model, 5), options | {"model": catalogue[model]}
    found = fit_many(one(stack, 0, **options), stack)
    for lane in range(5):
        assert_same(found, lane, fit(one(stack, lane, **options)))
    for name, (low, high) in options.get("bounds", {}).items():
        values = found["value"].sel(parameter=name).values
        assert ((low <= values) & (values <= high)).all()


@pytest.mark.parametrize("name", ["lambert", "ross-li", "ggx"])
def test_models_of_weights_alone_and_of_more_shape_values_are_fitted_too(name):
    stack = stack_of(name, 2)
    found = fit_many(one(stack, 0, model=catalogue[name]), stack, covariance="")
    for lane in range(2):
        assert_cost(found, lane, fit(one(stack, lane, model=catalogue[name])))


def test_a_long_scan_is_searched_first_on_a_part_of_its_points():
    rng = np.random.default_rng(2)
    angles = rng.uniform(0, 80, (2, 20_000))
    model = catalogue["torrance-sparrow"]
    directions = dict(zip(("theta_i", "theta_r", "phi"), (*angles, rng.uniform(0, 360, 20_000)), strict=True))
    exact = model(Geometry.from_degrees(*directions.values()), {"ks": 0.4, "kd": 0.1, "sigma": 0.2})
    values = exact * (1 + 0.02 * rng.standard_normal((2, 20_000)))
    coords = {name: ("direction", v, {"units": "degree"}) for name, v in directions.items()}
    stack = xr.Dataset({"brdf": (("sample", "direction"), values, {"units": "sr-1"})}, coords=coords)
    found = fit_many(one(stack, 0, model=model), stack, covariance="")
    assert_cost(found, 1, fit(one(stack, 1, model=model)))


@pytest.mark.parametrize("kind", ["scaled", "absolute"])
def test_other_covariances_are_those_of_one_scan(kind):
    stack = stack_of("torrance-sparrow", 3)
    stack["uncertainty"] = 0.02 * stack["brdf"]
    stack["uncertainty"].attrs = stack["brdf"].attrs
    options = {"model": catalogue["torrance-sparrow"], "weighting": "uncertainty"}
    found = fit_many(one(stack, 0, **options), stack, covariance=kind)
    for lane in range(3):
        assert_same(found, lane, fit(one(stack, lane, **options), covariance=kind))


def test_sets_are_fitted_jointly_where_they_are_no_lanes():
    lanes = stack_of("torrance-sparrow", 4)["brdf"].values.reshape(2, 2, -1)
    stack = xr.Dataset(
        {"brdf": (("sample", "wavelength", "direction"), lanes, {"units": "sr-1"})},
        coords=COORDS | {"wavelength": ("wavelength", [500.0, 600.0], {"units": "nm"})},
    )
    assert lane_dims(stack) == ("sample",)
    assert lane_dims(stack, each=("wavelength",)) == ("sample", "wavelength")
    model = catalogue["torrance-sparrow"]
    options = {"shared": ("kd",)}
    found = fit_many(Problem(model, stack.isel(sample=0), **options), stack)
    for lane in range(2):
        assert_same(found, lane, fit(Problem(model, stack.isel(sample=lane), **options)))
    apart = fit_many(Problem(model, stack.isel(sample=0, wavelength=0)), stack, covariance="")
    assert apart["value"].dims == ("sample", "wavelength", "parameter")
    np.testing.assert_array_equal(apart["wavelength"], [500.0, 600.0])


def test_gaps_masks_and_hopeless_lanes_have_a_status_and_leave_others_alone():
    stack = stack_of("torrance-sparrow", 9)
    alone = fit_many(one(stack, 0, model=SMALL), stack)
    values = stack["brdf"].values
    values[1, 5:60:3] = np.nan
    values[2] = 0.0
    values[3] -= 2 * values[3].mean()
    values[4] = -np.abs(values[4])
    values[5, 1:] = np.nan
    values[6] = np.nan
    mask = np.zeros(values.shape, dtype=np.int8)
    mask[7, :40] = 1
    stack["mask"] = (("sample", "direction"), mask)
    found = fit_many(one(stack, 0, model=SMALL), stack)
    said = [STATUSES[int(s)] for s in found["status"].values]
    assert said[2] is Status.ALL_ZERO
    assert said[4] is Status.NOT_DETERMINED  # every weight is at zero, and no shape shows
    assert said[5] is Status.TOO_FEW_POINTS
    assert said[6] is Status.NO_POINTS
    np.testing.assert_array_equal(found["points"], [123, 104, 123, 123, 123, 1, 0, 83, 123])
    for lane in (1, 3, 7):
        assert_same(found, lane, fit(one(stack, lane, model=SMALL)))
    for lane in (0, 8):
        for name in ("value", "cost", "covariance", "status"):
            np.testing.assert_array_equal(found[name][lane], alone[name][lane])
    for lane in (2, 6):
        assert np.isnan(found["value"][lane]).all()
        assert not found["converged"][lane]


def test_a_lane_that_cannot_be_weighed_says_so():
    stack = stack_of("torrance-sparrow", 3)
    stack["brdf"][1, 4] = -0.1
    found = fit_many(one(stack, 0, model=SMALL, weighting="relative"), stack, covariance="")
    assert [STATUSES[int(s)] for s in found["status"].values][1] is Status.NOT_WEIGHED
    assert found["converged"].values.tolist() == [True, False, True]


def test_a_block_of_one_lane_has_weights_of_its_own():
    """Relative weights of one lane are one row, as those of directions are, and must not pass for another lane's."""
    stack = stack_of("torrance-sparrow", 2)
    for weighting, shared_root in (("relative", False), ("solid-angle", True)):
        problem = Problem(SMALL, one_scan(stack, ("sample",)), weighting=weighting)
        lanes = StackLanes(stack, ("sample",), problem.points[NODE].values)
        for width in (1, 2):
            read = list(blocks(problem, laid_out(problem), lanes, width, False))
            assert [block.one_root for block in read] == [shared_root] * len(read)


def test_a_point_that_a_value_fits_exactly_is_seen_in_single_precision():
    """With one direction at one incidence angle its weight fits it exactly; the others have uncertainties."""
    stack = stack_of("torrance-sparrow", 2).isel(direction=slice(40, 83))  # one at 20 deg, 41 at 40 deg, one at 60 deg
    problem = one(stack, 0, model=SMALL, grouped={"ks": "theta_i"}, held={"sigma": 0.2})
    wide, narrow = (fit_many(problem, stack, precision=p)["uncertainty"].values for p in ("float64", "float32"))
    np.testing.assert_array_equal(np.isfinite(narrow), np.isfinite(wide))
    assert np.isfinite(wide).any()
    assert np.isinf(wide).any()


def test_points_of_no_weight_are_no_degrees_of_freedom():
    stack = stack_of("torrance-sparrow", 2)
    options = {"model": SMALL, "weighting": "solid-angle"}  # zero at theta_r = 0
    many = fit_many(one(stack, 0, **options), stack, covariance="scaled")
    single = fit(one(stack, 0, **options), covariance="scaled")
    np.testing.assert_allclose(many["uncertainty"][0], single.dataset["uncertainty"], rtol=1e-5)


def test_a_lane_without_a_group_lacks_that_groups_value_alone():
    stack = stack_of("torrance-sparrow", 2)
    stack["brdf"][1, :41] = np.nan
    found = fit_many(one(stack, 0, model=SMALL, grouped={"ks": "theta_i"}), stack).isel(sample=1)
    single = fit(one(stack, 1, model=SMALL, grouped={"ks": "theta_i"}))
    by_name = dict(zip(found["parameter"].values, found["value"].values, strict=True))
    assert np.isnan(by_name["ks[20]"])
    assert np.isinf(found["uncertainty"].values[0])
    assert STATUSES[int(found["status"])] is Status.NOT_DETERMINED
    for name, value in single.values.items():
        assert by_name[name] == pytest.approx(value, rel=1e-4)


def test_single_precision_finds_the_same_minimum():
    stack = stack_of("torrance-sparrow", 4)
    model = catalogue["torrance-sparrow"]
    wide, narrow = (
        fit_many(one(stack, 0, model=model), stack, covariance="", precision=p) for p in ("float64", "float32")
    )
    # Values of 1e-7 relative error in sums of 123 terms
    np.testing.assert_allclose(narrow["cost"], wide["cost"], rtol=1e-3)
    np.testing.assert_allclose(narrow["value"], wide["value"], rtol=2e-3)


def test_more_lanes_than_a_block_take_further_passes_and_agree():
    stack = stack_of("cauchy-lorentz", 40)
    narrow, wide = (
        fit_many(one(stack, 0), stack, replace(FOR_MANY, searches=4), covariance="", block=b) for b in (8, 16)
    )
    np.testing.assert_allclose(narrow["cost"], wide["cost"], rtol=COST)
    assert narrow["converged"].values.all()


def test_a_lane_is_a_solution_of_its_own():
    stack = stack_of("torrance-sparrow", 2)
    found = fit_many(one(stack, 0, model=SMALL), stack)
    mine, single = solution_of(found.isel(sample=1)), fit(one(stack, 1, model=SMALL))
    assert mine.status is single.status
    assert mine.cost == pytest.approx(single.cost, rel=COST)
    for name, (low, high) in single.intervals().items():
        assert mine.intervals()[name] == pytest.approx((low, high), rel=1e-4)
    with pytest.raises(ValueError, match=r"many lanes along sample: choose one, as by isel\(sample=0\)"):
        solution_of(found)


def test_dense_stacks_with_several_lane_dimensions_keep_their_coordinates(tmp_path):
    flat = stack_of("torrance-sparrow", 6)["brdf"].values.reshape(2, 3, 3, 41)
    stack = xr.Dataset(
        {"brdf": (("y", "x", "theta_i", "theta_r"), flat, {"units": "sr-1"})},
        coords={
            "y": [10, 20],
            "x": [1, 2, 3],
            "theta_i": ("theta_i", [20.0, 40.0, 60.0], {"units": "degree"}),
            "theta_r": ("theta_r", np.abs(SIGNED[:41]) + np.linspace(0, 1e-9, 41), {"units": "degree"}),
            "phi": ("theta_r", COORDS["phi"][1][:41], {"units": "degree"}),
        },
    )
    model = catalogue["torrance-sparrow"]
    problem = Problem(model, one_scan(stack, ("y", "x")))
    found = fit_many(problem, stack, covariance="")
    assert found["value"].dims == ("y", "x", "parameter")
    single = fit(Problem(model, stack.isel(y=1, x=2)))
    assert float(found["cost"].sel(y=20, x=3)) == pytest.approx(single.cost, rel=COST)
    stack.to_zarr(tmp_path / "stack.zarr", consolidated=False)
    lazily = xr.open_zarr(tmp_path / "stack.zarr", consolidated=False, chunks=None)
    np.testing.assert_array_equal(fit_many(problem, lazily, covariance="")["value"], found["value"])


REFUSED = {
    "instrument": "an instrument's acceptance is for fits of one scan",
    "loss": "a huber loss is for fits of one scan",
    "covariance": "no covariance 'other'",
    "precision": "no precision 'float16'",
    "device": "JAX sees no device 'tpu'",
    "no stack": "this is one scan, over direction, and no stack of scans",
    "directions": "theta_r differs from lane to lane",
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_done_for_many_is_refused_with_a_remedy(what):
    from gonio.measured.instrument import Instrument

    stack = stack_of("torrance-sparrow", 2)
    options = {
        "instrument": {"instrument": Instrument(detector_half_angle=2.0)},
        "loss": {"loss": "huber"},
    }.get(what, {})
    settings = {"covariance": {"covariance": "other"}, "precision": {"precision": "float16"}}.get(what, {})
    settings |= {"device": {"device": "tpu"}}.get(what, {})
    given = stack.isel(sample=0) if what == "no stack" else stack
    if what == "directions":
        angles = np.broadcast_to(given["theta_r"].values, given["brdf"].shape)
        given = given.assign_coords(theta_r=(("sample", "direction"), angles, {"units": "degree"}))
    with pytest.raises(ValueError, match=REFUSED[what]):
        fit_many(one(stack, 0, model=catalogue["torrance-sparrow"], **options), given, **settings)


def test_without_jax_the_remedy_is_said(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "jax", None)
    stack = stack_of("torrance-sparrow", 2)
    with pytest.raises(ValueError, match=r"need JAX: pip install 'gonio\[batch\]'"):
        fit_many(one(stack, 0, model=catalogue["torrance-sparrow"]), stack)


def test_annealing_many_comes_as_near_as_annealing_one():
    stack = stack_of("torrance-sparrow", 3)
    problem = one(stack, 0, model=catalogue["torrance-sparrow"])
    anneal = Anneal(cooling_rate=0.99, chains=2, seed=4)
    exact, many = (fit_many(problem, stack, covariance="", solver=how) for how in (FOR_MANY, anneal))
    single = fit(problem, anneal)
    excess = many["cost"].values / exact["cost"].values - 1
    assert (excess >= -1e-9).all()
    # Chains of other random numbers end within a few times each other's excess
    assert excess[0] < 10 * (single.cost / float(exact["cost"][0]) - 1)
    assert many["converged"].values.all()
    assert many.attrs["solver"] == "anneal, batched"
    again = fit_many(problem, stack, solver=anneal, covariance="", block=1)
    np.testing.assert_allclose(again["value"], many["value"], rtol=1e-12)
    narrow = fit_many(problem, stack, solver=Anneal(max_iterations=300, ub={"sigma": 0.05}), covariance="")
    assert (narrow["value"].sel(parameter="sigma") <= 0.05).all()
    assert [STATUSES[int(s)] for s in narrow["status"].values] == [Status.STEPS_EXHAUSTED] * 3


def test_a_stack_is_no_scan_of_one_problem():
    stack = stack_of("lambert", 2)
    with pytest.raises(ValueError, match=r"scans lie side by side along sample: choose one, or fit each by fit_many"):
        Problem(catalogue["lambert"], stack)
    (note,) = check(stack)
    assert str(note) == "note: scans lie side by side along sample: gonio fit-stack fits each"
