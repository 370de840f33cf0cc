"""What is handed on: values in 1/sr, in sets, with uncertainty and origin; what cannot be is refused."""

import hashlib
import math

import numpy as np
import pytest

import gonio
import gonio.exporting
from gonio.exporting.heading import heading
from gonio.exporting.subject import ONE, of_model, of_solution, points_digest

GGX = gonio.catalogue["ggx"]


@pytest.fixture(scope="module")
def fitted():
    return gonio.fit(gonio.sample("coating"), "ggx")


def test_a_model_takes_defaults_and_no_unknown_name():
    subject = of_model(GGX, {"rho_s": 0.5})
    assert subject.values == {"rho_s": 0.5, "rho_d": 0.0, "width": 0.3, "index": 1.5, "extinction": 0.0}
    with pytest.raises(ValueError, match=r"no parameter 'nope'; it has rho_s, rho_d, width"):
        of_model(GGX, {"nope": 1.0})
    with pytest.raises(ValueError, match=r"outside its bounds 0\.01 to 1: `gonio models ggx`"):
        of_model(GGX, {"rho_s": 1.0, "width": 3.0})
    with pytest.raises(ValueError, match=r"reflects nothing: give at least one weight, as in --set rho_s=0\.5"):
        of_model(GGX, {"width": 0.2})


def test_a_fit_keeps_values_and_uncertainties(fitted):
    subject = of_solution(fitted)
    assert subject.values == pytest.approx(fitted.values)
    assert subject.uncertainty("width") == pytest.approx(fitted.uncertainties["width"])
    assert subject.wavelength == 633.0
    assert subject.theta_i[0] == 10.0
    assert f"ggx fitted to {fitted.dataset.attrs['points']} points" in subject.origin


def test_the_digest_of_points_can_be_made_again(fitted):
    """By anybody who has the four columns."""
    columns = [fitted.scan[n].values.astype("<f8").tobytes() for n in ("theta_i", "theta_r", "phi", "brdf")]
    assert points_digest(fitted.scan) == hashlib.sha256(b"".join(columns)).hexdigest()


def relative(scan):
    scan = scan.copy()
    scan["brdf"] = scan["brdf"] * 7
    for name in ("brdf", "uncertainty"):
        scan[name].attrs["units"] = "a.u."
    return scan


def test_relative_data_need_a_scale(fitted):
    solution = gonio.fit(relative(gonio.sample("coating")), "ggx")
    with pytest.raises(ValueError, match=r"is relative \(a\.u\.\).*give --scale VALUE"):
        of_solution(solution)
    subject = of_solution(solution, scale=1 / 7)
    assert subject.values["rho_s"] == pytest.approx(fitted.values["rho_s"], rel=1e-3)
    assert "0.142857 1/sr for a unit" in subject.facts["scale"]
    with pytest.raises(ValueError, match=r"in 1/sr, which no --scale may change"):
        of_solution(fitted, scale=2.0)
    with pytest.raises(ValueError, match="give a positive number"):
        of_solution(solution, scale=-1.0)


LEVELS = {"R": 0.6, "G": 0.3, "B": 0.1}


@pytest.fixture(scope="module")
def by_channel():
    """A Lambertian surface in three channels."""
    theta_r = np.linspace(0, 70, 12)
    level = np.concatenate([np.full(12, rho / math.pi) for rho in LEVELS.values()])
    channel = np.repeat(list(LEVELS), 12)
    scan = gonio.scan(30.0, np.tile(theta_r, 3), level, channel=channel)
    return gonio.fit(gonio.Problem(gonio.catalogue["lambert"], scan))


def test_channels_are_sets(by_channel):
    subject = of_solution(by_channel)
    assert subject.by == "channel"
    assert {label: values["rho"] for label, values in subject.sets.items()} == pytest.approx(LEVELS)
    with pytest.raises(ValueError, match=r"has 3 sets, one for each channel.*--select channel=VALUE: B, G, R"):
        _ = subject.values
    green = of_solution(by_channel, select={"channel": "G"})
    assert green.values["rho"] == pytest.approx(0.3)
    assert green.origin.endswith("channel G")
    assert subject.one("B").values["rho"] == pytest.approx(0.1)
    with pytest.raises(ValueError, match="no channel is X; it has B, G, R"):
        of_solution(by_channel, select={"channel": "X"})
    with pytest.raises(ValueError, match="has no wavelength to select; it has channel"):
        of_solution(by_channel, select={"wavelength": "633"})


def test_one_value_for_each_incidence_is_refused():
    solution = gonio.fit(gonio.Problem(GGX, gonio.sample("coating"), grouped={"rho_d": ("theta_i",)}))
    with pytest.raises(ValueError, match=r"one value for each incidence angle.*--select theta_i=10"):
        of_solution(solution)
    at_50 = of_solution(solution, select={"theta_i": "40"})
    assert at_50.values["rho_d"] == pytest.approx(solution.values["rho_d[40]"])


def test_the_heading_says_what_a_reader_needs(fitted):
    text = "\n".join(heading(of_solution(fitted), "a file"))
    for part in (
        "written by: gonio",
        "model: ggx: GGX facets",
        "source: B. Walter",
        "https://doi.org/10.2312/EGWR/EGSR07/195-206",
        "wavelength: 633 nm",
        "the BRDF in 1/sr, without the cosine",
        "w_i to the light and w_r to the viewer",
        "SHA-256 of the fitted points",
        "data: simulated from ggx",
        "standard uncertainty",
    ):
        assert part in text
    assert max(map(len, text.splitlines())) <= 112


def test_the_heading_says_what_the_model_violates():
    model = gonio.catalogue["phong"]
    text = " ".join(heading(of_model(model, dict.fromkeys(model.weights, 0.1)), "a file"))
    for law in model.violates:
        assert f"violates {law}" in text


def test_one_set_has_one_label(fitted):
    assert list(of_solution(fitted).sets) == [ONE]


def clashing(
    g, values: float = 0.4, pre: float = 0.3, w_i: float = 0.2, inc: float = 0.1, f: float = 0.1, math: float = 1.0
):
    """A model of a user whose parameters are called as our own arguments are."""
    return (values + pre + w_i + inc + f) * math * g.cos_beta


@pytest.mark.parametrize("to", ["c", "javascript", "python", "numpy"])
def test_a_parameter_may_be_called_anything(to, tmp_path):
    """A name of the language, or of the functions that are printed, is no clash."""
    bounds = dict.fromkeys(("values", "pre", "w_i", "inc", "f", "math"), (0.0, 2.0))
    model = gonio.Model.from_function(clashing, bounds, name="int", weight="double", title='"""*/ //\n-->')
    path = tmp_path / f"x{gonio.exporting.targets()[to].suffixes[0]}"
    assert gonio.export(model, path, to=to, values={"double": 0.5}).prove().holds
