"""One scan fitted by lmfit, from the declared start vector and within the declared bounds, against `gonio.fitting.fit`.

lmfit searches once from one start; gonio searches from many and adds covariance, so that the E of both stand beside.
"""

from pathlib import Path

import lmfit
import numpy as np

from figures import Figure, paired
from gonio import Problem, catalogue, read
from gonio.fitting import fit

SCAN = Path(__file__).resolve().parents[2] / "shared" / "data" / "scans" / "jsss_mwir_copper.csv"


def start(problem: Problem) -> lmfit.Parameters:
    """Weights of one in units of the largest value, shape at its defaults."""
    size = float(np.max(problem.measured))
    values = [*[size] * problem.n_weights, *problem.shape_start]
    parameters = lmfit.Parameters()
    for k, (value, lower, upper) in enumerate(zip(values, problem.lower, problem.upper, strict=True)):
        parameters.add(f"p{k}", value=value, min=lower, max=upper)
    return parameters


def measure() -> Figure:
    if not SCAN.exists():
        return Figure("lmfit_over_fit", reason=f"not measured: no scan {SCAN.name} beside the project")
    problem = Problem(catalogue["cauchy-lorentz"], read(SCAN), grouped={"ks": "theta_i"})
    costs: dict[str, float] = {}

    def ours() -> None:
        costs["fit"] = fit(problem).cost

    def theirs() -> None:
        def residual(parameters: lmfit.Parameters) -> np.ndarray:
            return problem.residual(np.array(list(parameters.valuesdict().values())))

        found = lmfit.minimize(residual, start(problem), method="least_squares")
        costs["lmfit"] = float(problem.cost(found.residual))

    timed = paired(ours, theirs, rounds=5)
    more = {"scan": SCAN.stem, "E_fit": costs["fit"], "E_lmfit": costs["lmfit"], "lmfit_starts": 1}
    return Figure("lmfit_over_fit", timed.ratio, details=more | timed.details())
