"""A table over half-difference angles on a page: curves at some angles, and the table itself for the graphics."""

import math

import numpy as np
import pytest

import gonio
from gonio.formats.merl import directions
from gonio.resampling.interpolation import Targets
from gonio.resampling.sources import interpolator_of
from gonio.viewing.columns import columns_of
from gonio.viewing.sparse import INCIDENCES, is_table, table_of

SHAPE = (30, 15, 12)


@pytest.fixture
def scan(tmp_path):
    """A file of three channels whose values differ, with cells below the horizon and one without a value."""
    at = directions(SHAPE)
    below = (at["theta_i"].values > 90) | (at["theta_r"].values > 90)
    base = np.where(below, -1.0, 100.0 + at["theta_r"].values)
    numbers = np.stack([np.where(below, -1.0, base * k) for k in (1.0, 2.0, 3.0)])
    numbers[0, 3, 4, 5] = -1.0
    path = tmp_path / "small.binary"
    path.write_bytes(np.array(SHAPE, "<i4").tobytes() + numbers.astype("<f8").tobytes())
    return gonio.read(path)


def test_curves_are_interpolated_as_the_format_does(scan):
    columns = columns_of("small.binary", scan)
    header = columns.header
    assert header["interpolated"]
    assert header["total"] == int(np.isfinite(scan["brdf"].values).sum())
    assert sorted({cell["theta_i"] for cell in header["cells"]}) == list(INCIDENCES)
    assert all(cell["in_plane"] > 100 for cell in header["cells"])
    for block, label in enumerate(header["blocks"]):
        rows = [k for c in header["cells"] if c["block"] == block for k in range(c["start"], c["end"])]
        own = {n: columns.columns[n][rows] for n in ("theta_i", "theta_r", "phi", "value")}
        part = scan.sel(channel=label["channel"])
        at = Targets(own["theta_i"], own["theta_r"], own["phi"], np.zeros(len(rows)))
        np.testing.assert_array_equal(own["value"], interpolator_of(part)[0](at))


def test_the_table_has_every_value_of_the_file(scan):
    table = table_of(scan)
    header = columns_of("small.binary", scan).header
    assert header["table"]["size"] == list(SHAPE)
    assert header["table"]["around"] == math.pi
    planes = np.frombuffer(table.encoded(), "<f4").reshape(3, *SHAPE)
    for plane, block in zip(planes, header["table"]["planes"], strict=True):
        values = scan["brdf"].sel(channel=header["blocks"][block]["channel"]).values
        np.testing.assert_array_equal(plane, np.where(np.isnan(values), -1, values).astype("<f4"))
    assert planes[0, 3, 4, 5] == -1


def test_a_masked_cell_is_none_in_the_table(scan):
    mask = np.zeros(scan["brdf"].shape, dtype=np.int8)
    mask[1, 2, 3, 4] = 1
    table = table_of(scan.assign(mask=(scan["brdf"].dims, mask)))
    planes = np.frombuffer(table.encoded(), "<f4").reshape(3, *SHAPE)
    assert planes[1, 2, 3, 4] == -1 < planes[1, 2, 3, 5]


def test_other_scans_are_no_tables(aluminium):
    _, _, scan = aluminium
    assert not is_table(scan)
    assert table_of(scan) is None
    assert "interpolated" not in columns_of("scan", scan).header


def test_the_values_of_a_small_grid_are_shown_themselves(scan):
    """Nothing is interpolated where there are no more values than a page has room for."""
    small = scan.isel(theta_h=slice(0, 20), theta_d=slice(0, 10), phi_d=slice(0, 4))
    header = columns_of("small", small).header
    assert "interpolated" not in header
    assert header["shown"] == int(np.isfinite(small["brdf"].values).sum())
