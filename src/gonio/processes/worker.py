"""One process beside this one that is kept warm: it has imported what its work needs, and does one call at a time."""

import importlib
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from gonio.processes import begin
from gonio.processes.ending import unbroken
from gonio.processes.portable import deaf_to_interrupts, limit_memory

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

Tell = Callable[[Any], None]


class WorkerError(RuntimeError):
    """What went wrong in a worker: the words of the error that was raised there, or that the process has ended."""


class Worker:
    """A fresh process that ends with this one, even when this one is killed.

    modules: what it imports before its first call. Threads may call `end` while another one waits in `call`.
    """

    def __init__(self, modules: Sequence[str] = ()) -> None:
        from multiprocessing import get_context

        context = get_context("spawn")
        self._pipe, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, tuple(modules)))
        with unbroken(), deaf_to_interrupts():
            self._process.start()
        there.close()

    @property
    def is_alive(self) -> bool:
        """Whether it can be called."""
        return self._process.is_alive()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid or 0

    def call(
        self, function: Callable[..., Any], *arguments: Any, tell: Tell | None = None, seconds: float = 0.0
    ) -> Any:
        """What `function(*arguments)` gives there; it must be found by its name in a module.

        tell: handed on as the keyword `tell`; what the function calls it with arrives here. seconds: after which the
        process is ended, 0 for never. Raises WorkerError, with words for the user.
        """
        end = time.monotonic() + seconds if seconds else 0.0
        try:
            self._pipe.send((function, arguments, tell is not None))
            while True:
                if end and not self._pipe.poll(max(end - time.monotonic(), 0.0)):
                    self.end()
                    raise WorkerError(f"it took more than {seconds:g} s and was stopped")
                kind, what = self._pipe.recv()
                if kind == "told" and tell:
                    tell(what)
                elif kind == "result":
                    return what
                elif kind == "failed":
                    raise WorkerError(what)
        except (EOFError, OSError):
            raise WorkerError(
                "the process that did it has ended; it may have needed more memory than there is"
            ) from None

    def limit(self, room: int) -> None:
        """Let the process take so many more bytes of memory, and never more."""
        self.call(limit_memory, room)

    def end(self) -> None:
        """End the process at once, whatever it does."""
        self._process.kill()
        self._process.join(5)


def _serve(pipe: "Connection", modules: Sequence[str]) -> None:
    """What the process does: one call after another, until the other end of the pipe is closed."""
    begin()
    for name in modules:
        importlib.import_module(name)
    while True:
        try:
            function, arguments, tells = pipe.recv()
        except EOFError:
            return
        try:
            more = {"tell": lambda what: pipe.send(("told", what))} if tells else {}
            result = function(*arguments, **more)
        except BaseException as error:
            pipe.send(("failed", _words(error)))
        else:
            pipe.send(("result", result))


def _words(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "there is not enough memory for it"
    if isinstance(error, KeyError) and error.args:
        return str(error.args[0])
    if isinstance(error, ValueError | OSError):
        return str(error)
    return f"{type(error).__name__}: {error}"


class Bench:
    """Workers that wait for work, each with the same modules imported; one at least is kept warm after the first.

    Threads may use it at once.
    """

    def __init__(self, modules: Sequence[str] = ()) -> None:
        self._modules = modules
        self._lock = threading.Lock()
        self._waiting: list[Worker] = []
        self._busy: list[Worker] = []
        self._closed = False

    def warm(self) -> None:
        """Have one wait, so that the next piece of work need not wait for it."""
        with self._lock:
            self._fill()

    def _fill(self) -> None:
        self._waiting = [worker for worker in self._waiting if worker.is_alive]
        if not self._waiting and not self._closed:
            self._waiting.append(Worker(self._modules))

    def take(self) -> Worker:
        """A worker for a piece of work; hand it back by `give`."""
        with self._lock:
            if self._closed:
                raise WorkerError("the server is ending")
            self._fill()
            worker = self._waiting.pop()
            self._busy.append(worker)
            return worker

    def give(self, worker: Worker, used_up: bool = False) -> None:
        """Take a worker back; one that is used up, or that was ended, is replaced by a fresh one."""
        if used_up:
            worker.end()
        with self._lock:
            self._busy.remove(worker)
            if worker.is_alive and not self._waiting and not self._closed:
                self._waiting.append(worker)
                return
        worker.end()
        self.warm()

    def close(self) -> None:
        """End all of them."""
        with self._lock:
            self._closed = True
            workers = [*self._waiting, *self._busy]
            self._waiting = []
        for worker in workers:
            worker.end()
