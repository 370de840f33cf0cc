"""Files that a page hands over: read by a process that may fail, in a file that goes away."""

import resource
import socket
import stat
from contextlib import closing

import numpy as np
import pytest

import gonio
from asking import served
from gonio.processes.worker import Bench, WorkerError
from gonio.viewing.serving import uploads
from gonio.viewing.session import Opened, Session
from misreading import greedy, slow

CSV = b"theta_i_deg,theta_r_deg,phi_deg,brdf_sr-1\n30,10,180,0.5\n30,20,180,0.6\n30,30,180,0.7\n"


@pytest.fixture(scope="module")
def client():
    scan = gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.3}, [20.0], np.arange(-70, 71, 10.0))
    with served(Session([Opened("a.csv", scan)])) as asking:
        yield asking


def test_an_uploaded_scan_is_a_set(client):
    answer = client.ask("POST", "/api/upload?name=new.csv", CSV)
    assert answer.status == 200
    place = answer.json["place"]
    assert answer.json["set"]["name"] == "new.csv"
    assert client.ask("GET", f"/api/set/{place}.bin").status == 200
    assert client.ask("GET", "/api/session").json["sets"][place]["name"] == "new.csv"


@pytest.mark.parametrize(
    ("given", "called"),
    [("../../etc/passwd", "passwd"), ("C:%5Cx%5Cy.csv", "y.csv"), ("%3Cscript%3E%0a.csv", "_script_.csv"),
     ("", "upload"), ("...", "upload"), ("x" * 300 + ".csv", "x" * 76 + ".csv")],
)  # fmt: skip
def test_a_name_leads_nowhere(client, given, called):
    assert client.ask("POST", f"/api/upload?name={given}", CSV).json["set"]["name"] == called


@pytest.mark.parametrize(
    "body",
    [b"\x00\x01junk" * 100, b"", b"CDF\x01" + b"\xff" * 500, b"\x89HDF\r\n\x1a\n" + b"\x00" * 500, b"<html>",
     b"PK\x03\x04" + b"\xff" * 200, b"theta_i_deg,brdf\n1,2\n", CSV.splitlines()[0]],
)  # fmt: skip
def test_a_damaged_file_is_a_message(client, body, tmp_path):
    answer = client.ask("POST", "/api/upload?name=bad.csv", body)
    assert answer.status == 422
    assert "bad.csv" in answer.json["error"]
    assert "/tmp" not in answer.json["error"]
    assert ".gonio-" not in answer.json["error"]


def test_what_is_too_large_is_refused_before_it_is_read(client):
    """300 MB are announced, and some kB sent: the answer comes all the same."""
    with socket.create_connection((client.host, client.port), timeout=10) as raw:
        head = (
            f"POST /api/upload?name=x HTTP/1.1\r\nHost: {client.host}:{client.port}\r\nCookie: {client.cookie}\r\n"
            f"Origin: http://{client.host}:{client.port}\r\nContent-Type: application/octet-stream\r\n"
            f"Content-Length: {300 * 2**20}\r\n\r\n"
        )
        raw.sendall(head.encode() + b"x" * 1000)
        assert raw.recv(100).split()[1] == b"413"


def test_what_grows_too_large_is_refused_and_not_kept(client):
    """Without a length the bytes are counted: memory does not grow with them."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    sent = 0
    with socket.create_connection((client.host, client.port), timeout=10) as raw:
        head = (
            f"POST /api/upload?name=x HTTP/1.1\r\nHost: {client.host}:{client.port}\r\nCookie: {client.cookie}\r\n"
            f"Origin: http://{client.host}:{client.port}\r\nContent-Type: application/octet-stream\r\n"
            "Transfer-Encoding: chunked\r\n\r\n"
        )
        raw.sendall(head.encode())
        chunk = b"x" * 2**16
        try:
            while sent < 300 * 2**20:
                raw.sendall(b"10000\r\n" + chunk + b"\r\n")
                sent += len(chunk)
        except OSError:
            pass
        assert raw.recv(100).split()[1] == b"413"
    assert sent < 300 * 2**20
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


def test_the_file_is_private_and_goes_away(client, monkeypatch):
    seen = {}
    read = uploads._read

    def looking(bench, path):
        seen["path"], seen["mode"] = path, stat.S_IMODE(path.stat().st_mode)
        seen["folder"] = stat.S_IMODE(path.parent.stat().st_mode)
        return read(bench, path)

    monkeypatch.setattr(uploads, "_read", looking)
    assert client.ask("POST", "/api/upload?name=new.csv", CSV).status == 200
    assert (seen["mode"], seen["folder"]) == (0o600, 0o700)
    assert not seen["path"].exists()
    assert not seen["path"].parent.exists()


@pytest.mark.parametrize(("reader", "word"), [(slow, "stopped"), (greedy, "memory")])
def test_a_file_that_takes_too_much_is_a_message(monkeypatch, tmp_path, reader, word):
    monkeypatch.setattr(uploads, "SECONDS", 0.5 if reader is slow else 60.0)
    monkeypatch.setattr("gonio.viewing.working.reading.read_uploaded", reader)
    with closing(Bench()) as bench, pytest.raises(WorkerError, match=word):
        uploads._read(bench, tmp_path)
