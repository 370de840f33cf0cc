"""The procedure behind Figs 6 and 7 of guo2023: deviations by eq 9, with their range and uncertainty."""

import numpy as np
import pytest

from gonio import catalogue, simulate
from gonio.acquisition import Conditions, Layout, planned, readings
from gonio.acquisition.simulated import STEADY, Electronics, Mirror, SimulatedBench
from gonio.measured.dataset import make_scan
from gonio.verification import delta, diffuse, lambertian, polarisation_error, specular
from simulated_benches import measure

ALUMINIUM = (1.37, 7.62)
ANGLES = range(10, 81, 10)


def mirror_readings(path, state, mirror=None, **given):
    conditions = Conditions(wavelength=632.8, polarisation=state, filter="nd", dwell=1.0)
    plan = planned([(t, t, None) for t in ANGLES], Layout(incident=True), conditions)
    on = SimulatedBench(
        mirror or Mirror(*ALUMINIUM, state), electronics=Electronics(ranges=(1e-6, 1e-5, 2e-3)), **given
    )
    measure(path, on, plan)
    return readings(path)


def test_eq_9():
    assert delta([1.0, 2.0], [1.1, 1.8]) == pytest.approx(0.1)
    assert np.isnan(delta([], []))
    with pytest.raises(ValueError, match="1 measured values are not above zero"):
        delta([1.0, 0.0], [1.0, 1.0])


@pytest.mark.parametrize("state", ["s", "p", "unpolarised"])
def test_a_mirror_agrees_with_fresnel_in_every_state(tmp_path, state):
    """Through drift of the laser, dark and noise: 0.06 %, as the paper prints, is within reach of a known state."""
    found = specular(mirror_readings(tmp_path / "run.jsonl", state), *ALUMINIUM)
    assert found.polarisation == state
    assert list(found.theta_i.round(2)) == list(ANGLES)
    assert found.deviation().delta < 6e-4
    assert found.deviation(0.01).passes
    assert not found.deviation(1e-7).passes


def test_the_wrong_state_is_far_off(tmp_path):
    """Light of s that is taken for unpolarised: the error that is printed beside an unknown state."""
    raw = mirror_readings(tmp_path / "run.jsonl", "unknown", Mirror(*ALUMINIUM, "s"))
    found = specular(raw, *ALUMINIUM)
    assert found.deviation().delta == pytest.approx(np.sqrt(np.mean((1 - 1 / (1 + found.error)) ** 2)), rel=0.01)
    assert found.deviation().delta > 0.05


def test_the_error_of_an_unknown_polarisation():
    """Al, n = 1.37, k = 7.62: values of the specification, computed apart."""
    found = 100 * polarisation_error([10, 30, 45, 60, 80], *ALUMINIUM)
    np.testing.assert_allclose(found, [0.14, 1.31, 3.17, 6.49, 16.49], atol=0.006)


def test_a_wrong_transmittance_scales_everything(tmp_path):
    raw = mirror_readings(tmp_path / "run.jsonl", "s", laser=STEADY)
    found = specular(raw, *ALUMINIUM, transmittance=1.01e-3)
    assert found.deviation().delta == pytest.approx(0.01, abs=6e-4)


def test_readings_that_cannot_show_a_mirror(tmp_path):
    path = tmp_path / "run.jsonl"
    raw = mirror_readings(path, "s")
    without = raw.isel(reading=raw["kind"].values != "incident")
    with pytest.raises(ValueError, match="no reading of the incident beam"):
        specular(without, *ALUMINIUM)
    with pytest.raises(ValueError, match="no reading at theta_r = theta_i"):
        specular(raw.isel(reading=raw["kind"].values != "sample"), *ALUMINIUM)
    with pytest.raises(ValueError, match="no dark in the range"):
        specular(raw.isel(reading=raw["kind"].values != "dark"), *ALUMINIUM)
    del raw.attrs["filter_transmittance"]
    with pytest.raises(ValueError, match="transmittance of the filter in the incident beam is not known"):
        specular(raw, *ALUMINIUM)


def standard(angles, factor=1.0):
    theta_r = np.arange(-70.0, 71.0, 10.0)
    values = factor * (0.3 + 0.01 * (theta_r / 40) ** 2)
    incidence, outward = (a.ravel() for a in np.meshgrid(angles, theta_r, indexing="ij"))
    return make_scan(incidence, outward, np.tile(values, len(angles)), uncertainty=np.full(incidence.shape, 0.003))


def test_a_standard_against_its_own_curve():
    found = diffuse(standard([10.0, 30.0], 1.02), standard([10.0, 30.0]))
    assert found.missing == 0
    for one in found.deviations():
        assert one.delta == pytest.approx(1 - 1 / 1.02, rel=1e-9)
    assert [one.what for one in found.deviations()] == [
        f"|theta_r| up to {limit} deg" for limit in (20, 30, 45, 60, 70)
    ]
    assert found.within(30, theta_i=10.0).count == 7
    assert found.within(20).expanded == pytest.approx(0.02, rel=0.03)
    assert not found.within(20).passes
    assert found.within(20, expanded=0.05).passes


def test_against_a_constant_the_range_makes_the_number():
    scan = standard([10.0])
    found = diffuse(scan, lambertian(scan, 0.3 * np.pi))
    deltas = [one.delta for one in found.deviations()]
    assert deltas == sorted(deltas)
    assert deltas[-1] > 5 * deltas[0] > 0


def test_the_certificate_is_interpolated_and_what_it_does_not_reach_is_counted():
    scan = simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], np.arange(-75, 76, 5.0))
    found = diffuse(scan, simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], np.arange(-60, 61, 20.0)))
    assert found.missing == 6
    assert found.deviations()[-1].delta < 1e-12
    assert found.deviations()[-1].what == "|theta_r| up to 60 deg"


def test_arbitrary_units_are_no_certificate():
    scan = standard([10.0])
    other = simulate(catalogue["lambert"], {"rho": 0.9}, [10.0], [0.0, 10.0], unit="a.u.")
    with pytest.raises(ValueError, match=r"the scan is in .*absolute"):
        diffuse(other, scan)
    with pytest.raises(ValueError, match="the certificate is in"):
        diffuse(scan, other)
    far = simulate(catalogue["lambert"], {"rho": 0.9}, [80.0], [0.0, 10.0])
    with pytest.raises(ValueError, match="reaches no direction"):
        diffuse(scan, far)
