"""A disk that is full, and folders that are not there: every writer names the file, and no hidden name is shown."""

import resource
import sys
from pathlib import Path

import numpy as np
import pytest

from gonio import write
from gonio.files import FormatError, naming, replacing
from gonio.formats import formats
from gonio.measured.dataset import make_scan
from stacks import write_stack

WRITABLE = [
    f for f in formats().values() if f.write and f.holds.reflection and not f.holds.quantity and f.name != "merl"
]  # 33 MB take long
SUFFIXES = {f.name: f.suffix for f in WRITABLE}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a scan of the hemisphere, which is the current one."""
    theta_i, theta_r, phi = (a.ravel() for a in np.meshgrid([10.0, 40], np.arange(0, 86, 5.0), np.arange(0, 360, 15.0)))
    cosines = np.cos(np.radians(theta_i)) * np.cos(np.radians(theta_r))  # of both: reciprocal
    write(make_scan(theta_i, theta_r, 0.02 + 0.2 * cosines, phi), tmp_path / "scan.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def full(monkeypatch):
    """No file may grow beyond so many bytes, which is what a disk without room looks like to a program."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python itself would leave half of what it compiles
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


OTHERS = {
    "json": ("info scan.csv --json out.json", "out.json"),
    "netcdf of a fit": ("fit scan.csv --model lambert --out out", "out/fit.json"),
    "png": ("plot scan.csv --models lambert --out out.png", "out.png"),
    "svg": ("draw lambert --set rho=1 --out out.svg", "out.svg"),
    "difference": ("diff scan.csv scan.csv --out out.png", "out.png"),
    "reduced": ("reduce scan.csv --out out.csv", "out.csv"),
}
COMMANDS = OTHERS | {
    name: (f"convert scan.csv out{suffix} --to {name} --fill symmetry,lambert", f"out{suffix}")
    for name, suffix in SUFFIXES.items()
}


MORE = [("rgl", 1000), ("netcdf of a fit", 1000)]  # bytes at which NumPy counts, and at which a later file fails


@pytest.mark.parametrize(("name", "room"), [(name, 20) for name in COMMANDS] + MORE)
def test_a_full_disk_is_told_with_the_name_of_the_file(run, here, full, name, room):
    command, target = COMMANDS[name]
    full(room)
    code, out, err = run(*command.split())
    full(resource.RLIM_INFINITY)
    assert (code, err.count("\n")) == (1, 1), (out, err)
    named = target if room == 20 or name != "netcdf of a fit" else "out/"
    assert named in err
    assert "File too large" in err or "is the disk full?" in err
    assert ".gonio" not in err
    assert [path.name for path in here.iterdir()] == ["scan.csv"]


def test_standard_output_on_a_full_disk_is_named(run, here, monkeypatch):
    for extra in ((), ("--json", "-")):
        with Path("/dev/full").open("w") as stream, monkeypatch.context() as patch:
            patch.setattr("sys.stdout", stream)
            code, _, err = run("info", "scan.csv", *extra)
            patch.undo()
            stream.buffer.raw.close()  # what is still buffered has no place to go
        assert code == 1
        assert err == "gonio: [Errno 28] No space left on device: 'standard output'\n"


def test_no_error_shows_a_hidden_name(tmp_path):
    path = tmp_path / "a\nb.csv"

    def fails(error):
        with replacing(path) as temporary:
            raise error(temporary)

    with pytest.raises(FormatError) as caught:
        fails(lambda hidden: FormatError(hidden, "is wrong", "line 3"))
    assert str(caught.value) == f"{path}, line 3: is wrong"
    with pytest.raises(FormatError) as caught:
        fails(lambda hidden: FormatError(hidden / "brdf" / "zarr.json", "is wrong"))
    assert str(caught.value) == f"{path}/brdf/zarr.json: is wrong"
    with pytest.raises(OSError, match="No space") as caught_too:
        fails(lambda hidden: OSError(28, "No space left", str(hidden / "brdf")))
    assert caught_too.value.filename == str(path / "brdf")
    with pytest.raises(OSError, match="is the disk full") as caught_too:
        fails(lambda hidden: OSError("3 requested and 2 written"))
    assert str(path) in str(caught_too.value)
    assert list(tmp_path.iterdir()) == []


def test_errors_of_gonios_own_keep_their_words(tmp_path):
    said = FileExistsError("x exists: choose another name")
    with pytest.raises(FileExistsError) as caught, naming(tmp_path / "y"):
        raise said
    assert str(caught.value) == "x exists: choose another name"


NEW_FOLDER = {
    "convert": "convert scan.csv typo/dir/out.nc",
    "plot": "plot scan.csv --models lambert --out typo/dir/x.png",
    "plot without suffix": "plot scan.csv --models lambert --out typo/dir/x",
    "fit": "fit scan.csv --model lambert --out typo/dir",
    "json": "fit scan.csv --model lambert --json typo/fit.json",
    "info": "info scan.csv --json typo/info.json",
    "diff": "diff scan.csv scan.csv --out typo/x.png",
    "draw": "draw lambert --set rho=1 --out typo/x.png",
    "reduce": "reduce scan.csv --out typo/x.csv",
    "plan-next": "plan-next scan.csv --model lambert --out typo/x.csv",
    "demo": "demo --out typo/demo",
    "stack": "stack scan.csv --out typo/s.zarr",
    "fit-stack": "fit-stack stack.zarr --model lambert --out typo/o.zarr",
}


@pytest.mark.parametrize("name", NEW_FOLDER)
def test_a_folder_that_is_not_there_is_refused_before_the_work(run, here, name):
    write_stack(here / "stack.zarr", {"sample": 3})
    code, out, err = run(*NEW_FOLDER[name].split(), "--force")
    assert (code, out) == (1, "")
    assert "there is no such folder; make it first, or mend the name" in err
    assert err.count("\n") == 1
    assert not (here / "typo").exists()


def test_a_file_in_place_of_the_folder_is_told(run, here):
    code, _, err = run("convert", "scan.csv", "scan.csv/out.nc")
    assert code == 1
    assert "lies inside scan.csv" in err or "is no folder" in err
