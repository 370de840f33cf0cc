"""Writing to a temporary name: files and directories, all or nothing."""

import pytest

from gonio.files import FormatError, replacing


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


def test_an_error_is_one_line_of_printable_characters_whatever_it_quotes():
    error = FormatError("scan.astm", "In\x0ctegrated 'é'\nis\ud800 no number", "line 18")
    assert str(error) == "scan.astm, line 18: In\\x0ctegrated 'é'\\nis\\ud800 no number"
