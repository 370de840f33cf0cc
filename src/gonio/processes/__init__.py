"""Work on several processor cores at once: one function, many arguments, and the results as they come."""

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Protocol, TypeVar

from gonio.processes.ending import unbroken
from gonio.processes.portable import deaf_to_interrupts, ignore_interrupts

Item = TypeVar("Item")
Result = TypeVar("Result")

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class Crew(Protocol):
    """What shares work: `work(item)` of every item with the item's index, in the order in which they end."""

    def __call__(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[int, Result]]:
        """Do the work of all items."""


@contextmanager
def crew(workers: int) -> Iterator[Crew]:
    """Processes that share one piece of work after another within the block; one worker is this process.

    More workers are fresh processes, on every platform alike, with one thread each: `work`, items and results travel
    between them, so a function must be found by its name in a module, and a script that calls this needs its guard
    `if __name__ == "__main__"`. What `work` raises is raised here, and ends the other processes, as Ctrl-C does.
    Raises ValueError for less than one worker.
    """
    if workers < 1:
        raise ValueError(f"the number of workers must be at least 1, and is {workers}")
    if workers < 2:
        yield lambda work, items: enumerate(map(work, items))
        return
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import active_children, get_context

    other_children = set(active_children())
    with _one_thread_each():
        pool = ProcessPoolExecutor(workers, get_context("spawn"), initializer=begin)

        def shared(work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[int, Result]]:
            with unbroken(), deaf_to_interrupts():
                indices = {pool.submit(work, item): index for index, item in enumerate(items)}
            for future in as_completed(indices):
                yield indices[future], future.result()

        try:
            yield shared
        except BaseException:
            for child in set(active_children()) - other_children:
                child.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def results(work: Callable[[Item], Result], items: Sequence[Item], workers: int) -> Iterator[tuple[int, Result]]:
    """The same for one piece of work, by no more processes than it has items."""
    with crew(max(min(workers, len(items)), 1) if workers > 0 else workers) as shared:
        yield from shared(work, items)


def begin() -> None:
    """What a new process does first: it takes no Ctrl-C, and ends when the process that started it does."""
    ignore_interrupts()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent:
        parent.join()
        os._exit(1)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes that start within the block compute with one thread: the cores are shared between processes already."""
    previous = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in previous.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
