"""Cards for stray-light programs: their numbers, the fit of another model, and what is refused."""

import math

import numpy as np
import pytest

import gonio
from gonio import Geometry, catalogue
from gonio.exporting.entry import write
from gonio.exporting.stand_in import stand_in
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets.cards import ABG_CARD, BINOMIAL_CARD, HARVEY_SHACK_CARD, evaluated, read

CARDS = {card.model: card for card in (ABG_CARD, HARVEY_SHACK_CARD, BINOMIAL_CARD)}
every_card = pytest.mark.parametrize("target", CARDS)


def exported(tmp_path, name, values, target, **options):
    return gonio.export(catalogue[name], tmp_path / "card.txt", to=target, values=values, **options)


@every_card
def test_a_lambertian_comes_back_as_half_over_pi(target, tmp_path):
    done = exported(tmp_path, "lambert", {"rho": 0.5}, target)
    (values,) = read(done.files[0].read_text(), target)
    g = Geometry.from_degrees(np.array([0.0, 40.0, 70.0]), np.array([10.0, 40.0, 80.0]), np.array([0.0, 180.0, 90.0]))
    assert evaluated(CARDS[target], values, g) == pytest.approx(0.5 / math.pi, rel=1e-11)  # of 12 printed digits
    assert done.numbers["highest_tis"] == pytest.approx(0.5, abs=1e-9)
    assert done.prove().holds


@every_card
def test_the_model_itself_is_exact(target, tmp_path):
    weight = catalogue[target].weights[0]
    done = exported(tmp_path, target, {weight: 0.01}, target)
    assert "log10_rmse" not in done.numbers
    assert done.remarks == ()
    assert done.prove().holds


def test_another_model_is_fitted_and_its_error_told(tmp_path):
    """Harvey and Shack's lobe of slope -2 is an ABg: A = b0 L^2, B = L^2, g = 2."""
    done = exported(tmp_path, "harvey-shack", {"b0": 0.5, "L": 0.1, "S": -2.0}, "abg")
    (values,) = read(done.files[0].read_text(), "abg")
    assert values == pytest.approx({"A": 0.005, "B": 0.01, "g": 2.0}, rel=1e-4)
    assert done.numbers["log10_rmse"] < 1e-5
    assert abs(done.numbers["peak_error"]) < 1e-4
    for angle in (0, 45, 75):
        assert abs(done.numbers[f"reflectance_error_{angle}"]) < 1e-4
    assert "harvey-shack is not abg" in done.remarks[0]
    assert done.prove().holds


def test_a_bad_fit_says_how_bad_it_is(tmp_path):
    values = {"rho_s": 0.8, "width": 0.2}
    done = exported(tmp_path, "ggx", values, "abg")
    (found,) = read(done.files[0].read_text(), "abg")
    mirror = Geometry.from_degrees(60.0, 60.0, 180.0)
    peak = float(evaluated(ABG_CARD, found, mirror) / catalogue["ggx"](mirror, values))
    assert done.numbers["peak_error"] < -0.5
    assert done.numbers["peak_error"] == pytest.approx(
        peak - 1, abs=0.2
    )  # the brightest direction is beyond the mirror's
    assert done.numbers["log10_rmse"] > 0.1
    assert "zemax-dll" in done.remarks[0]


def test_the_tis_is_that_of_the_scan_s_angles(tmp_path):
    subject = of_model(catalogue["abg"], {"A": 0.01, "B": 0.05, "g": 1.5}, theta_i=(10.0, 50.0), wavelength=632.8)
    text = write(subject, tmp_path / "card.txt", "abg").files[0].read_text()
    assert "wavelength_um 0.6328" in text
    assert [line.split()[0] for line in text.splitlines() if line.startswith("TIS")] == [
        "TIS_at_10_deg",
        "TIS_at_50_deg",
    ]


def test_a_tis_by_its_closed_form(tmp_path):
    """At normal incidence the TIS of A/(B + s^2) is pi A ln(1 + 1/B), in direction cosines."""
    done = exported(tmp_path, "abg", {"A": 0.03, "B": 0.01, "g": 2.0}, "abg")
    line = next(x for x in done.files[0].read_text().splitlines() if x.startswith("TIS_at_0_deg"))
    assert float(line.split()[1]) == pytest.approx(math.pi * 0.03 * math.log(101), rel=1e-3)


def test_a_tis_above_1_is_refused_where_opticstudio_refuses_it(tmp_path):
    with pytest.raises(ValueError, match="none above 1"):
        exported(tmp_path, "abg", {"A": 0.4}, "abg")
    assert not (tmp_path / "card.txt").exists()
    told = exported(tmp_path, "harvey-shack", {"b0": 50.0, "L": 0.5}, "harvey-shack").remarks
    assert "more light than it gets" in told[0]


def test_a_negative_weight_is_refused(tmp_path):
    subject = of_model(catalogue["abg"], {"A": -0.1})
    with pytest.raises(ValueError, match="A is negative"):
        write(subject, tmp_path / "card.txt", "abg")


def test_every_set_has_a_block(tmp_path):
    model = catalogue["abg"]
    sets = {nm: {"A": a, "B": 0.01, "g": 2.0} for nm, a in (("532.0", 0.01), ("633.0", 0.02))}
    done = write(Subject(model, sets, by="wavelength"), tmp_path / "card.txt", "abg", "coating")
    text = done.files[0].read_text()
    assert [v["A"] for v in read(text, "abg")] == [0.01, 0.02]
    assert "name coating_532_0\n" in text
    assert "wavelength_um 0.532" in text
    assert done.prove().holds


def test_a_wrong_number_is_found(tmp_path):
    done = exported(tmp_path, "abg", {"A": 0.01}, "abg")
    path = done.files[0]
    path.write_text(path.read_text().replace("\nA 0.01", "\nA 0.0100001"))
    with pytest.raises(ValueError, match="differs from the model"):
        done.prove()


def test_a_stand_in_of_nothing_is_refused():
    subject = Subject(
        catalogue["ggx"], {"": dict.fromkeys(catalogue["ggx"].parameters, 0.0) | {"width": 0.3, "index": 1.5}}
    )
    with pytest.raises(ValueError, match="reflects nothing"):
        stand_in(subject, catalogue["abg"], ABG_CARD.level)


def test_text_from_outside_stays_in_the_comment(tmp_path):
    subject = of_model(catalogue["lambert"], {"rho": 0.5}, origin="a\nA 7\n")
    text = write(subject, tmp_path / "card.txt", "abg").files[0].read_text()
    assert all(line.startswith("#") for line in text.splitlines() if "A 7" in line)


@pytest.mark.parametrize("target", ["tracepro", "asap", "code-v"])
def test_programs_without_a_public_grammar_are_refused_with_what_to_do(target, tmp_path):
    with pytest.raises(ValueError, match=r"--to .*(abg|harvey-shack)"):
        gonio.export(catalogue["lambert"], tmp_path / "x.txt", to=target, values={"rho": 0.5})
