"""`xarray.open_dataset(path, engine="gonio")`, and what the engine leaves to others."""

import io
import json
import subprocess
import sys
import tomllib
import warnings
import zipfile

import numpy as np
import pytest
import xarray as xr
from xarray.backends import plugins

import gonio
from gonio.door import netcdf
from gonio.formats import formats
from gonio.formats.format import SIGNED
from gonio.opening import Gonio
from places import ROOT


@pytest.fixture
def registered(tmp_path_factory, monkeypatch):
    """The entry point as the project declares it, whether or not this version of gonio is installed."""
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["xarray.backends"]
    folder = tmp_path_factory.mktemp("installed")
    about = folder / "engine_of_gonio-0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: engine-of-gonio\nVersion: 0\n")
    lines = [f"{name} = {value}" for name, value in declared.items()]
    (about / "entry_points.txt").write_text("\n".join(["[xarray.backends]", *lines, ""]))
    monkeypatch.syspath_prepend(str(folder))
    plugins.list_engines.cache_clear()
    yield
    plugins.list_engines.cache_clear()


@pytest.fixture(scope="module")
def scan():
    return gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.4}, [10.0, 40.0], np.arange(-60, 61, 20.0))


def test_a_file_opens_by_the_name_of_the_engine(registered, sample_files, tmp_path):
    (tmp_path / "coating.bsdf").write_bytes(sample_files["zemax"][0].read_bytes())
    opened = xr.open_dataset(tmp_path / "coating.bsdf", engine="gonio")
    xr.testing.assert_identical(opened, gonio.read(tmp_path / "coating.bsdf"))
    assert opened.gonio.check() == gonio.check(opened)
    less = xr.open_dataset(str(tmp_path / "coating.bsdf"), engine="gonio", drop_variables="brdf")
    assert set(opened.variables) - set(less.variables) == {"brdf"}


def test_every_format_opens_and_what_is_signed_is_guessed(sample_files):
    engine = Gonio()
    for name, paths in sample_files.items():
        for path in paths:
            xr.testing.assert_identical(engine.open_dataset(path), gonio.read(path))
            signed = formats()[name].rank == SIGNED and path.is_file()
            if name != "tidy-csv":  # some of whose samples have a header in other words
                is_netcdf = path.is_file() and netcdf.is_netcdf(path.read_bytes()[:8])
                assert engine.guess_can_open(path) == (signed and not is_netcdf), path


def test_a_file_of_gonio_is_guessed_without_the_name_of_the_engine(registered, scan, tmp_path):
    gonio.write(scan, tmp_path / "scan.csv")
    xr.testing.assert_identical(xr.open_dataset(tmp_path / "scan.csv"), gonio.read(tmp_path / "scan.csv"))


def others(folder):
    """Files of other people, none of which is to be taken."""
    (folder / "table.csv").write_text("time,temperature\n1,2\n")
    (folder / "angles.csv").write_text("# theta_i_deg,theta_r_deg,brdf_sr-1\nday,theta_i_deg\n1,2\n")
    (folder / "five.txt").write_text("1 2 3 4 5\n2 3 4 5 6\n")
    (folder / "data.json").write_text(json.dumps({"a": [1, 2]}))
    (folder / "raw.bin").write_bytes(np.arange(1, 40, dtype="<i4").tobytes())
    (folder / "values.bin").write_bytes(np.full(700, 0.3).tobytes())
    (folder / "field.grib").write_bytes(b"GRIB" + bytes(200))
    (folder / "data.h5").write_bytes(netcdf.HDF5 + bytes(200))
    (folder / "empty.dat").write_bytes(b"")
    with zipfile.ZipFile(folder / "store.zip", "w") as file:
        file.writestr("zarr.json", "{}")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(folder / "data.nc", engine="scipy")
    (folder / "grid.zarr").mkdir()
    (folder / "grid.zarr" / "zarr.json").write_text("{}")
    return sorted(folder.iterdir())


def test_files_of_others_are_left_to_others(tmp_path):
    for path in others(tmp_path):
        assert not Gonio().guess_can_open(path), path.name
        assert not Gonio().guess_can_open(str(path)), path.name


@pytest.mark.parametrize(
    "given",
    ["https://example.org/a.nc", "no/such/file.nc", "a\0b", "x" * 5000, io.BytesIO(b"CDF"), b"CDF\x01", 3, None],
    ids=["address", "no file", "no name", "long", "buffer", "bytes", "number", "nothing"],
)
def test_guessing_raises_nothing(given):
    assert Gonio().guess_can_open(given) is False


def test_xarray_guesses_as_it_did(registered, tmp_path):
    """A file of NetCDF goes to the engines of xarray, and a file of nobody's is refused in xarray's own words."""
    others(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert xr.open_dataset(tmp_path / "data.nc")["a"].item() == 1.0
        with pytest.raises(ValueError, match="did not find a match in any of xarray's currently installed IO"):
            xr.open_dataset(tmp_path / "table.csv")


def test_what_is_no_path_and_what_is_no_scan_are_refused_in_a_line(tmp_path):
    with pytest.raises(TypeError, match="reads a file by its path, and was given a BytesIO: write it to a file first"):
        Gonio().open_dataset(io.BytesIO(b"a"))
    (tmp_path / "a.csv").write_text("time,temperature\n1,2\n")
    with pytest.raises(ValueError, match=r"a\.csv"):
        Gonio().open_dataset(tmp_path / "a.csv")


def test_looking_for_engines_loads_no_format(registered):
    code = "import sys, gonio.opening\nprint([m for m in sys.modules if m.startswith(('gonio.formats', 'scipy'))])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
