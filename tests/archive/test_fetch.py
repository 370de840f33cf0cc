"""Fetching from a server on this machine, whole, cut off or with wrong bytes, and from the cache alone."""

import contextlib
import functools
import hashlib
import json
import subprocess
import sys
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from gonio import archive
from gonio.app.cli import main
from gonio.app.commands import fetch as command
from gonio.archive import collection as declared
from gonio.archive import download
from gonio.archive.collection import Collection, PublicFile
from places import ROOT

CONTENT = bytes(range(256)) * 4000  # 1 MB, no part of it like another by accident of length
SHA256 = hashlib.sha256(CONTENT).hexdigest()

SHARED = ROOT.parent / "shared" / "data" / "files"
NAME = "small/surface"


class Server(BaseHTTPRequestHandler):
    """Serves CONTENT as its `manner` says and notes each request in `asked`: (path, Range)."""

    protocol_version = "HTTP/1.1"

    def __init__(self, manner, asked, *args):
        self.manner, self.asked = manner, asked
        super().__init__(*args)

    def do_GET(self):
        wanted = self.headers.get("Range", "")
        self.asked.append((self.path, wanted))
        cuts = self.manner.startswith("cuts")
        if self.manner == "missing":
            self.send_error(404)
            return
        if self.manner == "down" or (self.manner == "down once" and len(self.asked) == 1):
            self.send_error(503)
            return
        body = {"wrong": CONTENT[::-1], "longer": CONTENT + b"more", "shorter": CONTENT[:-1]}.get(self.manner, CONTENT)
        start = int(wanted.removeprefix("bytes=").removesuffix("-")) if wanted and self.manner != "no ranges" else 0
        self.send_response(206 if start else 200)
        if start:
            self.send_header("Content-Range", f"bytes {start}-{len(body) - 1}/{len(body)}")
        self.send_header("Content-Length", str(len(body) - start))
        self.end_headers()
        if self.manner == "drips":
            with contextlib.suppress(ConnectionError):
                while True:
                    self.wfile.write(b"\0")
                    self.wfile.flush()
                    threading.Event().wait(0.02)
            self.close_connection = True
            return
        end = start + 300_000 if cuts else len(body)
        with contextlib.suppress(ConnectionError):
            self.wfile.write(body[start:end])
        self.close_connection = cuts or self.manner == "no ranges"

    def log_message(self, *args):
        pass


@pytest.fixture
def serve(monkeypatch, tmp_path):
    """Start a server of some manner: its address, and the list of what it is asked."""
    running = []

    def start(manner):
        asked = []
        server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Server, manner, asked))
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        running.append(server)
        return f"http://127.0.0.1:{server.server_port}/mirror", asked

    yield start
    for server in running:
        server.shutdown()
        server.server_close()


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """One collection of one small file beside the real ones, an own cache, and no pauses."""
    file = PublicFile("surface", "deep/surface.bsdf", SHA256, len(CONTENT))
    empty = Collection("none", "t", "http://x", "http://home", "MIT", ("guo2023",), "c", "kept by hand only", {})
    one = Collection(
        "small",
        "Test data",
        "http://127.0.0.1:9/",
        "http://home",
        "MIT",
        ("guo2023",),
        "A paper.",
        "",
        {"surface": file},
    )
    every = {**declared.collections(), "small": one, "none": empty}
    monkeypatch.setattr(declared, "collections", lambda: type(declared_all)("collection", every))
    monkeypatch.setattr(archive, "collections", declared.collections)
    monkeypatch.setattr(command, "collections", declared.collections)
    monkeypatch.setenv("GONIO_DATA", str(tmp_path / "cache"))
    monkeypatch.setattr(download.time, "sleep", lambda seconds: None)
    for proxy in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(proxy, raising=False)


declared_all = declared.collections()


def contents(folder):
    return sorted(p.name for p in folder.rglob("*") if p.is_file())


def test_downloaded_once_and_found_again_without_network(serve, tmp_path):
    address, asked = serve("whole")
    seen = []
    path = archive.fetch(NAME, address, accept=seen.append)
    assert path == tmp_path / "cache" / "small" / "surface.bsdf"
    assert path.read_bytes() == CONTENT
    assert asked == [("/mirror/deep/surface.bsdf", "")]
    assert [c.name for c in seen] == ["small"]
    # Port 9 answers nobody, so this one comes from the cache, and the licence is not shown again.
    assert archive.fetch(NAME, accept=seen.append) == path
    assert len(seen) == len(asked) == 1
    assert contents(tmp_path) == ["small-licence.txt", "surface.bsdf"]
    assert "A paper." in (path.parent / "small-licence.txt").read_text()


def test_a_line_that_breaks_is_taken_up_where_it_broke(serve):
    address, asked = serve("cuts")
    assert archive.fetch(NAME, address).read_bytes() == CONTENT
    starts = [int(r.removeprefix("bytes=").removesuffix("-") or 0) for _, r in asked]
    assert len(starts) == 4
    # Each answer brings 300 000 bytes, and the last piece of one that breaks off is lost.
    assert all(0 <= k * 300_000 - start < k * download.CHUNK for k, start in enumerate(starts[1:], start=1))
    assert starts[0] == 0


def test_what_arrived_is_kept_for_the_next_run(serve, monkeypatch, tmp_path):
    address, _ = serve("cuts")
    monkeypatch.setattr(download, "ATTEMPTS", 2)
    with pytest.raises(OSError, match=r"surface\.bsdf did not arrive.*same command goes on from it"):
        archive.fetch(NAME, address)
    assert contents(tmp_path) == ["small-licence.txt", "surface.bsdf.part"]
    arrived = (tmp_path / "cache" / "small" / "surface.bsdf.part").stat().st_size
    assert 0 <= 600_000 - arrived < 2 * download.CHUNK
    whole, asked = serve("whole")
    assert archive.fetch(NAME, whole).read_bytes() == CONTENT
    assert asked == [("/mirror/deep/surface.bsdf", f"bytes={arrived}-")]
    assert contents(tmp_path) == ["small-licence.txt", "surface.bsdf"]


def test_a_server_without_ranges_starts_again(serve, tmp_path):
    partial = tmp_path / "cache" / "small" / "surface.bsdf.part"
    partial.parent.mkdir(parents=True)
    partial.write_bytes(CONTENT[:1000])
    address, asked = serve("no ranges")
    assert archive.fetch(NAME, address).read_bytes() == CONTENT
    assert asked == [("/mirror/deep/surface.bsdf", "bytes=1000-")]


@pytest.mark.parametrize("begun", [b"of another version", CONTENT + b"too long", b"x" * len(CONTENT)])
def test_a_partial_file_of_something_else_is_thrown_away(serve, tmp_path, begun):
    partial = tmp_path / "cache" / "small" / "surface.bsdf.part"
    partial.parent.mkdir(parents=True)
    partial.write_bytes(begun)
    address, _ = serve("whole")
    assert archive.fetch(NAME, address).read_bytes() == CONTENT
    assert not partial.exists()


@pytest.mark.parametrize("manner", ["wrong", "longer"])
def test_wrong_bytes_are_refused_and_nothing_stays(serve, tmp_path, manner):
    address, _ = serve(manner)
    with pytest.raises(ValueError, match="was expected; nothing was kept") as caught:
        archive.fetch(NAME, address)
    message = str(caught.value)
    assert f"{address}/deep/surface.bsdf" in message
    assert SHA256 in message
    if manner == "wrong":
        assert hashlib.sha256(CONTENT[::-1]).hexdigest() in message
    assert contents(tmp_path) == ["small-licence.txt"]


def test_a_file_that_ends_too_early(serve, tmp_path):
    address, _ = serve("shorter")
    with pytest.raises(OSError, match="did not arrive"):
        archive.fetch(NAME, address)
    assert contents(tmp_path) == ["small-licence.txt", "surface.bsdf.part"]


def test_an_archive_that_is_down_is_asked_again_and_one_without_the_file_is_not(serve):
    address, asked = serve("down once")
    assert archive.fetch(NAME, address).read_bytes() == CONTENT
    assert len(asked) == 2
    Path(archive.cache() / "small" / "surface.bsdf").unlink()
    address, asked = serve("down")
    with pytest.raises(OSError, match="did not arrive"):
        archive.fetch(NAME, address)
    assert len(asked) == download.ATTEMPTS
    address, asked = serve("missing")
    with pytest.raises(ValueError, match="answers 404 Not Found: name a mirror with --base-url"):
        archive.fetch(NAME, address)
    assert len(asked) == 1


def test_an_archive_that_sends_a_byte_at_a_time_does_not_hold_the_command_for_ever(serve, monkeypatch):
    monkeypatch.setattr(download, "AFTER", 0.2)
    address, asked = serve("drips")
    with pytest.raises(OSError, match=r"did not arrive: .* bytes arrived in 0 s"):
        archive.fetch(NAME, address)
    assert len(asked) == download.ATTEMPTS


def test_a_damaged_file_in_the_cache_is_fetched_anew(serve):
    address, asked = serve("whole")
    path = archive.fetch(NAME, address)
    path.write_bytes(CONTENT[:-1] + b"!")
    assert archive.fetch(NAME, address).read_bytes() == CONTENT
    assert len(asked) == 2


def test_into_a_folder_without_overwriting(serve, tmp_path):
    address, _ = serve("whole")
    folder = tmp_path / "mine"
    assert archive.fetch(NAME, address, folder=folder) == folder / "surface.bsdf"
    assert archive.fetch(NAME, folder=folder) == folder / "surface.bsdf"
    (folder / "surface.bsdf").write_text("precious")
    with pytest.raises(FileExistsError, match="another file: choose another folder"):
        archive.fetch(NAME, address, folder=folder)
    assert (folder / "surface.bsdf").read_text() == "precious"


def test_who_does_not_accept_gets_nothing(serve, tmp_path):
    address, asked = serve("whole")

    def refuse(collection):
        raise PermissionError(collection.licence)

    with pytest.raises(PermissionError, match="MIT"):
        archive.fetch(NAME, address, accept=refuse)
    assert asked == []
    assert contents(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "kind", "said"),
    [
        ("small/surfac", KeyError, "no public file is called 'small/surfac'; nearest: small/surface"),
        ("merl/alumnium", KeyError, "merl/aluminium"),
        ("mrl/aluminium", KeyError, "merl/aluminium"),
        ("merl", ValueError, "merl is a collection of 100 files: name one, as in merl/"),
        ("none/any", ValueError, "kept by hand only"),
        ("jsss/aluminium", ValueError, "Take it from the homepage"),
    ],
)
def test_names_that_are_none(name, kind, said):
    with pytest.raises(kind) as caught:
        archive.fetch(name)
    assert said in str(caught.value.args[0])


def test_an_address_that_is_none():
    with pytest.raises(ValueError, match="begins with https"):
        archive.fetch(NAME, "file:///etc")


def test_every_collection_says_licence_citation_and_pins_every_file():
    bibliography = (ROOT / "references.bib").read_text(encoding="utf-8")
    assert set(declared_all) == {"merl", "rgl", "ualoft", "satellite", "jsss"}
    for collection in declared_all.values():
        assert collection.base_url.startswith("https://")
        assert collection.base_url.endswith("/")
        assert collection.licence
        assert collection.citation
        assert all(f"{{{key}," in bibliography for key in collection.cite)
        basenames = [file.basename for file in collection.files.values()]
        assert len(set(basenames)) == len(basenames)
        for file in collection.files.values():
            assert len(file.sha256) == 64
            int(file.sha256, 16)
            assert file.size > 0
            assert ".." not in file.path
            assert not file.path.startswith("/")


def test_pins_are_those_of_the_files_beside_the_project():
    if not SHARED.is_dir():
        pytest.skip(f"no public files at {SHARED}")
    rows = (line.split("\t") for line in (SHARED / "merl_sha256.tsv").read_text().splitlines())
    assert {f.basename: (f.sha256, str(f.size)) for f in declared_all["merl"].files.values()} == {
        name: (digest, size) for name, digest, size in rows
    }
    for collection, folders in {"rgl": ["rgl"], "ualoft": ["fred", "rt300s"], "satellite": ["columns"]}.items():
        for file in declared_all[collection].files.values():
            (path,) = [SHARED / f / file.basename for f in folders if (SHARED / f / file.basename).exists()]
            assert hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256
            assert path.stat().st_size == file.size


@pytest.fixture
def run(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "100")

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["gonio", "fetch", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code or 0
        return code, *capsys.readouterr()

    return call


def test_the_command_shows_the_licence_once_and_the_path_alone_on_standard_output(run, serve):
    address, _ = serve("whole")
    code, out, err = run(NAME, "--base-url", address)
    assert code == 0
    assert Path(out.strip()).read_bytes() == CONTENT
    assert "licence: MIT" in err
    assert "A paper." in err
    assert run(NAME) == (0, out, "")


def test_the_command_lists_and_shows_without_network(run):
    code, out, _ = run()
    assert code == 0
    assert "merl" in out
    assert "CC-BY-SA-4.0" in out
    assert "3.5 GB" in out
    code, out, _ = run("rgl")
    assert "rgl/satin_rosaline_rgb" in out
    assert "Only files whose SHA-256 is known" in " ".join(out.split())
    code, out, _ = run("merl/aluminium", "--licence")
    assert code == 0
    assert "cite matusik2003" in out
    listed = json.loads(run("--json", "-")[1])
    assert next(c for c in listed if c["name"] == "merl")["files"][2]["name"] == "merl/aluminium"


def test_the_command_refuses_in_one_line(run, serve):
    address, _ = serve("wrong")
    code, out, err = run(NAME, "--base-url", address)
    assert (code, out) == (1, "")
    assert err.splitlines()[-1].startswith(f"gonio: {address}/deep/surface.bsdf is not the file")
    code, _, err = run("merl/alumnium")
    assert code == 1
    assert err.startswith("gonio: no public file is called 'merl/alumnium'; nearest: merl/aluminium")
    code, _, err = run("jsss/copper")
    assert code == 1
    assert "save the columns as tidy CSV" in err


def test_a_folder_is_made_only_in_one_that_is_there(run, serve, tmp_path):
    address, _ = serve("whole")
    code, _, err = run(NAME, "--base-url", address, "--to", tmp_path / "typo" / "dir")
    assert code == 1
    assert "there is no such folder; make it first" in err
    assert not (tmp_path / "typo").exists()
    code, out, _ = run(NAME, "--base-url", address, "--to", tmp_path / "new")
    assert (code, Path(out.strip()).parent) == (0, tmp_path / "new")


def test_json_of_a_fetched_file(run, serve):
    address, _ = serve("whole")
    found = json.loads(run(NAME, "--base-url", address, "--json", "-")[1])
    assert found["sha256"] == SHA256
    assert Path(found["path"]).read_bytes() == CONTENT


def test_nothing_of_the_network_is_loaded_before_it_is_needed():
    code = "import sys, gonio.app.cli; from gonio.archive import collections; collections()"
    code += "; print({'requests', 'pooch'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_the_collections_are_valid_toml_of_plain_names():
    for path in (ROOT / "src" / "gonio" / "archive").glob("*.toml"):
        files = tomllib.loads(path.read_text(encoding="utf-8"))["files"]
        assert all("/" not in name and name.isascii() for name in files)
