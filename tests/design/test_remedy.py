"""Which further readings would help a value that trades off: said, and true."""

import re

import numpy as np
import pytest

from gonio import Problem, catalogue, join, published, simulate
from gonio.design.known import Known
from gonio.design.remedy import HELPS, remedy_of
from gonio.fitting import fit
from gonio.fitting.certainty.identifiability import determinations
from gonio.measured.dataset import make_scan

MODEL = catalogue["cauchy-lorentz"]
SAID = re.compile(
    r"ten readings at theta_i (\d+), theta_r (-?\d+) to (-?\d+) deg would make it ([\d.]+) times more certain"
)


def scanned(farthest, step):
    return simulate(
        MODEL,
        published["Al"].values,
        [30.0, 40.0, 50.0],
        np.arange(-farthest, farthest + 1, step),
        unit="a.u.",
        noise=0.01,
        offset_noise=1.0,
        blocked=5,
        seed=1,
    )


@pytest.fixture(scope="module")
def solution():
    return fit(Problem(MODEL, scanned(60, 4.0), grouped={"ks": "theta_i"}, weighting="uncertainty"))


@pytest.mark.parametrize("name", ["gamma", "kdd", "kid"])
def test_the_readings_that_are_named_help_as_much_as_is_said(solution, name):
    """Fitted again with ten such readings, the value is as many times surer as the words say."""
    (one,) = [d for d in determinations(solution, 60.0, remedy=remedy_of(solution)) if d.name == name]
    found = SAID.search(one.words)
    assert found, one.words
    assert "fix one with --hold; ten readings" in one.words
    theta_i, low, high, times = (float(part) for part in found.groups())
    assert abs(high - low) == 9
    theta_r = np.arange(low, high + 1)
    more = make_scan(np.full(10, theta_i), theta_r, np.zeros(10), unit="a.u.")
    more["brdf"].values[:] = solution.brdf(more)
    more = more.assign(uncertainty=("direction", np.hypot(0.01 * more["brdf"].values, 1.0), {"units": "a.u."}))
    old = solution.scan.assign(brdf=("direction", solution.brdf(solution.scan), {"units": "a.u."}))
    before, after = (
        fit(Problem(MODEL, s, grouped={"ks": "theta_i"}, weighting="uncertainty"), covariance="absolute")
        for s in (old, join({"old": old, "new": more}).drop_vars("scan"))
    )
    assert before.uncertainties[name] / after.uncertainties[name] == pytest.approx(times, rel=0.05)
    assert times >= HELPS


def test_where_no_readings_help_that_is_said():
    dense = fit(Problem(MODEL, scanned(84, 1.0), grouped={"ks": "theta_i"}, weighting="uncertainty"))
    words = [d.words for d in determinations(dense, 84.0, remedy=remedy_of(dense)) if not d.determined]
    assert words
    assert all("no ten readings within 85 deg of the normal make it 1.5 times more certain" in w for w in words)


def test_where_nothing_can_be_said_the_words_promise_nothing(solution):
    """Without the scan, and for several wavelengths."""
    bare = solution.dataset.drop_vars([n for n in solution.dataset if str(n).startswith("scan_")])
    from dataclasses import replace

    assert remedy_of(replace(solution, dataset=bare))("gamma") == ""
    for one in determinations(replace(solution, dataset=bare), 60.0):
        assert one.determined or "readings beyond 60 deg may help" in one.words
    both = join(
        {
            "1": scanned(60, 10.0).assign_coords(channel=("direction", ["R"] * 39)),
            "2": scanned(60, 10.0).assign_coords(channel=("direction", ["G"] * 39)),
        }
    ).drop_vars("scan")
    joint = fit(Problem(MODEL, both, grouped={"ks": "theta_i"}))
    assert remedy_of(joint)("gamma") == ""
    with pytest.raises(ValueError, match="add --select channel="):
        Known.of(joint)
