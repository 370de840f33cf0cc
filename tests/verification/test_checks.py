"""What a set-up's own readings show: reciprocity, energy, linearity, the zero of the angles, repeats and darks."""

import math

import numpy as np
import pytest

from gonio import catalogue, simulate
from gonio.acquisition import Conditions, planned, readings
from gonio.acquisition.simulated import STEADY, Electronics, Mirror, Optics, SimulatedBench
from gonio.measured import dataset
from gonio.measured.causes import with_causes
from gonio.reduction.readings import make_readings
from gonio.reduction.steps.zeros import moved_arm, tilted
from gonio.verification import CHECKS, Outcome
from gonio.verification.checks import dark, energy, linearity, reciprocity, repeat, zero
from simulated_benches import measure

ANGLES = (20.0, 40.0, 60.0)
VALUES = {"rho_s": 0.3, "rho_d": 0.2, "width": 0.2}
HELD = {"index": 1.5, "extinction": 0.0}


def scan_of(factor=lambda theta_i, theta_r: 1.0, relative=0.01):
    """A reciprocal surface at three theta_i, every 10 deg, times a factor of the signed theta_r."""
    scan = simulate(catalogue["ggx"], VALUES | HELD, ANGLES, np.arange(-70.0, 71, 10))
    flat = dataset.points(scan)
    wrong = flat["brdf"] * factor(flat["theta_i"].values, dataset.signed_theta_r(flat))
    return flat.assign(
        brdf=wrong.assign_attrs(flat["brdf"].attrs), uncertainty=(relative * wrong).assign_attrs(flat["brdf"].attrs)
    )


def test_an_outcome_passes_within_its_expanded_uncertainty_or_what_is_known():
    one = Outcome(0.03, 0.01, 5, "x", "y")
    assert (one.limit(), one.passes()) == (0.02, False)
    assert one.passes(0.05) is True
    assert one.passes(0.001) is False
    assert Outcome(-0.019, 0.01, 5, "x", "y").passes() is True
    assert Outcome(0.03, math.nan, 5, "x", "y").passes() is None
    assert Outcome(0.9, math.nan, 5, "x", "y", expected=1.0).passes() is True
    assert Outcome(1.1, math.nan, 5, "x", "y", expected=1.0).passes() is None
    assert Outcome(1.1, 0.06, 5, "x", "y", expected=1.0).passes() is True


def test_a_reciprocal_surface_passes():
    found = reciprocity(scan_of())
    assert found.number < 1e-12
    assert found.uncertainty == pytest.approx(0.01 * math.sqrt(2))
    assert found.count == 6  # 20/40, 20/60 and 40/60, on either side of the normal
    assert found.passes()


def test_angles_that_were_read_back_are_those_of_the_exchanged_direction():
    scan = scan_of()
    random = np.random.default_rng(1)
    moved = scan["theta_r"] + 0.01 * random.standard_normal(scan.sizes["direction"])
    assert reciprocity(scan.assign_coords(theta_r=abs(moved))).count == 6


def test_the_wrong_filling_is_named():
    """Reduced as under-filled where it was over-filled: f is wrong by cos(theta_i)/cos(theta_r)."""
    found = reciprocity(scan_of(lambda i, r: np.cos(np.radians(i)) / np.cos(np.radians(r))))
    ratios = [2 * np.log(np.cos(np.radians(a)) / np.cos(np.radians(b))) for a, b in ((20, 40), (20, 60), (40, 60))]
    # the exchange turns the factor over, so that a pair differs by its square
    assert found.number == pytest.approx(np.sqrt(np.mean(np.square(ratios))))
    assert not found.passes()
    assert "--fill under or over" in found.remedy


def test_a_cosine_that_is_missing_is_named():
    found = reciprocity(scan_of(lambda i, r: np.cos(np.radians(r))))
    assert not found.passes()
    assert "--fill" in found.remedy
    other = reciprocity(scan_of(lambda i, r: 1 + 0.1 * np.sin(7 * i)))
    assert not other.passes()
    assert "--fill" not in other.remedy


def test_causes_of_both_values_of_a_pair_cancel():
    scan = scan_of()
    common = with_causes(scan, {"standard": 0.05 * scan["brdf"].values})
    assert reciprocity(common).uncertainty == pytest.approx(0.01 * math.sqrt(2))
    odd = with_causes(scan, {"zero": 0.05 * scan["brdf"].values * np.sign(scan["theta_i"].values - 30)})
    assert reciprocity(odd).uncertainty > 0.05


def test_without_pairs_or_uncertainties():
    scan = scan_of()
    assert reciprocity(scan.drop_vars("uncertainty")).passes() is None
    one = scan.isel(direction=np.flatnonzero(scan["theta_i"].values == 20))
    with pytest.raises(ValueError, match="no pair of exchanged directions: measure theta_r at the theta_i of other"):
        reciprocity(one)


@pytest.mark.parametrize(("rho", "passes"), [(0.9, True), (1.2, False)])
def test_the_energy_of_a_lambertian_standard(rho, passes):
    """In plane: R = rho sin^2 of the farthest angle, as the integral is exact for a constant."""
    values = np.full(29, rho / np.pi)
    theta_r = np.linspace(-70.0, 70.0, 29)
    scan = dataset.make_scan(np.full(29, 10.0), theta_r, values, uncertainty=0.01 * values)
    found = energy(with_causes(scan, {"standard": 0.02 * values}))
    assert found.number == pytest.approx(rho * math.sin(math.radians(70)) ** 2, rel=1e-9)
    assert 0.02 < found.uncertainty / found.number < 0.021  # the factor stays, the scatter averages out
    assert found.passes() is passes
    assert "cover 88.3 %" in found.notes[0]


def test_the_mean_of_both_sides_counts():
    """An f that is twice as large on one side, and curves of different angles: the largest is the number."""
    theta_r = np.arange(-80.0, 81, 5)
    one = np.where(theta_r > 0, 0.4, 0.2) / np.pi
    one[theta_r == 0] = 0.3 / np.pi
    scan = dataset.make_scan(
        np.repeat([10.0, 30.0], theta_r.size), np.tile(theta_r, 2), np.concatenate([one, 0.5 * one])
    )
    found = energy(scan)
    assert found.number == pytest.approx(0.3 * math.sin(math.radians(80)) ** 2, rel=1e-9)
    assert [detail.value for detail in found.details] == pytest.approx([found.number, found.number / 2])
    assert found.passes() is True


def test_the_energy_over_the_hemisphere():
    i, r, phi = (a.ravel() for a in np.meshgrid([30.0], np.arange(0, 90.0, 5), np.arange(0, 360.0, 15)))
    values = np.full(i.size, 1.1 / np.pi)
    found = energy(dataset.make_scan(i, r, values, phi, uncertainty=0.02 * values))
    assert found.number > 1.05
    assert found.uncertainty == pytest.approx(0.02 * found.number, rel=1e-6)
    assert found.passes() is False


def test_relative_values_have_no_energy():
    scan = simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], [-10.0, 0.0, 10.0], unit="a.u.")
    with pytest.raises(ValueError, match="only absolute values"):
        energy(scan)
    one_side = simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], [0.0, 10.0, 20.0])
    with pytest.raises(ValueError, match="no curve of the scan reaches both sides"):
        energy(one_side)


def flux(a, shares=(0.5,), sd=1e-9, dark_value=1e-6, order=("A", "A+B", "B")):
    """Readings of two apertures at four decades by a detector V = P (1 + a log10(P/P0))."""
    rows = [("dark", "", dark_value)]
    for k, power in enumerate(10.0 ** np.arange(-3, 1)):
        share = shares[k % len(shares)]
        light = {"A": share * power, "B": (1 - share) * power, "A+B": power}
        rows += [("incident", n, light[n] * (1 + a * np.log10(light[n] / 5e-3)) + dark_value) for n in order]
    columns = {
        "kind": [kind for kind, *_ in rows],
        "theta_i": [math.nan] * len(rows),
        "theta_r": [math.nan] * len(rows),
        "filter": [name for _, name, _ in rows],
        "signal": [value for *_, value in rows],
        "sd": [sd * (1 + abs(value)) for *_, value in rows],
        "time": np.arange(float(len(rows))),
    }
    return make_readings(columns, "V")


def test_flux_addition_gives_the_nonlinearity_of_a_decade():
    """NL = 1.00015051 for a = 5e-4 and equal fluxes: the specification's vector, computed apart."""
    found = linearity(flux(5e-4))
    assert found.details[1].value == pytest.approx(1.00015051, abs=2e-8)  # at the level P0 of the equation, nearly
    assert found.number == pytest.approx(5e-4, rel=2e-3)
    assert found.count == 4
    assert found.passes() is False
    assert "--nonlinearity 0.0005," in found.remedy


@pytest.mark.parametrize("shares", [(0.3,), (0.5, 0.2, 0.7)])
@pytest.mark.parametrize("order", [("A", "A+B", "B"), ("B", "A", "A+B")])
def test_fluxes_need_not_be_equal(shares, order):
    assert linearity(flux(5e-4, shares, order=order)).number == pytest.approx(5e-4, rel=3e-3)


def test_a_linear_detector_passes_and_noise_is_propagated():
    """Over many draws of the noise the number scatters by what is stated."""
    numbers, stated = [], []
    for seed in range(60):
        raw = flux(0.0, sd=1e-5)
        noise = raw["sd"].values * np.random.default_rng(seed).standard_normal(raw.sizes["reading"])
        found = linearity(raw.assign(signal=raw["signal"] + noise))
        numbers.append(found.number)
        stated.append(found.uncertainty)
    assert np.std(numbers) == pytest.approx(np.median(stated), rel=0.35)
    passed = np.mean(np.abs(numbers) <= 2 * np.array(stated))
    assert passed > 0.85
    assert linearity(flux(0.0)).passes()


def test_levels_that_differ_are_told():
    raw = flux(5e-4)
    signal = raw["signal"].values.copy()
    signal[raw["filter"].values == "A+B"] *= [1.0, 1.0, 1.0, 1.001]
    found = linearity(raw.assign(signal=("reading", signal, raw["signal"].attrs)))
    assert "the levels differ" in found.notes[0]
    assert linearity(flux(5e-4, sd=1e-6)).notes == ()


def test_readings_that_are_not_threes():
    raw = flux(0.0)
    with pytest.raises(ValueError, match=r"line 5: a level begins that lacks one of its three readings: read A, B"):
        linearity(raw.isel(reading=np.delete(np.arange(13), 5)))
    with pytest.raises(ValueError, match="no readings behind the filters A, B and A"):
        linearity(raw.isel(reading=[0]))
    signal = np.where(raw["filter"].values == "B", -1.0, raw["signal"].values)
    below = raw.assign(signal=("reading", signal, raw["signal"].attrs))
    with pytest.raises(ValueError, match="not above zero: more light"):
        linearity(below)


def mirror(path, optics, turn=None):
    """Peaks of a mirror on a simulated bench with a detector that sees half a degree."""
    plan = planned(
        [(i, i + r, None) for i in ANGLES for r in np.arange(-1.5, 1.51, 0.1).round(3)],
        conditions=Conditions(dwell=1.0),
    )
    on = SimulatedBench(Mirror(1.37, 7.62, "s"), optics=optics, laser=STEADY, electronics=Electronics(ranges=(2e-3,)))
    measure(path, on, plan)
    return readings(path)


@pytest.mark.parametrize("error", [0.0, 0.12])
def test_the_zero_of_the_arm_on_a_bench(tmp_path, error):
    raw = mirror(tmp_path / "run.jsonl", Optics(arm_zero=error))
    found = zero(raw)
    assert abs(abs(found.number) - error) < 2 * found.uncertainty
    assert found.uncertainty < 0.006  # a seventeenth of the step, which is twice the width of the edge
    assert [round(d.value, 2) for d in found.details] == [round(found.number, 2)] * 3
    assert found.passes(0.01) is (error == 0)
    # what the remedy corrects is then gone
    raw = raw.isel(reading=np.flatnonzero(raw["kind"].values == "sample"))
    theta_r, phi = moved_arm(raw["theta_r"].values, raw["phi"].values, found.number)
    assert abs(zero(raw.assign(theta_r=("reading", theta_r), phi=("reading", phi))).number) < 0.002


def peaks(shift=lambda i: 0.0, tilt=0.0, turns=(), side=1.0, sd=1e-4):
    """Readings of narrow peaks at theta_r = theta_i, as a sample that is tilted towards the forward side shows them."""
    offsets = np.arange(-1.45, 1.5, 0.1)
    rows = []
    for turn in turns or (math.nan,):
        sign = -1 if turn == 180 else 1
        for i in ANGLES:
            at = i + shift(i) + 2 * sign * tilt
            rows += [(i, side * (i + o), turn, np.exp(-(((i + o - at) / 0.4) ** 2))) for o in offsets]
    columns = dict(zip(("theta_i", "theta_r", "phi_i", "signal"), map(np.array, zip(*rows, strict=True)), strict=True))
    return make_readings(columns | {"sd": np.full(len(rows), sd)}, "V")


def test_a_tilt_shifts_the_peaks_by_twice_itself():
    """The rule of the specification: theta_i + e, theta_r - e; the readings of a mirror lie where these are equal."""
    raw = peaks(tilt=0.1)
    found = zero(raw)
    assert found.number == pytest.approx(0.2, abs=2e-3)
    assert "--tilt 0.100,0" in found.remedy
    theta_i, theta_r, _ = tilted(np.array([40.0]), np.array([40.2]), np.array([180.0]), 0.1, 0.0)
    assert theta_i == pytest.approx(theta_r)


def test_a_turned_sample_tells_zero_from_tilt():
    found = zero(peaks(shift=lambda i: 0.15, tilt=-0.05, turns=(0.0, 180.0)))
    assert found.what == "zero of the arm"
    assert found.number == pytest.approx(0.15, abs=2e-3)
    assert found.details[-1].value == pytest.approx(-0.05, abs=1e-3)
    assert found.passes() is False


def test_a_shift_that_changes_with_theta_i_is_no_zero():
    found = zero(peaks(shift=lambda i: 0.01 * (i - 40)))
    assert abs(found.number) < 0.01
    assert "changes with theta_i" in found.remedy
    assert "it changes by 0.4" in found.notes[0]


def test_angles_of_the_other_sign_are_named():
    found = zero(peaks(side=-1.0))
    assert found.passes() is False
    assert "the other sign" in found.remedy


def test_the_noise_of_the_peaks_is_propagated():
    numbers, stated = [], []
    for seed in range(60):
        raw = peaks(sd=0.01)
        noise = 0.01 * np.random.default_rng(seed).standard_normal(raw.sizes["reading"])
        found = zero(raw.assign(signal=raw["signal"] + noise))
        numbers.append(found.number)
        stated.append(found.uncertainty)
    assert np.std(numbers) == pytest.approx(np.median(stated), rel=0.35)


def test_a_scan_of_a_mirror_has_peaks_too():
    raw = peaks(shift=lambda i: 0.1)
    cosine = np.cos(np.radians(raw["theta_r"].values))
    scan = dataset.make_scan(
        raw["theta_i"].values, raw["theta_r"].values, raw["signal"].values / cosine, raw["phi"].values
    )
    found = zero(scan)
    assert found.number == pytest.approx(0.1, abs=2e-3)


def test_no_peak_of_a_mirror_is_one_line():
    with pytest.raises(ValueError, match="peaks of a mirror at 0 theta_i, and 3 are needed: scan theta_r of a mirror"):
        zero(scan_of())
    raw = peaks()
    with pytest.raises(ValueError, match="at 2 theta_i"):
        zero(raw.isel(reading=np.flatnonzero(raw["theta_i"].values > 30)))


def steady(checks, darks=(0.002,), sd=1e-5):
    rows = [("dark", math.nan, math.nan, value) for value in darks]
    rows += [("check", 0.0, 45.0, value) for value in checks] + [("sample", 30.0, 10.0, 0.05)]
    columns = dict(zip(("kind", "theta_i", "theta_r", "signal"), map(list, zip(*rows, strict=True)), strict=True))
    extra = {"sd": np.full(len(rows), sd), "time": np.arange(float(len(rows)))}
    return make_readings(columns | extra, "V")


def test_repeats_of_the_check_direction():
    found = repeat(steady([0.102, 0.103, 0.104], darks=[0.002]))
    assert found.number == pytest.approx(np.std([0.1, 0.101, 0.102], ddof=1) / 0.101)
    assert found.uncertainty == pytest.approx(1e-5 / 0.101, rel=0.01)
    assert found.details[0].value == pytest.approx(0.02)
    assert found.passes() is False
    assert found.passes(0.02) is True
    assert repeat(steady([0.102, 0.10201, 0.10199], darks=[0.002])).passes()
    with pytest.raises(ValueError, match="no check direction was read twice: plan it"):
        repeat(steady([0.102]))


def test_darks_that_move():
    found = dark(steady([0.1], darks=[0.002, 0.0021, 0.0022]))
    level = np.median([0.1 - 0.0022, 0.05 - 0.0022])
    assert found.number == pytest.approx(1e-4 / level)
    assert found.details[0].value == pytest.approx(2e-4 / level)
    assert found.uncertainty == pytest.approx(1e-5 / level)
    assert found.passes() is False
    assert dark(steady([0.1], darks=[0.002, 0.00201])).passes()
    with pytest.raises(ValueError, match="no range with readings has two darks"):
        dark(steady([0.1]))


def test_every_check_is_declared():
    assert set(CHECKS) == {"reciprocity", "energy", "linearity", "zero", "repeat", "dark"}
