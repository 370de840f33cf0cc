"""gonio-best on the full sets that peers fitted, and over the measured scans of benchmarks/validated.json."""

import json

import numpy as np
import pytest

from conftest import ROOT
from gonio import Problem, catalogue
from gonio.comparison.assessment import assess, validate
from gonio.fitting import fit
from surfaces import anoblack_ec1, merl_aluminium

BEST = catalogue["gonio-best"]


@pytest.mark.parametrize(
    ("measured", "points", "peers", "left_out"),
    [
        # peers: lg RMSE of the best peer fit, a binomial of 13 values, in sample; left_out: ours as measured, to 2 %
        pytest.param(anoblack_ec1, 1144, 0.0445, 0.0573, id="AnoBlackEC1onAlum"),
        pytest.param(merl_aluminium, 1785, 0.0733, 0.0780, id="merl_aluminium_slice"),
    ],
)
def test_fewer_values_and_a_lower_error_than_any_peer(shared_scans, measured, points, peers, left_out):
    problem = Problem(BEST, measured(), weighting="log")
    row = assess(problem, fit(problem))
    assert row.solution.dataset.attrs["points"] == points
    assert row.free_parameters < 13
    assert row.metrics["log10_rmse"] < peers
    assert validate(problem, row, "theta_i").validated["log10_rmse"] < 1.02 * left_out


def test_it_predicts_best_on_average():
    """The name is kept only while no model of the catalogue has a lower mean left-out error over the measured scans."""
    found = json.loads((ROOT / "benchmarks" / "validated.json").read_text(encoding="utf-8"))["scans"]
    names = set.intersection(*(set(scan["models"]) for scan in found.values()))
    errors = {name: [scan["models"][name]["left_out"] for scan in found.values()] for name in names}
    mean = {name: np.inf if None in some else np.mean(some) for name, some in errors.items()}
    assert len(names) > 40
    assert min(mean, key=mean.__getitem__) == BEST.name
