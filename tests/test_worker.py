"""A process that is kept warm: one call after another, ended at once, never more than asked of memory and time."""

import os
import time
from contextlib import closing
from math import sqrt
from threading import Thread

import pytest

from gonio.processes.worker import Bench, Worker, WorkerError


@pytest.fixture
def worker():
    made = Worker()
    yield made
    made.end()


def test_it_does_one_call_after_another_in_another_process(worker):
    assert worker.call(sqrt, 4.0) == 2.0
    assert worker.call(os.getpid) == worker.pid != os.getpid()
    with pytest.raises(WorkerError, match="domain"):
        worker.call(sqrt, -1.0)
    assert worker.call(sqrt, 9.0) == 3.0
    with pytest.raises(WorkerError, match="stopped"):
        worker.call(time.sleep, 60, seconds=0.1)
    assert not worker.is_alive
    with pytest.raises(WorkerError, match="ended"):
        worker.call(sqrt, 4.0)


def test_another_thread_ends_it(worker):
    worker.call(sqrt, 4.0)
    said = []

    def wait():
        try:
            worker.call(time.sleep, 60)
        except WorkerError as error:
            said.append(str(error))

    waiting = Thread(target=wait)
    waiting.start()
    time.sleep(0.05)
    begun = time.monotonic()
    worker.end()
    waiting.join(10)
    assert said
    assert time.monotonic() - begun < 5


def test_a_bench_keeps_one_warm_and_hands_each_to_one():
    with closing(Bench()) as bench:
        bench.warm()
        first, second = bench.take(), bench.take()
        assert first.pid != second.pid
        bench.give(first)
        assert bench.take() is first
        bench.give(first, used_up=True)
        assert not first.is_alive
        third = bench.take()
        assert third.is_alive
    assert not any(one.is_alive for one in (first, second, third))
    with pytest.raises(WorkerError):
        bench.take()
