"""The file of a bench: what it opens, and what is wrong in it, named with its table."""

import io
import random
import sys

import pytest

from gonio import catalogue
from gonio.acquisition import Conditions, DeviceError, grid, read_bench, read_journal, read_plan
from gonio.acquisition.simulated import FAULTS, Fault, Mirror
from gonio.files import FormatError
from simulated_benches import measure

OWN = """
from gonio.acquisition import Reading


class Arm:
    name, limits = "arm", (-180.0, 180.0)

    def __init__(self, at=0.0):
        self.at = at

    def position(self):
        return self.at

    def move(self, to):
        self.at = to


class Meter:
    unit, ranges = "V", (1.0, 10.0)

    def read(self, seconds):
        return Reading(0.5, 1e-3, 10, "V", self.largest)

    def set_range(self, largest):
        self.largest = largest


class Light:
    is_open = False

    def open(self):
        self.is_open = True

    def close(self):
        self.is_open = False


class Deaf:
    is_open = False


def broken():
    raise OSError("no such port\\n")
"""
REAL = """
[instrument]
aperture_radius = 4.75
operator = "N. N."
[table]
driver = "own.py:Arm"
zero = 2.0
[arm]
driver = "own.py:Arm"
at = 90.0
[detector]
driver = "own.py:Meter"
[shutter]
driver = "own.py:Light"
"""
LAMBERT = '[simulated]\nmodel = "lambert"\nvalues = {rho = 0.5}\n'


def bench_of(folder, text, conditions=None):
    (folder / "own.py").write_text(OWN)
    (folder / "bench.toml").write_text(text)
    return read_bench(folder / "bench.toml", conditions or Conditions(), catalogue.__getitem__)


def test_own_classes_beside_the_file_are_devices(tmp_path):
    on = bench_of(tmp_path, REAL)
    measure(tmp_path / "run.jsonl", on, grid([20], [0, 30]))
    content = read_journal(tmp_path / "run.jsonl")
    assert content.is_complete
    assert content.head["instrument"] == {"aperture_radius": 4.75, "operator": "N. N."}
    assert content.records[-1]["event"] == "complete"
    assert on.stage.table_zero == 2.0
    assert not on.shutter.is_open


def test_a_simulated_bench_is_what_its_file_says(tmp_path):
    text = LAMBERT + (
        "seed = 3\n[simulated.optics]\nbeam_radius = 2.0\n[simulated.electronics]\nranges = [1e-7, 1e-5]\n"
        '[simulated.laser]\nnoise = 0.0\n[[simulated.faults]]\nwhat = "nan"\nat = 4\n[instrument]\ndistance = 499.0\n'
    )
    on = bench_of(tmp_path, text, Conditions(wavelength=550.0))
    assert on.light.optics.beam_radius == 2.0
    assert on.light.optics.wavelength == 550.0
    assert on.detector.ranges == (1e-7, 1e-5)
    assert on.going_wrong.planned == [Fault("nan", 4)]
    assert on.instrument["distance"] == 499.0
    assert on.light.optics.distance == 500.0


def test_a_simulated_mirror_has_the_polarisation_of_the_plan(tmp_path):
    on = bench_of(tmp_path, '[simulated]\nmirror = "aluminium"\n', Conditions(wavelength=632.8, polarisation="p"))
    mirror = on.light.targets["sample"]
    assert isinstance(mirror, Mirror)
    assert mirror.polarisation == "p"
    assert mirror.n == pytest.approx(1.37, abs=0.1)


def test_values_may_change_with_the_incidence_angle(tmp_path):
    on = bench_of(tmp_path, '[simulated]\nmodel = "lambert"\n[simulated.values.rho]\n20 = 0.1\n40 = 0.3\n')
    assert on.light.part("sample", 40, 40) / on.light.part("sample", 20, 20) == pytest.approx(3, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[simulated", "is no TOML"),
        ("x = 3", "x stands outside of a table"),
        ("[detektor]\n", "has [detektor], which no bench has"),
        ("", "is empty"),
        ("[instrument]\n", "has no [table]"),
        (REAL.replace('driver = "own.py:Light"', ""), "[shutter] has no driver"),
        (REAL.replace("own.py:Light", "own.py:Deaf"), "[shutter]: the driver 'own.py:Deaf' lacks close, open"),
        (REAL.replace("own.py:Light", "own.py:broken"), "the driver 'own.py:broken' does not begin: no such port\\n"),
        (REAL.replace("own.py:Light", "own.py:None"), "the driver 'own.py:None' is not there"),
        (REAL.replace("own.py:Light", "other.py:Light"), "the driver 'other.py:Light' is not there"),
        (REAL.replace("own.py:Light", "no_module_of_that_name:A"), "needs no_module_of_that_name: install it"),
        (REAL.replace("own.py:Light", "pm10"), "no driver is called 'pm10'; nearest: pm100"),
        (REAL.replace("at = 90.0", "speed = 3"), "does not begin: Arm.__init__() got an unexpected keyword"),
        ("[simulated]\n", "[simulated] needs model"),
        (LAMBERT + 'mirror = "gold"', "[simulated] needs model"),
        (LAMBERT + "power = 3", "[simulated] has 'power'"),
        (LAMBERT + "[simulated.optics]\npower_mw = 3", "[simulated.optics] has 'power_mw'"),
        (LAMBERT + '[simulated.optics]\npower = "x"', "[simulated.optics] has power = 'x', expected such as 0.001"),
        (LAMBERT + "[simulated.optics]\npower = true", "[simulated.optics] has power = True"),
        (LAMBERT + "[simulated.optics]\npower = [1]", "[simulated.optics] has power = [1]"),
        (LAMBERT + "[simulated.electronics]\nranges = 3", "[simulated.electronics] has ranges = 3"),
        (LAMBERT + "[simulated.electronics]\nranges = []", "[simulated.electronics] has ranges = []"),
        (LAMBERT + "x = " + 5000 * "[", "is no TOML"),
        (LAMBERT + '[[simulated.faults]]\nwhat = "fire"', "the fault 'fire'"),
        (LAMBERT + '[[simulated.faults]]\nwhat = "nan"\nwhen = 3', "a fault has what, at and times"),
        (LAMBERT + "[table]\n", "has [simulated] and [table]"),
        (LAMBERT.replace("lambert", "lambart"), "lambart"),
        (LAMBERT.replace("rho =", "sigma ="), "lambert has no parameter 'sigma'"),
        ('[simulated]\nmirror = "unobtainium"', "unobtainium"),
    ],
)
def test_what_is_wrong_in_a_file_is_one_line_with_its_place(tmp_path, text, said):
    with pytest.raises(FormatError, match=r"bench\.toml") as caught:
        bench_of(tmp_path, text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_fault_says_what_it_is():
    for name in FAULTS:
        assert Fault(name).times == 1


def test_a_person_is_asked_and_answers(tmp_path, monkeypatch, capsys):
    text = REAL + '[targets]\ndriver = "by-hand"\nnames = ["sample", "standard"]\n'
    text += '[filters]\ndriver = "by-hand"\nnames = ["nd"]\ntransmittance = {nd = [1e-3, 1e-5]}\n'
    on = bench_of(tmp_path, text)
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n"))
    on.targets.select("standard")
    assert "put 'standard' in its place, then press Enter" in capsys.readouterr().err
    assert on.filters.transmittance("nd") == (1e-3, 1e-5)
    with pytest.raises(DeviceError, match="nobody answers"):
        on.targets.select("sample")


def test_damaged_files_are_refused_in_one_line_or_taken(tmp_path):
    """Bytes changed, cut and doubled at random in a plan and in a bench: no other error, and no line break in it."""
    chance = random.Random(5)
    plan = grid([20], [-30, 0, 30], conditions=Conditions(wavelength=632.8, filter="nd"))
    texts = {"plan": plan.text.encode(), "bench": (LAMBERT + "[simulated.optics]\nbeam_radius = 2.0\n").encode()}
    for _ in range(150):
        for name, raw in texts.items():
            at, much = chance.randrange(len(raw)), chance.randint(0, 4)
            path = tmp_path / f"{name}.toml"
            path.write_bytes(raw[:at] + chance.randbytes(chance.randint(0, 2)) + raw[at + much :])
            try:
                read_plan(path) if name == "plan" else read_bench(path, Conditions(), catalogue.__getitem__)
            except FormatError as error:
                assert "\n" not in str(error)  # noqa: PT017 - many are tried, and some are taken
