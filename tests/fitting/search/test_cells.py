"""Very many values, a few for each wavelength: solved in cells, with the answers of one matrix of all points."""

import time
import tracemalloc

import numpy as np
import pytest

from gonio import Problem, catalogue
from gonio.comparison import assess
from gonio.fitting import Anneal, fit
from gonio.fitting.certainty import correlation
from gonio.fitting.certainty.bootstrap import bootstrap
from gonio.fitting.certainty.identifiability import combinations, determinations
from gonio.fitting.certainty.outliers import scrutinise
from gonio.fitting.certainty.profile import rises
from gonio.fitting.objective import problem as problem_module
from gonio.fitting.objective.cells import memory
from gonio.fitting.objective.cells.linear import linearised, plane_of
from gonio.fitting.objective.cells.structure import in_cells
from gonio.fitting.objective.differences import SMALLEST, derivative, derivative_by_group
from gonio.fitting.search.cells import search as search_module
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.measured.instrument import Instrument

SPARROW, LORENTZ, GGX = (catalogue[name] for name in ("torrance-sparrow", "cauchy-lorentz", "ggx"))
# Both paths end where the residual is orthogonal to its tangent plane to 1e-11, and derivatives are good to 1e-12.
ROUNDING = 1e-7


def spectrum(count, model=SPARROW, directions=13, noise=0.02, **shape):
    """A scan of so many wavelengths, at 20 and 50 deg each, whose values change slowly with the wavelength."""
    k, theta_i, theta_r = (
        a.ravel() for a in np.meshgrid(np.arange(count), [20.0, 50.0], np.linspace(-75, 75, directions), indexing="ij")
    )
    x = k / (count - 1)
    values = {"ks": 0.4 + 0.3 * x, "kd": 0.1, "sigma": 0.15 + 0.05 * x, **shape}
    here = {name: value for name, value in values.items() if name in model.parameters}
    brdf = np.asarray(model(Geometry.in_plane(theta_i, theta_r), here))
    brdf = brdf * (1 + noise * np.random.default_rng(count).standard_normal(len(x)))
    return make_scan(theta_i, theta_r, brdf, coordinates={"wavelength": 400.0 + k})


@pytest.fixture
def in_one_matrix(monkeypatch):
    """A function that switches cells off or on, whatever the size of a problem."""

    def switch(dense):
        monkeypatch.setattr(problem_module, "MANY_VALUES", 10**9 if dense else 10)
        monkeypatch.setattr(problem_module, "LARGE", 3000)
        monkeypatch.setattr(search_module, "LARGE", 3000)

    return switch


OPTIONS = {
    "a shape that all share": {},
    "a shape value each": {"grouped": {"sigma": "wavelength"}},
    "relative": {"weighting": "relative"},
    "logarithms": {"weighting": "log"},
    "logarithms, a shape value each": {"weighting": "log", "grouped": {"sigma": "wavelength"}},
    "a shared weight": {"shared": ("kd",)},
    "a shared weight, and a shape value each": {"shared": ("kd",), "grouped": {"sigma": "wavelength"}},
    "shape by incidence angle": {"grouped": {"sigma": "theta_i"}},
    "weight by incidence angle": {"grouped": {"ks": "theta_i"}},
    "a held weight": {"held": {"kd": 0.1}, "shared": ("kd",)},
    "bounds that hold values": {"bounds": {"ks": (0.0, 0.5)}},
    "smooth": {"smooth": {"sigma": ("wavelength", 1e-4)}},
    "instrument": {"instrument": Instrument(detector_half_angle=1.0)},
}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
def test_the_answers_are_those_of_one_matrix(options, in_one_matrix):
    scan, found = spectrum(12), []
    for dense in (True, False):
        in_one_matrix(dense)
        problem = Problem(SPARROW, scan, **options)
        assert bool(in_cells(problem)) is not dense
        solution = fit(problem)
        found.append((solution, scrutinise(problem, solution.vector(problem.names))))
    (dense, far_dense), (cells, far) = found
    free = ~dense.dataset["held"].values
    spread = dense.dataset["uncertainty"].values[free]
    both = np.isfinite(spread)
    assert np.array_equal(np.isfinite(cells.dataset["uncertainty"].values[free]), both)
    moved = (cells.dataset["value"].values - dense.dataset["value"].values)[free][both] / spread[both]
    assert np.abs(moved).max() < ROUNDING
    covariances = [s.dataset["covariance"].values[np.ix_(free, free)][np.ix_(both, both)] for s in (dense, cells)]
    assert np.abs(np.diff(covariances, axis=0)[0] / np.outer(spread[both], spread[both])).max() < ROUNDING
    assert cells.cost == pytest.approx(dense.cost, rel=1e-12)
    assert cells.effective_values == pytest.approx(dense.effective_values, rel=ROUNDING)
    assert cells.status == dense.status
    assert far.threshold == pytest.approx(far_dense.threshold)
    assert np.abs(far.studentised - far_dense.studentised).max() < 1e-6


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_losses_settle_at_the_same_weights(loss, in_one_matrix):
    found = []
    for dense in (True, False):
        in_one_matrix(dense)
        found.append(fit(Problem(SPARROW, spectrum(12), loss=loss)).dataset)
    spread = found[0]["uncertainty"].values
    # weights have settled when no residual moves by more than 1e-4 of the scatter
    assert (np.abs(found[1]["value"].values - found[0]["value"].values) / spread).max() < 1e-3
    assert found[1]["uncertainty"].values == pytest.approx(spread, rel=1e-3)


@pytest.mark.parametrize("kind", ["scaled", "absolute"])
def test_other_covariances_are_the_same_and_systematic_shifts_too(kind, in_one_matrix):
    scan = spectrum(12)
    stated = 0.02 * np.abs(scan["brdf"])
    scan = scan.assign(uncertainty=stated, uncertainty_systematic=stated / 2)
    found = []
    for dense in (True, False):
        in_one_matrix(dense)
        found.append(fit(Problem(SPARROW, scan, weighting="relative"), covariance=kind).dataset)
    for name in ("uncertainty", "systematic_shift"):
        assert found[1][name].values == pytest.approx(found[0][name].values, rel=ROUNDING)


def test_values_that_the_data_do_not_determine_are_the_same(in_one_matrix):
    """Without a lobe sigma has no effect; a wavelength of three points leaves nothing to tell an error from."""
    scan = spectrum(12, ks=0.0, noise=0.0)
    few = scan.isel(
        direction=np.flatnonzero((scan["wavelength"].values != 403) | (np.arange(len(scan["brdf"])) % 9 == 0))
    )
    for one in (scan, few):
        found = []
        for dense in (True, False):
            in_one_matrix(dense)
            problem = Problem(SPARROW, one, grouped={"sigma": "wavelength"}, shared=("kd",))
            vector = np.concatenate([np.zeros(12), [0.1], np.full(12, 0.2)])
            found.append(plane_of(linearised(problem, vector)).blind)
        assert np.array_equal(*found)
        assert found[0].any()


def test_where_nothing_is_shared_each_wavelength_is_a_fit_of_its_own(in_one_matrix):
    scan = spectrum(24)
    in_one_matrix(False)
    together = Problem(SPARROW, scan, grouped={"sigma": "wavelength"})
    assert in_cells(together)
    solution = fit(together)
    for wavelength in np.unique(scan["wavelength"].values)[::5]:
        alone = fit(Problem(SPARROW, scan.isel(direction=np.flatnonzero(scan["wavelength"].values == wavelength))))
        for name, value in alone.values.items():
            spread = alone.uncertainties[name]
            assert solution.values[f"{name}[{wavelength:g}]"] == pytest.approx(value, abs=ROUNDING * spread)
            assert solution.uncertainties[f"{name}[{wavelength:g}]"] == pytest.approx(spread, rel=ROUNDING)


def test_profile_and_bootstrap_are_the_same(in_one_matrix):
    found = []
    for dense in (True, False):
        in_one_matrix(dense)
        problem = Problem(SPARROW, spectrum(12))
        solution = fit(problem)
        rise = rises(problem, solution, {"sigma": solution.values["sigma"] * 1.02, "ks[405]": 0.5})
        drawn = bootstrap(problem, solution, "pairs", draws=20)
        found.append((rise, drawn))
    (rise_dense, drawn_dense), (rise, drawn) = found
    assert rise == pytest.approx(rise_dense, rel=1e-6)
    # a search of a draw ends where the cost changes by 1e-10 of itself, 1e-5 of a standard deviation times root points
    spread = drawn_dense["value"].std("draw")
    assert float((np.abs(drawn["value"] - drawn_dense["value"]) / spread).max()) < 1e-3
    assert drawn["acceleration"].values == pytest.approx(drawn_dense["acceleration"].values, abs=1e-6)


def test_derivatives_by_group_are_those_of_single_values():
    group = np.repeat(np.arange(4), 5)
    at = np.linspace(0.1, 2.0, 20)
    values = np.array([0.0, 0.3, 1.0, 2.0])  # at a bound, inside, inside, at the other

    def function(values):
        return np.sin(values[..., group] * at) + values[..., group] ** 2

    by_group = derivative_by_group(function, values, group, 0.0, 2.0, SMALLEST)
    one_by_one = derivative(function, values, 0.0, 2.0, scale=SMALLEST, vectorised=True)
    assert by_group == pytest.approx(one_by_one[np.arange(20), group], rel=1e-12, abs=1e-14)
    exact = at * np.cos(values[group] * at) + 2 * values[group]
    assert by_group[5:15] == pytest.approx(exact[5:15], rel=1e-11)


def test_trade_offs_of_very_many_values_are_those_of_the_whole_matrix(monkeypatch):
    """Cells are independent given what they share, exactly so for residuals of one variance."""
    scan = spectrum(12, LORENTZ, kid=20.0)
    solution = fit(Problem(LORENTZ, scan, grouped={}), covariance="scaled")
    whole = determinations(solution)
    monkeypatch.setattr(correlation, "MANY", 5)
    correlation._KNOWN.pop(solution)
    in_parts = determinations(solution)
    assert [d.inflation for d in in_parts] == pytest.approx([d.inflation for d in whole], rel=1e-6, nan_ok=True)
    for one, other in zip(in_parts, whole, strict=True):
        assert one.name == other.name
        wavelength = one.name.partition("[")[2]
        near = {p for p in other.partners if not wavelength or "[" not in p or p.endswith(f"[{wavelength}")}
        assert one.determined or set(one.partners) == near


def measured(count, options):
    """Processor time [s] and largest memory [bytes] of a fit and all that `gonio fit` says of it."""
    scan = spectrum(count)
    problem = Problem(SPARROW, scan, **options)
    assert in_cells(problem)
    tracemalloc.start()
    started = time.process_time()
    solution = fit(problem)
    assess(problem, solution)
    scrutinise(problem, solution.vector(problem.names))
    determinations(solution)
    combinations(solution)
    seconds, peak = time.process_time() - started, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return seconds, peak


@pytest.mark.parametrize(
    "options", [{}, {"shared": ("kd",), "grouped": {"sigma": "wavelength"}}], ids=["shape", "each"]
)
def test_time_and_memory_grow_with_the_number_of_wavelengths_and_not_faster(options):
    """Four times as many wavelengths took 16 to 64 times as much with one matrix of all points and values."""
    measured(110, options)  # what is done once in a process
    (seconds, peak), (more_seconds, more_peak) = measured(110, options), measured(440, options)
    assert more_peak < 4 * peak
    assert more_seconds < 6 * seconds  # half more than four times, as a loaded machine takes less even turns


def test_a_fit_larger_than_the_memory_says_so_before_it_begins(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 1e5)
    monkeypatch.setattr(memory, "SMALLEST", 0)
    with pytest.raises(ValueError, match=r"a fit of 201 values to 2600 points takes some .* GB: .*--select"):
        fit(Problem(SPARROW, spectrum(100)))
    monkeypatch.setattr(memory, "available_memory", lambda: 1e7)
    with pytest.raises(ValueError, match="memory"):
        Anneal(chains=100).search(Problem(SPARROW, spectrum(100)))
