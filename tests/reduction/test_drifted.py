"""Readings while the source changed: what no correction makes sure is masked as drifted, on a simulated bench."""

import math

import numpy as np
import pytest

from gonio.acquisition import Conditions, Layout, grid, readings
from gonio.acquisition.device import Reading
from gonio.acquisition.simulated import STEADY, Diffuse, SimulatedBench
from gonio.measured.dataset import MASK_MEANINGS
from gonio.reduction import Filling, Known, Reduction, Relative, flags, make_readings, reduce
from gonio.reduction.readings import of_kind
from simulated_benches import FEW_RANGES, measure

ANGLES = ("theta_i", "theta_r", "phi")
DRIFTED = MASK_MEANINGS.index("drifted")
PLAN = grid(
    [20, 40],
    [-60, -30, 0, 30, 60],
    layout=Layout(blocked=5, dark_every=4, check=(0, 45), check_every=4),
    conditions=Conditions(wavelength=632.8, dwell=0.1),
)
ONE = Relative.parsed("3.141592653589793:factor@0,0", Known(1.0))


def measured(path, part=1.0, after=math.inf, seen=True):
    """Readings of a bench whose source falls to a part of its power after a time [s]; `seen`: by its monitor too."""
    on = SimulatedBench(Diffuse(0.5), laser=STEADY, electronics=FEW_RANGES)
    steady = on.source.source
    on.source.source = lambda: steady() * (part if on.clock.monotonic() > after else 1.0)
    if not seen:
        on.source.read = lambda seconds: Reading(1.0, 0.0, 1, "V", 10.0)
    measure(path, on, PLAN)
    return readings(path)


@pytest.fixture(scope="module")
def times(tmp_path_factory):
    """When the checks of the plan are read [s of the readings], and when the first reading is [s of the clock]."""
    raw = measured(tmp_path_factory.mktemp("steady") / "a.jsonl")
    assert not reduce(raw, ONE, Reduction(fill=Filling("under")))["mask"].values.any()
    return raw["time"].values[raw["kind"].values == "check"]


def masked(raw, **settings):
    """The readings of the sample that are masked as drifted, and the times of all of them."""
    scan = reduce(raw, ONE, Reduction(fill=Filling("under"), **settings))
    # an attempt that was repeated, in another range, is the same step once more: the last one counts
    at = {
        tuple(round(float(raw[n].values[r]), 1) for n in ANGLES): raw["time"].values[r] for r in of_kind(raw, "sample")
    }
    time = [
        at[tuple(round(float(a), 1) for a in angles)] for angles in zip(*(scan[n].values for n in ANGLES), strict=True)
    ]
    return scan["mask"].values == DRIFTED, np.array(time), scan


def test_a_fall_that_the_monitor_does_not_see_masks_what_was_read_between_two_checks(tmp_path, times):
    assert len(times) > 3
    between = (times[1] + times[2]) / 2
    raw = measured(tmp_path / "a.jsonl", 0.8, between, seen=False)
    found, time, scan = masked(raw)
    assert found.tolist() == ((time >= times[1]) & (time <= times[2])).tolist()
    assert 0 < found.sum() < len(found)
    reasons = {flag["reason"] for flag in flags(scan) if flag["flag"] == "drifted"}
    (reason,) = reasons
    assert reason.startswith("the check direction changed by -19.9 % between the readings before and after")
    assert all(flag["masked"] for flag in flags(scan) if flag["flag"] == "drifted")
    by_check, _, _ = masked(raw, drift="check")
    assert by_check.tolist() == found.tolist()  # a line between 1 and 0.8 is no measurement of a step
    assert not masked(raw, drift="none")[0].any()  # its size is a cause of the budget


def test_a_fall_that_the_monitor_sees_is_corrected_and_masks_nothing(tmp_path, times):
    raw = measured(tmp_path / "a.jsonl", 0.8, (times[1] + times[2]) / 2)
    found, _, _ = masked(raw)
    assert not found.any()
    unseen, _, _ = masked(raw, drift="check")
    assert unseen.any()


def test_a_small_drift_is_corrected_and_masks_nothing(tmp_path, times):
    """2 % in one step; 5 % is the limit."""
    assert not masked(measured(tmp_path / "a.jsonl", 0.98, (times[1] + times[2]) / 2, seen=False))[0].any()


def test_a_monitor_alone_is_trusted_near_its_median():
    def values(*monitor):
        rows = [("sample", 20.0, float(10 * k), 1.0 * m) for k, m in enumerate(monitor)]
        kind, theta_i, theta_r, signal = zip(*rows, strict=True)
        columns = {"kind": kind, "theta_i": theta_i, "theta_r": theta_r, "signal": signal, "monitor": monitor}
        return masked(make_readings(columns, "V"))[0].tolist()

    assert values(1.0, 1.1, 0.9, 1.0) == [False] * 4
    assert values(1.0, 1.0, 0.7, 1.0) == [False, False, True, False]


def test_a_change_within_the_noise_of_the_check_is_none():
    rows = [("check", 0.0, 45.0, 1.0), ("sample", 20.0, 0.0, 1.0), ("check", 0.0, 45.0, 0.9)]
    kind, theta_i, theta_r, signal = zip(*rows, strict=True)
    columns = {"kind": kind, "theta_i": theta_i, "theta_r": theta_r, "signal": signal, "time": [0, 1, 2]}
    assert masked(make_readings(columns, "V"))[0].tolist() == [True]
    assert masked(make_readings(columns | {"sd": [0.05] * 3}, "V"))[0].tolist() == [False]
    np.testing.assert_allclose(
        reduce(make_readings(columns, "V"), ONE, Reduction(fill=Filling("under")))["brdf"], 1 / 0.95
    )
