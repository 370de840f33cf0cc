"""What is no file that gonio reads: compressed files, archives, pipes, devices and `-`, in every command."""

import bz2
import gzip
import io
import lzma
import os
import tarfile
import zipfile

import pytest

from gonio import read
from gonio.app import arguments
from gonio.app.program import COMMANDS
from gonio.files import FormatError

TABLE = "theta_i_deg,theta_r_deg,brdf_sr-1\n" + "".join(f"{i},{r},1\n" for i in (10, 30) for r in range(-60, 61, 10))
READING = {
    "info": ("info", "{}"),
    "fit": ("fit", "{}", "--model", "lambert"),
    "compare": ("compare", "{}", "--models", "lambert"),
    "plot": ("plot", "{}", "--models", "lambert", "--out", "{folder}/x.png"),
    "check": ("check", "{}"),
    "report": ("report", "{}", "--model", "lambert", "--out", "{folder}/x.html"),
    "plan-next": ("plan-next", "{}", "--model", "lambert"),
    "fit-stack": ("fit-stack", "{}", "--model", "lambert", "--out", "{folder}/o.zarr"),
    "stack": ("stack", "{}", "--out", "{folder}/s.zarr"),
    "stack onto": ("stack", "{good}", "--out", "{folder}/s.zarr", "--onto", "{}"),
    "convert": ("convert", "{}", "{folder}/o.nc"),
    "onto": ("convert", "{good}", "{folder}/o.nc", "--onto", "{}"),
    "diff": ("diff", "{good}", "{}"),
    "reduce": ("reduce", "{}", "--out", "{folder}/o.csv"),
    "blank": ("reduce", "{good}", "--blank", "{}", "--out", "{folder}/o.csv"),
    "magnitude": ("magnitude", "{}", "{good}"),
    "pass": ("magnitude", "{body}", "{}"),
    "albedo": ("albedo", "ross-li", "--set", "fiso=1", "--material", "{}", "--wavelength", "500"),
    "eval": ("eval", "ggx", "--material", "{}", "--wavelength", "500", "--at", "10,10"),
    "draw": ("draw", "ggx", "--material", "{}", "--wavelength", "500", "--out", "{folder}/x.png"),
}
FILES = ("a measured scan", "measured scans", "the file that is compared", "a height map")  # as helps call them
every_reader = pytest.mark.parametrize("command", READING.values(), ids=READING)


def zipped(text):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("scan.csv", text)
    return target.getvalue()


def tarred(text):
    target = io.BytesIO()
    with tarfile.open(fileobj=target, mode="w") as archive:
        member = tarfile.TarInfo("scan.csv")
        member.size = len(text)
        archive.addfile(member, io.BytesIO(text))
    return target.getvalue()


PACKED = {
    "gz": (gzip.compress, "is compressed by gzip: unpack it first (gunzip -k "),
    "bz2": (bz2.compress, "is compressed by bzip2: unpack it first (bunzip2 -k "),
    "xz": (lzma.compress, "is compressed by xz: unpack it first (unxz -k "),
    "zst": (lambda text: b"\x28\xb5\x2f\xfd\x04\x58" + text, "is compressed by Zstandard: unpack it first (unzstd "),
    "zip": (zipped, "is a ZIP archive: unpack it first (unzip "),
    "tar": (tarred, "is a tar archive: unpack it first (tar -xf "),
    "7z": (lambda text: b"7z\xbc\xaf\x27\x1c" + text, "is a 7-Zip archive: unpack it first (7z x "),
}


def called(run, tmp_path, command, target):
    good = tmp_path / "good.csv"
    good.write_text(TABLE)
    body = tmp_path / "body.toml"
    body.write_text('[[facet]]\narea = 1\nnormal = [0, 0, 1]\nmodel = "lambert"\nvalues = {rho = 1}\n')
    return run(*(part.format(target, folder=tmp_path, good=good, body=body) for part in command))


@every_reader
@pytest.mark.parametrize("kind", PACKED)
def test_packed_files_say_what_they_are_and_how_to_unpack_them(run, tmp_path, command, kind):
    pack, said = PACKED[kind]
    path = tmp_path / f"my scan.csv.{kind}"
    path.write_bytes(pack(TABLE.encode()))
    code, out, err = called(run, tmp_path, command, path)
    assert code == 1
    assert out == ""
    assert err == f"gonio: {path}, byte 0: {said}'{path}')\n"


def test_workbooks_are_no_archives_to_unpack(tmp_path):
    for first in ("[Content_Types].xml", "xl/workbook.xml", "_rels/.rels"):
        path = tmp_path / "table.xlsx"
        with zipfile.ZipFile(path, "w") as book:
            book.writestr(first, "<a/>")
        with pytest.raises(FormatError, match=r"is a workbook or document .*: save its table as CSV"):
            read(path)


def test_text_in_utf_16_says_so(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(TABLE, encoding="utf-16")
    with pytest.raises(FormatError, match="is text in UTF-16: save it as UTF-8"):
        read(path)


@every_reader
def test_pipes_and_devices_are_refused_with_the_remedy(run, tmp_path, command):
    fifo = tmp_path / "pipe"
    os.mkfifo(fifo)
    for path in (fifo, "/dev/null"):
        code, out, err = called(run, tmp_path, command, path)
        assert (code, out) == (1, "")
        said = "is not a regular file, but a pipe or a device: save what it holds as a file first"
        assert err == f"gonio: {path}: {said}\n"


@every_reader
def test_a_dash_is_no_standard_input(run, tmp_path, command):
    code, out, err = called(run, tmp_path, command, "-")
    assert (code, out) == (1, "")
    assert err == "gonio: '-' is no file, and gonio reads no standard input: save what it holds as a file first\n"


def test_a_dash_is_no_output_but_of_json(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scan = tmp_path / "scan.csv"
    scan.write_text(TABLE)
    for command in (
        ("convert", scan, "-", "--to", "tidy-csv"),
        ("fit", scan, "--model", "lambert", "--out", "-"),
        ("plot", scan, "--models", "lambert", "--out", "-"),
        ("reduce", scan, "--out", "-", "--to", "tidy-csv"),
    ):
        code, _, err = run(*command)
        assert code == 1
        assert err == "gonio: the output is '-', and only --json writes to standard output: name a file\n"
    assert [path.name for path in tmp_path.iterdir()] == ["scan.csv"]


def test_help_says_what_no_input_is(run):
    for command in COMMANDS:
        _, out, _ = run(command, "--help")
        words = " ".join(out.split())
        takes_files = any(said in words for said in FILES)
        assert ("not pipes or -" in words) == (takes_files or command in ("check", "report")), command


def test_pairs_of_numbers_may_share_one_text():
    """One flag for several values, as others take lists; the names of groups may hold commas."""
    assert arguments.numbers(["a=1,b=2", "ks[30,R]=3, c-d=4"], "--set") == {"a": 1, "b": 2, "ks[30,R]": 3, "c-d": 4}
    assert arguments.held(["gamma=half-width,n=1"], "--hold") == {"gamma": "half-width", "n": 1}
    assert arguments.bounds(["gamma=5:90,sigma=0:1"], "--bound") == {"gamma": (5, 90), "sigma": (0, 1)}
    assert arguments.groups(["ks=theta_i,channel"], "--group") == {"ks": ("theta_i", "channel")}
    with pytest.raises(ValueError, match="--hold a is '1,2', not a number"):
        arguments.held(["a=1,2"], "--hold")
