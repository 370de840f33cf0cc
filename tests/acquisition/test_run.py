"""Every fault of a bench: the measurement goes on, or ends with the shutter closed and a whole journal."""

from dataclasses import replace

import pytest

from gonio.acquisition import Bench, Conditions, DeviceError, Journal, Layout, grid, read_journal, readings, run
from gonio.acquisition.simulated import STEADY, Diffuse, Fault, Optics, SimulatedClock
from simulated_benches import FEW_RANGES, SMALL, bench, measure

REFERENCES = grid(
    [20],
    [0, 30],
    layout=Layout(check=(0, 45), incident=True, standard=(0, 45), background=True),
    conditions=Conditions(filter="nd", dwell=0.1),
)


def notes(content, event=""):
    return [r["note"] for r in content.records if r.get("note") and r.get("event", "") == event]


def signals(path):
    """The last reading of each step of the sample."""
    raw = readings(path)
    rows = {
        (i, r, p): s
        for k, i, r, p, s in zip(*(raw[n].values for n in ("kind", "theta_i", "theta_r", "phi", "signal")), strict=True)
        if k == "sample"
    }
    return {tuple(round(float(a), 2) for a in key): float(value) for key, value in rows.items()}


@pytest.mark.parametrize(
    ("faults", "note"),
    [
        ([Fault("overload", 7, 1)], "overload: again in a larger range"),
        ([Fault("nan", 5, 2)], "the reading is nan, not a number"),
        ([Fault("lost", 9, 2)], "no answer from the detector"),
    ],
)
def test_a_reading_that_fails_is_repeated(tmp_path, faults, note):
    on, whole = bench(faults), bench()
    measure(tmp_path / "run.jsonl", on)
    measure(tmp_path / "whole.jsonl", whole)
    content = read_journal(tmp_path / "run.jsonl")
    assert content.is_complete
    assert not on.shutter.is_open
    assert note in notes(content)
    there, expected = signals(tmp_path / "run.jsonl"), signals(tmp_path / "whole.jsonl")
    assert there.keys() == expected.keys()
    for key, value in expected.items():
        assert there[key] == pytest.approx(value, rel=0.03)  # of the laser's warm-up and noise


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (Fault("stall", 3, 2), "table: stalled at"),
        (Fault("miss", 4, 1), "instead of"),
    ],
)
def test_an_axis_that_stalls_or_misses_is_moved_again(tmp_path, fault, said):
    on = bench([fault])
    measure(tmp_path / "run.jsonl", on)
    content = read_journal(tmp_path / "run.jsonl")
    assert content.is_complete
    assert any(said in note for note in notes(content, "failure"))
    for record in content.records:
        if record.get("kind") == "sample":
            step = content.plan.steps[record["step"]]
            assert record["stage"]["table"] == pytest.approx(step.theta_i, abs=0.05)
            assert record["stage"]["arm"] == pytest.approx(step.theta_i + step.theta_r, abs=0.05)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (Fault("stall", 3, 99), "stalled at"),
        (Fault("miss", 3, 99), r"is at .* deg instead of"),
        (Fault("lost", 12, 99), "no answer from the detector"),
        (Fault("nan", 12, 99), "the reading is nan"),
    ],
)
def test_what_no_attempt_mends_ends_with_the_shutter_closed_and_goes_on_later(tmp_path, fault, said):
    path, on = tmp_path / "run.jsonl", bench([fault])
    with pytest.raises(DeviceError, match=said) as caught:
        measure(path, on)
    assert "run the same command to go on" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not on.shutter.is_open
    stopped = read_journal(path)
    assert stopped.records[-1]["event"] == "stopped"
    assert not stopped.torn
    assert not stopped.is_complete
    measure(path, bench(clock=SimulatedClock(on.clock.utc() + 600)))
    whole = read_journal(path)
    assert whole.is_complete
    assert whole.records[: len(stopped.records)] == stopped.records
    assert len(signals(path)) == sum(step.kind == "sample" for step in SMALL.steps)


def test_a_detector_that_overloads_in_every_range_keeps_its_flag(tmp_path):
    """A reading that no range holds is there, and flagged: it is not lost, and does not stop the rest."""
    path = tmp_path / "run.jsonl"
    measure(path, bench(optics=Optics(power=1e4)))
    raw = readings(path)
    assert read_journal(path).is_complete
    sample = raw.isel(reading=(raw["kind"].values == "sample"))
    assert sample["overload"].values.all()
    assert "1e-04" in set(sample["range"].values) or "0.0001" in set(sample["range"].values)


def test_ctrl_c_passes_with_the_shutter_closed(tmp_path):
    path, on = tmp_path / "run.jsonl", bench([Fault("interrupt", 20)])
    with pytest.raises(KeyboardInterrupt):
        measure(path, on)
    assert not on.shutter.is_open
    assert read_journal(path).records[-1]["note"] == "KeyboardInterrupt"
    measure(path, bench())
    assert read_journal(path).is_complete


def test_who_stops_asking_stops_the_measurement(tmp_path):
    """A script that leaves its loop: the generator is closed, and the shutter with it."""
    on = bench()
    with Journal(tmp_path / "run.jsonl", SMALL, on.described("")) as journal:
        records = run(SMALL, on, journal)
        for record in records:
            if record["kind"] == "sample":
                break
        assert on.shutter.is_open
        records.close()
    assert not on.shutter.is_open


def test_a_shutter_that_sticks_is_told_aloud(tmp_path):
    on = bench([Fault("stuck", 1, 999)])
    on.shutter.is_open = True
    with pytest.raises(DeviceError, match="THE SHUTTER MAY BE OPEN"):
        measure(tmp_path / "run.jsonl", on)


def test_a_shutter_that_sticks_once_is_closed_again(tmp_path):
    on = bench([Fault("stuck", 1, 1)])
    measure(tmp_path / "run.jsonl", on)
    assert not on.shutter.is_open


def test_a_session_begins_with_dark_and_check(tmp_path):
    """Drift is known piece by piece: after a stop both are read again before anything else, and the sessions differ."""
    path = tmp_path / "run.jsonl"
    with pytest.raises(DeviceError):
        measure(path, bench([Fault("lost", 20, 99)]))
    count = len(read_journal(path).records)
    measure(path, bench())
    later = [r for r in read_journal(path).records[count:] if "kind" in r]
    ranges = len(FEW_RANGES.ranges)
    assert [r["kind"] for r in later[: ranges + 1]] == ["dark"] * ranges + ["check"]
    assert {r["step"] for r in later[: ranges + 1]} == {None}
    assert set(readings(path)["session"].values) == {0, 1}


def test_a_complete_journal_moves_nothing(tmp_path):
    path, on = tmp_path / "run.jsonl", bench()
    measure(path, bench())
    before = path.read_bytes()
    assert measure(path, on) == []
    assert on.clock.elapsed == 0
    assert path.read_bytes() == before


def test_targets_and_filters_are_changed_with_the_shutter_closed(tmp_path):
    on = bench()
    seen = []
    for name in ("targets", "filters"):
        selector = getattr(on, name)
        select = selector.select
        selector.select = lambda to, select=select, name=name: (seen.append((name, to, on.shutter.is_open)), select(to))
    measure(tmp_path / "run.jsonl", on, REFERENCES)
    assert [to for name, to, _ in seen if name == "targets"] == [
        "none",
        "standard",
        "trap",
        "sample",
        "standard",
        "none",
    ]
    assert ("filters", "nd", False) in seen
    assert not any(is_open for name, _, is_open in seen if name == "targets")


def test_the_physics_of_the_kinds(tmp_path):
    """Incident: the beam behind the filter. Standard: its Lambert value. Background: none. Dark: the detector's own."""
    on = bench(laser=STEADY, standard=Diffuse(0.99))
    measure(tmp_path / "run.jsonl", on, REFERENCES)
    raw = readings(tmp_path / "run.jsonl")
    means = {kind: float(raw["signal"].values[raw["kind"].values == kind][-1]) for kind in set(raw["kind"].values)}
    omega = Optics().solid_angle
    assert means["incident"] == pytest.approx(1e-6, rel=2e-3)
    assert means["standard"] == pytest.approx(1e-3 * omega * 0.99 / 3.14159265 * 2**-0.5, rel=2e-3)
    assert means["background"] < 1e-11
    assert raw.attrs["filter_transmittance"] == 1e-3


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (grid([20], [0], [90]), None),
        (grid([20], [10], [90]), "lies out of the plane of incidence"),
        (grid([20], [0], layout=Layout(incident=True), conditions=Conditions(filter="x")), "filter 'x'"),
    ],
)
def test_what_a_bench_cannot_take_is_refused_before_anything_moves(tmp_path, plan, said):
    on = bench()
    if said is None:
        measure(tmp_path / "run.jsonl", on, plan)
        return
    with Journal(tmp_path / "run.jsonl", plan) as journal, pytest.raises(ValueError, match=said):
        list(run(plan, on, journal))
    assert on.clock.elapsed == 0


def test_limits_and_missing_targets_are_refused_before_anything_moves(tmp_path):
    on = bench()
    on.stage.arm.limits = (-50, 190)
    with pytest.raises(ValueError, match="moves the arm to -60 deg, outside -50 to 190"):
        measure(tmp_path / "run.jsonl", on, grid([20], [-80]))
    plain = Bench(on.stage, on.detector, on.shutter, clock=on.clock)
    with pytest.raises(ValueError, match="no target 'standard'"):
        measure(tmp_path / "other.jsonl", plain, grid([20], [0], layout=Layout(standard=(0, 45))))


def test_the_simulated_clock_agrees_with_the_duration_of_the_plan(tmp_path):
    """Without a monitor, with one range: then nothing is read but what the plan counts."""
    plan = grid([20, 50], range(-60, 61, 5), layout=Layout(blocked=5, dark_every=10))
    on = bench(electronics=replace(FEW_RANGES, ranges=(1e-4,)))
    on.monitor = None
    measure(tmp_path / "run.jsonl", on, plan)
    assert on.clock.elapsed == pytest.approx(plan.duration, rel=1e-9)


def test_zeros_of_the_stage(tmp_path):
    """theta_i = a - a0, theta_r = (b - b0) - (a - a0): with zeros set, the same angles at other positions."""
    on = bench()
    on.stage = replace(on.stage, table_zero=12.5, arm_zero=-3.0)
    measure(tmp_path / "run.jsonl", on)
    record = next(r for r in read_journal(tmp_path / "run.jsonl").records if r.get("kind") == "sample")
    assert record["stage"] == pytest.approx({"table": 32.5, "arm": 20 - 60 - 3}, abs=0.002)
    assert record["direction"] == pytest.approx([20, 60, 0], abs=0.002)


def test_backlash_of_a_table_near_the_normal_is_no_other_side(tmp_path):
    """A table that reads -0.01 deg is at the normal: theta_r keeps its sign. Beyond the tolerance it is not."""
    stage = bench().stage
    assert stage.direction({"table": -0.01, "arm": 45.0}) == pytest.approx((0.0, 45.01, 180.0))
    assert stage.direction({"table": -10.0, "arm": 35.0}) == pytest.approx((10.0, 45.0, 0.0))
