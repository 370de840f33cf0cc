"""A signal ends the program in order and with one line, wherever it is; and real commands at a few moments."""

import os
import signal
import subprocess
import sys
import time

import pytest

from interrupting import COMMANDS, LIMIT, SCAN, Trial, heard, inputs, tried

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes are looked up in Linux's /proc")

# The program with another command in it, `work`, which says "on" when the signal may come.
PROGRAM = """
import sys
from gonio.app import cli
from gonio.app.cli import main
def on():
    print("on", flush=True)
{work}
cli.app = work
main()
"""

DESTRUCTOR = """
import time
class Held:
    def __del__(self):
        on()
        time.sleep(60)
def work():
    Held()
    time.sleep(60)
"""
LONG_CALL = """
import hashlib
def work():
    on()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""
EXIT = """
import atexit, time
def work():
    atexit.register(time.sleep, 60)
    atexit.register(on)
"""
THREADS = """
import concurrent.futures, time
def work():
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        list(pool.map(time.sleep, [0, 60], timeout=on()))
"""
WAKEUP = """
import signal, socket, time
def work():
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    signal.set_wakeup_fd(theirs.fileno())  # as a loop of asyncio does that listens to signals
    on()
    time.sleep(60)
"""
LIBRARY = """
import asyncio
async def caught():
    try:
        on()
        await asyncio.sleep(60)
    except BaseException:
        print("what a library says of it", file=sys.stderr)
        await asyncio.sleep(60)
def work():
    asyncio.run(caught())
"""


def begun(work, folder):
    """The program with this command in a session of its own, at work in a folder."""
    paths = os.pathsep.join(filter(None, sys.path))
    with heard():
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM.format(work=work)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=os.environ | {"PYTHONPATH": paths},
            start_new_session=True,
        )
    assert process.stdout.readline() == "on\n", process.communicate()[1]
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name)
@pytest.mark.parametrize(
    "work", [DESTRUCTOR, LONG_CALL, EXIT, THREADS, WAKEUP], ids=["del", "call", "exit", "threads", "wakeup"]
)
def test_a_signal_is_not_lost_and_is_one_line(work, number, tmp_path):
    process = begun(work, tmp_path)
    sent = time.monotonic()
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert time.monotonic() - sent < LIMIT
    name = "Ctrl-C" if number == signal.SIGINT else number.name
    assert (process.returncode, out, err) == (128 + number, "", f"gonio: stopped by {name}\n")


def test_a_signal_during_an_import_is_one_line(tmp_path):
    """Even that of the module which knows the processes: whoever asks for it as well would wait for ever."""
    (tmp_path / "multiprocessing").mkdir()
    (tmp_path / "multiprocessing" / "__init__.py").write_text(
        "import sys, time\nsys.modules['__main__'].on()\ntime.sleep(60)"
    )
    process = begun("def work():\n    import multiprocessing", tmp_path)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (143, "gonio: stopped by SIGTERM\n")


def test_a_step_that_waits_for_what_the_main_thread_holds_is_given_up(tmp_path):
    work = """
import threading, time
from gonio.processes.ending import undone
def work():
    lock = threading.Lock()
    with lock, undone(lock.acquire):
        on()
        time.sleep(60)
"""
    process = begun(work, tmp_path)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert time.monotonic() - sent < LIMIT
    assert process.returncode == 130
    assert err.startswith("gonio: stopped by Ctrl-C; not everything could be put in order: look for files")


def test_what_a_library_makes_of_ctrl_c_is_not_seen(tmp_path):
    process = begun(LIBRARY, tmp_path)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "gonio: stopped by Ctrl-C\n")


def test_a_signal_that_the_program_was_told_to_ignore_is_ignored(tmp_path):
    """As `nohup` and a shell's `&` do."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        process = begun(LONG_CALL, tmp_path)
    finally:
        signal.signal(signal.SIGHUP, before)
    process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=30)[1] == "gonio: stopped by SIGTERM\n"


WRITING = """
import threading, time
from contextlib import suppress
from pathlib import Path
from gonio.files import filling, replacing
def work():
    with replacing("whole.txt") as text, filling(Path("folder")) as folder, replacing("store") as store:
        text.write_text("half")
        (folder / "one.txt").write_text("half")
        store.unlink()
        def chunks():
            for _ in range(1000):  # a batch; each of Zarr's takes a millisecond to compress
                with suppress(OSError):
                    (store / "c").mkdir(parents=True, exist_ok=True)
                    (store / "c" / str(time.perf_counter_ns())).write_text("chunk")
                    time.sleep(0.001)
        for _ in range(2):
            threading.Thread(target=chunks, daemon=True).start()
        time.sleep(0.1)
        on()
        time.sleep(60)
"""


def test_nothing_half_written_is_left(tmp_path):
    """Nor of a folder into which threads of a library go on to write, as Zarr's do."""
    process = begun(WRITING, tmp_path)
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=30)[1] == "gonio: stopped by SIGTERM\n"
    assert [path.name for path in tmp_path.iterdir()] == []


REPLACING = """
import shutil, time
from pathlib import Path
from gonio.files import replacing
def work():
    real = Path.rename
    def slow(path, target):  # between putting the old folder aside and giving the new one its name
        real(path, target)
        if path.name == "store":
            on()
            time.sleep(0.5)
    Path.rename = slow
    with replacing("store", force=True) as store:
        store.unlink()
        store.mkdir()
        (store / "zarr.json").write_text("new")
"""


def test_a_step_that_has_begun_is_done_whole(tmp_path):
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "zarr.json").write_text("old")
    process = begun(REPLACING, tmp_path)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "gonio: stopped by Ctrl-C\n")
    assert [path.name for path in tmp_path.iterdir()] == ["store"]
    assert (tmp_path / "store" / "zarr.json").read_text() == "new"


LEFT = """
import time
from gonio.processes.ending import undone
def fails():
    raise PermissionError(13, "Permission denied", "some file")
def work():
    with undone(fails):
        on()
        time.sleep(60)
"""


def test_what_could_not_be_removed_is_named(tmp_path):
    process = begun(LEFT, tmp_path)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert err == "gonio: stopped by Ctrl-C; [Errno 13] Permission denied: 'some file'\n"


def test_processes_do_not_outlive_one_that_is_killed(tmp_path):
    script = """
import time
from gonio.processes import results
def work():
    on()
    list(results(time.sleep, [30, 30], 2))
"""
    from interrupting import members

    process = begun(script, tmp_path)
    end = time.monotonic() + 30
    while len(members(process.pid)) < 4:  # with the two and the one that looks after semaphores
        assert time.monotonic() < end
    process.kill()
    process.communicate()
    while members(process.pid):
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    if not SCAN.exists():
        pytest.skip(f"no measured scan {SCAN}")
    return inputs(tmp_path_factory.mktemp("given"))


# At the first moment, while libraries are imported, while processes start, and later on a fast machine.
MOMENTS = [
    *(("fit", 0.0), ("fit --bootstrap", 1.0), ("convert --fill", 0.2), ("plot", 0.5)),
    *(("compare --models all", 1.2), ("compare --models all", 2.4), ("compare --models all", 4.0)),
    *(("fit-stack", 1.4), ("fit-stack --block", 2.4), ("fit-stack --block", 4.0)),
]


@pytest.mark.parametrize(("command", "moment"), MOMENTS)
def test_a_command_ends_in_order(command, moment, given, monkeypatch):
    if "stack" in command:
        pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(given["stack"].with_name("compiled")))
    k = MOMENTS.index((command, moment))
    trial = Trial(command, (signal.SIGINT, signal.SIGTERM)[k % 2], k % 4 < 2, moment, 0.1 if k % 3 else None)
    with heard():
        outcome = tried(trial, given)
    assert not outcome.wrong, trial.words()


def test_the_trials_find_a_program_that_leaves_things(given, monkeypatch):
    """A command that answers a signal as Python does, and writes under the final name."""
    from interrupting import Command

    code = "import signal,time;signal.signal(15,lambda*_:1/0);open('half.json','w').write('{');"
    code += "open('.gonio-x','w');__import__('subprocess').Popen(['sleep','9']);time.sleep(20)"
    bad = Command("", "half.json", COMMANDS["fit --bootstrap"].read)
    monkeypatch.setattr(Command, "argv", lambda *_: [sys.executable, "-c", code])
    monkeypatch.setitem(COMMANDS, "bad", bad)
    monkeypatch.setattr("interrupting.LIMIT", 1.0)
    wrong = " ".join(tried(Trial("bad", signal.SIGTERM, False, 0.5), given).wrong)
    for part in ("exit code 1", "Traceback", "processes are left", ".gonio-x", "half.json is not whole"):
        assert part in wrong
