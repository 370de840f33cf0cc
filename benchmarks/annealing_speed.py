"""Exact weights against the paper's annealing and SciPy's, on a real scan: how much longer those take for no lower E.

Copper with ks by incidence angle, the shape held where the fit left it, so that all three look for the same weights.
"""

from pathlib import Path

from scipy.optimize import dual_annealing

from figures import Figure, paired
from gonio import Problem, catalogue, read
from gonio.fitting import Anneal, Projection, fit
from gonio.fitting.search.anneal import _Objective

SCAN = Path(__file__).resolve().parents[2] / "shared" / "data" / "scans" / "jsss_mwir_copper.csv"
EVALUATIONS = 20_000
ALLOWED = 1 + 1e-9  # E of the exact weights over the others'


def weights_alone() -> Problem:
    """The fit of copper with its shape held."""
    model, grouped = catalogue["cauchy-lorentz"], {"ks": "theta_i"}
    scan = read(SCAN)
    values = fit(Problem(model, scan, grouped=grouped)).values
    return Problem(model, scan, grouped=grouped, held={name: values[name] for name in model.shape})


def measure() -> list[Figure]:
    if not SCAN.exists():
        reason = f"not measured: no scan {SCAN.name} beside the project"
        return [Figure(name, reason=reason) for name in ("anneal_over_exact", "dual_annealing_over_exact")]
    problem = weights_alone()
    annealing = Anneal(max_iterations=EVALUATIONS, final_temperature=0.0)
    objective = _Objective(problem, *annealing.bounds(problem))  # E in coordinates from 0 to 1, for both annealings
    bounds = [(0.0, 1.0)] * len(problem.names)
    costs: dict[str, float] = {}

    def exact() -> None:
        costs["exact"] = Projection().search(problem).cost

    def appendix() -> None:
        costs["anneal"] = annealing.search(problem).cost

    def scipy() -> None:
        found = dual_annealing(lambda unit: objective(unit[None])[0], bounds, maxfun=EVALUATIONS, seed=0)
        costs["dual_annealing"] = float(found.fun)

    figures = []
    for name, other in (("anneal", appendix), ("dual_annealing", scipy)):
        timed = paired(exact, other, rounds=5)
        if costs["exact"] > costs[name] * ALLOWED:
            raise ValueError(f"exact weights end at E = {costs['exact']}, {name} at {costs[name]}")
        more = {"scan": SCAN.stem, "evaluations": EVALUATIONS, "E_exact": costs["exact"], "E_other": costs[name]}
        figures.append(Figure(f"{name}_over_exact", timed.ratio, details=more | timed.details()))
    return figures
