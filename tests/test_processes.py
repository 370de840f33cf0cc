"""Several processes: the same results, errors passed on, Ctrl-C within moments, and nothing left behind."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from gonio import Model, catalogue, simulate
from gonio.comparison.ranking import compare
from gonio.processes import THREADS, results
from gonio.processes.portable import cores

NAMES = ("lambert", "torrance-sparrow", "cauchy-lorentz", "sgd")


@pytest.fixture(scope="module")
def scan():
    truth = {"ks": 0.3, "kd": 0.05, "sigma": 0.15}
    return simulate(catalogue["torrance-sparrow"], truth, [10.0, 40, 70], np.arange(-75, 76, 5.0), noise=0.03, seed=4)


def test_two_workers_find_what_one_finds(scan):
    """Rows are equal to the last digit and in the same order, models are the same objects; progress reaches its end."""
    models, seen = [catalogue[name] for name in NAMES], []
    one, two = (
        compare(scan, models, weighting="log", left_out="theta_i", workers=n, progress=seen.append) for n in (1, 2)
    )
    assert [row.model for row in two] == [row.model for row in one]
    for left, right in zip(one, two, strict=True):
        assert right.solution.values == left.solution.values
        assert right.metrics == left.metrics
        assert right.validated == left.validated
        assert right.by_fold == left.by_fold
    assert seen == [1 / 4, 2 / 4, 3 / 4, 1] * 2
    assert not multiprocessing.active_children()


def test_the_environment_is_as_before_and_threads_are_not_shared_out_twice():
    before = {name: os.environ.get(name) for name in THREADS}
    found = dict(results(os.getenv, THREADS, 2))
    assert found == dict.fromkeys(range(len(THREADS)), "1")
    assert {name: os.environ.get(name) for name in THREADS} == before


def test_an_error_of_a_process_is_raised_here(scan):
    models = [catalogue[name] for name in NAMES[1:]]
    with pytest.raises(ValueError, match="do not group"):
        compare(scan, models, left_out="theta_i", grouped={"ks": "theta_i"}, workers=2)
    assert not multiprocessing.active_children()
    with pytest.raises(ValueError, match="at least 1, and is 0"):
        compare(scan, models, workers=0)


def test_a_model_that_is_in_no_module_needs_one_worker(scan):
    lambert = catalogue["lambert"]
    own = Model("own", "Of a notebook", lambert.cite, lambert.terms)
    assert len(compare(scan, [own, lambert])) == 2
    with pytest.raises(ValueError, match="own is declared in no module"):
        compare(scan, [own, lambert], workers=2)


def test_cores_are_those_of_this_process():
    assert 1 <= cores() <= (os.cpu_count() or 1)


def is_there(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to a process alone")
def test_ctrl_c_ends_everything():
    """A minute of sleep in two processes ends at once, and no process outlives it."""
    # A shell that started the tests in the background has told them to ignore the signal, which is inherited.
    script = "import signal, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
    script += "from gonio.processes import results; print('on', flush=True); "
    script += "list(results(time.sleep, [60, 60], 2))"
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as running:
        assert running.stdout.readline() == "on\n"
        time.sleep(4)  # until the processes sleep, also on a busy machine
        started = time.perf_counter()
        os.killpg(running.pid, signal.SIGINT)
        _, err = running.communicate(timeout=30)
        assert time.perf_counter() - started < 20
        assert running.returncode != 0
        assert err.count("KeyboardInterrupt") == 1
    deadline = time.monotonic() + 20  # one that has ended is there until the system has noticed
    while is_there(running.pid) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not is_there(running.pid)
