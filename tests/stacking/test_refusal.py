"""Several files that make no stack are told by name, all at once."""

import pytest

from gonio import catalogue, simulate, write
from gonio.stacking import stack

THETA_R = [-60.0, -20, 20, 40, 60]


def put(path, theta_r=THETA_R, unit="sr-1"):
    scan = simulate(catalogue["lambert"], {"rho": 0.5}, [10.0, 30.0], theta_r)
    scan["brdf"].attrs["units"] = unit
    write(scan, path, force=True)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "csv").mkdir()
    for k in range(9):
        put(tmp_path / "csv" / f"s{k}.csv")
    return tmp_path / "csv"


def refused(*paths, out):
    with pytest.raises(ValueError, match="make no stack") as caught:
        stack(paths, out)
    assert "\n" not in str(caught.value)
    assert not out.exists()
    return str(caught.value)


def test_all_bad_files_of_a_folder_are_told_at_once(folder, tmp_path):
    """F43's 300 files with one unreadable, one of another quantity and one of other angles."""
    put(folder / "s2.csv", theta_r=[-60.0, -20, 20, 40, 61])
    put(folder / "s5.csv", unit="a.u.")
    (folder / "s7.csv").write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n10,zwei,0.1\n")
    said = refused(folder, out=tmp_path / "s.zarr")
    assert said.startswith("2 of 9 files make no stack with the others: ")
    assert "s2.csv: has theta_i 10 deg, theta_r 61 deg" in said
    assert "s5.csv: is in a.u., and " in said
    assert "; no scans: " in said
    assert "s7.csv" in said
    assert "zwei" in said
    for remedy in ("gonio stack --resample", "calibrate the relative ones", "or leave these files out"):
        assert said.count(remedy) == 1
    assert "the first" not in said.partition("; no scans")[0]


def test_named_files_are_told_together_too(folder, tmp_path):
    (folder / "bad.csv").write_text("x")
    (folder / "worse.csv").write_text("y")
    said = refused(*(folder / f"{name}.csv" for name in ("s1", "bad", "worse", "s2")), out=tmp_path / "s.zarr")
    assert said.startswith("2 of 4 files")
    assert "bad.csv" in said
    assert "worse.csv" in said


def test_where_the_first_file_is_the_odd_one_that_is_said(folder, tmp_path):
    put(folder / "s0.csv", theta_r=[-60.0, -20, 20, 40, 61])
    said = refused(folder, out=tmp_path / "s.zarr")
    assert f"most files differ from the first, {folder / 's0.csv'}" in said
    assert len(said.replace(str(folder), "")) < 1000  # however long the path is


def test_where_no_named_file_can_be_read_all_are_told(tmp_path):
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("x")
    said = refused(tmp_path / "a.csv", tmp_path / "b.csv", out=tmp_path / "s.zarr")
    assert "a.csv" in said
    assert "b.csv" in said
