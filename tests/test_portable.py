"""gonio where a system lacks what only some have: no `resource`, no `fcntl`, no fork, no modes, no signals but one."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gonio import catalogue, simulate, write
from gonio.processes.portable import available_memory, cores, give_usual_rights, peak_megabytes, synchronise

ABSENT = ("fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty")  # none is on Windows
# What Python runs first when it starts: the modules are as absent as elsewhere, and so are the functions of `os` and
# the signals that Windows does not have. Processes that the run starts get the same by the environment.
BARE = f"""
import multiprocessing, os, signal, sys
for name in {ABSENT!r}:
    sys.modules[name] = None
def no_fork(*_):
    raise OSError("this system cannot fork")
for name in ("fork", "forkpty", "sched_getaffinity", "process_cpu_count", "O_DIRECTORY"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGALRM", "SIGKILL", "SIGHUP", "setitimer", "alarm", "pthread_sigmask"):
    if hasattr(signal, name):
        delattr(signal, name)
multiprocessing.set_start_method("spawn")
open_anything = os.open
def open_files(path, *arguments, **options):
    if os.path.isdir(path):
        raise PermissionError(13, "Permission denied", path)  # as Windows answers
    return open_anything(path, *arguments, **options)
os.open = open_files
"""

# A main module of its own, which the processes of --workers import again.
END = "-- end of a command --"
COMMANDS = f"""
import sys
if __name__ == "__main__":
    from gonio.app.cli import main
    for command in {{commands!r}}:
        sys.argv = ["gonio", *command]
        try:
            main()
        except SystemExit as end:
            if end.code:
                raise
        print({END!r})
"""


@pytest.fixture
def bare(tmp_path):
    """Run commands of gonio, one after the other, in a Python without what only some systems have: what each prints."""
    (tmp_path / "start").mkdir()
    (tmp_path / "start" / "sitecustomize.py").write_text(BARE, encoding="utf-8")
    paths = os.pathsep.join([str(tmp_path / "start"), *filter(None, sys.path)])

    def call(*commands):
        (tmp_path / "commands.py").write_text(COMMANDS.format(commands=commands), encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "commands.py"],
            capture_output=True, text=True, cwd=tmp_path, check=False, env=os.environ | {"PYTHONPATH": paths},
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.split(END)[:-1]

    return call


@pytest.fixture
def scan_file(tmp_path):
    values = {"ks": 2.0, "kdd": 30.0, "kid": 0.1, "sigma": 0.15, "gamma": 20.0}
    scan = simulate(catalogue["cauchy-lorentz"], values, [30.0, 50.0], np.arange(-80, 81, 8.0), noise=0.01)
    write(scan, tmp_path / "scan.csv")
    return tmp_path / "scan.csv"


def test_the_absence_is_real(bare, tmp_path):
    start = tmp_path / "start" / "sitecustomize.py"
    start.write_text(BARE + "\nimport fcntl\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", "1"], capture_output=True, text=True, check=False, env={"PYTHONPATH": str(start.parent)}
    )
    assert "import of fcntl halted" in done.stderr


def test_info_fit_compare_and_convert_need_no_one_system(bare, scan_file, tmp_path):
    scan = str(scan_file)
    described, fitted, ranked, *converted = bare(
        ("info", scan, "--json", "-"),
        ("fit", scan, "--model", "cauchy-lorentz", "--out", "fitted", "--json", "-"),
        ("compare", scan, "--models", "lambert,cauchy-lorentz", "--workers", "2", "--json", "-"),
        ("convert", scan, "scan.nc"),
        ("info", "scan.nc", "--json", "-"),
        ("convert", scan, "scan.zarr"),
        ("info", "scan.zarr", "--json", "-"),
    )
    assert json.loads(described)["points"] == 42
    assert json.loads(fitted)["status"].startswith("converged")
    assert (tmp_path / "fitted" / "solution.nc").exists()
    assert [row["model"] for row in json.loads(ranked)[0]["ranking"]] == ["cauchy-lorentz", "lambert"]
    assert [json.loads(text)["points"] for text in converted[1::2]] == [42, 42]


def test_what_stands_in_where_the_system_does_not_tell(monkeypatch, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"1")
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.delattr(os, "process_cpu_count", raising=False)
    assert cores() == (os.cpu_count() or 1)
    monkeypatch.setitem(sys.modules, "resource", None)
    assert peak_megabytes() == 0.0
    with monkeypatch.context() as elsewhere:  # no files of the kernel, and none of its numbers
        elsewhere.setattr(Path, "read_text", lambda *_, **__: (tmp_path / "absent").stat())
        elsewhere.setattr(os, "sysconf_names", {})
        assert available_memory() == math.inf
    monkeypatch.setattr(os, "name", "nt")
    monkeypatch.setattr(Path, "chmod", None)
    give_usual_rights(path)


def test_a_folder_that_cannot_be_opened_is_left_to_the_system_and_a_file_is_not(monkeypatch, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"1")

    def refused(*_):
        raise PermissionError

    monkeypatch.setattr(os, "open", refused)
    synchronise(tmp_path)
    with pytest.raises(PermissionError):
        synchronise(path)


def test_memory_and_cores_are_counted_here():
    assert cores() >= 1
    assert peak_megabytes() > 10
    assert 1e6 < available_memory() < 1e15


def test_what_a_container_leaves_is_what_may_be_taken(monkeypatch):
    """Files that it has cached are given up when memory is needed."""
    stated = {"memory.max": "3000\n", "memory.current": "2500\n", "memory.stat": "anon 100\nfile 400\n"}
    monkeypatch.setattr(Path, "read_text", lambda self, *_, **__: stated.get(self.name, ""))
    assert available_memory() == 900.0
