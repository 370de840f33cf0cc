"""A plan as bluesky's messages, run by its RunEngine with devices in plain Python."""

import time

import pytest

from gonio.acquisition import Conditions, Layout, grid
from simulated_benches import SMALL

pytest.importorskip("bluesky", reason="the extra `bluesky` is not installed")

from bluesky import RunEngine
from bluesky.utils import FailedStatus

from gonio.acquisition.drivers.bluesky import messages

PLAN = grid([20, 40], [-30, 0, 30], layout=Layout(dark_every=2), conditions=Conditions(settle=0.0))


class Done:
    """A status that is done."""

    done, success = True, True

    def add_callback(self, callback):
        callback(self)

    def exception(self, timeout=0.0):
        return None

    def wait(self, timeout=None):
        return None


class Device:
    """What can be set, triggered and read; it remembers what it was set to."""

    parent = None

    def __init__(self, name, log, value=0.0):
        self.name, self.log, self.value = name, log, value

    def set(self, value):
        self.log.append((self.name, value))
        self.value = value
        return Done()

    def trigger(self):
        self.log.append((self.name, "read"))
        return Done()

    def read(self):
        return {self.name: {"value": self.value, "timestamp": time.time()}}

    def describe(self):
        return {self.name: {"source": "python", "dtype": "number", "shape": []}}

    def read_configuration(self):
        return {}

    def describe_configuration(self):
        return {}


class Broken(Device):
    def trigger(self):
        raise OSError("no answer")


@pytest.fixture
def bench():
    log = []
    return log, {name: Device(name, log) for name in ("table", "arm", "meter", "shutter")}


def run(devices, plan=PLAN, **given):
    documents = []
    meter = given.pop("meter", devices["meter"])
    stage = {name: devices[name] for name in ("table", "arm", "shutter")}
    RunEngine({}, context_managers=[])(
        messages(plan, detectors=[meter], **stage, **given), lambda name, document: documents.append((name, document))
    )
    return documents


def test_a_run_engine_takes_every_step(bench):
    log, devices = bench
    documents = run(devices)
    start = next(document for name, document in documents if name == "start")
    assert start["plan_sha256"] == PLAN.sha256
    streams = {document["uid"]: document["name"] for name, document in documents if name == "descriptor"}
    events = [document for name, document in documents if name == "event"]
    assert [streams[event["descriptor"]] for event in events] == [step.kind for step in PLAN.steps]
    for step, event in zip(PLAN.steps, events, strict=True):
        if step.kind == "sample":
            assert event["data"]["table"] == step.theta_i
            assert event["data"]["arm"] == step.theta_i + step.theta_r
    assert log[-1] == ("shutter", 0)


def test_the_shutter_is_closed_during_darks_and_open_else(bench):
    log, devices = bench
    run(devices)
    state, seen = None, []
    for name, value in log:
        if name == "shutter":
            state = value
        elif (name, value) == ("meter", "read"):
            seen.append(state)
    assert seen == [0 if step.kind == "dark" else 1 for step in PLAN.steps]


def test_the_shutter_is_closed_when_a_device_fails(bench):
    log, devices = bench
    with pytest.raises((OSError, FailedStatus)):
        run(devices, meter=Broken("meter", log))
    assert log[-1] == ("shutter", 0)


def test_what_bluesky_cannot_take_is_refused_before_anything_moves(bench):
    log, devices = bench
    standard = grid([20], [0], layout=Layout(standard=(0, 45)))
    with pytest.raises(ValueError, match="steps of standard: give prepare"):
        run(devices, standard)
    with pytest.raises(ValueError, match="give a shutter"):
        messages(SMALL, table=devices["table"], arm=devices["arm"], detectors=[])
    with pytest.raises(ValueError, match="out of the plane"):
        run(devices, grid([20], [30], [90]))
    assert log == []
    asked = []
    run(devices, standard, prepare=lambda step: asked.append(step.kind) or iter(()))
    assert asked == [step.kind for step in standard.steps]
