"""Promises that every format of scans keeps."""

import functools
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, convert, fit, read, resample, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.formats.format import Format
from gonio.measured.dataset import flatten, make_scan, modes, points
from gonio.measured.stack import foreign_dims
from gonio.resampling.conversion import in_words
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling
from places import ROOT

SHARED_FILES = ROOT.parent / "shared" / "data" / "files"
WRITABLE = [f for f in formats().values() if f.write]
LOSSLESS = [f for f in WRITABLE if "*" in f.holds.variables and f.holds.relative]
every_writable = pytest.mark.parametrize("kind", WRITABLE, ids=lambda f: f.name)
every_lossless = pytest.mark.parametrize("kind", LOSSLESS, ids=lambda f: f.name)
HUGE = {"merl", "utia"}  # of a fixed size, megabytes: their own tests write them in full
TELLING = {".ddr", ".ddt", ".sdr", ".sdt"}  # suffixes that say which mode a file holds


def full_scan() -> xr.Dataset:
    """Every kind of content: out of plane, channels, uncertainties, a mask, a gap, a stranger's column, history."""
    return make_scan(
        [10, 10, 30, 30.5],
        [5, 10, 45.25, 89],
        [0.1, np.nan, 1 / 3, 2e-7],
        [0, 180, 90.5, 360],
        phi_i=[0, 15, 0, 200.5],
        uncertainty=[0.01, 0.02, 0.03, 0.04],
        coordinates={
            "channel": ["R", "R", "G", "µ"],
            "mode": ["reflection", "reflection", "transmission", "reflection"],
            "side": ["front", "back", "front", "front"],
            "polarisation": ["s", "p", "s", "s"],
        },
        variables={
            "uncertainty_systematic": ([0.1, 0.2, 0.3, 0.4], "sr-1"),
            "mask": (np.array([0, 1, 0, 2], dtype=np.int8), "1"),
            "temperature": ([20.0, 21.5, 22.0, 23.0], "1"),
        },
        provenance="material: aluminium, ünpolished\nsource: a test",
        history="made by hand",
    )


def plain_scan(unit: str = "sr-1", kind: Format | None = None) -> xr.Dataset:
    """What every format can hold: one set, positive, no gap; numbers that fit in four bytes.

    It names no mode, which is reflection, unless it is for a format that holds transmission alone.
    """
    theta_i, theta_r, phi = (a.ravel() for a in np.meshgrid([10.0, 40], [0.0, 20, 60], [0.0, 90, 180, 270]))
    values = np.round(0.1 + np.cos(np.radians(theta_r)) * np.cos(np.radians(theta_i)) * 8) / 32
    scan = make_scan(theta_i, theta_r, values, phi, unit=unit, history="made by hand")
    return scan if kind is None or kind.holds.reflection else of_mode(scan, "transmission")


def of_mode(scan: xr.Dataset, mode: str) -> xr.Dataset:
    """The flat scan with a mode, or with none."""
    return scan.assign_coords(mode=("direction", np.full(scan.sizes["direction"], mode))) if mode else scan


def assert_same(found: xr.Dataset, expected: xr.Dataset) -> None:
    found, expected = (flatten(s).drop_vars("line", errors="ignore") for s in (found, expected))
    xr.testing.assert_equal(found, expected)
    for name in expected.variables:
        if name != "mask":
            assert found[name].attrs.get("units") == expected[name].attrs.get("units"), name
    assert found.attrs["provenance"] == expected.attrs["provenance"]


def fits(scan: xr.Dataset, kind: Format) -> bool:
    """Whether a file of this kind can hold what was read from one: of two formats that share their content, one can.

    A file whose parts have different grids is read as scattered directions, which only resampling puts on a grid.
    """
    transmitted = "mode" in scan.coords and bool((scan["mode"] == "transmission").any())
    scattered = kind.layout is not None and scan["brdf"].dims == ("direction",)
    same = scan.attrs.get("quantity", "") == kind.holds.quantity
    same = same and (kind.holds.relative or scan["brdf"].attrs["units"] == "sr-1")
    return (
        same and not scattered and (kind.holds.transmission or not transmitted) and bool(scan["brdf"].notnull().any())
    )


def anything(points: xr.Dataset) -> np.ndarray:
    """A stand-in for a fitted model: positive, smooth."""
    return 0.1 + 0.05 * np.cos(np.radians(points["theta_r"].values))


@every_lossless
def test_a_lossless_format_keeps_everything(kind, tmp_path):
    path = tmp_path / f"scan{kind.suffix}"
    scan = full_scan()
    write(scan, path)
    found = read(path)
    assert_same(found, scan)
    assert found.attrs["history"].splitlines()[0] == "made by hand"
    assert recognise(path) is kind


@every_lossless
def test_real_scans_survive(kind, real_scan, tmp_path):
    scan = read(real_scan)
    path = tmp_path / f"scan{kind.suffix}"
    write(scan, path)
    assert_same(read(path), scan)


@every_lossless
def test_dense_is_kept_value_for_value(kind, tmp_path):
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
def test_every_sample_is_written_back_exactly(kind, sample_files, tmp_path):
    """What a format holds, it holds: each sample, read and written again in its own format, to the last bit."""
    assert sample_files.get(kind.name), f"tests/samples has no file of {kind.name}"
    for path in sample_files[kind.name]:
        scan = read(path)
        if not fits(scan, kind):
            continue
        done = convert(scan, tmp_path / f"{path.stem}-again", kind.name)
        assert done.error.missing == 0, path.name
        assert done.error.rms == 0, path.name
        assert recognise(done.path) is kind
        again, scan = points(read(done.path)), points(scan)
        np.testing.assert_array_equal(again["brdf"].values, scan["brdf"].values, err_msg=path.name)


@every_writable
def test_a_plain_scan_goes_into_every_format(kind, tmp_path):
    """Exact where directions are stored as they are; on a grid, the values that were written, and the error stated."""
    if kind.name in HUGE or kind.holds.quantity:
        pytest.skip("megabytes, or no BRDF: its own tests write it")
    plain = plain_scan(kind=kind)
    done = convert(plain, tmp_path / "plain", kind.name, filling=Filling(("bilateral",), anything, "a model"))
    assert recognise(done.path) is kind
    if kind.layout is None:
        assert done.error.missing == 0
        np.testing.assert_allclose(done.error.error, 0, atol=1e-12)  # angles in radians round by 1e-16
    else:
        assert in_words(difference(done.scan, plain)) in done.scan.attrs["history"]
        # Formats of f cos(theta_r) cannot say f on the horizon itself.
        above = done.scan.assign(brdf=done.scan["brdf"].where(done.scan["theta_r"] < 89.9).assign_attrs(units="sr-1"))
        written = difference(read(done.path), above)
        assert written.missing == 0
        assert written.largest < 1e-6  # single precision


@every_writable
@pytest.mark.parametrize("mode", ["", "reflection", "transmission"])
def test_a_mode_is_kept_or_refused_and_never_becomes_the_other(kind, mode, coarse_tables, tmp_path):
    """By `convert` and by `write`, under the suffix of each format: reflection is what names no mode."""
    if kind.name in HUGE or kind.holds.quantity:
        pytest.skip("megabytes, or no BRDF: its own tests write it")
    scan = of_mode(plain_scan(), mode)
    filling = Filling(("bilateral",), anything, "a model")
    ready = scan if kind.layout is None else resample(scan, kind.layout(scan), filling=filling)
    by_convert = functools.partial(convert, scan, to=kind.name, filling=filling)
    by_write = functools.partial(write, ready, to=kind.name)
    # The suffixes that tell modes apart are those of one family; `convert` hands the path to the same writers.
    suffixes = {kind.suffix, *TELLING} if kind.suffix in TELLING else {kind.suffix}
    tries = [(by_convert, suffix) for suffix in suffixes] + [(by_write, suffix) for suffix in {kind.suffix, *TELLING}]
    written = 0
    for k, (make, suffix) in enumerate(tries):
        path = tmp_path / f"{k}{suffix}"
        try:
            make(path=path)
        except ValueError:
            assert not path.exists()
        else:
            written += 1
            assert modes(read(path)) == {mode or "reflection"}
    assert bool(written) == ((mode or "reflection") in kind.holds.modes)


@every_writable
def test_of_two_modes_the_one_that_a_format_holds_is_written_with_a_word(kind, tmp_path):
    if kind.name in HUGE or kind.holds.quantity or len(kind.holds.modes) == 2:
        pytest.skip("megabytes, no BRDF, or both modes")
    parts = [of_mode(plain_scan(), mode) for mode in ("reflection", "transmission")]
    parts[1] = parts[1].assign(brdf=2 * parts[1]["brdf"].assign_attrs(units="sr-1"))
    parts[1]["brdf"].attrs["units"] = "sr-1"
    both = xr.concat(parts, dim="direction")
    done = convert(both, tmp_path / "both", kind.name, filling=Filling(("bilateral",), anything, "a model"))
    (kept,) = kind.holds.modes
    assert ("transmission" if kept == "reflection" else "reflection") in done.left_out
    assert modes(read(done.path)) == {kept}
    with pytest.raises(ValueError, match=rf"the scan is of .*, and .* of {kept} alone"):
        write(both, tmp_path / "direct", to=kind.name)


@every_writable
def test_relative_stays_relative_or_is_refused(kind, tmp_path):
    if kind.name in HUGE or kind.holds.quantity:
        pytest.skip("megabytes, or no BRDF: its own tests write it")
    path = tmp_path / "relative"
    filling = Filling(("bilateral",), anything, "a model")
    if kind.holds.relative:
        convert(plain_scan("a.u.", kind), path, kind.name, filling=filling)
        assert read(path)["brdf"].attrs["units"] == "a.u."
    else:
        with pytest.raises(ValueError, match=r"relative \(a\.u\.\), and .* cannot say so: calibrate them, or write"):
            convert(plain_scan("a.u.", kind), path, kind.name, filling=filling)
        assert not path.exists()


@every_writable
def test_nothing_is_overwritten_or_left_behind(kind, sample_files, tmp_path):
    path = tmp_path / f"scan{kind.suffix}"
    path.write_text("precious")
    scan = next(s for s in map(read, sample_files[kind.name]) if fits(s, kind))
    with pytest.raises(FileExistsError, match="--force"):
        convert(scan, path, kind.name)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]
    convert(scan, path, kind.name, force=True)
    assert recognise(path) is kind
    assert list(tmp_path.iterdir()) == [path]


def converted(scan: xr.Dataset, target: Path, kind: str) -> str:
    """Nothing where the scan was written, or the sentence that says why it cannot be."""
    try:
        convert(scan, target, kind, filling=Filling(("bilateral",), anything, "a model"))
    except FormatError:
        raise
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.no_cover  # counting the lines of so many conversions takes half as long as they do
@pytest.mark.parametrize("source", sorted(set(formats()) - HUGE))
def test_every_sample_goes_into_every_format_or_says_why_not(source, sample_files, tmp_path, coarse_tables):
    """No crash among all pairs: a file, or one sentence with a remedy. The smallest file stands for its format."""
    scan = read(min(sample_files[source], key=size_of))
    if scan.sizes.get("wavelength", 0) > 2:
        scan = scan.isel(wavelength=slice(2))  # two are several, and take less time
    written = 0
    for kind in [kind for kind in WRITABLE if kind.name not in HUGE]:
        target = tmp_path / f"{source}-{kind.name}"
        if why := converted(scan, target, kind.name):
            assert len(why) > 40, (kind.name, why)
            assert not target.exists()
            continue
        assert recognise(target) is kind, kind.name
        shutil.rmtree(target) if target.is_dir() else target.unlink()
        written += 1
    assert written  # gonio's own formats hold everything


@pytest.mark.parametrize("source", sorted(formats()))
def test_every_sample_is_one_scan_that_can_be_fitted(source, sample_files, tmp_path):
    """Whatever the axes of a format are called; what is not fitted names the physics that the model lacks."""
    for path in sample_files[source]:
        scan = read(path)
        assert foreign_dims(scan) == (), path.name
        if why := refusal(scan):
            assert re.search(r"transmission|specular|quantity|no BRDF|Mueller", why), (path.name, why)


def refusal(scan: xr.Dataset) -> str:
    """Nothing where Lambert's model was fitted to a scan, or the sentence that says why it cannot be."""
    try:
        solution = fit(Problem(catalogue["lambert"], scan))
    except ValueError as error:
        return str(error)
    assert np.isfinite(list(solution.values.values())).any()
    return ""


def size_of(path: Path) -> int:
    """Bytes of a file, or of the files of a folder."""
    return sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size


NAMES = {
    "bird/example.brdf": "bird",
    "columns/chassis_brdf.csv": "columns",
    "columns/merl_aluminium_slice.csv": "columns",
    "columns/solar_array_brdf.csv": "columns",
    "fred/*.txt": "fred",
    "lighttools/test_lighttools.txt": "reflet",
    "rgl/*.bsdf": "rgl",
    "rt300s/*.jdv": "jdv",
    "rt300s/*.xls": "rt300s",
    "speos/test_speos.rtd": "reflet",
    "zemax/*.bsdf": "zemax",
}


@pytest.mark.parametrize("pattern", NAMES)
def test_real_files_are_named_without_a_hint_from_their_names(pattern, tmp_path):
    if not SHARED_FILES.is_dir():
        pytest.skip(f"no files at {SHARED_FILES}")
    files = sorted(SHARED_FILES.glob(pattern))
    assert files
    for k, path in enumerate(files):
        renamed = tmp_path / f"file{k}.dat"
        shutil.copyfile(path, renamed)
        assert recognise(renamed).name == NAMES[pattern], path
        assert read(renamed)["brdf"].size > 0


def test_every_other_shared_file_is_refused_by_what_it_is(tmp_path):
    """Schemas, licences, notes and roughness tables are no scans, and the error says what they look like."""
    if not SHARED_FILES.is_dir():
        pytest.skip(f"no files at {SHARED_FILES}")
    scans = {path for pattern in NAMES for path in SHARED_FILES.glob(pattern)}
    others = [path for path in SHARED_FILES.rglob("*") if path.is_file() and path not in scans]
    assert len(others) > 20
    for path in others:
        renamed = tmp_path / "file.dat"
        shutil.copyfile(path, renamed)
        with pytest.raises(FormatError) as caught:
            read(renamed)
        wanted = {".json": "JSON|no object 'data'", ".xlsx": "is a workbook .*: save its table as CSV"}.get(
            path.suffix, "header"
        )
        assert re.search(wanted, str(caught.value)), path


def test_unknown_suffix_names_the_known_ones_and_a_shared_one_asks(tmp_path):
    with pytest.raises(ValueError, match=r"no format is written to \.xyz; use .*\.nc.*\.csv"):
        write(full_scan(), tmp_path / "scan.xyz")
    with pytest.raises(ValueError, match=r"several formats are called \.bsdf: say .*zemax"):
        write(full_scan(), tmp_path / "scan.bsdf")
    with pytest.raises(KeyError, match="zemax"):
        write(full_scan(), tmp_path / "scan.bsdf", to="zemaks")
