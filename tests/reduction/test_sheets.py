"""Raw scans to a BRDF: each step on numbers that are worked out by hand."""

import math

import numpy as np
import pytest
import xarray as xr

from gonio.measured.dataset import make_scan
from gonio.reduction.sheets import Shadow, reduce, turned


def raw(signal, theta_i=30.0, theta_r=(0.0, 60.0, 60.0), phi=(180.0, 90.0, 270.0)) -> xr.Dataset:
    """A scan whose signal, pi f cos(theta_r), is given."""
    theta_r = np.array(theta_r)
    f = np.array(signal) / (math.pi * np.cos(np.radians(theta_r)))
    return make_scan(np.full(len(f), theta_i), theta_r, f, phi, history="read from raw.xls as a workbook")


def signal(scan: xr.Dataset) -> list[float]:
    return (scan["brdf"].values * math.pi * np.cos(np.radians(scan["theta_r"].values))).tolist()


def test_blank_and_floor_are_subtracted_and_mirrored_values_averaged():
    reduced = reduce([raw([0.5, 0.3, 0.2])], raw([0.1, 0.1, 0.05]), floor=True, mirror=True)
    # 0.4, 0.2, 0.15 above the blank; the least is the detector's zero; 60 deg at 90 and at 270 deg are one direction
    assert reduced["theta_r"].values.tolist() == [0, 60]
    assert signal(reduced) == pytest.approx([0.25, 0.025])
    assert reduced["repeats"].values.tolist() == [1, 2]
    assert np.isnan(reduced["uncertainty"].values[0])
    # two values 0.05 apart: standard deviation 0.05/sqrt(2), of their mean 0.025; f = signal/(pi/2)
    assert reduced["uncertainty"].values[1] == pytest.approx(0.025 / (math.pi / 2))
    assert reduced.attrs["symmetry"] == "isotropic"
    assert reduced.attrs["history"].splitlines() == [
        "reduced raw.xls as a workbook",
        "subtracted the blank, raw.xls as a workbook",
        "subtracted the least signal of each scan as the detector's zero: uncertainty_systematic holds that signal over"
        " sqrt(3)",
        "left out 0 values within 10 deg of the incident direction and 30 deg of its plane, where the receiver shadows"
        " the beam",
        "averaged repeats and mirror images, up to 2 values each; uncertainties are of the mean",
    ]


def test_each_scan_has_a_floor_of_its_own():
    """Off unless asked for: a least signal that is no zero would be taken from every value."""
    scans = [raw([0.5, 0.2, 0.2]), raw([0.7, 0.3, 0.3])]
    reduced = reduce(scans, floor=True)
    assert signal(reduced) == pytest.approx([0.35, 0.0, 0.0])
    # 0.2 and 0.3 were subtracted: as rectangular distributions 0.2/sqrt(3) and 0.3/sqrt(3), common to all readings
    u = reduced["uncertainty_systematic"].values * math.pi * np.cos(np.radians(reduced["theta_r"].values))
    assert u == pytest.approx(0.25 / math.sqrt(3))
    plain = reduce(scans)
    assert signal(plain) == pytest.approx([0.6, 0.25, 0.25])
    assert "uncertainty_systematic" not in plain


def test_mirror_images_are_repeats_only_on_request():
    scan = raw([0.3, 0.2], theta_r=(60.0, 60.0), phi=(90.0, 270.0))
    assert signal(reduce([scan])) == pytest.approx([0.3, 0.2])
    assert reduce([scan]).attrs["history"].splitlines()[-1] == "no repeats to average: each direction was read once"
    assert "symmetry" not in reduce([scan]).attrs
    assert signal(reduce([scan], mirror=True)) == pytest.approx([0.25])


def test_a_turned_sample_is_another_geometry():
    """So are its mirror images, unless phi_i is mirrored too: (phi_i 90, phi 60) is the image of (270, 300)."""
    one = raw([0.3, 0.2], theta_r=(60.0, 60.0), phi=(60.0, 300.0))
    reduced = reduce([turned(one, 0), turned(one, 90), turned(one, 90)])
    assert reduced["phi_i"].values.tolist() == [0, 90, 0, 90]
    assert reduced["phi"].values.tolist() == [60, 60, 300, 300]
    assert reduced["repeats"].values.tolist() == [1, 2, 1, 2]
    assert signal(reduced) == pytest.approx([0.3, 0.3, 0.2, 0.2])
    mirrored = reduce([turned(one, 0), turned(one, 90)], mirror=True)
    assert list(zip(mirrored["phi_i"].values, mirrored["phi"].values, strict=True)) == [(0, 60), (90, 60), (90, 300)]
    assert signal(mirrored) == pytest.approx([0.25, 0.3, 0.2])
    both = reduce([turned(one, 90), turned(one, 270)], mirror=True)
    assert signal(both) == pytest.approx([0.25, 0.25])
    with pytest.raises(ValueError, match="phi_i is stated in the file"):
        turned(turned(one, 0), 90)
    with pytest.raises(ValueError, match=r"some samples name phi_i and some do not.*say how each sample was turned"):
        reduce([one, turned(one, 90)])


def test_only_values_of_one_set_are_repeats():
    """Two wavelengths, channels, modes or sides at one direction are not."""
    for name, labels in {
        "wavelength": [500.0, 600.0],
        "channel": ["B", "R"],
        "mode": ["reflection", "transmission"],
        "polarisation": ["p", "s"],
    }.items():
        scan = make_scan([30.0] * 4, [50.0] * 4, [1, 2, 3, 4], coordinates={name: [*labels, *labels]})
        reduced = reduce([scan])
        assert reduced["brdf"].values.tolist() == [2, 3]
        assert reduced[name].values.tolist() == labels
        blank = make_scan([30.0] * 2, [50.0] * 2, [0.5, 1], coordinates={name: labels})
        assert reduce([scan], blank)["brdf"].values.tolist() == [1.5, 2]
        with pytest.raises(ValueError, match=f"do not both name {name}"):
            reduce([scan], make_scan([30.0], [50.0], [1]))
        with pytest.raises(ValueError, match=f"some samples name {name} and some do not"):
            reduce([scan, make_scan([30.0], [50.0], [1])])


def test_transmission_is_not_shadowed():
    """The receiver stands behind the sample."""
    scan = make_scan([30.0] * 2, [30.0] * 2, [1, 2], [0, 0], coordinates={"mode": ["reflection", "transmission"]})
    assert reduce([scan])["mode"].values.tolist() == ["transmission"]


def test_stated_uncertainties_are_not_lost():
    """Of one reading it is the stated one; of several, the larger of scatter and what was stated."""
    scan = make_scan([30.0] * 3, [0.0, 50.0, 50.0], [1, 2, 2], uncertainty=[0.1, 0.3, 0.4])
    reduced = reduce([scan])
    assert reduced["uncertainty"].values == pytest.approx([0.1, 0.25])  # sqrt(0.09 + 0.16)/2
    blank = make_scan([30.0] * 2, [0.0, 50.0], [0.5, 1], uncertainty=[0.1, 0.0])
    assert reduce([scan], blank)["uncertainty"].values == pytest.approx([math.sqrt(0.02), 0.25])
    far = make_scan([30.0] * 2, [50.0, 50.0], [1, 3], uncertainty=[0.1, 0.1])
    assert reduce([far])["uncertainty"].values == pytest.approx([1.0])


def test_columns_that_cannot_be_averaged_are_named():
    scan = make_scan([30.0], [50.0], [1], variables={"temperature": ([20.0], "1")})
    assert "left out temperature: columns of single readings" in reduce([scan]).attrs["history"].splitlines()


def test_at_the_normal_each_plane_counts_once():
    """Azimuths 0 and 180 deg are one plane: (1 + 3)/2 = 2, and with 90 deg (5) the mean is 3.5, not 3."""
    reduced = reduce([raw([1.0, 3.0, 5.0], theta_r=(0, 0, 0), phi=(0, 180, 90))], shadow=None)
    assert signal(reduced) == pytest.approx([3.5])
    assert reduced["uncertainty"].values[0] * math.pi == pytest.approx(1.5)  # 2 and 5: 3/sqrt(2)/sqrt(2)
    one = reduce([raw([1.0], theta_r=(0,), phi=(180,)), raw([2.0], theta_r=(0,), phi=(180,))], shadow=None)
    assert one["uncertainty"].values[0] * math.pi == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("theta_i", "theta_r", "phi", "shadowed"),
    [
        (30, 30, 0, True),
        (30, 40, 0, True),
        (30, 41, 0, False),
        (30, 20, 30, True),
        (30, 20, 31, False),
        (30, 25, 330, True),
        (30, 30, 180, False),
        (10, 0, 150, True),
        (10, 0, 90, False),
        (5, 5, 180, True),
    ],
)
def test_the_receiver_shadows_the_beam_about_the_incident_direction(theta_i, theta_r, phi, shadowed):
    scan = make_scan([theta_i], [theta_r], [1.0], [phi])
    assert Shadow().holds(scan).tolist() == [shadowed]


def test_shadowed_values_still_set_the_floor():
    """As in the recipe, whose zero is found before directions are left out."""
    scan = raw([0.5, 0.3, 0.1], theta_r=(0, 60, 30), phi=(180, 90, 0))
    assert signal(reduce([scan], floor=True)) == pytest.approx([0.4, 0.2])


def test_the_second_of_two_measurements_takes_the_blanks_second():
    turned = {"theta_r": (60, 60), "phi": (180, 180)}
    reduced = reduce([raw([0.5, 0.7], **turned)], raw([0.1, 0.3], **turned))
    assert signal(reduced) == pytest.approx([0.4])
    assert reduced["uncertainty"].values[0] == pytest.approx(0, abs=1e-15)


def test_relative_scans_stay_relative():
    scan = make_scan([30, 30], [0, 40], [2.0, 3.0], unit="a.u.")
    assert reduce([scan])["brdf"].attrs["units"] == "a.u."


def test_what_cannot_be_reduced_says_so():
    with pytest.raises(ValueError, match="no scan to reduce"):
        reduce([])
    with pytest.raises(ValueError, match=r"no value at theta_i 30, theta_r 60, phi 270 deg: measure it"):
        reduce([raw([0.5, 0.3, 0.2])], raw([0.1, 0.1], theta_r=(0, 60), phi=(180, 90)))
    with pytest.raises(ValueError, match="differ in their units"):
        reduce([raw([0.5, 0.3, 0.2])], make_scan([30], [0], [1], unit="a.u."))
    with pytest.raises(ValueError, match="no direction is left"):
        reduce([raw([0.5], theta_r=(30,), phi=(0,))])
