"""How `gonio view` ends: at once, with all of its processes, whatever ends it."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

import gonio
from asking import Client
from gonio.app.commands.view import _seconds
from gonio.formats import write
from gonio.processes.ending import LONGEST
from gonio.viewing.serving.running import Serving, _listening, hosts

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are looked up in Linux's /proc")
# Ctrl-C is not ignored, even where the tests run in the background of a shell.
PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from gonio.app.cli import main; main()"
)


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    path = tmp_path_factory.mktemp("scan") / "scan.csv"
    write(gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.3}, [20.0, 40.0], np.arange(-70, 71, 5.0)), path)
    return path


@contextmanager
def viewing(scan, *options):
    arguments = [sys.executable, "-c", PROGRAM, "view", str(scan), "--no-browser", *options]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        process.stderr.close()


def family(process):
    """The numbers of the processes that a process started, and those that these did."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, IndexError):
            if int((entry / "stat").read_text().rpartition(")")[2].split()[1]) == process:
                found += [int(entry.name), *family(int(entry.name))]
    return found


def gone(numbers, seconds=3.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if not any(Path(f"/proc/{number}").exists() for number in numbers):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_fit_ends_with_the_server(scan, number):
    with viewing(scan) as (process, address):
        client = Client(address)
        client.ask("POST", "/api/fit", {"set": 0, "model": "best"})
        while not (children := family(process.pid)):
            time.sleep(0.02)
        begun = time.monotonic()
        process.send_signal(number)
        process.wait(20)
        assert time.monotonic() - begun < LONGEST + 1  # s; a fit would take longer
        assert gone(children)
        if number is not signal.SIGKILL:
            assert process.returncode == 128 + number  # as every command of gonio ends
            assert len(process.stderr.read().splitlines()) == 1


def test_it_ends_when_nobody_asks(scan):
    with viewing(scan, "--idle", "1s") as (process, address):
        assert address.startswith("http://127.0.0.1:")
        assert process.wait(10) == 0
        assert process.stderr.read() == ""


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "example.org", "::"])
def test_other_machines_are_let_in_only_when_asked(host):
    with pytest.raises(ValueError, match="--expose"):
        Serving(host=host)
    assert "localhost" in hosts(Serving(host=host, expose=True))


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.2", "::1"])
def test_this_machine_needs_no_leave(host):
    assert Serving(host=host).is_private
    assert set(hosts(Serving(host=host))) >= {"127.0.0.1", "localhost"}


def test_exposing_is_warned_of_and_answers_to_the_name(scan):
    with viewing(scan, "--host", "0.0.0.0", "--expose") as (process, address):
        assert address.startswith(f"http://{os.uname().nodename.lower()}:")
        client = Client(address.replace(os.uname().nodename.lower(), "127.0.0.1"))
        assert client.ask("GET", "/api/session").status == 200
        assert client.ask("GET", "/api/session", Host=f"{os.uname().nodename}:{client.port}").status == 200
        assert client.ask("GET", "/api/session", Host=f"evil.example:{client.port}").status == 421
        process.terminate()
        assert "nothing on the way is encrypted" in process.stderr.read()


@pytest.mark.parametrize(
    ("text", "seconds"), [("30m", 1800.0), ("90s", 90.0), ("2h", 7200.0), ("1.5 min", 90.0), ("", 0.0)]
)
def test_a_time_has_a_unit(text, seconds):
    assert _seconds(text) == seconds


@pytest.mark.parametrize("text", ["x", "30", "-1m", "0m", "1d", "nan s"])
def test_a_time_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match="30m"):
        _seconds(text)


def test_an_answer_is_sent_at_once():
    """Asyncio switches Nagle's algorithm off where the protocol is named; else each of fifty answers waits 40 ms."""
    with _listening(Serving()) as listening:
        assert listening.proto == socket.IPPROTO_TCP
        with socket.create_connection(listening.getsockname()):
            accepted, _ = listening.accept()
            with accepted:
                assert accepted.proto == socket.IPPROTO_TCP  # what asyncio looks at
