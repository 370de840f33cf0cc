"""What `check` finds, what `mask` hides, and that nothing is lost."""

import numpy as np
import pytest

from gonio import check, read
from gonio.measured.check import Severity
from gonio.measured.dataset import flatten, join, make_scan, points, select, sets, signed_theta_r
from gonio.measured.masking import mask


def scan(**changes):
    columns = {"theta_i": [10, 10, 30, 30], "theta_r": [-20, 10, 30, -30], "brdf": [1.0, 2.0, 3.0, 4.0]} | changes
    return make_scan(**columns)


def found(data):
    return {(f.severity, f.what.split(" at ")[0]) for f in check(data)}


def test_nothing_wrong():
    assert check(scan()) == []


@pytest.mark.parametrize(
    ("changes", "severity", "what"),
    [
        ({"theta_i": [10, 10, 95, 30]}, Severity.ERROR, "theta_i outside the hemisphere, 0 to 90 deg,"),
        ({"brdf": [0.0] * 4}, Severity.ERROR, "every brdf value is zero"),
        ({"brdf": [np.nan] * 4}, Severity.ERROR, "no value is in use"),
        ({"brdf": [1.0, np.inf, 1, 1]}, Severity.ERROR, "brdf is infinite"),
        ({"brdf": [1.0, -1, 1, 1]}, Severity.WARNING, "brdf is negative"),
        ({"brdf": [1.0, np.nan, 1, 1]}, Severity.NOTE, "1 values are missing (NaN)"),
        ({"theta_i": [10] * 4}, Severity.WARNING, "one incidence angle only, 10 deg"),
        ({"uncertainty": [0.1, 0, 0.1, 0.1]}, Severity.NOTE, "no uncertainty is stated"),
        ({"theta_r": [-20, 10, 30, 30]}, Severity.WARNING, "2 values share their geometry with another"),
    ],
)
def test_findings(changes, severity, what):
    assert (severity, what) in found(scan(**changes))


def test_missing_pieces_and_units():
    data = scan()
    assert found(data.drop_vars("phi")) == {(Severity.ERROR, "no phi in the Dataset")}
    data["brdf"].attrs["units"] = "cd"
    data["theta_i"].attrs["units"] = "rad"
    assert found(data) == {(Severity.ERROR, "brdf is in 'cd'"), (Severity.ERROR, "theta_i is in 'rad'")}


def test_findings_name_the_lines_of_the_file(tmp_path):
    path = tmp_path / "scan.csv"
    rows = "".join(f"30,{t},{-1 if t < 8 else 1}\n" for t in range(12))
    path.write_text(f"# one\n# two\ntheta_i_deg,theta_r_deg,brdf_sr-1\n{rows}20,10,1\n")
    (finding,) = check(read(path))
    assert finding.where == "lines 4, 5, 6, 7, 8 and 3 more"
    without_lines = check(read(path).drop_vars("line"))
    assert without_lines[0].where.startswith("theta_i 30, theta_r 0, phi 180 deg")


def test_angles_that_may_be_radians_are_asked_about():
    angles = np.linspace(0.05, 1.5, 12)
    small = make_scan(np.repeat([0.2, 0.5], 12), np.tile(angles, 2), np.full(24, 0.1), np.zeros(24))
    assert any("no polar angle is above" in f.what and "theta_i_rad" in f.remedy for f in check(small))
    degrees = small.assign_coords(theta_i=small["theta_i"] * 57.3)
    assert not any(
        "no polar angle" in f.what
        for f in check(degrees.assign_coords(theta_i=degrees["theta_i"].assign_attrs(units="degree")))
    )


def test_a_column_that_is_nearly_one_of_gonios_is_asked_about():
    data = make_scan([10.0, 30.0], [20.0, 20.0], [0.1, 0.2], variables={"uncertanty": ([0.1, 0.1], "sr-1")})
    told = [f for f in check(data) if "uncertanty" in f.what]
    assert [f.severity for f in told] == [Severity.WARNING]
    assert "rename it to uncertainty" in told[0].remedy
    harmless = make_scan([10.0, 30.0], [20.0, 20.0], [0.1, 0.2], variables={"temperature": ([20.0, 21.0], "1")})
    assert not any("temperature" in f.what for f in check(harmless))


def test_mask_keeps_the_values():
    masked = mask(scan(), blocked=5.0, floor=1.5)
    assert masked["mask"].values.tolist() == [2, 0, 0, 1]
    assert masked["brdf"].values.tolist() == [1, 2, 3, 4]
    assert points(masked)["brdf"].values.tolist() == [2, 3]
    assert masked.attrs["history"].splitlines() == [
        "masked 1 values within 5 deg of the incident beam",
        "masked 1 values below the noise floor 1.5",
    ]
    again = mask(masked, exclude=np.array([False, True, False, True]))
    assert again["mask"].values.tolist() == [2, 3, 0, 1]
    assert (Severity.NOTE, "3 values are masked") in found(again)


def test_select_and_join():
    coloured = scan().assign_coords(channel=("direction", ["R", "G", "R", "G"]))
    assert sets(coloured) == ("channel",)
    assert select(coloured, {"channel": "G"})["brdf"].values.tolist() == [2, 4]
    with pytest.raises(ValueError, match="no channel is B; there are G, R"):
        select(coloured, {"channel": "B"})
    with pytest.raises(ValueError, match="no coordinate 'colour'"):
        select(coloured, {"colour": "B"})
    both = join({"one": scan(), "two": scan(brdf=[5.0, 6, 7, 8])})
    assert sets(both) == ("scan",)
    assert select(both, {"scan": "two"})["brdf"].values.tolist() == [5, 6, 7, 8]
    with pytest.raises(ValueError, match="cannot be joined"):
        join({"one": scan(), "two": scan(unit="a.u.")})


def test_joined_scans_keep_their_masks_labels_and_history():
    """A scan without a mask joins one that has one: what was in use stays in use."""
    masked = mask(scan(), floor=2.5).assign_attrs(history="measured")
    joined = join({"one": masked, "two": scan().assign_attrs(simulated="simulated from x")})
    assert joined["mask"].dtype == np.int8
    assert joined["mask"].values.tolist() == [2, 2, 0, 0, 0, 0, 0, 0]
    assert points(joined)["scan"].values.tolist() == ["one"] * 2 + ["two"] * 4
    assert joined.attrs["simulated"] == "simulated from x"
    assert joined.attrs["history"].splitlines() == ["one: measured", "joined one, two"]
    again = join({"day 1": joined, "day 2": scan()})
    assert list(dict.fromkeys(again["scan"].values.tolist())) == ["day 1/one", "day 1/two", "day 2"]


def test_joined_scans_may_differ_in_wavelengths_and_not_in_having_them():
    red, green = (scan().assign_coords(wavelength=("direction", np.full(4, w))) for w in (650.0, 550.0))
    assert sets(join({"a": red, "b": green})) == ("scan", "wavelength")
    with pytest.raises(ValueError, match="b says no wavelength, and other scans do"):
        join({"a": red, "b": scan()})
    with pytest.raises(ValueError, match="no scan to join"):
        join({})


def test_signed_angle_round_trips():
    data = scan()
    np.testing.assert_array_equal(signed_theta_r(flatten(data)), [-20, 10, 30, -30])
