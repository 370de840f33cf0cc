"""UTIA's tables: the published index, the one size, what is mistaken for one, and damage."""

import numpy as np
import pytest

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.formats.utia import AXES, SIZE
from gonio.measured import coordinates
from gonio.measured.dataset import make_scan
from samples.utia import samples

FORMAT = formats()["utia"]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return samples(tmp_path_factory.mktemp("utia"))[0]


def published(numbers, plane, theta_i, phi_i, theta_v, phi_v):
    """A number by the index of the database's own reader, of a node in degrees."""
    rows, columns = 6 * 48, 6 * 48
    index = plane * rows * columns + columns * (48 * round(theta_i / 15) + round(phi_i / 7.5))
    return numbers[index + 48 * round(theta_v / 15) + round(phi_v % 360 / 7.5)]


def test_every_number_is_at_its_published_directions(file):
    numbers = np.fromfile(file, "<f8")
    assert file.stat().st_size == SIZE == 1_990_656
    scan = read(file)
    rng = np.random.default_rng(4)
    for _ in range(300):
        at = {name: int(rng.integers(len(nodes))) for name, nodes in AXES.items()}
        plane = int(rng.integers(3))
        one = scan["brdf"].isel(channel=plane, **at)
        phi_v = float(one["phi_i"]) + float(one["phi"])
        expected = published(numbers, plane, float(one["theta_i"]), float(one["phi_i"]), float(one["theta_r"]), phi_v)
        assert float(one) == expected
        assert str(one["channel"].values) == "RGB"[plane]


def test_it_is_relative_and_says_why(file):
    scan = read(file)
    assert scan["brdf"].attrs["units"] == "a.u."
    assert "public readers disagree" in scan.attrs["history"]
    assert "sRGB" in scan.attrs["stored"]
    assert scan.attrs["symmetry"] == "anisotropic"
    assert (scan["brdf"].values < 0).any()  # kept, not clamped


def test_a_file_written_again_is_the_same_file(file, tmp_path):
    again = tmp_path / "again.bin"
    write(read(file), again, to="utia")
    assert again.read_bytes() == file.read_bytes()
    assert recognise(again) is FORMAT


def test_layout_is_the_one_grid_and_grey_fills_three_planes(tmp_path):
    grid = FORMAT.layout(make_scan([10.0], [5.0], [0.1]))
    assert {n: grid.sizes[n] for n in AXES} == {"theta_i": 6, "phi_i": 48, "theta_r": 6, "phi": 48}
    values = np.random.default_rng(5).random(tuple(grid.sizes[n] for n in AXES))
    path = tmp_path / "grey.bin"
    write(grid.assign(brdf=(tuple(AXES), values, {"units": "a.u."})), path, to="utia")
    found = read(path)
    for channel in "RGB":
        np.testing.assert_array_equal(found["brdf"].sel(channel=channel), values)


@pytest.mark.parametrize(
    "content",
    [
        np.full(1024, 0.8, "<f4").tobytes(),
        np.random.default_rng(6).bytes(4096),
        b"30 -10 0.5 0.25 1\n" * 400,
        bytes(4096),
        np.full(511, 0.5).tobytes(),
        np.array([90, 90, 180], "<i4").tobytes() + np.full(600, 0.5).tobytes(),
        np.where(np.arange(512) == 77, np.nan, 0.5).tobytes(),
    ],
    ids=["float32", "random", "text", "zeros", "short", "merl", "nan"],
)
def test_other_bytes_are_not_taken_for_it(content):
    assert not FORMAT.recognises(content[:4096])


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (lambda raw: raw[:-8], "byte 1990648", "1990648 bytes of numbers without a header, and a UTIA file 1990656"),
        (lambda raw: raw + b"\0", "byte 1990656", "1990657 bytes"),
        (lambda raw: raw[:8000] + np.array([np.inf]).tobytes() + raw[8008:], "byte 8000", "not finite"),
        (lambda raw: raw[:8000] + np.array([np.nan]).tobytes() + raw[8008:], "byte 8000", "not finite"),
    ],
)
def test_damage_is_named_with_its_place(file, tmp_path, change, where, what):
    path = tmp_path / "damaged.bin"
    path.write_bytes(change(file.read_bytes()))
    with pytest.raises(FormatError, match=what) as error:
        read(path)
    assert error.value.where == where


def on_grid(values, **extra):
    grid = coordinates.grid("spherical", **AXES)
    return grid.assign(brdf=((*extra, *AXES), values, {"units": "a.u."})).assign_coords(extra)


SHAPE = tuple(len(v) for v in AXES.values())


@pytest.mark.parametrize(
    ("scan", "what"),
    [
        (on_grid(np.ones((3, *SHAPE)), channel=["X", "Y", "Z"]), "R, G and B, not X, Y, Z"),
        (on_grid(np.ones((2, *SHAPE)), wavelength=[500.0, 600.0]), "select one of each wavelength"),
        (on_grid(np.full(SHAPE, np.nan)), "no gaps"),
        (make_scan([10.0], [5.0], [0.1]), "theta_i from 0 to 75 by 15 deg"),
    ],
)
def test_what_cannot_be_written_is_refused_with_a_remedy(tmp_path, scan, what):
    with pytest.raises(ValueError, match=what):
        write(scan, tmp_path / "out.bin", to="utia")


def test_a_table_of_zeros_is_no_measurement(tmp_path):
    """Told by the reader: such a file is not even recognised."""
    path = tmp_path / "zeros.bin"
    path.write_bytes(bytes(SIZE))
    with pytest.raises(FormatError, match="every brdf value is zero"):
        FORMAT.read(path)
