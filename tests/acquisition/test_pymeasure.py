"""PyMeasure's drivers against pyvisa-sim: dialogues that stand for a PM100, an ESP300, an SR830 and a shutter."""

import pytest

from gonio.acquisition import Bench, DeviceError, InPlane, Journal, grid, read_journal, readings, run
from gonio.acquisition.plan import Conditions
from gonio.acquisition.simulated import SimulatedClock

pytest.importorskip("pymeasure", reason="the extra `instruments` is not installed")
pytest.importorskip("pyvisa_sim", reason="pyvisa-sim is not installed")

from gonio.acquisition.drivers.pymeasure import PM100, SR830, CommandShutter, ESP300Axis

SIMULATION = """
spec: "1.1"
devices:
  meter:
    eom: {USB INSTR: {q: "\\n", r: "\\n"}}
    error: ERROR
    dialogues:
      - {q: "SYST:SENSOR:IDN?", r: "S130C,123456,01-JAN-2026,1,1,33"}
      - {q: "SENS:CORR:WAV? MIN", r: "400"}
      - {q: "SENS:CORR:WAV? MAX", r: "1100"}
      - {q: "SENS:POW:RANG:AUTO 0"}
      - {q: "SENS:AVER:COUN 10"}
      - {q: "MEAS:POW?", r: "POWER"}
    properties:
      wavelength:
        default: 1064.0
        getter: {q: "SENSE:CORR:WAV?", r: "{:.4f}"}
        setter: {q: "SENSE:CORR:WAV {:f}"}
        specs: {type: float}
      range:
        default: 1.0
        getter: {q: "SENS:POW:RANG:UPP?", r: "{:.6e}"}
        setter: {q: "SENS:POW:RANG:UPP {:e}"}
        specs: {type: float}
  stages:
    eom: {GPIB INSTR: {q: "\\r\\n", r: "\\r\\n"}, ASRL INSTR: {q: "\\r\\n", r: "\\r\\n"}}
    error: ERROR
    dialogues:
      - {q: "1MD?", r: "1"}
      - {q: "2MD?", r: "DONE"}
      - {q: "TE?", r: "CODE"}
      - {q: "2ST"}
      - {q: "2OR1"}
    properties:
      one:
        default: 0.0
        getter: {q: "1TP", r: "{:.4f}"}
        setter: {q: "1PA{:f}"}
        specs: {type: float}
      two:
        default: 180.0
        getter: {q: "2TP", r: "{:.4f}"}
        setter: {q: "2PA{:f}"}
        specs: {type: float}
  lockin:
    eom: {GPIB INSTR: {q: "\\n", r: "\\n"}}
    error: ERROR
    dialogues:
      - {q: "OUTP?1", r: "1.5e-6"}
      - {q: "OFLT?", r: "0"}
      - {q: "LIAS?", r: "LOCKIN"}
    properties:
      sensitivity:
        default: 26
        getter: {q: "SENS?", r: "{:d}"}
        setter: {q: "SENS{:d}"}
        specs: {type: int}
  shutter:
    eom: {ASRL INSTR: {q: "\\r\\n", r: "\\n"}}
    error: ERROR
    properties:
      blade:
        default: 0
        getter: {q: "ens?", r: "{:d}"}
        setter: {q: "ens={:d}"}
        specs: {type: int}
resources:
  USB0::1::INSTR: {device: meter}
  GPIB0::1::INSTR: {device: stages}
  GPIB0::2::INSTR: {device: lockin}
  ASRL1::INSTR: {device: shutter}
"""
USB = "USB0::0x1313::0x8078::P1::INSTR"


@pytest.fixture
def devices(tmp_path):
    """Opens a driver against the dialogues, some of whose answers a test chooses."""
    count = 0

    def device(of, address, answers=(), **given):
        nonlocal count
        count += 1
        text = SIMULATION.replace("USB0::1::INSTR", USB)
        for name, answer in {"POWER": "3.2e-8", "DONE": "1", "CODE": "0", "LOCKIN": "0", **dict(answers)}.items():
            text = text.replace(f'"{name}"', f'"{answer}"')
        path = tmp_path / f"devices{count}.yaml"
        path.write_text(text)
        terminations = {"ASRL1::INSTR": ("\r\n", "\n"), "GPIB0::1::INSTR": ("\r\n", "\r\n")}
        write, read = terminations.get(address, ("\n", "\n"))
        link = {"visa_library": f"{path}@sim", "write_termination": write, "read_termination": read}
        return of(address, clock=SimulatedClock(), **given, **link)

    return device


def meter(devices, **answers):
    return devices(PM100, USB, answers, wavelength=632.8, ranges=[1e-8, 1e-7, 1e-6])


def shutter(devices):
    return devices(CommandShutter, "ASRL1::INSTR", open="ens=1", close="ens=0", query="ens?", says_open="1")


def test_a_whole_measurement_through_pymeasure(devices, tmp_path):
    """The same plan, journal and readings as with the simulated bench: positions and power come from the dialogues."""
    table, arm = (devices(ESP300Axis, "GPIB0::1::INSTR", number=n, limits=[-190, 190]) for n in (1, 2))
    clock = SimulatedClock()
    power, light = meter(devices, POWER="2.2e-8"), shutter(devices)
    power.clock = clock
    plan = grid([20], [-30, 0, 30], conditions=Conditions(wavelength=632.8, dwell=0.05, settle=0))
    on = Bench(InPlane(table, arm), power, light, clock=clock)
    with Journal(tmp_path / "run.jsonl", plan) as journal:
        for _ in run(plan, on, journal):
            pass
    raw = readings(tmp_path / "run.jsonl")
    sample = raw.isel(reading=raw["kind"].values == "sample")
    assert set(sample["theta_i"].values) == {20}
    assert set(zip(sample["theta_r"].values, sample["phi"].values, strict=True)) == {(30, 0), (0, 180), (30, 180)}
    assert (sample["signal"].values == 2.2e-8).all()
    assert set(sample["range"].values) == {"1e-06", "1e-07"}  # 2.2e-8 W is weak in the first, and read again
    assert not light.is_open
    assert read_journal(tmp_path / "run.jsonl").is_complete


def test_the_meter_keeps_its_range_and_wavelength(devices):
    power = meter(devices)
    assert power.device.wavelength == pytest.approx(632.8)
    power.set_range(1e-7)
    reading = power.read(0.0)
    assert (reading.value, reading.range, reading.overload, reading.unit) == (3.2e-8, 1e-7, False, "W")
    power.set_range(1e-8)
    assert power.read(0.0).overload


def test_infinity_of_scpi_is_an_overload(devices):
    reading = meter(devices, POWER="9.9E37").read(0.0)
    assert reading.overload
    assert reading.value == 1e-6


def test_an_axis_moves_and_reads_back(devices):
    arm = devices(ESP300Axis, "GPIB0::1::INSTR", number=2, limits=[-190, 190], backlash=1.0)
    arm.move(-12.3456)
    assert arm.position() == pytest.approx(-12.3456)
    with pytest.raises(DeviceError, match="outside the limits"):
        arm.move(200)


@pytest.mark.parametrize(("homing", "asked"), [(False, []), (True, ["2OR1"])])
def test_an_axis_looks_for_its_home_only_when_asked(devices, monkeypatch, homing, asked):
    arm = devices(ESP300Axis, "GPIB0::1::INSTR", number=2, homing=homing)
    written, write = [], arm.device.write
    monkeypatch.setattr(arm.device, "write", lambda text: (written.append(text), write(text)))
    arm.home()
    assert [one for one in written if "OR" in one] == asked


def test_an_axis_that_never_stops_is_stopped(devices):
    arm = devices(ESP300Axis, "GPIB0::1::INSTR", {"DONE": "0"}, number=2, limits=[-190, 190], timeout=2.0)
    with pytest.raises(DeviceError, match="has not stopped after 2 s"):
        arm.move(10)


def test_an_error_of_the_controller_is_told(devices):
    arm = devices(ESP300Axis, "GPIB0::1::INSTR", {"CODE": "203"}, number=2, limits=[-190, 190])
    with pytest.raises(DeviceError, match="error 203"):
        arm.move(10)


@pytest.mark.parametrize(("status", "is_over"), [("0", False), ("1", True), ("4", True), ("8", False)])
def test_a_lock_in(devices, status, is_over):
    lock_in = devices(SR830, "GPIB0::2::INSTR", {"LOCKIN": status}, ranges=[2e-6, 1e-3])
    lock_in.set_range(2e-6)
    reading = lock_in.read(0.01)
    assert (reading.value, reading.unit, reading.overload) == (1.5e-6, "V", is_over)


def test_a_shutter_says_whether_it_is_open(devices):
    light = shutter(devices)
    assert not light.is_open
    light.open()
    assert light.is_open
    light.close()
    assert not light.is_open


def test_a_connection_is_opened_anew(devices):
    light = shutter(devices)
    before = light.device
    light.reconnect()
    assert light.device is not before
    light.open()
    assert light.is_open
