"""Blocks on a Dask cluster: workers and runs that are killed, blocks that fail, and what is there afterwards."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from stacks import asked, contents, write_stack

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

from gonio.fitting.stack import cluster as clusters
from gonio.fitting.stack.cluster import connected, fit_blocks, fit_stack
from gonio.fitting.stack.manifest import Manifest
from gonio.fitting.stack.run import fit_block, prepare
from places import ROOT

pytestmark = pytest.mark.xdist_group("cluster")  # one process, which starts the two workers once
LANES, BLOCK = 30, 3

PROGRAM = ROOT / "tests" / "tools" / "stacks.py"
LONGEST = 120.0  # s that anything waited for may take on a loaded machine


@pytest.fixture(scope="module")
def cluster():
    """Two workers that all tests of this file share, and that give a block up after two deaths."""
    before, clusters.DEATHS = clusters.DEATHS, 1
    with connected(workers=2) as found:
        yield found
    clusters.DEATHS = before


@pytest.fixture
def stack(tmp_path):
    write_stack(tmp_path / "stack.zarr", {"sample": LANES})
    return tmp_path / "stack.zarr"


@pytest.fixture
def undisturbed(stack, tmp_path):
    """What the store holds when every block is fitted in this process."""
    run = prepare(asked(stack, tmp_path / "undisturbed.zarr", block=BLOCK))
    run.begin()
    for block in run.todo:
        fit_block(run.job, block)
    return contents(run.job.out)


def prepared(stack, **settings):
    return prepare(asked(stack, stack.with_name("out.zarr"), block=BLOCK, settings=settings))


def wait_for(condition):
    end = time.monotonic() + LONGEST
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.01)


def computations(manifest):
    """How often each block was begun; every time before it was written."""
    counts = []
    for record in manifest.records():
        starts = manifest.starts(record.block)
        assert all(when <= record.written for when, _, _ in starts), f"block {record.block} was computed once more"
        counts.append(len(starts))
    return counts


def test_every_block_is_fitted_once_by_two_processes(cluster, stack, undisturbed):
    run = prepared(stack, pause=0.05)
    records = list(fit_blocks(cluster.client, run))
    assert sorted(r.block for r in records) == list(range(10))
    assert len({r.process for r in records}) == 2
    assert os.getpid() not in {r.process for r in records}
    assert contents(run.job.out) == undisturbed
    assert computations(run.manifest) == [1] * 10


def test_a_client_without_the_key_of_the_run_is_refused(cluster):
    """Whoever can submit a task runs code as the user who fits."""
    from distributed import Client

    address = cluster.client.scheduler.address
    assert address.startswith("tls://127.0.0.1")
    for stranger in (address, address.replace("tls", "tcp")):
        with pytest.raises((OSError, TypeError)), Client(stranger, timeout=2, set_as_default=False):
            pass


def test_few_tasks_are_with_the_scheduler(cluster, stack, monkeypatch):
    submitted, most = [], 0
    real = cluster.client.submit

    def submit(*arguments, **options):
        future = real(*arguments, **options)
        submitted.append(future)
        nonlocal most
        most = max(most, sum(not f.done() for f in submitted))
        return future

    monkeypatch.setattr(cluster.client, "submit", submit)
    list(fit_blocks(cluster.client, prepared(stack, pause=0.02)))
    assert len(submitted) == 10
    assert 2 <= most <= 2 * clusters.TASKS_A_THREAD


def test_a_worker_that_is_killed_costs_one_computation(cluster, stack, undisturbed):
    """SIGKILL in the middle of block 4."""
    run = prepared(stack, pause=0.05, deadly=130, once=str(stack.with_name("killed")))
    list(fit_blocks(cluster.client, run))
    assert contents(run.job.out) == undisturbed
    assert computations(run.manifest) == [1] * 4 + [2] + [1] * 5
    killed, other = (process for _, _, process in run.manifest.starts(4))
    assert killed != other == run.manifest.record(4).process


def test_a_block_that_kills_its_workers_is_given_up_and_named(cluster, stack):
    cluster.client.cluster.scheduler.allowed_failures = 1
    run = prepared(stack, deadly=130)
    with pytest.raises(ValueError, match=r"^block 4 \(sample 12 to 14\) ended its worker 2 times.*--block") as failed:
        list(fit_blocks(cluster.client, run))
    assert "1 block failed; 9 of 10 are there" in str(failed.value)
    assert run.manifest.written() == set(range(10)) - {4}


def test_a_block_that_fails_is_named_and_the_others_are_fitted(cluster, stack):
    run = prepared(stack, fails=130)
    expected = r"^block 4 \(sample 12 to 14\): lane 130 cannot be fitted \(1 block failed; 9 of 10 are there"
    with pytest.raises(ValueError, match=expected):
        list(fit_blocks(cluster.client, run))
    assert run.manifest.written() == set(range(10)) - {4}
    assert not list(run.manifest.folder.glob("*4.json"))


def test_when_many_blocks_fail_the_rest_is_not_tried(cluster, stack):
    """Every block fails here, as on a full disk."""
    run = prepared(stack)
    run.begin()
    for folder in ("value", "cost"):
        (run.job.out / folder / "zarr.json").unlink()
    object.__setattr__(run, "fresh", None)
    with pytest.raises(ValueError, match="3 blocks failed, and the rest was not tried; 0 of 10") as failed:
        list(fit_blocks(cluster.client, run))
    assert "\n" not in str(failed.value)
    assert len(run.manifest.begun()) < 10


def started(stack, out, pause, workers):
    """A run in a process of its own."""
    path = os.pathsep.join(filter(None, [str(PROGRAM.parent), *sys.path]))
    return subprocess.Popen(
        [sys.executable, str(PROGRAM), str(stack), str(out), str(pause), str(workers)],
        env=os.environ | {"PYTHONPATH": path},
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def is_running(process):
    import psutil  # comes with distributed

    try:
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_a_run_that_is_killed_goes_on_where_it_stopped(stack, undisturbed, tmp_path):
    """Three times at a random moment between the first and the last block, then to the end."""
    draw, out = random.Random(6), tmp_path / "out.zarr"
    manifest, pause = Manifest(out), 0.1
    kept: dict[int, object] = {}
    for goal, workers in ((1, 2), (3, 1), (5, 1)):
        process = started(stack, out, pause, workers)
        wait_for(lambda goal=goal: len(manifest.written()) >= goal)
        time.sleep(draw.uniform(0, 2 * pause))
        process.kill()
        process.communicate()
        orphans = {p for block in manifest.begun() for _, _, p in manifest.starts(block)}
        wait_for(lambda orphans=orphans: not any(map(is_running, orphans)))
        there = {r.block: r for r in manifest.records()}
        assert kept.items() <= there.items()  # what was written is still there, by whom it was
        kept = there
    assert len(kept) < LANES / BLOCK, "the run was killed too late to show anything"
    run = prepare(asked(stack, out, block=BLOCK, settings={"pause": pause}))
    assert run.done == set(kept)
    for block in run.todo:
        fit_block(run.job, block)
    assert contents(out) == undisturbed
    counts = computations(manifest)
    assert len(counts) == LANES / BLOCK
    assert sum(counts) <= LANES / BLOCK + 2 + 1 + 1  # what the workers of each run were at when it was killed


def test_ctrl_c_leaves_a_run_that_goes_on(stack, undisturbed, tmp_path):
    out = tmp_path / "out.zarr"
    process = started(stack, out, 0.2, 1)
    wait_for(lambda: Manifest(out).written())
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to workers too
    _, errors = process.communicate(timeout=LONGEST)
    assert b"KeyboardInterrupt" in errors
    assert errors.count(b"Traceback") == 1, errors.decode()
    run = prepare(asked(stack, out, block=BLOCK, settings={"pause": 0.2}))
    assert run.resumed
    assert 0 < len(run.done) < LANES / BLOCK
    for block in run.todo:
        fit_block(run.job, block)
    assert contents(out) == undisturbed


def test_a_run_from_python_on_a_scheduler_tells_its_progress(stack, undisturbed, tmp_path):
    from distributed import LocalCluster

    told = []
    declared = asked(stack, tmp_path / "out.zarr", block=BLOCK)
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as someones:
        options = {"scheduler": someones.scheduler_address, "progress": told.append}
        found = fit_stack(declared, **options)
        fit_stack(declared, **options)
    assert told == sorted(told)
    assert len(told) == 10
    assert told[-1] == 1.0
    assert found["value"].shape == (LANES, 1)
    assert contents(tmp_path / "out.zarr") == undisturbed


def test_a_scheduler_that_is_not_there_or_alone_is_told_of(monkeypatch):
    monkeypatch.setattr(clusters, "PATIENCE", 1)
    with (
        pytest.raises(ValueError, match=r"no scheduler answers at tcp://127.0.0.1:9 .*dask scheduler"),
        connected("tcp://127.0.0.1:9"),
    ):
        pass
    with pytest.raises(ValueError, match=r"no scheduler answers at tls://.*TLS"), connected("tls://127.0.0.1:9"):
        pass
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, dashboard_address=None, processes=False) as alone:
        address = alone.scheduler_address
        with pytest.raises(ValueError, match=f"has no worker: start one by `dask worker {address}"), connected(address):
            pass


def test_workers_of_a_scheduler_are_not_ours_to_count():
    with pytest.raises(ValueError, match="leave out --workers"), connected("tcp://127.0.0.1:9", workers=2):
        pass
    with pytest.raises(ValueError, match="at least 1"), connected(workers=-1):
        pass


def test_without_dask_a_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"this needs Dask: pip install 'gonio\[cluster\]'"), connected():
        pass
