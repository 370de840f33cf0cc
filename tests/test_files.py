"""Writing to a temporary name: files and directories, all or nothing."""

import errno
import os
import stat
import threading
from pathlib import Path

import pytest

from gonio.files import FormatError, filling, refuse_overlap, replacing


def fill(path, name="part"):
    path.unlink()
    path.mkdir()
    (path / name).write_text("new")


def test_a_directory_takes_the_name_and_leaves_nothing_behind(tmp_path):
    with replacing(tmp_path / "store") as temporary:
        fill(temporary)
    assert (tmp_path / "store" / "part").read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["store"]


def test_a_directory_replaces_a_file_or_one_of_its_kind_by_force(tmp_path):
    path = tmp_path / "store"
    path.write_text("old")
    for _ in range(2):
        with replacing(path, force=True) as temporary:
            fill(temporary)
        assert [p.name for p in path.iterdir()] == ["part"]
    assert [p.name for p in tmp_path.iterdir()] == ["store"]


def test_a_directory_of_other_files_stays(tmp_path):
    path = tmp_path / "home"
    path.mkdir()
    (path / "precious").write_text("old")
    with pytest.raises(FileExistsError, match="a directory of other files"), replacing(path, force=True) as temporary:
        fill(temporary)
    assert [p.name for p in path.iterdir()] == ["precious"]
    with pytest.raises(IsADirectoryError), replacing(path, force=True) as temporary:
        temporary.write_text("new")
    assert [p.name for p in tmp_path.iterdir()] == ["home"]


def test_a_directory_half_written_vanishes(tmp_path):
    path = tmp_path / "store"
    path.mkdir()
    (path / "part").write_text("old")

    def fails(temporary):
        fill(temporary)
        raise RuntimeError("full disk")

    with pytest.raises(RuntimeError, match="full disk"), replacing(path, force=True) as temporary:
        fails(temporary)
    assert (path / "part").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["store"]


def test_a_link_stays_and_what_it_points_to_is_replaced(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    with replacing(link, force=True) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_pipe_gets_what_is_written_and_stays(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_text()))
    reader.start()
    with replacing(pipe) as temporary:  # no force: nothing is lost
        temporary.write_text("new")
    reader.join(10)
    assert got == ["new"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]


def test_a_device_stays_a_device():
    with replacing("/dev/null", force=True) as temporary:
        temporary.write_text("new")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    with pytest.raises(FileExistsError, match="one stream of bytes"), replacing("/dev/null") as temporary:
        fill(temporary)


def test_a_long_name_is_no_longer_while_it_is_written(tmp_path):
    with replacing(tmp_path / ("n" * 250 + ".csv")) as temporary:
        temporary.write_text("new")
    assert [len(p.name) for p in tmp_path.iterdir()] == [254]


@pytest.mark.parametrize("named", [True, False])
def test_an_error_of_the_system_names_the_file_that_was_meant(tmp_path, named):
    path = tmp_path / "scan.csv"
    with pytest.raises(OSError, match="No space left") as failed, replacing(path) as temporary:
        raise OSError(errno.ENOSPC, "No space left on device", *([str(temporary)] if named else []))
    assert failed.value.filename == str(path)


def test_a_folder_is_filled_whole_or_not_at_all_and_its_other_files_stay(tmp_path):
    folder = tmp_path / "results"

    def fails(temporary):
        (temporary / "first").write_text("new")
        raise RuntimeError("full disk")

    with pytest.raises(RuntimeError, match="full disk"), filling(folder) as temporary:
        fails(temporary)
    assert list(tmp_path.iterdir()) == []
    for text in ("old", "new"):
        with filling(folder, force=text == "new") as temporary:
            (temporary / "first").write_text(text)
        (folder / "mine").write_text("kept")
    assert {p.name: p.read_text() for p in folder.iterdir()} == {"first": "new", "mine": "kept"}
    with pytest.raises(FileExistsError, match="--force"), filling(folder):
        pass
    assert [p.name for p in tmp_path.iterdir()] == ["results"]


def test_an_output_is_no_input_and_lies_neither_inside_nor_around_one(tmp_path):
    store = tmp_path / "stack.zarr"
    store.mkdir()
    (tmp_path / "link").symlink_to(store)
    for path, how in ((store, "is"), (store / "fits", "lies inside"), (tmp_path, "holds"), (tmp_path / "link", "is")):
        with pytest.raises(ValueError, match=f"{how} .*which is read"):
            refuse_overlap(path, [store])
    refuse_overlap(tmp_path / "stack.zarr.out", [store])
    refuse_overlap(tmp_path / "out", [])


def test_an_error_is_one_line_of_printable_characters_whatever_it_quotes():
    error = FormatError("scan.astm", "In\x0ctegrated 'é'\nis\ud800 no number", "line 18")
    assert str(error) == "scan.astm, line 18: In\\x0ctegrated 'é'\\nis\\ud800 no number"
