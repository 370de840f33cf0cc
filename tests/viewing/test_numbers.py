"""The numbers of the page are gonio's own: weights, agreement and band, as the modules of the page compute them."""

import numpy as np
import pytest

from gonio import Problem, catalogue, fit, join, simulate
from gonio.comparison.assessment import floor_of
from gonio.comparison.metrics import metrics
from gonio.comparison.ranking import settled
from gonio.fitting.certainty.band import band
from gonio.fitting.search.reduced import Reduced
from gonio.measured import dataset
from gonio.measured.causes import with_causes
from gonio.viewing.session import Opened, Session
from viewed import by_node

ANGLES = np.arange(-80.0, 81, 4)
MODELS = ("gonio-best", "ggx", "cauchy-lorentz", "torrance-sparrow", "lambert", "disney", "student-t", "he-torrance")


def simulated(noise=0.02, rho_d=0.1, width=0.2, **more):
    values = {"rho_s": 0.3, "rho_d": rho_d, "width": width}
    return simulate(catalogue["ggx"], values, [0.0, 45.0], ANGLES, noise=noise, seed=1, **more)


def around():
    """Out of the plane, with stated uncertainties: less than two decades, so that these are what values weigh."""
    theta_i, theta_r, phi = (g.ravel() for g in np.meshgrid([20.0, 50.0], [5.0, 30.0, 60.0], np.arange(0, 360.0, 40)))
    at = dataset.make_scan(theta_i, theta_r, np.zeros(theta_i.size), phi)
    f = np.asarray(catalogue["ggx"](dataset.geometry(at), {"rho_s": 0.3, "rho_d": 0.1, "width": 0.6}))
    return dataset.make_scan(theta_i, theta_r, f, phi, uncertainty=0.01 + 0.02 * f)


def below_zero():
    scan = simulated(noise=0.0)
    shifted = scan["brdf"].values - 0.035 + 0.01 * np.sin(np.arange(scan["brdf"].size)).reshape(scan["brdf"].shape)
    return scan.assign(brdf=(scan["brdf"].dims, shifted, scan["brdf"].attrs))


SCANS = {
    "log": lambda: simulated(width=0.03).drop_vars("uncertainty"),
    "uncertainty": around,
    "relative": below_zero,
    "spectral": lambda: join(
        {str(k): simulated(rho_d=0.1 + 0.2 * k, wavelength=500.0 + 50 * k) for k in range(3)}
    ).drop_vars("scan"),
    "two": lambda: join({"a": simulated(width=0.1), "b": simulated(rho_d=0.4)}).drop_vars("uncertainty"),
}


@pytest.fixture(scope="module")
def scans():
    return {name: make() for name, make in SCANS.items()}


@pytest.fixture(scope="module")
def best(scans, tmp_path_factory):
    """Of every scan and model: exact weights of the default shape, and the agreement of each block."""
    session = Session([Opened(name, scan) for name, scan in scans.items()])
    script = f"""
    const {{ store, state, actions }} = await opened();
    const {{ computed }} = await import("gonio/compute.js");
    const found = [];
    for (let k = 0; k < state.sets.length; k++) {{
      await actions.chooseSet(k);
      for (const name of {list(MODELS)!r}) {{
        await actions.chooseModel("model", name);
        const {{ cost, lgRmse, count }} = computed(state);
        const {{ declaration }} = state.model;
        const values = Object.fromEntries(declaration.parameters.map((p, j) => [p.name, state.values[j]]));
        const {{ name: set, weighting }} = state.sets[k];
        found.push({{ set, model: name, values, cost, lgRmse, count, weighting }});
      }}
    }}
    answer(found);
    """
    found = by_node(session, script, tmp_path_factory.mktemp("weights"))
    return {(one["set"], one["model"]): one for one in found}


def problem_of(scan, model):
    """The problem of the weights alone, with every shape value at its default."""
    options = settled(scan, {})
    held = {name: p.default for name, p in model.shape.items()}
    return Problem(model, scan, weighting=options.weighting, noise_floor=options.noise_floor, held=held)


@pytest.mark.parametrize("name", SCANS)
@pytest.mark.parametrize("model", MODELS)
def test_weights_and_agreement(name, model, scans, best):
    """Both sides solve least squares exactly, and least logarithms until rounding ends them: 1e-9 is far above that."""
    problem, found = problem_of(scans[name], catalogue[model]), best[name, model]
    assert found["weighting"] == problem.weighting
    expected = fit(problem).vector(problem.names) if problem.logarithmic else Reduced(problem).solve(np.empty(0))[0]
    own = np.concatenate([found["values"][weight] for weight in catalogue[model].weights])
    np.testing.assert_allclose(own, expected, rtol=1e-9, atol=1e-9 * expected.max())
    modelled = problem.brdf(own)
    np.testing.assert_allclose(found["cost"], problem.cost(problem.difference(modelled)), rtol=1e-9)
    lg = metrics(problem.points, modelled, floor=floor_of(problem))["log10_rmse"]
    np.testing.assert_allclose(found["lgRmse"], lg, rtol=1e-9)
    assert found["count"] == len(problem.measured)


def by_cause():
    """Systematic uncertainties of two causes beside random ones."""
    scan = simulated()
    f = scan["brdf"].values
    return with_causes(scan, {"standard": 0.02 * f, "zero": 1e-3 * dataset.signed_theta_r(scan) * f})


FITS = {
    "log": lambda: Problem(catalogue["phong"], SCANS["log"](), weighting="log"),
    "few values": lambda: Problem(catalogue["torrance-sparrow"], part(20, 31), weighting="log"),
    "by cause": lambda: Problem(catalogue["torrance-sparrow"], by_cause()),
    "grouped": lambda: Problem(
        catalogue["cauchy-lorentz"], simulated(), grouped={"ks": "theta_i"}, held={"gamma": 40.0}
    ),
    "spectral": lambda: Problem(catalogue["phong"], SCANS["spectral"](), grouped={"n": "wavelength"}),
    "floor": lambda: Problem(catalogue["phong"], below_zero(), weighting="relative", noise_floor=0.05),
    "loss": lambda: Problem(catalogue["phong"], simulated(noise=0.1), loss="cauchy"),
    "undetermined": lambda: Problem(catalogue["torrance-sparrow"], part(20, 22)),
}


def part(begin, end):
    return SCANS["log"]().isel(direction=slice(begin, end))


@pytest.fixture(scope="module")
def fits():
    return {name: fit(make()) for name, make in FITS.items()}


@pytest.fixture(scope="module")
def fitted(fits, tmp_path_factory):
    """Of every fit: agreement, and theta_r, values and half widths of the curves, as the page has them."""
    session = Session([Opened(name, solution.scan, {name: solution}) for name, solution in fits.items()])
    script = """
    const { store, state, actions } = await opened();
    const { computed } = await import("gonio/compute.js");
    const found = [];
    for (let k = 0; k < state.sets.length; k++) {
      await actions.chooseSet(k);
      const set = state.sets[k];
      const parts = [];
      for (let block = 0; block < set.blocks.length; block++) {
        actions.chooseBlock(block);
        store.set({ hidden: new Set() });
        const { curves, cost, lgRmse } = computed(state);
        const of = [...curves].map(([cell, { x, f, half }]) => ({ x, f, half, theta_i: set.cells[cell].theta_i }));
        parts.push({ of, cost, lgRmse, labels: set.blocks[block] });
      }
      found.push(parts);
    }
    answer(found);
    """
    return dict(zip(fits, by_node(session, script, tmp_path_factory.mktemp("bands")), strict=True))


@pytest.mark.parametrize("name", FITS)
def test_agreement_and_bands_of_a_fit(name, fits, fitted):
    """Differences on the page are right to some 1e-6 of a slope, so that 1e-3 of the band shows a wrong covariance."""
    solution = fits[name]
    for part in fitted[name]:
        np.testing.assert_allclose(part["cost"], solution.cost, rtol=1e-9)
        for curve in part["of"]:
            x = np.array(curve["x"])
            at = dataset.make_scan(
                np.full(len(x), curve["theta_i"]), np.abs(x), np.zeros(len(x)), np.where(x >= 0, 180.0, 0.0)
            )
            at = dataset.points(at).assign_coords({n: ("direction", [v] * len(x)) for n, v in part["labels"].items()})
            expected = band(solution, at)
            np.testing.assert_allclose(curve["f"], expected["brdf"], rtol=1e-9)
            half = solution.expanded(expected["uncertainty"].values, expected["uncertainty_systematic"].values)
            own = np.array(curve["half"], dtype=float)
            assert (np.isinf(own) == np.isinf(half)).all()
            finite = np.isfinite(half)
            np.testing.assert_allclose(own[finite], half[finite], rtol=1e-3)
            assert (half > 0).any()


def test_fits_of_every_kind_are_tried(fits):
    """What the test above is for: few degrees of freedom, causes, values that the data do not determine."""
    assert fits["few values"].coverage_factor() > 2.2
    assert fits["by cause"].has_systematic
    assert any(np.isinf(list(fits["undetermined"].uncertainties.values())))
    assert fits["loss"].dataset.attrs["loss"] == "cauchy"
