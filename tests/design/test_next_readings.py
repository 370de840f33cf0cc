"""Where to measure next, for fits of every kind."""

import numpy as np
import pytest

from gonio import Problem, catalogue, join, published, sample, simulate
from gonio.design import Cost, Noise, next_readings, reachable
from gonio.design.candidates import beam_angle, nearest_to_beam, parsed_range
from gonio.design.known import Known
from gonio.design.travel import in_order
from gonio.fitting import fit
from gonio.measured.dataset import make_scan, signed_theta_r
from gonio.measured.instrument import Instrument

GGX = catalogue["ggx"]
VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}
HELD = {"index": 1.5, "extinction": 0.0}


def scanned(angles=(20.0, 50.0), step=10.0, **options):
    return simulate(GGX, VALUES, list(angles), np.arange(-70, 71, step), **({"noise": 0.02} | options))


def fitted(scan, **options):
    return fit(Problem(GGX, scan, **({"held": HELD} | options)))


@pytest.fixture(scope="module")
def solution():
    return fitted(scanned())


@pytest.fixture(scope="module")
def plan(solution):
    return next_readings(solution, reachable(solution.scan, step=2.0), 12, ["width"])


def test_a_plan_beats_a_uniform_grid_of_its_size(plan):
    assert plan.directions.sizes["direction"] == 12
    assert plan.after["width"] < 0.9 * plan.uniform["width"] < plan.now["width"]
    assert 0.95 < plan.efficiency <= 1
    assert plan.guarded[0] in ("rho_s", "rho_d")
    assert plan.systematic == {}
    assert plan.seconds is None


def test_the_expected_uncertainty_is_what_a_fit_with_the_readings_states(solution, plan):
    """Old and new readings simulated and fitted by their stated noise: the absolute covariance is that of the plan."""
    new = plan.directions
    extra = [
        scanned((float(i),), noise=0.02, seed=5 + k)
        .isel(direction=[0])
        .assign_coords({n: ("direction", new[n].values[[k]]) for n in ("theta_i", "theta_r", "phi")})
        for k, i in enumerate(new["theta_i"].values)
    ]
    true = np.concatenate([np.asarray(solution.brdf(one)) for one in extra])
    more = make_scan(new["theta_i"].values, new["theta_r"].values, true, new["phi"].values, uncertainty=0.02 * true)
    old = solution.scan.assign(brdf=("direction", solution.brdf(solution.scan), {"units": "sr-1"}))
    both = join({"old": old, "new": more}).drop_vars("scan")
    again = fit(Problem(GGX, both, held=HELD, weighting="uncertainty"), covariance="absolute")
    for name, expected in plan.after.items():
        assert again.uncertainties[name] == pytest.approx(expected, rel=0.05)  # the noise of the old ones is about 2 %


def test_noise_is_read_from_what_a_scan_states_or_from_its_residuals():
    both = simulate(GGX, VALUES, [20.0, 50.0], np.arange(-80, 81, 1.0), noise=0.03, offset_noise=0.002, seed=3)
    for scan, exact in ((both, 0.02), (both.drop_vars("uncertainty"), 0.25)):  # 322 residuals show it to some 5 %
        found = Known.of(fitted(scan, weighting="relative", noise_floor=0.07)).noise()
        assert found.relative == pytest.approx(0.03, rel=exact)
        assert found.constant == pytest.approx(0.002, rel=exact)


def test_noise_of_a_fit_in_logarithms_is_that_of_the_brdf():
    scan = scanned(step=2.0, noise=0.04, seed=2).drop_vars("uncertainty")
    found = Known.of(fitted(scan, weighting="log")).noise()
    assert found.relative == pytest.approx(0.04, rel=0.25)
    assert found.constant < 0.004 * float(scan["brdf"].max())


@pytest.mark.parametrize(
    ("text", "expected"), [("1%", (0.01, 0)), ("0.5", (0, 0.5)), ("1%+2", (0.01, 2)), (" 3 % + 1e-3", (0.03, 1e-3))]
)
def test_noise_as_a_person_writes_it(text, expected):
    assert Noise.parsed(text)[:2] == pytest.approx(expected)


@pytest.mark.parametrize("text", ["", "x", "1%%", "-1%", "0", "1%+2%", "1+2", "nan", "inf%", "1%+", "0%+0"])
def test_noise_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match="write a percentage of the BRDF, a constant, or both"):
        Noise.parsed(text)


def test_values_that_are_held_or_at_a_bound_are_no_aim(solution):
    directions = reachable(solution.scan, step=5.0)
    with pytest.raises(ValueError, match="index is held, so no reading makes it surer: leave it free"):
        next_readings(solution, directions, 5, ["index"])
    with pytest.raises(ValueError, match="the fit has no value 'gamma' to want; it has rho_s, rho_d"):
        next_readings(solution, directions, 5, ["gamma"])
    bound = fitted(scanned(), bounds={"width": (0.3, 1.0)})
    with pytest.raises(ValueError, match="width lies at its bound, so no reading makes it surer: give it wider bounds"):
        next_readings(bound, directions, 5, ["width"])
    found = next_readings(bound, directions, 5)
    assert found.at_bound == ("width",)
    assert "width" not in found.after


def test_grouped_weights_are_wanted_by_their_name():
    values = published["Al"].values
    scan = simulate(
        catalogue["cauchy-lorentz"],
        values,
        [30.0, 50.0],
        np.arange(-80, 81, 5.0),
        noise=0.01,
        offset_noise=1.0,
        unit="a.u.",
        blocked=5,
    )
    found = fit(Problem(catalogue["cauchy-lorentz"], scan, grouped={"ks": "theta_i"}))
    directions = reachable(found.scan, step=5.0, blocked=nearest_to_beam(found.scan))
    plan = next_readings(found, directions, 10, ["ks"])
    assert plan.wanted == ("ks[30]", "ks[50]")
    with pytest.raises(ValueError, match="ks was fitted for theta_i = 30, 50; there is none for 60"):
        next_readings(found, reachable(found.scan, [60.0]), 10, ["ks"])


def test_masked_points_are_no_information_and_no_direction():
    """The beam is blocked in the scan: no reading is asked for nearer to it than the scan's nearest in use."""
    scan = scanned(step=5.0, blocked=12)
    solution = fitted(scan)
    assert nearest_to_beam(solution.scan) == pytest.approx(15)
    directions = reachable(solution.scan, blocked=nearest_to_beam(solution.scan))
    angles = (directions[n].values for n in ("theta_i", "theta_r", "phi"))
    assert beam_angle(*angles).min() == pytest.approx(15)
    known, noise = Known.of(solution), Noise(0.02, 0.0)
    assert len(known.rows(solution.scan, noise)) == int((scan["mask"].values == 0).sum()) < scan.sizes["direction"]


def test_several_wavelengths_are_refused_with_the_remedy():
    colours = join({"a": scanned(wavelength=550.0), "b": scanned(wavelength=650.0)}).drop_vars("scan")
    joint = fitted(colours)
    with pytest.raises(ValueError, match="2 values of wavelength, and readings are planned for one: add --select wave"):
        next_readings(joint, reachable(joint.scan, step=10.0), 5)
    one = fitted(scanned(wavelength=550.0))
    assert next_readings(one, reachable(one.scan, step=10.0), 5).directions.sizes["direction"] == 5
    three = join({n: scanned(step=20.0, wavelength=w) for n, w in (("a", 500.0), ("b", 600.0), ("c", 700.0))})
    smooth = fitted(three.drop_vars("scan"), smooth={"rho_d": ("wavelength", 1e-5)})
    with pytest.raises(ValueError, match="rho_d is smooth: fit without --smooth"):
        Known.of(smooth)


def test_out_of_plane_scans_are_planned_on_their_azimuths():
    theta_i, theta_r, phi = (
        a.ravel() for a in np.meshgrid([20.0, 50.0], [10.0, 30.0, 50.0, 70.0], [0.0, 60.0, 120.0, 180.0], indexing="ij")
    )
    scan = make_scan(theta_i, theta_r, np.zeros(len(phi)), phi)
    from gonio.measured.dataset import geometry

    true = np.asarray(GGX(geometry(scan), VALUES | HELD))
    noise = np.random.default_rng(1).standard_normal(len(true))
    solution = fitted(scan.assign(brdf=("direction", true * (1 + 0.02 * noise), {"units": "sr-1"})))
    directions = reachable(solution.scan, step=5.0)
    assert set(np.unique(directions["phi"].values).tolist()) == {0.0, 60.0, 120.0, 180.0}
    assert directions["theta_r"].values.min() == 10
    plan = next_readings(solution, directions, 10, ["width"])
    assert plan.after["width"] < plan.uniform["width"]


def test_an_instrument_is_folded_in():
    """A wide detector sees the peak blurred: another design than for a single direction, and less sure."""
    wide = fitted(scanned(step=5.0), instrument=Instrument(detector_half_angle=8.0, step=2.0))
    sharp = fitted(scanned(step=5.0))
    directions, noise = reachable(sharp.scan, step=4.0), Noise(0.0, 0.002)
    blurred, clear = (next_readings(s, directions, 8, ["width"], noise=noise) for s in (wide, sharp))
    assert blurred.after["width"] > 1.02 * clear.after["width"]


def test_a_systematic_part_is_said_where_the_scan_states_one():
    scan = scanned()
    stated = scan.assign(uncertainty_systematic=("direction", 0.05 * scan["brdf"].values, {"units": "sr-1"}))
    solution = fitted(stated)
    plan = next_readings(solution, reachable(solution.scan, step=5.0), 5, ["rho_s"])
    assert plan.systematic == {"rho_s": pytest.approx(solution.parameters()["rho_s"]["uncertainty_systematic"])}


def test_a_fifth_of_all_readings_stands_on_a_grid():
    """A pilot of few readings: what it lacks of a fifth is added evenly, whatever the model says."""
    pilot = fitted(scanned((30.0,), step=20.0), held=HELD)
    directions = reachable(pilot.scan, step=1.0)
    plan = next_readings(pilot, directions, 60, ["width"])
    grid = {-70.0, 70.0}  # 67 readings: 14 on a grid, 8 of the pilot, 6 new ones from end to end
    assert grid <= set(signed_theta_r(plan.directions).tolist())
    assert len(np.unique(signed_theta_r(plan.directions))) == 60


def test_the_order_goes_along_the_arm_and_back():
    scan = make_scan([20, 20, 50, 50, 50], [40, -10, 30, -20, 5], np.ones(5))
    ordered = scan.isel(direction=in_order(scan))
    assert signed_theta_r(ordered).tolist() == [-10, 40, 30, 5, -20]
    cost = Cost(read=2.0, arm=0.5, table=60.0)
    assert cost.seconds(ordered) == 5 * 2 + 0.5 * (50 + 10 + 25 + 25) + 2 * 60
    with pytest.raises(ValueError, match="--cost has no 'dwell': give seconds for read, arm, table"):
        Cost.given({"dwell": 1.0})
    with pytest.raises(ValueError, match="give seconds of 0 or more"):
        Cost.given({"arm": -1.0})


def test_a_dear_table_leaves_incidence_angles_out(solution):
    directions = reachable(solution.scan, step=5.0)
    cheap = next_readings(solution, directions, 8, cost=Cost(read=1.0))
    dear = next_readings(solution, directions, 8, cost=Cost(read=1.0, table=500.0))
    assert cheap.left_out == ()
    assert len(dear.left_out) == 1
    assert len(np.unique(dear.directions["theta_i"].values)) == 1
    assert dear.seconds == 8 + 500


def test_values_that_no_direction_determines_are_named():
    scan = simulate(catalogue["lambert"], {"rho": 0.5}, [20.0], np.arange(-60, 61, 10.0), noise=0.01)
    solution = fit(Problem(catalogue["torrance-sparrow"], scan))
    inside = Known.of(solution).names
    if len(inside) == 1:
        pytest.skip("the fit put every other value at its bound")
    with pytest.raises(ValueError, match="no reading within the ranges determines"):
        next_readings(solution, reachable(solution.scan, step=10.0), 5)


@pytest.mark.parametrize("text", ["", "10", "80:-80", "-91:0", "a:b", "1..2:5", "0:91"])
def test_a_range_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match="is not a range from -90 to 90 deg: write -80:80"):
        parsed_range(text)


def test_too_many_directions_are_refused(solution):
    with pytest.raises(ValueError, match="give a larger --every, or --theta-i"):
        reachable(solution.scan, step=0.01)


def test_a_bundled_scan_with_a_value_at_its_bound():
    solution = fit(Problem(GGX, sample("coating"), weighting="log"))
    plan = next_readings(solution, reachable(solution.scan, step=5.0), 10, ["rho_s", "index"])
    assert plan.at_bound == ("extinction",)
    assert plan.after["index"] < plan.now["index"]
