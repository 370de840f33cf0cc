"""Files made into a stack: names, order, what must be alike, and what is told of the rest."""

import os

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, convert, join, read, simulate, write
from gonio.files import FormatError
from gonio.fitting import fit
from gonio.measured.masking import mask
from gonio.measured.stack import lane_dims
from gonio.measured.stack_store import open_stack
from gonio.resampling.resample import Filling
from gonio.stacking import stack, writing
from gonio.stacking.members import natural

LAMBERT = catalogue["lambert"]
THETA_R = [-60.0, -20, 20, 40, 60]


def scan(rho=1.0, theta_r=THETA_R, theta_i=(10.0, 30.0), **options):
    return simulate(LAMBERT, {"rho": rho}, list(theta_i), theta_r, **options)


def put(path, *arguments, **options):
    path.parent.mkdir(exist_ok=True)
    write(scan(*arguments, **options), path)
    return path


@pytest.fixture
def folder(tmp_path):
    """Eleven scans whose values are their numbers, so that s10 comes after s9."""
    for k in range(1, 12):
        put(tmp_path / "csv" / f"s{k}.csv", k / 20)
    return tmp_path / "csv"


def test_a_folder_is_its_files_in_natural_order(folder, tmp_path):
    done = stack([folder], tmp_path / "stack.zarr")
    wanted = [f"s{k}" for k in range(1, 12)]
    found = open_stack(tmp_path / "stack.zarr")
    assert done.names == wanted == found["sample"].values.tolist()
    assert found["brdf"].dims == ("sample", "direction")
    for k in range(11):
        own = read(folder / f"s{k + 1}.csv")
        np.testing.assert_array_equal(found["brdf"].values[k], own["brdf"].values)
        for name in ("theta_i", "theta_r", "phi"):
            np.testing.assert_array_equal(found[name].values, own[name].values)
    plain = xr.open_zarr(tmp_path / "stack.zarr", chunks=None)  # as others open it
    assert [str(name) for name in plain["sample"].values] == wanted
    assert set(plain.coords) == {"sample", "theta_i", "theta_r", "phi"}


@pytest.mark.parametrize(
    ("names", "in_order"),
    [
        (["s10", "s9", "s1"], ["s1", "s9", "s10"]),
        (["b", "A", "a1"], ["A", "a1", "b"]),
        (["10", "x", "9"], ["9", "10", "x"]),
        (["w2_s10", "w2_s9", "w10_s1"], ["w2_s9", "w2_s10", "w10_s1"]),
    ],
)
def test_natural_order(names, in_order):
    assert sorted(names, key=natural) == in_order


def test_formats_may_be_mixed_and_grids_be_lists(tmp_path):
    """The same directions on a grid of NetCDF, and in a table in another order."""
    first, rows = put(tmp_path / "a.csv", noise=0.1, seed=1), (tmp_path / "a.csv").read_text().splitlines()
    head = [line for line in rows if not line[0].isdigit()]
    values = [line for line in rows if line[0].isdigit()]
    (tmp_path / "b.csv").write_text("\n".join([*head, *values[::-1]]) + "\n")
    write(read(first), tmp_path / "c.nc")
    stack([tmp_path / "b.csv", first, tmp_path / "c.nc"], tmp_path / "stack.zarr")
    found = open_stack(tmp_path / "stack.zarr")
    assert found["sample"].values.tolist() == ["b", "a", "c"]
    np.testing.assert_array_equal(found["brdf"].values[0], read(tmp_path / "b.csv")["brdf"].values)
    np.testing.assert_array_equal(found["brdf"].values[1], found["brdf"].values[0])
    np.testing.assert_array_equal(found["brdf"].values[2], found["brdf"].values[0])


def test_an_azimuth_at_the_normal_or_beyond_a_turn_is_no_other_direction(tmp_path):
    head = "theta_i_deg,theta_r_deg,phi_deg,brdf_sr-1\n"
    (tmp_path / "a.csv").write_text(head + "10,0,0,1\n10,20,0,2\n10,20,90,3\n")
    (tmp_path / "b.csv").write_text(head + "10,0,180,4\n10,20,360,5\n10,20,90,6\n")
    stack([tmp_path / "a.csv", tmp_path / "b.csv"], tmp_path / "s.zarr")
    np.testing.assert_array_equal(open_stack(tmp_path / "s.zarr")["brdf"].values, [[1, 2, 3], [4, 5, 6]])


def test_names_that_are_alike_become_paths(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a/x.csv", "b/x.csv", "b/y.csv"):
        put(tmp_path / name)
    assert stack(["a/x.csv", "b"], "s.zarr").names == ["a/x.csv", "b/x.csv", "b/y.csv"]
    with pytest.raises(ValueError, match=r"b/x\.csv is given twice"):
        stack(["b/x.csv", "b"], "t.zarr")


@pytest.mark.parametrize("chunk", [1, 4, 1000])
def test_chunks_hold_many_scans_whatever_their_size(folder, tmp_path, monkeypatch, chunk):
    monkeypatch.setattr(writing, "SCANS_OF_CHUNK", chunk)
    (folder / "s5.txt").write_text("no scan\n")  # fewer scans than files, so the last chunk is cut
    stack([folder], tmp_path / "stack.zarr")
    found = open_stack(tmp_path / "stack.zarr")["brdf"]
    np.testing.assert_allclose(found.values[:, 0], np.arange(1, 12) / 20 / np.pi)
    files = [p for p in (tmp_path / "stack.zarr" / "brdf" / "c").rglob("*") if p.is_file()]
    assert len(files) == -(-11 // chunk)


def test_what_a_folder_holds_beside_scans_is_left_out_with_a_word(folder, tmp_path):
    (folder / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (folder / "notes.txt").write_text("calibrated on Monday\n")
    (folder / ".hidden").write_text("x")
    (folder / "older").mkdir()
    done = stack([folder], tmp_path / "stack.zarr")
    assert len(done.names) == 11
    assert [error.path.name for error in done.skipped] == ["notes.txt", "older", "photo.png"]
    assert "no scans, and left out: 3 of 14 files (notes.txt, older, photo.png)" in done.notes
    with pytest.raises(FormatError, match="PNG picture"):
        stack([folder / "s1.csv", folder / "photo.png"], tmp_path / "other.zarr")
    assert not (tmp_path / "other.zarr").exists()


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"theta_r": [-60.0, -20, 20, 40, 61]}, "b.csv: has theta_i 10 deg, theta_r 61 deg, phi 180 deg, and "),
        ({"theta_r": [-60.0, -20, 20, 40]}, "b.csv: lacks theta_i 10 deg, theta_r 60 deg, phi 180 deg of "),
        ({"theta_r": [-60.0, -20, 20, 40]}, "(8 directions, and 10 there): gonio stack --resample takes all scans"),
        ({"theta_i": [10.0, 31.0]}, "b.csv: has theta_i 31 deg, theta_r 60 deg, phi 0 deg, and "),
        ({"wavelength": 650.0}, "b.csv: it says a wavelength, and "),
    ],
)
def test_other_directions_are_refused_with_file_place_and_remedy(tmp_path, other, said):
    paths = [put(tmp_path / "a.csv"), put(tmp_path / "b.csv", **other)]
    with pytest.raises(ValueError, match=r"b\.csv") as caught:
        stack(paths, tmp_path / "stack.zarr")
    assert said in str(caught.value)
    assert "a.csv" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a.csv", "b.csv"]


def test_other_wavelengths_and_units_are_refused(tmp_path):
    paths = [put(tmp_path / "a.csv", wavelength=550.0), put(tmp_path / "b.csv", wavelength=650.0)]
    with pytest.raises(ValueError, match=r"b\.csv: has wavelength 650 nm, which .*a\.csv has not: choose .*--select"):
        stack(paths, tmp_path / "stack.zarr")
    relative = scan(wavelength=550.0)
    relative["brdf"].attrs["units"] = "a.u."
    write(relative, tmp_path / "r.csv")
    with pytest.raises(ValueError, match=r"r\.csv: is in a\.u\., and .*a\.csv in sr-1"):
        stack([paths[0], tmp_path / "r.csv"], tmp_path / "stack.zarr")


def test_several_wavelengths_and_channels_stay(tmp_path):
    for name, values in (("wavelength", [550.0, 650.0]), ("channel", ["R", "G"])):
        paths = []
        for k in (1, 2):
            parts = {str(v): scan(k / 5).assign_coords({name: ("direction", np.full(10, v))}) for v in values}
            paths.append(tmp_path / f"{name}{k}.nc")
            write(join(parts).drop_vars("scan"), paths[-1])
        stack(paths, tmp_path / f"{name}.zarr")
        found = open_stack(tmp_path / f"{name}.zarr")
        assert sorted(set(found[name].values.tolist())) == sorted(values)
        assert found["brdf"].shape[0] == 2


def test_masked_values_are_gaps_and_counted(tmp_path):
    write(mask(scan(), blocked=15), tmp_path / "a.nc")
    put(tmp_path / "b.csv")
    done = stack([tmp_path / "b.csv", tmp_path / "a.nc"], tmp_path / "stack.zarr")
    masked = int((read(tmp_path / "a.nc")["mask"].values != 0).sum())
    assert masked
    assert f"{masked} masked values are gaps" in done.notes
    assert np.isnan(open_stack(tmp_path / "stack.zarr")["brdf"].values[1]).sum() == masked


@pytest.mark.parametrize("stating", [(True, True, True), (True, False, True), (False, True, True), (False,) * 3])
def test_uncertainties_are_kept_where_all_state_them(tmp_path, monkeypatch, stating):
    monkeypatch.setattr(writing, "SCANS_OF_CHUNK", 2)
    paths = []
    for k, has in enumerate(stating):
        one = scan((k + 1) / 5)
        if has:
            one = one.assign(uncertainty=("direction", 0.01 * one["brdf"].values, {"units": "sr-1"}))
        write(one, tmp_path / f"{k}.csv")
        paths.append(tmp_path / f"{k}.csv")
    done = stack(paths, tmp_path / "stack.zarr")
    found = open_stack(tmp_path / "stack.zarr")
    assert ("uncertainty" in found) == all(stating)
    told = [note for note in done.notes if note.startswith("uncertainties left out")]
    if all(stating):
        np.testing.assert_allclose(found["uncertainty"].values, 0.01 * found["brdf"].values)
    lacking = [f"{k}.csv" for k, has in enumerate(stating) if not has]
    mixed = 0 < len(lacking) < 3
    assert told == [f"uncertainties left out: {len(lacking)} of 3 scans state none ({', '.join(lacking)})"] * mixed


def test_scans_are_taken_at_common_directions_with_the_error_in_the_history(tmp_path):
    wide = np.arange(-60, 61, 10.0)
    values = {"ks": 0.4, "kd": 0.1, "sigma": 0.3}
    for name, theta_r in (("a", wide), ("b", wide[::2]), ("c", wide + 5)):
        write(simulate(catalogue["torrance-sparrow"], values, [30.0], theta_r), tmp_path / f"{name}.csv")
    paths = [tmp_path / f"{name}.csv" for name in "abc"]
    done = stack(paths, tmp_path / "stack.zarr", resample=True)
    found = open_stack(tmp_path / "stack.zarr")["brdf"]
    np.testing.assert_array_equal(found.values[0], read(paths[0])["brdf"].values)
    np.testing.assert_array_equal(found.values[1][::2], read(paths[1])["brdf"].values)
    assert np.isnan(found.values[2]).tolist() == [True] + [False] * 12  # -60 deg lies outside of -55 to 65
    line = next(note for note in done.notes if note.startswith("taken at the directions of a.csv"))
    assert "rms error by solid angle" in line
    assert "at most" in line
    assert "(c.csv)" in line
    assert "1 values missing in 1 scans" in line
    assert line in open_stack(tmp_path / "stack.zarr").attrs["history"]
    stack(paths, tmp_path / "onto.zarr", onto=paths[1])
    assert open_stack(tmp_path / "onto.zarr")["brdf"].shape == (3, 7)
    with pytest.raises(ValueError, match="give one of them"):
        stack(paths, tmp_path / "x.zarr", onto=paths[1], resample=True)


def test_equal_directions_cost_nothing(folder, tmp_path):
    done = stack([folder], tmp_path / "stack.zarr", resample=True)
    assert "taken at the directions of s1.csv: every value as measured" in done.notes


def test_nothing_is_overwritten_unless_forced(folder, tmp_path):
    stack([folder], tmp_path / "stack.zarr")
    with pytest.raises(FileExistsError, match="--force"):
        stack([folder / "s1.csv"], tmp_path / "stack.zarr")
    stack([folder / "s1.csv"], tmp_path / "stack.zarr", force=True)
    assert open_stack(tmp_path / "stack.zarr").sizes["sample"] == 1
    with pytest.raises(FileExistsError, match="directory of other files"):
        stack([tmp_path / "stack.zarr"], folder, force=True)
    with pytest.raises(ValueError, match="which is read"):
        stack([folder], folder / "stack.zarr")


def test_a_stack_is_not_made_of_stacks(folder, tmp_path):
    stack([folder], tmp_path / "stack.zarr")
    with pytest.raises(ValueError, match="is a stack over sample already"):
        stack([tmp_path / "stack.zarr"], tmp_path / "other.zarr")


def test_folders_without_scans_are_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError, match="is a folder without a file"):
        stack([tmp_path / "empty"], tmp_path / "s.zarr")
    (tmp_path / "empty" / "x.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(FormatError, match=r"without a scan that can be read: .*PNG picture"):
        stack([tmp_path / "empty"], tmp_path / "s.zarr")
    with pytest.raises(FormatError, match="no such file"):
        stack([tmp_path / "none.csv"], tmp_path / "s.zarr")


def test_progress_names_the_file(folder, tmp_path):
    told = []
    stack([folder], tmp_path / "stack.zarr", progress=lambda fraction, name: told.append((fraction, name)))
    assert told[0] == (0.0, "s1.csv")
    assert told[-1] == (10 / 11, "s11.csv")


def test_names_that_no_text_can_hold_become_escapes(tmp_path):
    """A name with a byte that is no UTF-8, and one with a line feed."""
    for name in (os.fsdecode(b"a\xff.csv"), "b\nc.csv"):
        put(tmp_path / "plain.csv").rename(tmp_path / name)
    told = []
    stack([tmp_path], tmp_path.with_name(f"{tmp_path.name}.zarr"), progress=lambda _, name: told.append(name))
    found = open_stack(tmp_path.with_name(f"{tmp_path.name}.zarr"))
    assert found["sample"].values.tolist() == ["a\\udcff", "b\\nc"]
    assert told == ["a\\udcff.csv", "b\\nc.csv"]
    assert found.attrs["history"].splitlines()[0] == "stacked 2 scans: a\\udcff.csv, b\\nc.csv"


def test_dense_scans_stay_on_their_grid(tmp_path):
    """Two files of Zemax, and what a stack has no place for."""
    for k in (1, 2):
        one = scan(k / 10, np.arange(-85, 86, 5.0), np.arange(0, 90, 15.0))
        fitted = fit(Problem(LAMBERT, one))
        convert(one, tmp_path / f"c{k}.bsdf", to="zemax", filling=Filling((), fitted.predict, "lambert"))
    done = stack([tmp_path / "c1.bsdf", tmp_path / "c2.bsdf"], tmp_path / "stack.zarr")
    found, second = open_stack(tmp_path / "stack.zarr"), read(tmp_path / "c2.bsdf")
    assert found["brdf"].dims == ("sample", *second["brdf"].dims)
    np.testing.assert_array_equal(found["brdf"].values[1], second["brdf"].values)
    assert lane_dims(found) == ("sample",)
    assert "variables left out: tis" in done.notes
