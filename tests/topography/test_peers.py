"""Height maps and their numbers against SurfaceTopography, which the extra `topography` installs (surface.md)."""

import math
import warnings

import numpy as np
import pytest

import gonio
from gonio.topography import level, make_heights, simulate_heights, spectrum, statistics
from gonio.topography.heights import values
from places import SHARED

TOPOGRAPHY = SHARED / "topography"
pytestmark = pytest.mark.skipif(not TOPOGRAPHY.is_dir(), reason=f"no measured height maps at {TOPOGRAPHY}")


@pytest.fixture(scope="module")
def peer():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("SurfaceTopography", reason="the extra `topography` is not installed")


def test_levels_of_the_alicona_map(peer):
    """Its `height` is the plane of least squares, as gonio's; its `slope` takes off the mean slope, which is none."""
    path = TOPOGRAPHY / "al3d-1.al3d"
    found = peer.open_topography(str(path)).topography().to_unit("um")
    spread = {name: float(np.std(found.detrend(name).heights())) for name in ("height", "slope")}
    assert spread == {"height": pytest.approx(0.289822, abs=5e-7), "slope": pytest.approx(0.433616, abs=5e-7)}
    assert statistics(level(gonio.read_heights(path))).Sq == pytest.approx(spread["height"], abs=1e-9)


def test_a_tilt_is_a_slope_until_it_is_taken_off(peer):
    heights = gonio.read_heights(TOPOGRAPHY / "al3d-1.al3d")
    assert statistics(heights).Sdq == pytest.approx(0.24, abs=0.005)
    assert statistics(level(heights)).Sdq == pytest.approx(0.09, abs=0.005)


def test_eight_times_the_zygo_map_is_what_surfalize_reads(peer):
    """Its table has 4096 counts for phase_res 1, where 32768 are right (surfalize 0.19.2)."""
    found = statistics(gonio.read_heights(TOPOGRAPHY / "metropro-1.dat")).Sq
    assert 8 * found == pytest.approx(0.602306, abs=5e-6)


def test_a_map_a_million_times_too_large_is_refused():
    """As a reader of nms-1 makes it, 1.6e8 um for 160 um."""
    with pytest.raises(ValueError, match=r"1.6e\+08 um .*check the unit of the pitch"):
        make_heights(np.random.default_rng(0).random((160, 160)), 1e6)


def test_the_spectrum_is_theirs_at_two_pi_f(peer):
    """C_iso(q) at q = 2 pi f; both average rings, of other widths."""
    heights = simulate_heights(0.142, 2.0, points=(256, 256), pitch=0.25, seed=1)
    theirs = peer.Topography(values(heights).T, (64.0, 64.0), unit="um")
    q, found = (np.ma.filled(column, np.nan) for column in theirs.power_spectrum_from_area(window="hann")[:2])
    f, own = q / (2 * math.pi), spectrum(heights)
    inside = np.isfinite(found) & (f > 0.1) & (f < 0.6)
    assert inside.sum() > 10
    assert np.median(found[inside] / np.interp(f[inside], own.f, own.radial)) == pytest.approx(1.0, abs=0.03)
