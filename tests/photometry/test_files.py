"""Bodies and passes as files: what they say, and how a wrong one is refused."""

import numpy as np
import pytest

import gonio
from gonio.files import FormatError
from gonio.photometry import from_horizon, read_facets, read_pass

BODY = """[[facet]]
name = "a"
area = 2
normal = [0, 0, -1]
model = "lambert"
values = {rho = 0.3}
"""
HORIZON = "time,sun_altitude_deg,sun_azimuth_deg,altitude_deg,azimuth_deg,height_km\nt1,-15,250,40,100,550\n"


def body(tmp_path, text):
    path = tmp_path / "body.toml"
    path.write_text(text, encoding="utf-8")
    return read_facets(path, gonio.catalogue)


def table(tmp_path, text):
    path = tmp_path / "pass.csv"
    path.write_text(text, encoding="utf-8")
    return read_pass(path)


def test_a_body_of_models_and_fits(tmp_path):
    scan = gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.2}, [10.0, 40.0], np.arange(-60, 61, 20.0), noise=0.01)
    solution = gonio.fitting.fit(gonio.Problem(gonio.catalogue["lambert"], scan))
    (tmp_path / "fits").mkdir()
    solution.save(tmp_path / "fits" / "one.nc")
    fitted = '[[facet]]\narea = 1.5\nnormal = [0, 1, 0]\nalong = [1, 0, 0]\nfit = "fits/one.nc"\n'
    first, second, third = body(tmp_path, BODY + fitted + fitted)
    assert (first.name, first.area, first.normal, first.values) == ("a", 2, [0, 0, -1], {"rho": 0.3})
    assert first.brdf is gonio.catalogue["lambert"]
    assert second.solution is third.solution  # read once, so that both err together
    assert second.solution.values == solution.values
    assert second.along == [1, 0, 0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("area = 2", "", "facet 1: has no area: add it"),
        ("area = 2", "area = -2", "facet 1: facet a: its area is -2"),
        ("area = 2", 'area = "two"', "area is 'two', not a number"),
        ("area = 2", "area = true", "not a number"),
        ("area = 2", "area = nan", "its area is nan"),
        ("[0, 0, -1]", "[0, 0]", "normal is no vector"),
        ("[0, 0, -1]", '"nadir"', "normal is no vector"),
        ("lambert", "lambent", r"no model 'lambent' \(nearest: lambert"),
        ('"lambert"', "3", "no model '3'"),
        ("{rho = 0.3}", "{rho = true}", "values has rho = 'True'"),
        ("{rho = 0.3}", "{roh = 0.3}", "no parameter 'roh'"),
        ("{rho = 0.3}", "3", "values is no table"),
        ("model =", "modell =", r"has 'modell', which no facet has \(nearest: model"),
        ('model = "lambert"\nvalues = {rho = 0.3}', 'fit = "gone.nc"', "there is no such file"),
        ('model = "lambert"', 'model = "lambert"\nfit = "x.nc"', "either fit"),
        ('model = "lambert"\nvalues = {rho = 0.3}', "", "either fit"),
        ("[[facet]]", "[facet]", r"no \[\[facet\]\] table"),
        ("[[facet]]", "[[face]]", r"states face|no \[\[facet\]\]"),
        ("area = 2", "area = = 2", "is no TOML"),
    ],
)
def test_a_wrong_body_is_refused(tmp_path, old, new, message):
    assert old in BODY
    with pytest.raises(FormatError, match=message):
        body(tmp_path, BODY.replace(old, new))


def test_what_an_observer_sees(tmp_path):
    text = "# by hand\n" + HORIZON.replace("height_km", "height_km,magnitude_mag,id").replace("550\n", "550,5.5,7\n")
    seen = table(tmp_path, text + "t2,-16,251,50,120,550,,8\n")
    sight = from_horizon([-15, -16], [250, 251], [40, 50], [100, 120], 550e3)
    assert np.array_equal(seen.sun, sight.sun)
    assert np.allclose(seen.observer, sight.observer)
    assert np.allclose(seen.position, sight.position)
    assert seen.altitude.tolist() == [40, 50]
    assert seen.time == ["t1", "t2"]
    assert seen.measured[0] == 5.5
    assert np.isnan(seen.measured[1])
    assert seen.unused == ("id",)


def test_vectors_and_angles(tmp_path):
    seen = table(tmp_path, "sun_x,sun_y,sun_z,observer_x_km,observer_y_km,observer_z_km\n0,0,1,0,0,500\n")
    assert (seen.sun.tolist(), seen.observer.tolist()) == ([[0, 0, 1]], [[0, 0, 5e5]])
    assert seen.position is None
    assert seen.altitude is None
    assert seen.time == ["1"]
    seen = table(tmp_path, "theta_i_deg,theta_r_deg,phi_deg,distance_m\n30,60,180,700000\n")
    assert seen.sun[0] == pytest.approx([0.5, 0, np.sqrt(0.75)])
    assert seen.observer[0] == pytest.approx([-7e5 * np.sqrt(0.75), 0, 3.5e5], abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("-15", "low", "line 2.*sun_altitude_deg is 'low', not a finite number"),
        ("-15", "nan", "line 2.*not a finite number"),
        ("height_km", "height", "has no column height_m"),
        ("height_km", "height_m", None),
        ("height_km", "azimuth_deg", "two columns 'azimuth_deg'"),
        ("40", "-4", "below the horizon"),
        ("550", "0", "on the ground"),
        (",550", "", "has 5 values, and the table 6 columns"),
        ("time,", "theta_i_deg,", "line 2: theta_i_deg is 't1'"),
        ("t1,-15,250,40,100,550\n", "", "holds no rows"),
        (
            "sun_altitude_deg,sun_azimuth_deg,altitude_deg,azimuth_deg,height_km",
            "a,b,c,d,e",
            "neither sun nor observer",
        ),
    ],
)
def test_a_wrong_table_is_refused(tmp_path, old, new, message):
    assert old in HORIZON
    text = HORIZON.replace(old, new)
    if message is None:
        assert table(tmp_path, text).observer.shape == (1, 3)
        return
    with pytest.raises(FormatError, match=message):
        table(tmp_path, text)


def test_two_kinds_of_columns_are_not_mixed(tmp_path):
    with pytest.raises(FormatError, match="mixes two kinds of columns"):
        table(tmp_path, HORIZON.replace("time", "sun_x").replace("t1", "1"))


def test_lengths_in_metres_and_kilometres_are_not_both_taken(tmp_path):
    with pytest.raises(FormatError, match="height_m in m and in km: give one"):
        table(tmp_path, HORIZON.replace("height_km", "height_km,height_m").replace("550\n", "550,550000\n"))
