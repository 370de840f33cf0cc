"""MERL tables: cells against the published reader's index, scales, invalid cells, the whole size, and damage."""

import time
import tracemalloc
from math import acos, atan2, cos, pi, radians, sin, sqrt

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.formats.merl import AXES, SHAPE, directions
from gonio.geometry import Geometry
from gonio.measured import coordinates
from gonio.measured.dataset import flatten, make_scan, points
from gonio.models import catalogue
from gonio.resampling.resample import resample
from samples.merl import SCALES, samples, table

FORMAT = formats()["merl"]
GGX = {"rho_s": 0.7, "rho_d": 0.2, "width": 0.3, "index": 1.5, "extinction": 0.0}


def turned(vector, axis, angle):
    """Rodrigues' rotation, as the published reader turns vectors; `axis` is y or z."""
    (x, y, z), c, s = vector, cos(angle), sin(angle)
    return (c * x + s * z, y, c * z - s * x) if axis == "y" else (c * x - s * y, s * x + c * y, z)


def half_difference(theta_in, phi_in, theta_out, phi_out):
    """theta_half, theta_diff and phi_diff [rad] of the published reader, one direction at a time."""
    light = (sin(theta_in) * cos(phi_in), sin(theta_in) * sin(phi_in), cos(theta_in))
    view = (sin(theta_out) * cos(phi_out), sin(theta_out) * sin(phi_out), cos(theta_out))
    half = [a + b for a, b in zip(light, view, strict=True)]
    length = sqrt(sum(a * a for a in half))
    theta_half, phi_half = acos(min(half[2] / length, 1.0)), atan2(half[1], half[0])
    x, y, z = turned(turned(light, "z", -phi_half), "y", -theta_half)
    return theta_half, acos(min(z, 1.0)), atan2(y, x)


def cell(theta_in, phi_in, theta_out, phi_out):
    """The published reader's indices of a direction: truncated, phi_diff folded by reciprocity."""
    theta_half, theta_diff, phi_diff = half_difference(theta_in, phi_in, theta_out, phi_out)
    th = int(sqrt(theta_half / (pi / 2) * 90 * 90))
    td = int(theta_diff / (pi / 2) * 90)
    pd = int((phi_diff + pi if phi_diff < 0 else phi_diff) / pi * 180)
    return min(th, 89), min(td, 89), min(pd, 179)


@pytest.fixture(scope="module")
def standard():
    """The directions of the published size."""
    return directions(SHAPE)


def test_the_published_reader_finds_each_cell_at_its_own_angles(standard):
    rng = np.random.default_rng(0)
    above = np.argwhere((standard["theta_i"].values < 90) & (standard["theta_r"].values < 90))
    for k in above[rng.choice(len(above), 400, replace=False)]:
        theta_i, theta_r, phi = (radians(standard[n].values[tuple(k)]) for n in ("theta_i", "theta_r", "phi"))
        turn = rng.uniform(0, 2 * pi)  # an isotropic table does not see how the surface is turned
        assert cell(theta_i, turn, theta_r, turn + phi) == tuple(k)


def test_directions_are_those_of_the_half_difference_system():
    shape = (7, 6, 10)
    found = directions(shape)
    expected = coordinates.grid("half-difference", **{n: found[n].values for n in AXES})
    for name in ("theta_i", "theta_r"):
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-12)  # rounding of angles up to 180 deg
    np.testing.assert_allclose((found["phi"] - expected["phi"] + 180) % 360, 180, rtol=0, atol=1e-12)
    assert found["theta_h"].values[3] == pytest.approx(90 * (3.5 / 7) ** 2, abs=1e-13)


def test_planes_and_index_are_the_published_ones(tmp_path, standard):
    """Every number says its own place, and a BRDF is found at the published index of the file."""
    count = np.prod(SHAPE)
    path = tmp_path / "simulated.binary"
    path.write_bytes(table(SHAPE, np.arange(1, 3 * count + 1.0).reshape(3, *SHAPE)))
    scan = read(path)
    above = np.argwhere((standard["theta_i"].values < 90) & (standard["theta_r"].values < 90))
    for th, td, pd in above[:: len(above) // 50]:
        for k, channel in enumerate("RGB"):
            index = pd + 180 * (td + 90 * th) + k * 90 * 90 * 180
            found = float(scan["brdf"].sel(channel=channel)[th, td, pd])
            assert found == (index + 1) * [1 / 1500, 1.15 / 1500, 1.66 / 1500][k]


def test_the_constant_that_other_readers_agree_on(tmp_path):
    """Three public readers return 0.159155 on a file of 0.5/pi."""
    path = tmp_path / "half.binary"
    numbers = np.broadcast_to((0.5 / np.pi / SCALES)[:, None, None, None], (3, 8, 8, 8))
    path.write_bytes(table((8, 8, 8), numbers))
    scan = points(read(path))
    np.testing.assert_allclose(scan["brdf"], 0.15915494309189535, rtol=3e-16)
    assert set(scan["channel"].values) == {"R", "G", "B"}
    assert scan["brdf"].attrs["units"] == "sr-1"


def test_invalid_cells_and_the_horizon_are_gaps(tmp_path):
    numbers = np.full((3, 6, 5, 8), 3.0)
    numbers[1, 0, 0, 0] = -0.25
    path = tmp_path / "gaps.binary"
    path.write_bytes(table((6, 5, 8), numbers))
    scan = read(path)
    below = (scan["theta_i"].values > 90) | (scan["theta_r"].values > 90)
    missing = np.isnan(scan["brdf"].values)
    np.testing.assert_array_equal(missing[0], below)
    assert missing[1].sum() == below.sum() + 1
    assert missing[1, 0, 0, 0]
    assert f"1 of {numbers.size} cells hold no value" in scan.attrs["history"]
    assert f"left out {3 * below.sum()} values of cells whose middle lies below the horizon" in scan.attrs["history"]


def test_a_file_written_again_is_read_as_before(tmp_path):
    for path in samples(tmp_path):
        scan = read(path)
        again = tmp_path / f"again_{path.name}"
        write(scan, again)
        xr.testing.assert_identical(read(again).drop_attrs(), scan.drop_attrs())
        assert again.stat().st_size == path.stat().st_size
        assert recognise(again) is FORMAT
        missing = np.isnan(scan["brdf"].values)
        stored = np.frombuffer(again.read_bytes()[12:], "<f8").reshape(missing.shape)
        assert (stored[missing] == -1).all()
        assert (stored[~missing] >= 0).all()


def test_three_colours_of_a_scan_without_channels(tmp_path):
    scan = directions((3, 2, 4)).assign(brdf=(AXES, np.full((3, 2, 4), 0.25), {"units": "sr-1"}))
    write(scan, tmp_path / "grey.binary")
    found = points(read(tmp_path / "grey.binary"))
    np.testing.assert_allclose(found["brdf"], 0.25, rtol=3e-16)  # 0.25 times 1500 and back: one rounding
    assert found.sizes["direction"] == 3 * int(
        (scan["theta_i"].values < 90).sum() - (scan["theta_r"].values > 90).sum()
    )


def test_layout_is_the_published_one_or_the_scans_own(standard):
    scan = make_scan([10.0, 20.0], [5.0, 6.0], [0.1, 0.2])
    xr.testing.assert_identical(FORMAT.layout(scan), standard)
    own = directions((4, 3, 360)).assign(brdf=(AXES, np.ones((4, 3, 360))))
    xr.testing.assert_identical(FORMAT.layout(own), directions((4, 3, 360)))
    assert own["phi_d"].values[-1] == 359.5
    other = coordinates.grid("half-difference", theta_h=[0.0, 10.0], theta_d=[0.0, 30.0], phi_d=[0.0, 90.0])
    assert FORMAT.layout(other).sizes == dict(zip(AXES, SHAPE, strict=True))


def test_between_the_middles_it_is_linear_in_the_index():
    """A table that is linear in the indices gives the line back at any direction, by the published coordinates."""
    h, d, p = np.meshgrid(*(np.arange(n) + 0.5 for n in SHAPE), indexing="ij")
    scan = xr.Dataset({"brdf": (AXES, 1 + 0.5 * h + 0.25 * d + 0.125 * np.minimum(p, 170))})
    rng = np.random.default_rng(3)
    theta_i, theta_r, phi = rng.uniform(1, 80, 300), rng.uniform(1, 80, 300), rng.uniform(10, 350, 300)
    found = FORMAT.evaluate(scan, theta_i, theta_r, phi, np.zeros(300))
    for k, value in enumerate(found):
        theta_half, theta_diff, phi_diff = half_difference(
            radians(theta_i[k]), 0.0, radians(theta_r[k]), radians(phi[k])
        )
        h, d, p = sqrt(theta_half / pi * 2) * 90, theta_diff / pi * 180, phi_diff % pi / pi * 180
        if p < 169 and p > 1:
            assert value == pytest.approx(1 + 0.5 * h + 0.25 * d + 0.125 * p, abs=1e-9)


def test_the_outermost_half_cells_are_constant_and_gaps_stay_gaps():
    table = np.ones((4, 3, 6))
    table[0, 1] = 5.0
    table[3] = np.nan
    scan = xr.Dataset({"brdf": (AXES, table)})
    found = FORMAT.evaluate(
        scan, *(np.array(a, dtype=float) for a in ([45, 0, 10], [45, 80, 85], [180, 0, 0], [0, 0, 0]))
    )
    assert found[0] == 5.0  # the mirror direction at 45 deg: theta_h = 0, in the middle of theta_d's second cell
    assert np.isfinite(found[1])
    table[:] = np.nan
    assert np.isnan(FORMAT.evaluate(scan, *(np.array([v]) for v in (45.0, 45.0, 180.0, 0.0))))


@pytest.fixture(scope="module")
def full_size(tmp_path_factory):
    """A table of the published size, simulated from GGX."""
    grid = directions(SHAPE)
    above = (grid["theta_i"].values < 90) & (grid["theta_r"].values < 90)
    angles = [grid[n].values[above] for n in ("theta_i", "theta_r", "phi")]
    values = np.full(SHAPE, np.nan)
    values[above] = np.asarray(catalogue["ggx"](Geometry.from_degrees(*angles), GGX))
    path = tmp_path_factory.mktemp("merl") / "simulated.binary"
    write(grid.assign(brdf=(AXES, values, {"units": "sr-1"})), path)
    assert path.stat().st_size == 34_992_012
    return path


def test_the_full_size_is_read_within_a_second_and_in_little_memory(full_size):
    """The BRDF and three angles are 70 MB. The time is the processor's, because other processes run beside."""
    start = time.process_time()
    read(full_size)
    assert time.process_time() - start < 1
    tracemalloc.start()
    scan = read(full_size)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert scan["brdf"].shape == (3, *SHAPE)
    assert peak < 120e6


def test_a_slice_of_the_full_size_is_the_model_that_it_was_made_from(full_size):
    """In plane, the mirror direction included: on this lobe linear between the cells was measured good to 0.3 %."""
    theta_r = np.arange(-80.0, 81.0, 2.5)
    scan = read(full_size).sel(channel="G")
    for theta_i in (10.0, 45.0, 60.0):
        wanted = make_scan(np.full(len(theta_r), theta_i), theta_r, np.zeros(len(theta_r)))
        angles = [wanted[n].values for n in ("theta_i", "theta_r", "phi")]
        found = FORMAT.evaluate(scan, *angles, np.zeros(len(theta_r)))
        expected = np.asarray(catalogue["ggx"](Geometry.from_degrees(*angles), GGX))
        np.testing.assert_allclose(found, expected, rtol=0.004)


def test_resampling_asks_the_format(tmp_path):
    path = samples(tmp_path)[0]
    found = resample(read(path), make_scan([45.0], [45.0], [0.0]))
    assert "as merl files are read" in found.attrs["history"]


def damaged(tmp_path, content):
    path = tmp_path / "damaged.binary"
    path.write_bytes(content)
    return path


NUMBERS = np.ones((3, 2, 2, 2))
GOOD = table((2, 2, 2), NUMBERS)


@pytest.mark.parametrize(
    ("content", "where", "what"),
    [
        (GOOD[:-1], "byte 203", "2 x 2 x 2 cells in three colours need 204 bytes, and the file has 203"),
        (GOOD + b"\0", "byte 204", "and the file has 205"),
        (table((4096, 4096, 4096), NUMBERS), "byte 0", "4096 x 4096 x 4096 are not those of a table"),
        (table((2, 2, 2), np.where(np.arange(24).reshape(3, 2, 2, 2) == 9, np.inf, 1)), "byte 84", "infinite"),
        (table((2, 2, 2), -NUMBERS), "byte 12", "every brdf value is zero or marked as invalid"),
        (table((2, 2, 2), 0 * NUMBERS), "byte 12", "every brdf value is zero or marked as invalid"),
    ],
)
def test_damage_is_named_with_its_place(tmp_path, content, where, what):
    with pytest.raises(FormatError, match=what) as error:
        read(damaged(tmp_path, content))
    assert error.value.where == where


@pytest.mark.parametrize("shape", [(0, 2, 2), (-1, 2, 2), (2**31 - 1, 2, 2), (2, 2, 4097)])
def test_other_headers_are_not_recognised(shape):
    assert not FORMAT.recognises(table(shape, NUMBERS))
    assert FORMAT.recognises(GOOD)
    assert not FORMAT.recognises(GOOD[:11])


def on_table(values, **extra):
    return directions((2, 2, 2)).assign(brdf=((*extra, *AXES), values, {"units": "sr-1"})).assign_coords(extra)


def test_one_channel_of_any_name_is_written_to_all_three(tmp_path):
    write(on_table(np.ones((1, 2, 2, 2)), channel=["vis"]), tmp_path / "vis.binary")
    scan = points(read(tmp_path / "vis.binary"))
    np.testing.assert_allclose(scan["brdf"], 1, rtol=3e-16)


@pytest.mark.parametrize(
    ("scan", "what"),
    [
        (on_table(np.ones((3, 2, 2, 2)), channel=["X", "Y", "Z"]), "R, G and B, not X, Y, Z"),
        (on_table(np.ones((2, 2, 2, 2)), wavelength=[500.0, 600.0]), "select one of each wavelength"),
        (on_table(-np.ones((2, 2, 2))), "leave negative values out"),
        (make_scan([10.0], [5.0], [0.1]), "resample the scan onto them"),
        (flatten(on_table(np.ones((2, 2, 2)))), "resample the scan onto them"),
    ],
)
def test_what_cannot_be_written_is_refused_with_a_remedy(tmp_path, scan, what):
    with pytest.raises(ValueError, match=what):
        write(scan, tmp_path / "out.binary")
    assert not (tmp_path / "out.binary").exists()
