"""Smooth spectra: what is penalised, what that does to values, uncertainties and counts, and how strength is found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from gonio import Problem, catalogue, join, simulate
from gonio.comparison.assessment import assess, information_criteria, validate
from gonio.fitting import Anneal, Projection, Solution, Status, fit
from gonio.fitting.certainty.covariance import covariance
from gonio.fitting.certainty.identifiability import determinations
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.search.descent import LeastSquares, descend
from gonio.fitting.search.strength import effective_values, resolved
from gonio.measured.dataset import make_scan

LAMBERT, SPARROW = catalogue["lambert"], catalogue["torrance-sparrow"]
SMOOTH = {"ks": "wavelength", "kd": "wavelength", "sigma": "wavelength"}
COARSE = 25  # directions of a curve in the tests that fit often


def truth(x):
    """The parameters of a surface whose slope and reflectance vary over the spectrum, x from 0 to 1."""
    return {"ks": 0.4 + 0.3 * x, "kd": 0.1 + 0.05 * np.sin(3 * x), "sigma": 0.15 + 0.1 * np.sin(2.5 * x)}


def spectrum(count=12, noise=0.1, seed=0, directions=COARSE):
    """A scan of Torrance-Sparrow at so many wavelengths, unevenly spaced, at two incidence angles."""
    x = np.linspace(0, 1, count) ** 1.2
    theta_r = np.linspace(-75, 75, directions)
    parts = {
        str(k): simulate(
            SPARROW, truth(at), [20.0, 50.0], theta_r, noise=noise, seed=1000 * seed + k, wavelength=400 + 300 * at
        )
        for k, at in enumerate(x)
    }
    return join(parts).drop_vars("scan"), x


def values_of(solution, name):
    return np.array([value for key, value in solution.values.items() if key.startswith(f"{name}[")])


def flat_spectrum(wavelengths, reflectance, noise=0.0, seed=0, repeats=4):
    """A Lambertian surface, each wavelength seen from so many directions: a problem that is linear."""
    brdf = np.repeat(reflectance, repeats) / np.pi
    brdf = brdf + noise * np.random.default_rng(seed).standard_normal(brdf.size)
    theta_r = np.tile(np.linspace(0, 60, repeats), len(wavelengths))
    return make_scan(
        np.full(brdf.size, 10.0), theta_r, brdf, coordinates={"wavelength": np.repeat(wavelengths, repeats)}
    )


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.integers(300, 3000), min_size=3, max_size=12, unique=True),
    st.tuples(*[st.floats(-5, 5)] * 3),
    st.floats(1e-6, 1e6),
)
def test_a_parabola_is_penalised_by_its_curvature(wavelengths, coefficients, strength):
    """Whatever the steps: its second derivative is one number, and straight lines go free."""
    wavelengths = np.sort(np.array(wavelengths, dtype=float))
    x = (wavelengths - wavelengths[0]) / np.ptp(wavelengths)
    problem = Problem(
        LAMBERT,
        flat_spectrum(wavelengths, np.full(x.size, 0.5)),
        smooth={"rho": Smooth("wavelength", strength, scale=2.0)},
    )
    constant, slope, bend = coefficients
    vector = constant + slope * x + bend * x**2
    inside = np.sum((x[2:] - x[:-2]) / 2)  # the interval, less half a step at either end
    expected = strength * (2 * bend / 2.0) ** 2 * inside
    found = float(problem.cost(problem.penalty @ vector))
    # rounding of second differences: 1e-16 of the values over the squares of steps down to 1/2700
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-16 * strength)


def test_the_penalty_is_added_to_the_objective_and_is_no_part_of_the_metric():
    scan, _x = spectrum()
    problem = resolved(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 1e-4), "ks": ("wavelength", 1e-6)}))
    solution = fit(problem)
    vector = solution.dataset["value"].values
    error = problem.brdf(vector) - problem.measured
    own = np.sum(error**2) / np.sum(problem.measured**2)
    assert solution.cost == pytest.approx(own, rel=1e-9)
    row = assess(problem, solution)
    assert row.metrics["E"] == pytest.approx(own, rel=1e-9)
    penalty = float(problem.cost(problem.penalty @ vector))
    assert penalty > 1e-6
    assert float(problem.cost(problem.residual(vector))) == pytest.approx(own + penalty, rel=1e-9)
    assert solution.dataset["history"].values[-1] == pytest.approx(own + penalty, rel=1e-9)
    # what counts as free values, everywhere
    assert row.free_parameters == 36
    assert 16 < row.effective_values < 36  # straight lines and free values
    criteria = information_criteria(float(np.sum(error**2)), problem.measured.size, row.effective_values)
    assert (row.aicc, row.bic) == pytest.approx(criteria, rel=1e-12)  # the sum of squares there is E times its scale
    wide = fit(Problem(SPARROW, scan, grouped={"sigma": "wavelength"}))
    assert wide.cost < solution.cost
    assert wide.dataset.attrs["effective_values"] == 36


def test_without_strength_the_fit_is_free():
    scan, _x = spectrum(5)
    free = fit(Problem(SPARROW, scan, grouped={"sigma": "wavelength"}))
    none = fit(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 0), "kd": ("wavelength", 0.0)}))
    weak = fit(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 1e-14)}))
    assert none.values == pytest.approx(free.values, rel=1e-8)
    assert none.uncertainties == pytest.approx(free.uncertainties, rel=1e-8)
    assert weak.values == pytest.approx(free.values, rel=1e-6)  # the strength itself moves values by 1e-8 or so


@pytest.mark.parametrize("strength", [1e4, 1e8])
def test_the_strongest_fit_is_a_straight_line(strength):
    """Against SciPy's fit of the two numbers of a line, the weights solved wavelength by wavelength."""
    scan, x = spectrum(6)
    solution = fit(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", strength)}))
    found = values_of(solution, "sigma")
    assert solution.status is Status.CONVERGED
    free = Problem(SPARROW, scan, grouped={"sigma": "wavelength"})

    def residual(line):
        matrix, _ = free.design(line[0] + line[1] * x)
        weights = np.linalg.lstsq(matrix, free.measured, rcond=None)[0]
        return matrix @ weights - free.measured

    line = least_squares(residual, [0.2, 0.0], xtol=1e-12, ftol=1e-12).x
    np.testing.assert_allclose(found, line[0] + line[1] * x, rtol=max(1e-2 / strength, 1e-6))


def test_smooth_weights_are_the_exact_optimum():
    """A linear problem, against the normal equations with third-party second differences on even steps."""
    count, strength = 9, 3e-4
    reflectance = 0.3 + 0.1 * np.sin(np.arange(count))
    scan = flat_spectrum(np.linspace(500, 580, count), reflectance, noise=0.02)
    problem = resolved(Problem(LAMBERT, scan, smooth={"rho": ("wavelength", strength)}))
    solution = fit(problem)
    step = 1 / (count - 1)
    bends = np.diff(np.eye(count), 2, axis=0) / step**2 * np.sqrt(step)
    scale = problem.smoothed["rho"].scale
    pull = strength / scale**2 * bends.T @ bends * np.sum(problem.measured**2)
    matrix = np.kron(np.eye(count), np.ones((4, 1))) / np.pi
    normal = np.linalg.inv(matrix.T @ matrix + pull)
    expected = normal @ matrix.T @ problem.measured
    np.testing.assert_allclose(values_of(solution, "rho"), expected, rtol=1e-9)
    alone = np.pi * problem.measured.reshape(count, 4).mean(axis=1)
    assert scale == pytest.approx(np.sqrt(np.mean(alone**2)))
    trace = np.trace(matrix @ normal @ matrix.T)
    assert solution.dataset.attrs["effective_values"] == pytest.approx(trace, rel=1e-9)
    assert 3 < trace < 8


def test_uncertainties_are_the_scatter_of_repeated_measurements():
    """About the mean of the smooth estimates, which is not the truth; free fits scatter more."""
    count, seeds = 9, 200
    wavelengths, reflectance = np.linspace(500, 580, count), 0.3 + 0.05 * np.sin(np.arange(count))
    found, stated = [], []
    for seed in range(seeds):
        scan = flat_spectrum(wavelengths, reflectance, noise=0.01, seed=seed, repeats=30)
        problem = Problem(LAMBERT, scan, smooth={"rho": Smooth("wavelength", 1e-4, 0.3)})
        found.append(Projection().search(problem).vector)
        stated.append(np.sqrt(np.diag(covariance(problem, found[-1]))))
    scatter, stated = np.std(found, axis=0, ddof=1), np.sqrt(np.mean(np.square(stated), axis=0))
    # 200 draws know a standard deviation to 5 %, and nine of neighbours that go together in part to half of it or less
    np.testing.assert_allclose(stated, scatter, rtol=0.15)
    assert np.mean(stated / scatter) == pytest.approx(1, abs=0.07)
    free = Problem(LAMBERT, scan)
    assert scatter[4] < 0.8 * np.sqrt(np.diag(covariance(free, Projection().search(free).vector)))[4]
    # the mean is not the truth, and by more than it is known to: what smoothing takes away is not in the covariance
    assert np.abs(np.mean(found, axis=0) - reflectance).max() > 5 * scatter.max() / np.sqrt(seeds)


@pytest.mark.parametrize("kind", ["robust", "scaled", "absolute"])
def test_every_covariance_counts_the_penalty_once(kind):
    """Against dense matrices: the penalty holds the values, and only the points have errors and take up freedom."""
    reflectance = 0.5 + 0.1 * np.sin(np.arange(8.0))
    data = flat_spectrum(np.linspace(400, 700, 8), reflectance, noise=0.01)
    data["uncertainty"] = ("direction", np.linspace(0.005, 0.02, data.sizes["direction"]), data["brdf"].attrs)
    problem = Problem(LAMBERT, data, smooth={"rho": ("wavelength", 1e-4)})
    problem = resolved(problem)
    vector = fit(problem).vector(problem.names)
    slopes, left = problem.design(np.empty(0))[0], problem.brdf(vector) - problem.measured
    pull = np.linalg.inv(slopes.T @ slopes + problem.penalty.T @ problem.penalty) @ slopes.T
    leverage = np.einsum("pn,np->p", slopes, pull)
    variance = {
        "robust": (left / (1 - leverage)) ** 2,
        "scaled": np.full(len(left), left @ left / (len(left) - leverage.sum())),
        "absolute": data["uncertainty"].values ** 2,
    }[kind]
    assert leverage.sum() < len(vector) - 1
    np.testing.assert_allclose(covariance(problem, vector, kind), (pull * variance) @ pull.T, rtol=1e-8, atol=1e-12)


def test_slopes_are_derivatives():
    """Against central differences of the whole residual, one value at a time."""
    scan, _x = spectrum(4)
    for weighting in ("uniform", "log"):
        problem = Problem(SPARROW, scan, smooth={"sigma": Smooth("wavelength", 1.0, 0.2)}, weighting=weighting)
        vector = np.concatenate([np.full(8, 0.3), [0.1, 0.2, 0.25, 0.15]])
        for column, step in zip(quick_jacobian(problem, vector).T, 1e-6 * np.eye(12), strict=True):
            expected = (problem.residual(vector + step) - problem.residual(vector - step)) / 2e-6
            np.testing.assert_allclose(column, expected, atol=1e-6 * np.abs(expected).max())


def test_the_strength_is_found():
    """Where all is smooth and noise is 10 %: far nearer than free values, and near the best of fixed strengths.

    benchmarks/spectral.py has more of the same.
    """
    scan, x = spectrum(seed=1)
    true = np.concatenate([truth(x)[name] for name in ("ks", "kd", "sigma")])
    problem = resolved(Problem(SPARROW, scan, smooth=SMOOTH))

    def error(smooth):
        one = Problem(SPARROW, scan, smooth=smooth)
        squares = LeastSquares(one.residual, one.lower, one.upper, jacobian=lambda v: quick_jacobian(one, v))
        end = descend(squares, true, last_digits=False)
        return np.sqrt(np.mean((end.point / true - 1) ** 2))

    def strength(value):
        return {name: one._replace(strength=value) for name, one in problem.smoothed.items()}

    auto, free = error(problem.smoothed), error(strength(0.0))
    fixed = min(error(strength(value)) for value in (1e-6, 1e-5, 1e-4, 1e-3))
    assert auto < free / 2
    assert auto < 1.3 * fixed


def test_what_was_chosen_is_said_and_fits_again(tmp_path):
    scan, _x = spectrum(5)
    solution = fit(Problem(SPARROW, scan, smooth={"sigma": "wavelength"}))
    solution.save(tmp_path / "solution.nc")
    said = Solution.load(tmp_path / "solution.nc").smooth
    assert said["sigma"].by == "wavelength"
    again = fit(Problem(SPARROW, scan, smooth=said))
    assert again.values == pytest.approx(solution.values, rel=1e-9)


def test_each_scan_has_its_own_curve():
    """Two scans of other curvature: each is smooth by itself, and the mean of their integrals is added."""
    one, two = (flat_spectrum([500.0, 600.0, 700.0], np.array(r)) for r in ([0.2, 0.3, 0.4], [0.3, 0.5, 0.3]))
    problem = Problem(LAMBERT, join({"one": one, "two": two}), smooth={"rho": Smooth("wavelength", 1.0, 1.0)})
    assert problem.names[0] == "rho[one,500]"
    assert problem.penalty.shape == (2, 6)
    # steps of 1/2: second derivatives 0 and -1.6 over half the interval
    vector = np.array([0.2, 0.3, 0.4, 0.3, 0.5, 0.3])
    assert float(problem.cost(problem.penalty @ vector)) == pytest.approx(1.6**2 / 2 / 2)


def test_annealing_sees_the_penalty():
    scan, _x = spectrum(3)
    problem = Problem(SPARROW, scan, smooth={"sigma": Smooth("wavelength", 1e-2, 0.2)})
    optimum = Anneal(max_iterations=300).search(problem)
    assert optimum.cost == pytest.approx(float(problem.cost(problem.residual(optimum.vector))), rel=1e-9)
    assert float(problem.cost(problem.penalty @ optimum.vector)) > 0.01 * optimum.cost


def test_logarithms_are_smooth_too():
    """No point downhill of the end: SciPy finds nothing lower from there."""
    scan, _x = spectrum(4)
    problem = resolved(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 1e-3)}, weighting="log"))
    vector = fit(problem).dataset["value"].values
    cost = float(problem.cost(problem.residual(vector)))
    found = least_squares(problem.residual, vector, x_scale=vector, xtol=1e-12, ftol=1e-12)
    assert 2 * found.cost / problem.scale > cost * (1 - 1e-6)


def test_neighbours_are_no_partners_that_trade_off():
    """Values of a straight line are told together; a verdict is about what else could explain the data."""
    scan, _x = spectrum(6, noise=0.02)
    solution = fit(Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 1.0)}))
    spread = np.array([solution.uncertainties[f"sigma[{w}]"] for w in ("400", "443.487")])
    assert solution.dataset["covariance"].values[-6, -5] > 0.8 * spread.prod()
    partners = {v.name: v.partners for v in determinations(solution)}
    assert partners["ks[400]"]
    for name, others in partners.items():
        assert not [other for other in others if other.startswith("sigma") and other[5:] not in name]


def test_smooth_fits_are_validated():
    scan, _x = spectrum(4)
    problem = Problem(SPARROW, scan, smooth={"sigma": ("wavelength", 1e-3)})
    row = validate(problem, assess(problem, fit(problem)), "3")
    assert 0.03 < row.validated["log10_rmse"] < 0.1  # 10 % of noise is 0.043


def test_a_value_that_nothing_tells_takes_no_part_in_the_choice():
    """A lone point of one wavelength is fitted exactly, however smooth the rest is."""
    scan, _x = spectrum(5)
    lone = scan.isel(direction=np.flatnonzero((scan["wavelength"].values < 700) | (np.arange(scan.brdf.size) == 249)))
    solution = fit(Problem(SPARROW, lone, smooth={"sigma": "wavelength"}, held={"kd": 0.12}))
    assert 1e-13 <= solution.smooth["sigma"].strength <= 1e2
    assert np.isinf(solution.uncertainties["ks[700]"])


def test_effective_values_fall_with_the_strength():
    scan, _x = spectrum(8)
    vector = fit(Problem(SPARROW, scan, grouped={"sigma": "wavelength"})).dataset["value"].values
    strengths = (0.0, 1e-8, 1e-6, 1e-4, 1e-2, 1e4)
    counts = [
        effective_values(Problem(SPARROW, scan, smooth={"sigma": Smooth("wavelength", s, 0.2)}), vector)
        for s in strengths
    ]
    assert counts[0] == 24
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == pytest.approx(16 + 2, abs=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"smooth": {"x": "wavelength"}}, "smooth: torrance-sparrow has no parameter 'x'"),
        ({"smooth": {"sigma": "colour"}}, "no coordinate 'colour' to be smooth over"),
        ({"smooth": {"sigma": "scan"}}, "not numbers"),
        ({"smooth": {"sigma": "theta_i"}}, "fewer than three values of theta_i"),
        ({"smooth": {"sigma": ("wavelength", -1)}}, "finite and not negative"),
        ({"smooth": {"sigma": ("wavelength", np.inf)}}, "finite and not negative"),
        ({"smooth": {"sigma": ("wavelength", "loud")}}, "give a number or 'auto'"),
        ({"smooth": {"sigma": ("wavelength", 1, 0.0)}}, "must be positive"),
        ({"smooth": {"sigma": "wavelength"}, "held": {"sigma": 0.1}}, "held and smooth"),
        ({"smooth": {"ks": "wavelength"}, "shared": ("ks",)}, "shared and smooth"),
    ],
)
def test_refusals(options, message):
    scan, _x = spectrum(3)
    named = scan.assign_coords(scan=("direction", np.full(scan.brdf.size, "a")))
    with pytest.raises(ValueError, match=message):
        Problem(SPARROW, named, **options)


def test_what_is_not_resolved_is_refused():
    scan, _x = spectrum(3)
    for smooth in ("wavelength", ("wavelength", 1.0)):
        with pytest.raises(ValueError, match="not resolved"):
            _ = Problem(SPARROW, scan, smooth={"sigma": smooth}).penalty
    dark = flat_spectrum([500.0, 600.0, 700.0], np.array([-0.2, -0.3, -0.2]))
    with pytest.raises(ValueError, match="rho is zero"):
        resolved(Problem(LAMBERT, dark, smooth={"rho": ("wavelength", 1.0)}))
