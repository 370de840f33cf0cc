"""Readings through polarisers: what Mueller models make of them, and what scalar models are shown."""

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, compare, fit, fit_many, simulate
from gonio.measured.dataset import make_scan
from gonio.measured.instrument import Instrument
from gonio.measured.polarisers import analysed, states, unpolarised

MODEL = catalogue["priest-mueller"]
TRUTH = {"ks": 0.6, "kd": 0.02, "sigma": 0.2, "index": 1.5, "extinction": 0.0}
THETA_I, THETA_R = [20.0, 40.0, 60.0], np.arange(-75.0, 76, 5)


def readings(labels, noise=0.0, seed=0, theta_i=THETA_I):
    """A simulated scan of MODEL, each direction once in every state of `labels`."""
    incidence, reflection, label = (a.ravel() for a in np.meshgrid(theta_i, THETA_R, labels, indexing="ij"))
    empty = make_scan(incidence, reflection, np.zeros(len(label)), coordinates={"polarisation": label.astype(str)})
    from gonio.measured.instrument import Acceptance

    true = Acceptance.of(Instrument(), empty).brdf(MODEL, TRUTH)
    spread = noise * np.abs(true) + 1e-9
    measured = true + spread * np.random.default_rng(seed).standard_normal(len(true))
    return empty.assign(
        brdf=("direction", measured, {"units": "sr-1"}), uncertainty=("direction", spread, {"units": "sr-1"})
    )


@pytest.mark.parametrize(
    ("label", "pair"),
    [
        ("s", ("s", "u")),
        ("S>p", ("s", "p")),
        (">p", ("u", "p")),
        ("", ("u", "u")),
        ("TE", ("s", "u")),
        ("u>u", ("u", "u")),
    ],
)
def test_a_label_names_the_light_and_the_analyser(label, pair):
    assert states(label) == pair


@pytest.mark.parametrize("label", ["diagonal", "s>q", "1 2 0 0", "2 0 0 0", "1 0 0"])
def test_a_label_that_is_none_is_refused_with_those_that_are(label):
    with pytest.raises(ValueError, match="write s, p or u"):
        states(label)


def test_readings_add_as_light_does():
    """f_s>s + f_s>p = f_s; f_u>s + f_u>p = f_u = (f_s + f_p)/2, the element 00 of the Mueller matrix."""
    labels = ["s>s", "s>p", "p>s", "p>p", "s", "p", "u", ">s", ">p"]
    value = dict(zip(labels, readings(labels)["brdf"].values.reshape(-1, len(labels)).T, strict=True))
    for one, other, both in (("s>s", "s>p", "s"), ("p>s", "p>p", "p"), (">s", ">p", "u")):
        np.testing.assert_allclose(value[one] + value[other], value[both], atol=1e-8)  # of noise 1e-9
    np.testing.assert_allclose((value["s"] + value["p"]) / 2, value["u"], atol=1e-8)


def test_s_and_p_of_specular_light_are_fresnels():
    """At the mirror direction f_s/f_p is R_s/R_p of the facet, whose normal is the surface's."""
    from gonio.optics.fresnel import reflectances

    empty = make_scan([60.0] * 2, [60.0] * 2, np.ones(2), coordinates={"polarisation": ["s", "p"]})
    from gonio.measured.instrument import Acceptance

    f_s, f_p = Acceptance.of(Instrument(), empty).brdf(MODEL, TRUTH | {"kd": 0.0})
    r_s, r_p, *_ = reflectances(np.array(0.5), 1.5, 0.0)
    assert f_s / f_p == pytest.approx(float(r_s / r_p), rel=1e-9)


@pytest.mark.parametrize("labels", [["s", "p"], [">s", ">p"], ["s>s", "s>p", "p>p"]])
def test_an_index_comes_back_from_polarised_readings(labels):
    scan = readings(labels, noise=0.02, seed=3)
    solution = fit(Problem(MODEL, scan, held={"extinction": 0.0}, weighting="uncertainty"))
    away = (solution.values["index"] - 1.5) / solution.uncertainties["index"]
    assert abs(away) < 2, f"{away:.1f} standard uncertainties away"
    mean = unpolarised(readings(["s", "p"], 0.02, 3))
    alone = fit(Problem(MODEL, mean, held={"extinction": 0.0}, weighting="uncertainty"))
    assert solution.uncertainties["index"] < alone.uncertainties["index"]  # which trades off with ks there


def test_the_instrument_is_folded_in_too():
    scan = readings(["s", "p"])
    wide = fit(Problem(MODEL, scan, instrument=Instrument(detector_half_angle=0.5), held={"extinction": 0.0}))
    assert wide.values["index"] == pytest.approx(1.5, abs=0.02)  # half a degree is small against the lobe


def test_a_scalar_model_is_shown_the_mean_which_is_said():
    scan = readings(["s", "p"], noise=0.02, seed=1)
    problem = Problem(catalogue["ggx"], scan)
    directions = len(THETA_I) * len(THETA_R)
    assert len(problem.measured) == directions
    assert f"s, p combined to unpolarised light at {directions} directions" in problem.data.attrs["history"]
    s, p = scan["brdf"].values.reshape(-1, 2).T
    np.testing.assert_allclose(np.sort(problem.measured), np.sort((s + p) / 2))
    u_s, u_p = scan["uncertainty"].values.reshape(-1, 2).T
    np.testing.assert_allclose(
        np.sort(problem.points["uncertainty"].values), np.sort(np.hypot(u_s, u_p) / 2), rtol=1e-12
    )


def test_a_systematic_cause_shifts_the_mean_as_it_shifts_each():
    scan = readings(["s", "p"])
    scan["uncertainty_systematic"] = ("direction", 0.01 * scan["brdf"].values, {"units": "sr-1"})
    mean = unpolarised(scan)
    np.testing.assert_allclose(mean["uncertainty_systematic"], 0.01 * mean["brdf"], rtol=1e-12)


def test_one_state_alone_is_taken_as_it_is_and_said_once():
    scan = readings(["s"])
    line = "polarisation s alone: taken as if the light were unpolarised"
    problem = Problem(catalogue["ggx"], scan)
    assert problem.data.attrs["history"].splitlines().count(line) == 1
    again = Problem(catalogue["ggx"], problem.data)
    assert again.data.attrs["history"].splitlines().count(line) == 1


def test_a_word_of_the_laboratorys_own_is_no_matter_for_a_model_without_polarisation():
    scan = readings(["s"])
    scan = scan.assign_coords(polarisation=("direction", np.full(scan.sizes["direction"], "diagonal")))
    problem = Problem(catalogue["ggx"], scan)
    assert "polarisation diagonal alone: taken as if the light were unpolarised" in problem.data.attrs["history"]
    with pytest.raises(ValueError, match="write s, p or u"):
        Problem(MODEL, scan)
    unknown = scan.assign_coords(polarisation=("direction", np.full(scan.sizes["direction"], "unknown")))
    assert Problem(catalogue["ggx"], unknown).data is unknown
    assert len(Problem(MODEL, unknown).measured) == scan.sizes["direction"]


def test_directions_that_lack_a_state_are_left_out_with_a_word():
    scan = readings(["s", "p"]).isel(direction=slice(0, -3))  # the last p, and both before it
    mean = unpolarised(scan)
    assert mean.sizes["direction"] == len(THETA_I) * len(THETA_R) - 2
    assert "1 left out, which lack one of them" in mean.attrs["history"]


def test_repeats_are_averaged_and_wavelengths_kept_apart():
    one = readings(["s", "p"])
    blue, red = (
        one.assign_coords(wavelength=("direction", np.full(one.sizes["direction"], w))) for w in (450.0, 650.0)
    )
    both = xr.concat([blue, blue, red], dim="direction")
    mean = unpolarised(both)
    for wavelength in (450.0, 650.0):
        part = mean.isel(direction=np.flatnonzero(mean["wavelength"].values == wavelength))
        np.testing.assert_allclose(np.sort(part["brdf"].values), np.sort(unpolarised(one)["brdf"].values), rtol=1e-12)


def test_unpolarised_light_needs_no_mean():
    scan = simulate(catalogue["ggx"], {"rho_s": 1.0}, [30.0], THETA_R)
    assert unpolarised(scan) is scan
    assert analysed(scan) is None


def test_all_models_of_a_ranking_see_the_same_points():
    rows = compare(readings(["s", "p"], noise=0.02), [MODEL, catalogue["ggx"]])
    counts = [row.solution.scan.sizes["direction"] for row in rows]
    assert counts == [len(THETA_I) * len(THETA_R)] * 2


def test_many_scans_refuse_polarisers_that_are_no_lanes():
    pytest.importorskip("jax", reason="the extra `batch` is not installed")
    scan = readings(["s", "p"])
    stack = xr.concat([scan, scan], dim="sample", coords="minimal", compat="override")
    with pytest.raises(ValueError, match="readings through polarisers are for fits of one scan"):
        fit_many(Problem(MODEL, scan), stack)
    with pytest.raises(ValueError, match="readings through polarisers are for fits of one scan"):
        fit_many(Problem(catalogue["lambert"], scan), stack)
