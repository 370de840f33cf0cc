"""Raw readings of others, reduced to what they published."""

import numpy as np
import pytest

from gonio.raw import read_readings
from gonio.reduction import Filling, Known, Reduction, Relative, reduce
from places import SHARED

FOLDER = SHARED / "raw" / "blacklab"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no measured files at {FOLDER}")
STANDARD, OVER = 1.02086, Reduction(fill=Filling("over"))
# The reading of the standard that the files lack, in V: the one number with which every factor is that of the file.
RUNS = {"z307_al": 9.178717, "nite_invar": 4.9170853}
CERTIFICATE = f"{STANDARD}:factor@0,45"
DIGITS = 6  # decimals of a published factor


def published(name):
    """theta_i, theta_r, phi and the reflectance factor at 630.79 nm of each row."""
    lines = (FOLDER / f"{name}_sample.txt").read_text(encoding="latin-1").splitlines()
    column = lines[5].split().index("630.79nm")
    rows = np.array([line.split() for line in lines[6:]], dtype=float)
    return rows[:, 0], rows[:, 2], rows[:, 3], rows[:, column]


@pytest.mark.parametrize("name", RUNS)
def test_readings_reduce_to_the_published_factors_in_all_directions(name):
    raw = read_readings(FOLDER / f"{name}_a_l631h.inp.txt")
    scan = reduce(raw, Relative.parsed(CERTIFICATE, Known(RUNS[name])), OVER)
    theta_i, theta_r, phi, factor = published(name)
    assert len(factor) == scan.sizes["direction"] == 114
    assert scan["theta_i"].values.tolist() == theta_i.tolist()
    assert scan["theta_r"].values.tolist() == theta_r.tolist()
    assert (scan["phi"].values == phi)[theta_r > 0].all()  # at the normal there is no azimuth
    # all 114 as printed: half of the last digit is 1.9e-5 of the least factor of one file, 1.2e-4 of that of the other
    assert [f"{value:.{DIGITS}f}" for value in np.pi * scan["brdf"].values] == [
        f"{value:.{DIGITS}f}" for value in factor
    ]


@pytest.mark.parametrize(("name", "shares"), [("z307_al", (1.9e-5, 2.0e-5)), ("nite_invar", (1.2e-4, 1.3e-4))])
def test_the_files_print_six_decimals_which_no_reduction_is_nearer_to(name, shares):
    lines = (FOLDER / f"{name}_sample.txt").read_text(encoding="latin-1").splitlines()[5:]
    column = lines[0].split().index("630.79nm")
    assert {len(line.split()[column].partition(".")[2]) for line in lines[1:]} == {DIGITS}
    half = 0.5 * 10.0**-DIGITS / published(name)[3].min()
    assert shares[0] < half < shares[1]


def test_the_wrong_filling_gives_another_result_by_the_ratio_of_cosines():
    raw = read_readings(FOLDER / "z307_al_a_l631h.inp.txt")
    how = Relative.parsed(CERTIFICATE, Known(9.17872))
    over, under = (reduce(raw, how, Reduction(fill=Filling(kind))) for kind in ("over", "under"))
    cosine_i, cosine_r = (np.cos(np.radians(over[n].values)) for n in ("theta_i", "theta_r"))
    expected = over["brdf"].values * cosine_i / cosine_r * np.cos(np.radians(45))
    assert under["brdf"].values == pytest.approx(expected, rel=1e-12)
