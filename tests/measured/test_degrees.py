"""Degrees of linear polarisation: made of readings with their uncertainty, kept in files, fitted by Mueller models."""

import numpy as np
import pytest

from gonio import Problem, catalogue, compare, convert, join, read, simulate, write
from gonio import fit as answer
from gonio.files import FormatError
from gonio.findings import check
from gonio.fitting import Solution
from gonio.fitting.fitting import fit
from gonio.measured import dataset
from gonio.measured.causes import causes, with_causes
from gonio.measured.dataset import make_scan
from gonio.measured.instrument import Instrument
from gonio.measured.polarimetry.degree import dolp, labelled
from gonio.measured.polarisers import unpolarised

MODEL = catalogue["priest-mueller"]
GLASS = {"ks": 0.6, "kd": 0.02, "sigma": 0.2, "index": 1.5, "extinction": 0.0}
METAL = {"ks": 0.6, "kd": 0.02, "sigma": 0.2, "index": 2.0, "extinction": 2.5}
THETA_I, THETA_R = [20.0, 40.0, 60.0], np.arange(-70.0, 71, 10)


def scan_of(values, states, noise=0.0, seed=0, **given):
    return simulate(MODEL, values, THETA_I, THETA_R, noise=noise, seed=seed, polarisation=states, **given)


@pytest.mark.parametrize(
    ("states", "label"),
    [
        (("s", "p"), "q/i"),
        ((">s", ">p"), ">q/i"),
        (("s>s", "s>p"), "s>q/i"),
        (("s>s", "s>p", "p>s", "p>p"), ">q/i"),
        ((">s", ">p", ">1 0 1 0"), ">dolp"),
        ((">s", ">p", "> 1.0 0 1 0", ">1 0 -1 0"), ">dolp"),
    ],
)
def test_a_degree_of_readings_is_that_of_the_model(states, label):
    """Without noise the ratio of readings is what a model of the same label gives, whatever the readings were."""
    made = dolp(scan_of(METAL, states))
    assert set(made["polarisation"].values.tolist()) == {label}
    assert dataset.unit(made) == "1"
    model = scan_of(METAL, label)
    np.testing.assert_allclose(made["brdf"].values, model["brdf"].values, atol=1e-12)


def test_in_plane_the_degree_is_fresnels_at_the_mirror_direction():
    """(R_s - R_p)/(R_s + R_p) of the facet, where nothing is diffuse."""
    from gonio.optics.fresnel import reflectances

    r_s, r_p, *_ = reflectances(np.array(np.cos(np.radians(50.0))), 1.5, 0.0)
    seen = simulate(MODEL, GLASS | {"kd": 0.0}, [50.0], [50.0], polarisation=(">s", ">p"))
    assert dolp(seen)["brdf"].values == pytest.approx([float((r_s - r_p) / (r_s + r_p))], rel=1e-9)


@pytest.mark.parametrize("states", [("s", "p"), (">s", ">p", ">1 0 1 0")])
def test_its_uncertainty_is_the_scatter_of_repeated_measurements(states):
    """120 runs: the scatter of one is known to 6.5 %, the largest of 45 to 4 standard deviations of that, 26 %."""
    true = scan_of(GLASS, states, noise=0.02)
    rng = np.random.default_rng(1)
    exact = scan_of(GLASS, states)["brdf"].values
    runs = []
    for _ in range(120):
        noisy = exact + true["uncertainty"].values * rng.standard_normal(len(exact))
        runs.append(dolp(true.assign(brdf=("direction", noisy, true["brdf"].attrs)))["brdf"].values)
    stated = dolp(true.assign(brdf=("direction", exact, true["brdf"].attrs)))["uncertainty"].values
    above = np.abs(dolp(scan_of(GLASS, states))["brdf"].values) > 5 * stated  # where a root is no bias
    np.testing.assert_allclose(np.std(runs, axis=0)[above], stated[above], rtol=0.26)


def test_a_scale_that_all_readings_share_leaves_it_as_it_is_and_an_error_of_one_state_does_not():
    scan = scan_of(GLASS, ("s", "p"))
    of_s = np.where(scan["polarisation"].values == "s", 0.01, 0.0)
    scan = with_causes(scan, {"scale": 0.05 * scan["brdf"].values, "polariser": of_s * scan["brdf"].values})
    shift = causes(dolp(scan))
    np.testing.assert_allclose(shift["scale"], 0.0, atol=1e-15)
    s = scan["brdf"].values.reshape(-1, 2)
    s, p = (s[:, 0], s[:, 1]) if scan["polarisation"].values[0] == "s" else (s[:, 1], s[:, 0])
    exact = (1.01 * s - p) / (1.01 * s + p) - (s - p) / (s + p)
    np.testing.assert_allclose(shift["polariser"], exact, rtol=0.011)  # to first order in 1 %


@pytest.mark.parametrize("truth", [GLASS, METAL])
@pytest.mark.parametrize("label", ["q/i", ">dolp"])
def test_index_and_extinction_come_back_from_a_degree(truth, label):
    scan = scan_of(truth, label, offset_noise=0.005, seed=4)
    held = {"extinction": 0.0} if truth is GLASS else {}
    solution = fit(Problem(MODEL, labelled(abs_of(scan, label)), held=held, weighting="uncertainty"))
    names = ("index", "sigma") if held else ("index", "extinction", "sigma")
    away = {n: (solution.values[n] - truth[n]) / solution.uncertainties[n] for n in names}
    away["kd"] = (solution.values["kd"] - truth["kd"] / truth["ks"]) / solution.uncertainties["kd"]
    assert max(map(abs, away.values())) < 2.5, away  # of four values, once in 20 such tests
    assert solution.values["ks"] == 1.0
    assert solution.model is MODEL


def abs_of(scan, label):
    """A polarimeter's degree without a sign is never below zero."""
    return scan.assign(brdf=abs(scan["brdf"]).assign_attrs(scan["brdf"].attrs)) if label == ">dolp" else scan


def test_relative_readings_give_the_same_degree():
    scan = scan_of(GLASS, ("s", "p"), noise=0.02, seed=3)
    relative = scan.assign(brdf=(scan["brdf"] * 7.3).assign_attrs(units="a.u."))
    np.testing.assert_allclose(dolp(relative)["brdf"].values, dolp(scan)["brdf"].values, rtol=1e-12)


def test_an_instrument_reads_the_ratio_of_means():
    """Not the mean of ratios: both parts are averaged over the cones."""
    wide = Instrument(detector_half_angle=5.0, step=1.0)
    readings = dolp(scan_of(GLASS, (">s", ">p"), instrument=wide))
    np.testing.assert_allclose(scan_of(GLASS, ">q/i", instrument=wide)["brdf"], readings["brdf"], atol=1e-12)
    narrow = scan_of(GLASS, ">q/i")
    assert np.abs(narrow["brdf"].values - readings["brdf"].values).max() > 1e-3
    problem = Problem(MODEL, readings, instrument=Instrument(detector_half_angle=5.0, step=0.5))
    vector = np.array([GLASS[n] / (GLASS["ks"] if n == "kd" else 1.0) for n in problem.names])
    np.testing.assert_allclose(problem.brdf(vector), readings["brdf"].values, atol=1e-6)


def test_states_share_the_weights_of_a_mueller_model():
    """The ratio of s to p is what the index says: weights of their own for s and p would take it away."""
    scan = scan_of(GLASS, ("s", "p"))
    assert Problem(MODEL, scan).names == ("ks", "kd", "sigma", "index", "extinction")
    apart = Problem(MODEL, scan, grouped={"ks": "polarisation"})
    assert "ks[p]" in apart.names
    colours = [
        scan.assign_coords(wavelength=("direction", np.full(scan.sizes["direction"], w))) for w in (450.0, 650.0)
    ]
    both = join({"a": colours[0], "b": colours[1]}).drop_vars("scan")
    assert Problem(MODEL, both).names[:4] == ("ks[450]", "ks[650]", "kd[450]", "kd[650]")
    assert Problem(MODEL, dolp(both)).names[:2] == ("kd[450]", "kd[650]")  # a share of each colour


def test_a_model_without_polarisation_refuses_in_one_line():
    scan = scan_of(GLASS, ">q/i")
    for fitted in (lambda: Problem(catalogue["ggx"], scan), lambda: compare(scan, [catalogue["lambert"]])):
        with pytest.raises(ValueError, match=r"knows no polarisation, .*: take a model with a Mueller matrix, such as"):
            fitted()


def test_the_scale_is_no_value_of_a_fit():
    scan = scan_of(GLASS, ">q/i")
    with pytest.raises(ValueError, match="ks cannot be grouped: a degree of polarisation has no scale"):
        Problem(MODEL, scan, grouped={"ks": "theta_i"})
    with pytest.raises(ValueError, match="ks is held at 0: then no light is polarised"):
        Problem(MODEL, scan, held={"ks": 0.0})


def test_the_answer_tries_the_models_that_know_polarisation(tmp_path):
    """And what is saved is read again as the fit it was, with its scan."""
    found = answer(scan_of(GLASS, ">q/i", offset_noise=0.01, seed=1), [MODEL])
    found.save(tmp_path / "fit.nc")
    again = Solution.load(tmp_path / "fit.nc")
    assert again.unit == "1"
    np.testing.assert_allclose(again.brdf(again.scan), found.brdf(found.scan), rtol=1e-12)
    predicted = again.predict(make_scan([30.0], [30.0], [0.0], unit="1"))
    assert predicted.attrs["long_name"] == "degree of polarisation of priest-mueller"
    exact = simulate(MODEL, again.values, [30.0], [30.0], polarisation=">q/i")["brdf"].values
    np.testing.assert_allclose(predicted.values, exact, rtol=1e-12)


@pytest.mark.parametrize("suffix", [".csv", ".nc"])
def test_files_keep_it_with_its_uncertainty(tmp_path, suffix):
    scan = dolp(scan_of(GLASS, (">s", ">p"), noise=0.02))
    write(with_causes(scan, {"polariser": 0.01 * scan["brdf"].values}), tmp_path / f"a{suffix}")
    again = read(tmp_path / f"a{suffix}")
    for name in ("brdf", "uncertainty", "polarisation", "uncertainty_systematic"):
        np.testing.assert_array_equal(again[name].values, read(tmp_path / f"a{suffix}")[name].values)
    np.testing.assert_allclose(again["brdf"].values, scan["brdf"].values, rtol=1e-12)
    assert dataset.is_degree(again)
    with pytest.raises(ValueError, match=r"the data are degrees of polarisation, and .* cannot say so: write"):
        convert(scan, tmp_path / "a.astm", to="astm")


HEADINGS = {
    "theta_i_deg,theta_r_deg,dolp": (0.3, None),
    "theta_i_deg,theta_r_deg,DoLP,uncertainty": (0.3, 0.02),
    "theta_i_deg,theta_r_deg,dolp,dolp_std": (0.3, 0.02),
    "theta_i [deg],theta_r [deg],DoLP": (0.3, None),
    "theta_i [deg],theta_r [deg],DoLP [%],u(DoLP)": (0.003, 0.0002),
    "theta_i [deg],theta_r [deg],degree of linear polarization [%]": (0.003, None),
}


@pytest.mark.parametrize(("heading", "expected"), HEADINGS.items())
def test_a_table_with_a_column_of_degrees(tmp_path, heading, expected):
    more = ",0.02" if heading.count(",") == 3 else ""
    path = tmp_path / "a.csv"
    path.write_text(f"{heading}\n30,30,0.3{more}\n30,40,0.4{more}\n")
    scan = read(path)
    assert scan["brdf"].values[0] == pytest.approx(expected[0])
    assert dataset.is_degree(scan)
    assert set(scan["polarisation"].values.tolist()) == {">dolp"}
    if expected[1]:
        assert scan["uncertainty"].values[0] == pytest.approx(expected[1])


def test_a_sign_or_a_state_in_the_table_says_which_degree_it_is(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("theta_i_deg,theta_r_deg,dolp\n30,30,0.3\n30,40,-0.01\n")
    assert set(read(path)["polarisation"].values.tolist()) == {">q/i"}
    path.write_text("theta_i_deg,theta_r_deg,polarisation,dolp\n30,30,s,0.3\n30,40,s,0.01\n")
    assert set(read(path)["polarisation"].values.tolist()) == {"s>dolp"}
    path.write_text("theta_i_deg,theta_r_deg,polarisation,dolp\n30,30,s>p,0.3\n")
    with pytest.raises(FormatError, match="is that of a reading, and the values are degrees"):
        read(path)


def test_a_column_of_degrees_beside_a_brdf_is_kept_and_can_be_taken(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("theta_i_deg,theta_r_deg,brdf_sr-1,dolp,uncertainty_dolp\n30,30,0.1,0.3,0.02\n30,40,0.2,0.4,0.02\n")
    scan = read(path)
    assert dataset.unit(scan) == "sr-1"
    taken = dolp(scan)
    np.testing.assert_allclose(taken["brdf"].values, [0.3, 0.4])
    np.testing.assert_allclose(taken["uncertainty"].values, 0.02)


@pytest.mark.parametrize("states", [(), ("s",), (">p", "s")])
def test_readings_that_give_none_are_refused_with_the_remedy(states):
    scan = scan_of(GLASS, states)
    with pytest.raises(ValueError, match="it needs readings in s and p"):
        dolp(scan)


def test_readings_and_their_ratios_are_not_mixed():
    scan = scan_of(GLASS, "s")
    mixed = scan.assign_coords(
        polarisation=("direction", np.where(np.arange(scan.sizes["direction"]) % 2, "s", ">q/i"))
    )
    with pytest.raises(ValueError, match="are readings and ratios of them in one scan"):
        Problem(MODEL, mixed)


def test_values_above_one_are_found():
    scan = scan_of(GLASS, ">q/i")
    found = check(scan.assign(brdf=(100 * scan["brdf"]).assign_attrs(units="1")))
    assert (str(found[0].severity), found[0].name) == ("error", "degree-above-one")
    assert "--divide 100" in found[0].remedy
    assert not [f for f in check(scan) if str(f.severity) != "note"]  # none of the mistakes of a BRDF


def test_directions_without_light_are_missing_with_a_word():
    scan = scan_of(GLASS, ("s", "p"))
    dark = np.where(scan["theta_r"].values == 70.0, 0.0, scan["brdf"].values)
    made = dolp(scan.assign(brdf=("direction", dark, scan["brdf"].attrs)))
    assert int(np.isnan(made["brdf"].values).sum()) == 6
    assert "6 missing, where their sum is not above zero" in made.attrs["history"]


def test_the_mean_of_masked_readings_is_masked_and_a_strict_one_refuses_what_is_lacking():
    scan = scan_of(GLASS, ("s", "p"))
    masked = scan.assign(mask=("direction", np.where(np.arange(scan.sizes["direction"]) == 0, 4, 0).astype(np.int8)))
    mean = unpolarised(masked, strict=True)
    assert mean["mask"].values.tolist() == [4, *[0] * (mean.sizes["direction"] - 1)]
    with pytest.raises(ValueError, match="the direction 20, 70, 0 is not there in each of s, p: read the other one"):
        unpolarised(scan.isel(direction=slice(1, None)), strict=True)
    with pytest.raises(ValueError, match="needs readings in s and in p; there are s"):
        unpolarised(scan_of(GLASS, "s"), strict=True)
