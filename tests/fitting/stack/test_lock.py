"""One run at a time on a store of results, and no block of one run in the store of another."""

import os
import socket
import subprocess
import sys
import time

import pytest

from gonio.fitting.stack import lock
from gonio.fitting.stack.manifest import Manifest
from gonio.fitting.stack.run import fit_block, prepare
from stacks import asked, contents, write_stack


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "store" / "manifest").mkdir(parents=True)
    return tmp_path / "store" / "manifest"


def ended():
    """The number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_a_lock_is_there_while_it_is_held_and_gone_afterwards(folder):
    with lock.held(folder):
        assert (folder / "lock").read_text().startswith(f"{socket.gethostname()} {os.getpid()} ")
        with pytest.raises(ValueError, match=f"being written by process {os.getpid()} on .*if it is gone, remove"):
            lock.refuse_held(folder)
        with pytest.raises(ValueError, match="being written"), lock.held(folder):
            pass
    assert list(folder.iterdir()) == []
    lock.refuse_held(folder)


@pytest.mark.parametrize("content", ["{host} {ended} 1.0\n", "", "nonsense", "elsewhere 1 1.0\n"])
def test_a_lock_that_nobody_holds_is_taken_over(folder, content):
    path = folder / "lock"
    path.write_text(content.format(host=socket.gethostname(), ended=ended()))
    old = time.time() - 2 * lock.STALE
    os.utime(path, (old, old))
    lock.refuse_held(folder)
    with lock.held(folder):
        assert str(os.getpid()) in path.read_text()
    assert list(folder.iterdir()) == []


def test_a_lock_of_another_machine_is_believed_while_it_is_touched(folder):
    (folder / "lock").write_text("elsewhere 1 1.0\n")
    with pytest.raises(ValueError, match="process 1 on elsewhere"), lock.held(folder):
        pass
    assert (folder / "lock").read_text() == "elsewhere 1 1.0\n"


def test_a_lock_is_touched_while_it_is_held(folder, monkeypatch):
    monkeypatch.setattr(lock, "BEAT", 0.01)
    with lock.held(folder):
        os.utime(folder / "lock", (0, 0))
        end = time.monotonic() + 10
        while (folder / "lock").stat().st_mtime == 0:
            assert time.monotonic() < end
            time.sleep(0.01)


@pytest.fixture
def stack(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": 10})
    return tmp_path / "stack.zarr"


def runs(stack, tmp_path, force=True):
    """Two runs of one store, the second with another weighting."""
    out = tmp_path / "out.zarr"
    first = prepare(asked(stack, out, block=4))
    return first, lambda: prepare(asked(stack, out, block=4, settings={"pause": 0.01}), force)


def test_a_run_is_refused_while_another_is_at_work_whatever_force_says(stack, tmp_path):
    first, second = runs(stack, tmp_path)
    later = second()
    with first.held():
        before = contents(first.job.out)
        with pytest.raises(ValueError, match="is being written by process"):
            second()
        with pytest.raises(ValueError, match="is being written by process"), later.held():
            pass
        with pytest.raises(ValueError, match="is being written by process"):
            prepare(first.job.asked)  # the same run, too
        assert contents(first.job.out) == before
    with later.held():
        assert later.manifest.digest() == later.job.digest


def test_what_is_left_of_a_replaced_run_writes_and_marks_nothing(stack, tmp_path):
    """A worker that outlived its run, as on a cluster."""
    first, second = runs(stack, tmp_path)
    first.begin()
    fit_block(first.job, 0)
    later = second()
    later.begin()
    before = contents(later.job.out)
    with pytest.raises(ValueError, match="is now the store of another run"):
        fit_block(first.job, 1)
    assert contents(later.job.out) == before
    assert Manifest(later.job.out).written() == set()


def test_a_run_that_is_replaced_during_a_block_does_not_write_it(stack, tmp_path, monkeypatch):
    first, second = runs(stack, tmp_path)
    first.begin()
    later = second()
    fits = first.job.search()

    def replaced_meanwhile(*arguments, **settings):
        result = fits(*arguments, **settings)
        later.begin()
        return result

    monkeypatch.setattr(type(first.job), "search", lambda job: replaced_meanwhile)
    with pytest.raises(ValueError, match="is now the store of another run"):
        fit_block(first.job, 1)
    assert not (later.job.out / "value" / "c").exists()
    assert Manifest(later.job.out).written() == set()


def test_a_mark_of_another_run_vouches_for_nothing(stack, tmp_path):
    first, _ = runs(stack, tmp_path)
    first.begin()
    for block in first.todo:
        fit_block(first.job, block)
    mark = first.manifest.folder / "0000001.json"
    mark.write_text(mark.read_text().replace(first.job.digest, "0" * 64))
    again = prepare(first.job.asked)
    assert again.todo == [1]
    assert fit_block(again.job, 1).run == first.job.digest


@pytest.mark.parametrize("out", ["stack.zarr", "stack.zarr/fits", "."])
def test_the_results_are_never_in_the_stack_or_around_it(stack, tmp_path, out):
    with pytest.raises(ValueError, match="which is read"):
        asked(stack, tmp_path / out)
