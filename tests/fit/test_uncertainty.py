"""Stated uncertainties, against what happens when a measurement is repeated."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from gonio import Problem, Projection, catalogue, published, simulate
from gonio.fit import Status, fit
from gonio.fit.covariance import covariance
from gonio.measured.masking import mask

ANGLES = [30.0, 40.0, 50.0]
SCANS = 500
# One local search from a coarse grid: the truth is near, and 500 fits should not take a quarter of an hour.
QUICK = Projection(grid=7, searches=1, rounds=1)


def surface(name):
    constants = published[name]
    values = {k: {a: v[a] for a in ANGLES} if isinstance(v, dict) else v for k, v in constants.values.items()}
    return catalogue[constants.model], values


@pytest.mark.parametrize(
    ("name", "noise"),
    [("Al", {"noise": 0.01}), ("Cu", {"offset_noise": 5.0})],
    ids=["proportional", "constant"],
)
def test_intervals_cover_the_truth(name, noise):
    """Over 500 simulated scans the stated 95 % intervals hold the truth 93 to 97 % of the time."""
    model, values = surface(name)
    hits: dict[str, int] = {}
    for seed in range(SCANS):
        scan = simulate(model, values, ANGLES, np.arange(-80, 81.0), seed=seed, unit="a.u.", **noise)
        solution = fit(Problem(model, scan, grouped={"ks": "theta_i"}), QUICK)
        for parameter, (low, high) in solution.intervals(0.95).items():
            true = values[parameter] if "[" not in parameter else values["ks"][float(parameter[3:-1])]
            hits[parameter] = hits.get(parameter, 0) + (low <= true <= high)
    rates = {parameter: count / SCANS for parameter, count in hits.items()}
    print(name, noise, rates)
    assert len(rates) == 7
    assert 0.93 <= np.mean(list(rates.values())) <= 0.97
    # one parameter alone: 500 draws scatter by 1 %, so three of those beyond the range above
    assert all(0.90 <= rate <= 0.99 for rate in rates.values())


def test_covariance_equals_the_textbook_where_noise_is_constant():
    """HC3 against s^2 (J'J)^-1 from SciPy's own Jacobian over all parameters: equal on average over many scans."""
    model, values = surface("Cu")
    ratios = []
    for seed in range(20):
        scan = simulate(model, values, ANGLES, np.arange(-80, 81.0), seed=seed, offset_noise=5.0, unit="a.u.")
        problem = Problem(model, scan, grouped={"ks": "theta_i"})
        vector = fit(problem, QUICK).dataset["value"].values
        jacobian = least_squares(problem.residual, vector, x_scale=np.abs(vector), max_nfev=1).jac
        residual = problem.residual(vector)
        classic = np.linalg.inv(jacobian.T @ jacobian) * (residual @ residual) / (len(residual) - len(vector))
        ratios.append(np.sqrt(np.diag(covariance(problem, vector)) / np.diag(classic)))
    # the specular peak is a dozen points, so HC3 scatters by a tenth a scan; 20 scans bring that to a few hundredths
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.1)


def test_a_lone_point_has_no_uncertainty():
    """A weight that one point determines alone fits it exactly, which says nothing about its error."""
    model, values = surface("Al")
    scan = simulate(model, values, ANGLES, np.arange(-80, 81.0), noise=0.01, unit="a.u.")
    theta_i, keep = scan["theta_i"].values, scan["theta_r"].values == 40.0
    lone = mask(scan, exclude=(theta_i == 40.0) & ~(keep & (scan["phi"].values == 180)))
    solution = fit(Problem(model, lone, grouped={"ks": "theta_i"}))
    assert np.isinf(solution.uncertainties["ks[40]"])
    assert np.isfinite(solution.uncertainties["ks[30]"])
    assert solution.status is Status.NOT_DETERMINED
