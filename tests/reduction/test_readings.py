"""Each step from readings to values, on numbers that are worked out by hand; and what is refused, in one line."""

import math

import numpy as np
import pytest

from gonio.files import FormatError
from gonio.measured.dataset import make_scan
from gonio.measured.polarisers import unpolarised
from gonio.raw import read_readings, reader_of
from gonio.reduction import (
    Absolute,
    Filling,
    Known,
    Reduction,
    Relative,
    budget,
    flags,
    make_readings,
    reduce,
    together,
)
from gonio.reduction.causes import CAUSES
from gonio.reduction.repeats import averaged
from gonio.reduction.steps.signature import Signature

UNDER = Reduction(fill=Filling("under"))
ONE = Relative.parsed("3.141592653589793:factor@0,0", Known(1.0))  # f = V/cos(theta_r) where the spot is seen whole
NAN = math.nan


def readings(*rows, unit="V", **columns):
    """Readings from (kind, theta_i, theta_r, signal) and further columns."""
    kind, theta_i, theta_r, signal = zip(*rows, strict=True)
    return make_readings({"kind": kind, "theta_i": theta_i, "theta_r": theta_r, "signal": signal, **columns}, unit)


def values(raw, how=ONE, **settings):
    return reduce(raw, how, Reduction(fill=Filling("under"), **settings))["brdf"].values


def sample(*signals, theta_r=0.0):
    return [("sample", 20.0, theta_r, v) for v in signals]


def dark(*signals):
    return [("dark", NAN, NAN, v) for v in signals]


def test_the_dark_is_linear_in_time_between_two_of_its_range():
    first, last = dark(0.1, 0.3)
    raw = readings(*sample(1.0), first, *sample(1.0, 1.0), last, *sample(1.0), time=[0, 10, 15, 20, 30, 40])
    # 0.1 up to 10 s, then 0.01 a second up to 0.3 at 30 s
    assert values(raw) == pytest.approx([0.9, 0.85, 0.8, 0.7])
    of_ranges = readings(*dark(0.1, 0.5), *sample(1.0, 1.0), range=["lo", "hi", "hi", "lo"])
    assert values(of_ranges) == pytest.approx([0.5, 0.9])
    lacking = readings(*dark(0.1), *sample(1.0), range=["lo", "hi"])
    with pytest.raises(ValueError, match="line 2: there is no dark of range 'hi': read one"):
        reduce(lacking, ONE, UNDER)


def test_a_background_is_that_of_the_direction_and_follows_the_flux():
    rows = [*sample(1.0), ("sample", 20.0, 60.0, 1.0), ("background", 20.0, 0.0, 0.1), ("background", 20.0, 60.0, 0.2)]
    assert values(readings(*rows)) == pytest.approx([0.9, 0.8 / 0.5])
    flux = readings(*rows, monitor=[1.0, 2.0, 0.5, 1.0])
    # 0.1 at half the flux is 0.2; 0.2 at half of 2 is 0.4; the mean flux is 9/8
    assert values(flux) == pytest.approx([0.8 * 9 / 8, 0.6 / 2 / 0.5 * 9 / 8])
    with pytest.raises(ValueError, match="line 1: there is no background at theta_i 20, theta_r 0, phi 180 deg"):
        values(readings(*sample(1.0), *[("background", 20.0, r, 0.1) for r in (10.0, 20.0)]))


def test_drift_by_the_check_direction_and_by_the_monitor():
    check = [("check", 0.0, 45.0, v) for v in (1.0, 0.8)]
    raw = readings(check[0], *sample(1.0), check[1], time=[0, 5, 10])
    assert values(raw) == pytest.approx([1 / 0.9])
    assert values(raw, drift="none") == pytest.approx([1.0])
    left = budget(reduce(raw, ONE, Reduction(fill=Filling("under"), drift="none"))).rows[-1]
    assert (left.cause, left.distribution) == ("drift", "rectangular")
    assert left.by_direction == pytest.approx([0.5 * 0.2 / math.sqrt(3)])
    with pytest.raises(ValueError, match="not every reading has one"):
        values(raw, drift="monitor")
    with pytest.raises(ValueError, match="no drift 'clock'"):
        values(raw, drift="clock")


def test_ranges_filters_and_nonlinearity():
    raw = readings(*sample(1.0, 10.0), ("standard", 0.0, 0.0, 1.0), range=["lo", "hi", "lo"], filter=["", "nd", ""])
    how = Relative(Known(1.0))
    known = {"gains": {"hi": Known(10.0, 0.05)}, "filters": {"nd": Known(0.5, 0.005)}}
    assert values(raw, how, **known) == pytest.approx([1.0, 2.0])
    found = {
        r.parts[0]: r.by_direction for r in budget(reduce(raw, how, Reduction(fill=Filling("under"), **known))).rows
    }
    assert found["gain hi"] == pytest.approx([0.0, -0.005])
    assert found["filter nd"] == pytest.approx([0.0, -0.01])
    with pytest.raises(ValueError, match=r"line 2: read behind the filter 'nd', and others are not: .*--filter nd="):
        values(raw, how, gains=known["gains"])
    with pytest.raises(ValueError, match="no reading has the range 'x'; there are hi, lo"):
        values(raw, how, gains={"x": Known(1.0)})
    assert values(readings(*sample(10.0)), nonlinearity=0.01, level=1.0) == pytest.approx([10 / 1.01])


def test_causes_that_the_user_states():
    raw = readings(*[("sample", 40.0, r, math.cos(math.radians(r))) for r in (-10.0, 0.0, 10.0)], unit="W")
    sizes = {"scale": 0.01, "wavelength": 0.002, "tilt": 0.1, "nonlinearity": 1e-3, "standard": 0.003}
    found = {
        r.cause: r.by_direction
        for r in budget(reduce(raw, ONE, Reduction(fill=Filling("under"), uncertainties=sizes))).rows
    }
    assert found["scale"] == pytest.approx([0.01] * 3)
    assert found["standard"] == pytest.approx([0.003] * 3)
    tangent = np.tan(np.radians([-10, 0, 10])) * math.radians(0.1)
    assert found["tilt"] == pytest.approx(tangent)  # f is constant: the cosine alone
    assert found["nonlinearity"] == pytest.approx(-1e-3 * np.log10(raw["signal"].values))
    for name, message in {"zerro": "no cause 'zerro': nearest: zero", "spot": "belongs to --fill beam"}.items():
        with pytest.raises(ValueError, match=message):
            values(raw, uncertainties={name: 1.0})
    with pytest.raises(ValueError, match="the uncertainty of scale is -1"):
        values(raw, uncertainties={"scale": -1.0})
    with pytest.raises(ValueError, match="has nothing to act on: radius of the aperture"):
        values(raw, uncertainties={"aperture": 0.1})


def test_each_cause_is_declared_whole():
    for name, cause in CAUSES.items():
        assert cause.name == name
        assert cause.type in ("A", "B")
        assert cause.distribution in ("normal", "rectangular")
        assert cause.help
        assert cause.shape
        assert cause.unit


def test_negative_values_are_flagged_and_kept():
    scan = reduce(readings(*dark(0.5), *sample(1.0, 0.4, 0.5)), ONE, UNDER)
    assert scan["brdf"].values == pytest.approx([0.5, -0.1, 0.0])
    (flag,) = flags(scan)
    assert (flag["flag"], flag["line"], flag["masked"]) == ("negative", 3, False)
    assert scan["mask"].values.tolist() == [0, 0, 0]
    zero = reduce(readings(*dark(0.5), *sample(0.5), sd=[0.1, 0.2]), ONE, UNDER)
    assert zero["uncertainty"].values == pytest.approx([0.2])
    assert zero["systematic"].values == pytest.approx(np.array([[-0.1]]))  # a value of zero is uncertain, too


def test_an_overload_is_flagged_and_the_last_attempt_counts():
    raw = readings(*sample(9.0, 1.0, 2.0), overload=[1, 0, 1], attempt=[0, 1, 0])
    scan = reduce(raw, ONE, UNDER)
    assert scan["brdf"].values.tolist() == [1.0, 2.0]
    assert scan["mask"].values.tolist() == [0, 4]


def test_a_zero_of_the_arm_and_a_tilt_move_the_directions():
    raw = readings(("sample", 20.0, 0.2, 1.0), ("sample", 20.0, -30.0, 1.0))
    scan = reduce(raw, ONE, Reduction(fill=Filling("under"), zero=0.5))
    assert scan["theta_r"].values == pytest.approx([0.3, 30.5])
    assert scan["phi"].values.tolist() == [0.0, 0.0]
    tilted = reduce(raw, ONE, Reduction(fill=Filling("under"), tilt=(0.5, 0.0)))
    assert tilted["theta_i"].values == pytest.approx([20.5, 20.5])
    assert tilted["theta_r"].values == pytest.approx([0.3, 30.5])


def test_the_signature_of_the_instrument_is_subtracted_and_where_it_rules_masked():
    raw = readings(("sample", 30.0, 30.0, 1.0), ("sample", 30.0, 60.0, 1.0))
    signature = Signature(np.array([-1.0, 0.0, 1.0]), np.array([0.0, 8.0, 0.0]), 0.1)
    found = reduce(raw, ONE, Reduction(fill=Filling("under"), signature=signature, uncertainties={"stray": 0.1}))
    cosine = math.cos(math.radians(30))
    assert found["brdf"].values == pytest.approx([0.2 / cosine, 2.0])
    assert found["mask"].values.tolist() == [7, 0]
    assert found["systematic"].sel(cause="stray").values == pytest.approx([0.08 / cosine, 0.0])


def test_repeats_and_polarisation():
    raw = readings(*sample(1.0, 1.2), ("sample", 20.0, 0.0, 9.0), sd=[0.01] * 3, overload=[0, 0, 1])
    mean = averaged(reduce(raw, ONE, Reduction(fill=Filling("under"), uncertainties={"scale": 0.01})))
    assert mean["brdf"].values == pytest.approx([1.1])
    assert mean["repeats"].values.tolist() == [2]
    assert mean["uncertainty"].values == pytest.approx([0.1])  # scatter 0.1414/sqrt(2), more than 0.01/sqrt(2)
    assert mean["systematic"].values == pytest.approx(np.array([[0.011]]))
    both = readings(*sample(1.0, 3.0), polarisation=["s", "p"])
    scan = reduce(both, ONE, Reduction(fill=Filling("under"), uncertainties={"polarisation": 0.02}))
    assert scan["systematic"].values[0] == pytest.approx([-0.5 * 0.02 * 1.0, -0.5 * 0.02 * 3.0])
    assert unpolarised(scan, strict=True)["brdf"].values == pytest.approx([2.0])
    with pytest.raises(ValueError, match="needs readings in s and in p; there are none"):
        unpolarised(reduce(raw, ONE, UNDER), strict=True)


def test_a_standard_that_is_known_at_each_direction():
    known = make_scan([20.0, 20.0], [0.0, 60.0], [0.30, 0.25], uncertainty=[0.003, 0.0025])
    rows = [("sample", 20.0, r, v) for r, v in ((0.0, 1.0), (60.0, 2.0))]
    raw = readings(*rows, *[("standard", 20.0, r, 4.0) for r in (0.0, 60.0)])
    scan = reduce(raw, Relative(scan=known), UNDER)
    assert scan["brdf"].values == pytest.approx([0.075, 0.125])  # direction by direction, no cosine
    assert budget(scan).rows[-1].by_direction == pytest.approx([0.01, 0.01])
    for fill in ("over", "beam:2,3"):
        assert reduce(raw, Relative(scan=known), Reduction(fill=Filling.parsed(fill)))["brdf"].values == pytest.approx(
            [0.075, 0.125]
        )
    more = [("sample", 20.0, 70.0, 1.0), ("standard", 20.0, 70.0, 1.0)]
    with pytest.raises(ValueError, match="line 3: the standard has no certificate at theta_i 20, theta_r 70"):
        reduce(readings(*rows, *more, *[("standard", 20.0, r, 4.0) for r in (0.0, 60.0)]), Relative(scan=known), UNDER)


def test_several_wavelengths_and_files_keep_their_causes_apart():
    rows = [*dark(0.1), *sample(1.0, 2.0), ("standard", 0.0, 0.0, 2.1), ("standard", 0.0, 0.0, 4.1)]
    raw = readings(*rows, wavelength=[NAN, 500, 600, 500, 600], sd=[0.01] * 5)
    scan = reduce(raw, Relative(Known(1.0)), UNDER)
    assert scan["wavelength"].values.tolist() == [500, 600]
    assert scan["brdf"].values == pytest.approx([0.9 / 2.0, 1.9 / 4.0])
    assert scan["cause"].values.tolist() == ["dark", "standard-reading"]
    two = together([scan, scan], names=["a", "b"])
    assert two["cause"].values.tolist() == ["dark of a", "standard-reading of a", "dark of b", "standard-reading of b"]
    assert (two["systematic"].sel(cause="dark of a").values[2:] == 0).all()


REFUSED = {
    "the filling is not stated": (lambda: reduce(readings(*sample(1.0)), ONE), "under where .* over where .* beam:W,R"),
    "grazing": (
        lambda: values(readings(*sample(1.0, theta_r=90.0))),
        "line 1: theta_r is 90 deg, where nothing is seen",
    ),
    "no sample": (lambda: values(readings(*dark(1.0))), "there is no reading of a sample"),
    "no standard": (lambda: values(readings(*sample(1.0)), Relative(Known(1.0))), "no reading of the standard"),
    "standard elsewhere": (
        lambda: values(readings(*sample(1.0), ("standard", 0.0, 30.0, 1.0)), Relative(Known(1.0))),
        "line 2: the standard was read at theta_i 0, theta_r 30, phi 180 deg, and has no certificate there",
    ),
    "standard twice": (
        lambda: values(readings(*sample(1.0), ("standard", 0.0, 0.0, 1.0)), ONE),
        "line 2: the standard was read, and its signal is stated",
    ),
    "dark standard": (
        lambda: values(readings(*dark(2.0), *sample(1.0), ("standard", 0.0, 0.0, 1.0)), Relative(Known(1.0))),
        "line 3: the net signal of the standard is -1, not above zero",
    ),
    "hemispherical": (
        lambda: Relative.parsed("0.99:8/d@8,0"),
        "hemispherical reflectance, which says nothing about one",
    ),
    "no certificate": (lambda: Relative.parsed("0.99"), "no certificate and no file"),
    "no incident": (
        lambda: values(readings(*sample(1.0)), Absolute(Known(1.0), Known(9.0))),
        "the incident beam is not known",
    ),
    "no share": (
        lambda: reduce(
            readings(*sample(1.0)),
            Absolute(Known(1.0), Known(9.0), incident=Known(1.0)),
            Reduction(fill=Filling("over")),
        ),
        "needs the share of the beam",
    ),
    "no distance": (lambda: Absolute.parsed("radius=3"), "--absolute says no distance"),
    "kind": (lambda: readings(("smaple", 0.0, 0.0, 1.0)), "line 1: no kind of reading 'smaple': nearest: sample"),
    "unit": (lambda: readings(*sample(1.0), unit="mV"), "the signal is in 'mV'"),
    "below": (lambda: readings(("sample", 100.0, 0.0, 1.0)), "line 1: theta_i is 100 deg, outside 0 to 90"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_reduced_is_refused_in_one_line_with_the_remedy(case):
    make, message = REFUSED[case]
    with pytest.raises(ValueError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


TABLE = (
    "# fill: under\n# instrument: bench 3\nkind;theta_i_deg;theta_r_deg;signal_W;sd_W;overload\ndark;;;1e-9;1e-11;\n"
)


def test_a_table_of_readings(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(TABLE + "sample;30;-40;2e-8;1e-10;yes\n")
    raw = read_readings(path)
    assert raw.attrs["fill"] == "under"
    assert raw["signal"].attrs["units"] == "W"
    assert raw["line"].values.tolist() == [4, 5]
    assert raw["theta_r"].values[1], raw["phi"].values[1] == (40.0, 0.0)
    assert raw["overload"].values.tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TABLE, None),
        (TABLE + "sample;30;x;1;1;\n", "line 5: theta_r is 'x', not a number"),
        (TABLE + "sample;30;1\n", "line 5: has 3 cells where the header has 6"),
        (TABLE + "smaple;30;1;1;1;\n", "line 5: no kind of reading 'smaple'"),
        (TABLE.replace("sd_W", "sd_A"), "line 3: sd_A is not in the unit of the signal, W"),
        (TABLE.replace("overload", "overlaod"), "line 3: no column 'overlaod' of readings: nearest: overload"),
        (TABLE.replace("theta_r_deg", "phi_deg"), "line 3: has no column theta_r_deg"),
    ],
)
def test_what_is_wrong_with_a_table_is_told_with_its_line(tmp_path, text, message):
    path = tmp_path / "run.csv"
    path.write_text(text)
    assert reader_of(path) is not None
    if message is None:
        assert read_readings(path).sizes["reading"] == 1
        return
    with pytest.raises(FormatError, match=r"run\.csv") as caught:
        read_readings(path)
    assert message in str(caught.value)


def test_files_of_scans_are_no_readings(tmp_path):
    path = tmp_path / "scan.csv"
    path.write_text("theta_i_deg,theta_r_deg,brdf_sr-1,signal_V\n10,0,0.3,1\n")
    assert reader_of(path) is None
    with pytest.raises(FormatError, match="holds no raw readings"):
        read_readings(path)


def test_what_a_file_states_of_the_set_up_stands_for_what_is_not_named():
    """As a journal does: without the filter's transmittance f would be a thousand times too large."""
    stated = {"aperture_radius": 4.75, "distance": 500.0, "filter_transmittance": 1e-3}
    stated |= {"filter_transmittance_uncertainty": 1e-5, "operator": "N. N."}
    found = Absolute.parsed("stated", stated)
    assert (found.radius.value, found.distance.value, found.tau.value, found.tau.uncertainty) == (4.75, 500, 1e-3, 1e-5)
    named = Absolute.parsed("stated,tau=2e-3", stated)
    assert (named.radius.value, named.tau.value) == (4.75, 2e-3)
    with pytest.raises(ValueError, match="--absolute says no radius"):
        Absolute.parsed("stated", {"distance": 500.0})
