"""Promises that every format of scans keeps."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gonio import read, write
from gonio.files import FormatError
from gonio.measured.dataset import flatten, make_scan
from gonio.measured.formats import formats, recognise

WRITABLE = [f for f in formats().values() if f.write]
every_writable = pytest.mark.parametrize("kind", WRITABLE, ids=lambda f: f.name)


def full_scan() -> xr.Dataset:
    """Every kind of content: out of plane, channels, uncertainties, a mask, a gap, a stranger's column, history."""
    return make_scan(
        [10, 10, 30, 30.5],
        [5, 10, 45.25, 89],
        [0.1, np.nan, 1 / 3, 2e-7],
        [0, 180, 90.5, 360],
        uncertainty=[0.01, 0.02, 0.03, 0.04],
        coordinates={"channel": ["R", "R", "G", "µ"]},
        variables={
            "uncertainty_systematic": ([0.1, 0.2, 0.3, 0.4], "sr-1"),
            "mask": (np.array([0, 1, 0, 2], dtype=np.int8), "1"),
            "temperature": ([20.0, 21.5, 22.0, 23.0], "1"),
        },
        provenance="material: aluminium, ünpolished\nsource: a test",
        history="made by hand",
    )


def assert_same(found: xr.Dataset, expected: xr.Dataset) -> None:
    found, expected = (flatten(s).drop_vars("line", errors="ignore") for s in (found, expected))
    xr.testing.assert_equal(found, expected)
    for name in expected.variables:
        if name != "mask":
            assert found[name].attrs.get("units") == expected[name].attrs.get("units"), name
    assert found.attrs["provenance"] == expected.attrs["provenance"]


@every_writable
def test_round_trip_is_exact(kind, tmp_path):
    path = tmp_path / f"scan{kind.suffix}"
    scan = full_scan()
    write(scan, path)
    found = read(path)
    assert_same(found, scan)
    assert found.attrs["history"].splitlines()[0] == "made by hand"
    assert recognise(path) is kind


@every_writable
def test_found_by_content_not_by_name(kind, tmp_path):
    path = tmp_path / f"scan{kind.suffix}"
    write(full_scan(), path)
    renamed = path.rename(tmp_path / "scan.whatever")
    assert_same(read(renamed), full_scan())


@every_writable
def test_relative_stays_relative_and_dense_is_flattened(kind, tmp_path):
    dense = xr.Dataset(
        {"brdf": (("theta_i", "theta_r"), np.arange(1.0, 7.0).reshape(2, 3), {"units": "a.u."})},
        coords={
            "theta_i": ("theta_i", [10.0, 20.0], {"units": "degree"}),
            "theta_r": ("theta_r", [0.0, 30.0, 60.0], {"units": "degree"}),
            "phi": ((), 180.0, {"units": "degree"}),
        },
        attrs={"provenance": ""},
    )
    path = tmp_path / f"dense{kind.suffix}"
    write(dense, path)
    found = flatten(read(path))
    assert found["brdf"].attrs["units"] == "a.u."
    np.testing.assert_array_equal(found["brdf"].values, np.arange(1.0, 7.0))
    np.testing.assert_array_equal(found["theta_i"].values, [10, 10, 10, 20, 20, 20])


@every_writable
def test_nothing_is_overwritten_or_left_behind(kind, tmp_path):
    path = tmp_path / f"scan{kind.suffix}"
    path.write_text("precious")
    with pytest.raises(FileExistsError, match="--force"):
        write(full_scan(), path)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]
    write(full_scan(), path, force=True)
    assert_same(read(path), full_scan())


@every_writable
def test_real_scans_survive(kind, real_scan, tmp_path):
    scan = read(real_scan)
    path = tmp_path / f"scan{kind.suffix}"
    write(scan, path)
    assert_same(read(path), scan)


@every_writable
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_raise_format_errors_only(kind, data, tmp_path):
    """Bytes flipped, cut out or put in: the file is read or refused with its name and a place, never anything else."""
    path = tmp_path / f"scan{kind.suffix}"
    write(full_scan(), path, force=True)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content) - 1))
        match data.draw(st.sampled_from(["flip", "cut", "insert", "truncate"])):
            case "flip":
                content[at] = data.draw(st.integers(0, 255))
            case "cut":
                del content[at : at + data.draw(st.integers(1, 40))]
            case "insert":
                content[at:at] = data.draw(st.binary(min_size=1, max_size=20))
            case "truncate":
                del content[at:]
        if not content:
            break
    path.write_bytes(bytes(content))
    refused = None
    try:
        read(path)
    except FormatError as error:
        refused = str(error)
    assert refused is None or (str(path) in refused and "\n" not in refused)


def test_unknown_suffix_names_the_known_ones(tmp_path):
    with pytest.raises(ValueError, match=r"\.nc, \.csv"):
        write(full_scan(), tmp_path / "scan.xyz")
