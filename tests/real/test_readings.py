"""Raw readings of others, reduced to what they published."""

import numpy as np
import pytest

from gonio.raw import read_readings
from gonio.reduction import Filling, Known, Reduction, Relative, reduce
from places import SHARED

FOLDER = SHARED / "raw" / "blacklab"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no measured files at {FOLDER}")
STANDARD, OVER = 1.02086, Reduction(fill=Filling("over"))
# signal/(reflectance factor cos theta_i) is one number in each file, and its product with the standard's the reading
RUNS = {"z307_al": 8.991162 * STANDARD, "nite_invar": 4.816609 * STANDARD}
CERTIFICATE = f"{STANDARD}:factor@0,45"
DIGIT = 0.5e-6  # half a unit of the last digit of a published factor


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
    error = np.abs(np.pi * scan["brdf"].values - factor)
    # 2e-5 of the value, or half of the last printed digit where that is more, as the constant of the file is known
    assert (error <= np.maximum(2e-5 * factor, 1.05 * DIGIT)).all()


def test_the_wrong_filling_gives_another_result_by_the_ratio_of_cosines():
    raw = read_readings(FOLDER / "z307_al_a_l631h.inp.txt")
    how = Relative.parsed(CERTIFICATE, Known(9.17872))
    over, under = (reduce(raw, how, Reduction(fill=Filling(kind))) for kind in ("over", "under"))
    cosine_i, cosine_r = (np.cos(np.radians(over[n].values)) for n in ("theta_i", "theta_r"))
    expected = over["brdf"].values * cosine_i / cosine_r * np.cos(np.radians(45))
    assert under["brdf"].values == pytest.approx(expected, rel=1e-12)
