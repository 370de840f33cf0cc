"""What a Problem makes of a model and a scan."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from gonio import Geometry, Problem, catalogue, published, simulate
from gonio.fitting import Anneal, Projection, Status, fit
from gonio.fitting.search.linear import bounded_least_squares
from gonio.measured.dataset import join, make_scan, points

THETA_R = np.arange(-80, 81, 4.0)


def test_objective_is_equation_11(aluminium):
    model, _values, scan = aluminium
    problem = Problem(model, scan, g1=lambda t: 1 + t, g2=lambda t: 2.0 * (t < 50))
    flat = points(scan)
    vector = np.array([300.0, 7e4, 20.0, 0.15, 50.0])
    modelled = problem.brdf(vector)
    weights = (1 + flat["theta_i"].values) * 2.0 * (flat["theta_r"].values < 50)
    measured = flat["brdf"].values
    expected = np.sum(weights * (modelled - measured) ** 2) / np.sum(weights * measured**2)
    assert float(problem.cost(problem.residual(vector))) == pytest.approx(expected, rel=1e-12)


def test_grouped_weights_are_columns(aluminium):
    model, _values, scan = aluminium
    problem = Problem(model, scan, grouped={"ks": "theta_i"})
    assert problem.names == ("ks[30]", "ks[40]", "ks[50]", "kdd", "kid", "sigma", "gamma")
    matrix, fixed = problem.design(np.array([0.142, 47.0]))
    assert matrix.shape == (len(problem.measured), 5)
    assert np.all((matrix[:, :3] > 0).sum(axis=1) == 1)
    stacked, _ = problem.design(np.array([[0.142, 47.0], [0.2, 30.0]]))
    np.testing.assert_array_equal(stacked[0], matrix)
    assert not fixed.any()


def spectral_scan(wavelengths):
    """Simulated rough-surface scatter of one sample at several wavelengths [nm]."""
    model = catalogue["generalised-harvey-shack"]
    theta_r = np.arange(-60, 61, 3.0)
    parts = []
    for wavelength in wavelengths:
        shape = {"sigma": 0.08, "length": 3.0, "index": 1.37, "extinction": 7.62, "wavelength": wavelength / 1000}
        parts.append(model(Geometry.in_plane(np.full_like(theta_r, 30.0), theta_r), {"scale": 0.9, **shape}))
    n = len(wavelengths)
    return make_scan(
        np.full(n * theta_r.size, 30.0),
        np.tile(theta_r, n),
        np.concatenate(parts),
        coordinates={"wavelength": np.repeat(wavelengths, theta_r.size)},
    )


@pytest.mark.parametrize("wavelengths", [[632.8], [488.0, 632.8, 1064.0]])
def test_the_wavelength_is_the_scans_own(wavelengths):
    """Roughness shared over wavelengths comes back because each point is evaluated at its own wavelength."""
    scan = spectral_scan(wavelengths)
    problem = Problem(
        catalogue["generalised-harvey-shack"], scan, held={"index": 1.37, "extinction": 7.62}, shared=("scale",)
    )
    assert [entry.name for entry in problem.free] == ["scale", "sigma", "length"]
    solution = fit(problem)
    assert solution.values["sigma"] == pytest.approx(0.08, rel=1e-5)
    assert solution.values["length"] == pytest.approx(3.0, rel=1e-5)
    at = solution.at(points(scan))["wavelength"]
    np.testing.assert_allclose(np.broadcast_to(at, scan.sizes["direction"]), scan["wavelength"].values / 1000)
    assert np.isnan(solution.uncertainties[next(n for n in solution.values if n.startswith("wavelength"))])
    free = Problem(problem.model, scan, bounds={"wavelength": (0.2, 2.0)})
    assert "wavelength" in [entry.name for entry in free.free]


def test_held_by_group():
    """One held value for each wavelength, as a material's optical constants are."""
    scan = spectral_scan([488.0, 632.8])
    model = catalogue["generalised-harvey-shack"]
    index, extinction = {"488": 1.0, "632.8": 1.37}, {"488": 5.9, "632.8": 7.62}
    grouped = {"index": "wavelength", "extinction": "wavelength"}
    problem = Problem(model, scan, held={"index": index, "extinction": extinction}, grouped=grouped)
    solution = fit(problem)
    found = solution.at(points(scan))
    np.testing.assert_array_equal(np.unique(found["extinction"]), [5.9, 7.62])
    assert solution.parameters()["index"]["values"]["632.8"]["value"] == 1.37
    with pytest.raises(ValueError, match=r"there is none for 632\.8"):
        fit(Problem(model, scan, held={"index": {"488": 1.0}}, grouped={"index": "wavelength"}))
    with pytest.raises(ValueError, match="not grouped"):
        fit(Problem(model, scan, held={"index": index}))


def test_held_values_stay_and_have_no_uncertainty(aluminium):
    model, values, scan = aluminium
    solution = fit(Problem(model, scan, held={"kid": 24.0, "sigma": 0.142}, grouped={"ks": "theta_i"}))
    assert solution.values["kid"] == 24.0
    assert np.isnan(solution.uncertainties["kid"])
    assert solution.parameters()["sigma"]["held"] is True
    assert solution.values["kdd"] == pytest.approx(values["kdd"], rel=0.05)
    assert "kid" not in solution.intervals()


def channels_scan():
    model = catalogue["torrance-sparrow"]
    colours = {"R": (0.9, 0.3), "B": (0.4, 0.1)}
    parts = {
        c: simulate(model, {"ks": ks, "kd": kd, "sigma": 0.2}, [20.0, 50.0], THETA_R) for c, (ks, kd) in colours.items()
    }
    scan = join(parts)
    return model, scan.rename({"scan": "channel"})


def test_channels_share_the_shape_and_not_the_weights():
    model, scan = channels_scan()
    solution = fit(Problem(model, scan))
    assert solution.values["ks[R]"] == pytest.approx(0.9, rel=1e-6)
    assert solution.values["ks[B]"] == pytest.approx(0.4, rel=1e-6)
    assert solution.values["sigma"] == pytest.approx(0.2, rel=1e-6)
    assert solution.parameters()["kd"]["by"] == "channel"


def test_shared_weights_and_grouped_shape():
    model, scan = channels_scan()
    problem = Problem(model, scan, shared=("kd",), grouped={"sigma": "channel", "ks": ("theta_i", "channel")})
    assert problem.names == ("ks[20,B]", "ks[20,R]", "ks[50,B]", "ks[50,R]", "kd", "sigma[B]", "sigma[R]")
    solution = fit(problem)
    assert solution.cost < fit(Problem(model, scan, shared=("kd", "ks"))).cost
    found = solution.at(points(scan))
    assert found["sigma"].shape == found["ks"].shape == (len(problem.measured),)


def test_many_shape_parameters_are_searched_too():
    """Three and more start from quasi-random points: two samples with their own slope under one lobe."""
    model = catalogue["cauchy-lorentz"]
    lobe = {"kdd": 60.0, "kid": 0.02, "gamma": 40.0}
    slopes = {"a": 0.1, "b": 0.25}
    parts = {k: simulate(model, lobe | {"ks": 0.5, "sigma": s}, [20.0, 50.0, 65.0], THETA_R) for k, s in slopes.items()}
    solution = fit(Problem(model, join(parts), grouped={"sigma": "scan"}, shared=("kdd", "kid")))
    for name, value in {"sigma[a]": 0.1, "sigma[b]": 0.25, "gamma": 40.0, "kdd": 60.0}.items():
        assert solution.values[name] == pytest.approx(value, rel=1e-6)


def test_a_value_is_only_known_for_its_groups(aluminium):
    model, _values, scan = aluminium
    solution = fit(Problem(model, scan, grouped={"ks": "theta_i"}))
    elsewhere = make_scan([60.0], [10.0], [1.0])
    with pytest.raises(ValueError, match="ks was fitted for theta_i = 30, 40, 50; there is none for 60"):
        solution.at(elsewhere)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"held": {"x": 1.0}}, "held: cauchy-lorentz has no parameter 'x'"),
        ({"grouped": {"ks": "colour"}}, "no coordinate 'colour'"),
        ({"weighting": "loud"}, "no weighting 'loud'"),
        ({"held": {"sigma": 7.0}}, "outside its bounds"),
        ({"held": {"ks": 1.0}, "grouped": {"ks": "theta_i"}}, "choose one"),
        ({"bounds": {"gamma": (50.0, 10.0)}}, "wrong way round"),
        ({"bounds": {"sigma": (-1.0, 1.0)}}, "the bounds of sigma begin at -1, where cauchy-lorentz has no"),
        ({"bounds": {"sigma": (0.0, 1.0)}}, "begin at 0, where cauchy-lorentz has no value: begin above"),
        ({"bounds": {"ks": (0.0, 0.0)}}, "leave one value, 0: hold it there instead"),
        ({"g1": lambda t: -t}, "non-negative"),
        ({"held": {"ks": 1.0, "kdd": 1.0, "kid": 1.0, "sigma": 0.1, "gamma": 50.0}}, "nothing is left to fit"),
    ],
)
def test_refusals(aluminium, options, message):
    model, _values, scan = aluminium
    with pytest.raises(ValueError, match=message):
        Problem(model, scan, **options)


def test_weightings_refuse_what_they_cannot_weigh():
    model = catalogue["lambert"]
    negative = make_scan([10, 10, 10], [0, 10, 20], [1.0, -0.1, 2.0])
    for name in ("relative", "log"):
        with pytest.raises(ValueError, match=f"{name} weighting needs positive values, and 1 of 3 are not"):
            Problem(model, negative, weighting=name)
    with pytest.raises(ValueError, match="the scan has none"):
        Problem(model, negative, weighting="uncertainty")
    unknown = make_scan([10, 10], [0, 10], [1.0, 2.0], uncertainty=[0.1, 0.0])
    with pytest.raises(ValueError, match="1 of 2 have none"):
        Problem(model, unknown, weighting="uncertainty")
    with pytest.raises(ValueError, match="every brdf value of the scan is zero"):
        Problem(model, make_scan([10, 10], [0, 10], [0.0, 0.0]))
    with pytest.raises(ValueError, match="no value in use"):
        Problem(model, make_scan([10], [0], [np.nan]))


def test_statuses():
    model = catalogue["cauchy-lorentz"]
    few = make_scan([30, 30, 30], [0, 20, 40], [1.0, 2.0, 1.5])
    assert fit(Problem(model, few)).status is Status.TOO_FEW_POINTS
    flat = make_scan(np.full(40, 30.0), np.linspace(-60, 60, 40), np.full(40, 0.3))
    undetermined = fit(Problem(model, flat))
    assert undetermined.status is Status.NOT_DETERMINED
    assert np.isinf(undetermined.uncertainties["sigma"])
    slow = Anneal(max_iterations=50)
    assert fit(Problem(model, flat), slow).status is Status.STEPS_EXHAUSTED
    sharp = simulate(catalogue["torrance-sparrow"], {"ks": 1.0, "kd": 0.1, "sigma": 0.02}, [30.0, 50.0], THETA_R)
    wide = Problem(catalogue["torrance-sparrow"], sharp, bounds={"sigma": (0.05, 1.0)})
    assert fit(wide).status is Status.AT_BOUND


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 10_000), st.integers(1, 6), st.sampled_from(["free", "positive", "box"]), st.booleans())
def test_exact_weights_against_scipy(seed, n, kind, collinear):
    """Bounded linear least squares, against SciPy's own solver on the unreduced matrix."""
    random = np.random.default_rng(seed)
    matrix = random.random((30, n)) * 10.0 ** random.uniform(-3, 3, n)
    if collinear and n > 1:
        matrix[:, -1] = matrix[:, 0] * 2
    target = matrix @ random.standard_normal(n) + random.standard_normal(30)
    limits = {"free": (-np.inf, np.inf), "positive": (0.0, np.inf), "box": (-0.3, 0.4)}[kind]
    lower, upper = np.full(n, limits[0]), np.full(n, limits[1])
    found = bounded_least_squares(matrix, target, lower, upper)
    assert np.all(found >= lower)
    assert np.all(found <= upper)
    scipy = lsq_linear(matrix, target, (lower, upper), method="bvls", tol=1e-14).x
    # on collinear columns SciPy may wander off along the direction that the data do not tell: its cost is rounding then
    assume(np.abs(scipy).max() < 1e6 * max(1.0, float(np.abs(found).max())))

    def cost(x):
        return float(np.sum((matrix @ x - target) ** 2))

    assert cost(found) <= cost(scipy) * (1 + 1e-8)


def test_exact_weights_of_several_problems_at_once():
    """Free, bounded and collinear ones side by side are those of each alone."""
    random = np.random.default_rng(7)
    matrices = random.random((6, 30, 3)) * [1.0, 10.0, 0.1]
    targets = np.einsum("kpn,n->kp", matrices, [1.0, 0.1, 2.0]) + random.standard_normal((6, 30))
    matrices[2, :, 1] = matrices[2, :, 0]
    matrices[4, :, 2] = 0.0
    targets[5] *= -1  # the free optimum is negative
    lower, upper = np.zeros(3), np.array([np.inf, 5.0, np.inf])
    together = bounded_least_squares(matrices, targets, lower, upper)
    alone = [bounded_least_squares(*one, lower, upper) for one in zip(matrices, targets, strict=True)]
    np.testing.assert_allclose(together, alone, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(together[5], 0.0)


def test_published_constants_come_back_to_six_digits():
    """Noise-free scans of every published surface give its constants back, ks by incidence angle as in Table 1."""
    for surface in published.values():
        model = catalogue[surface.model]
        scan = simulate(model, surface.values, sorted(surface.values["ks"]), np.arange(-80, 81.0), unit=surface.unit)
        solution = fit(Problem(model, scan, grouped={"ks": "theta_i"}))
        assert solution.status is Status.CONVERGED
        for name, value in solution.values.items():
            plain = surface.values[name] if "[" not in name else surface.values["ks"][float(name[3:-1])]
            assert value == pytest.approx(plain, rel=1e-6), (surface.name, name)


def test_progress_is_told(aluminium):
    model, _values, scan = aluminium
    for solver in (Projection(), Anneal(max_iterations=600)):
        seen = []
        solver.search(Problem(model, scan), seen.append)
        assert seen
        assert all(0 < fraction <= 1 for fraction in seen)
        assert seen == sorted(seen)
