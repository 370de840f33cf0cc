"""The end of the program `gonio` by a signal such as Ctrl-C: in order, at once, and with one line.

Python answers Ctrl-C by an exception, raised wherever the program is at that moment. It may be in an import, where a
library makes another error of it, in a destructor, where it is dropped and the program goes on, or in the loop of a
library that reports it in its own words. And other signals end a program at once, with whatever was half done.

So the program lets a thread wait for signals. When one comes, the thread stops the main one, ends the worker processes,
undoes what `undone` and `unbroken` were told of, writes one line, and ends the process. Where gonio is used as a
library nothing of this happens: a script gets KeyboardInterrupt, and the same is undone while it passes.
"""

import atexit
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from gonio.processes.portable import await_signals, end_processes, name_of_signal, no_signals

LONGEST = 4.0  # s from the signal to the end, whatever was not put in order by then

_steps: list[Callable[[], None]] = []
_words: list[Callable[[], str]] = []
_whole = threading.RLock()  # held by a step that must not be broken
_alarm, _asked = threading.Event(), list[tuple[int, int]]()  # the signal, and where the last line goes
_is_listening = _is_ending = False
_depth = 0  # of steps of the main thread that must not be broken


@contextmanager
def unbroken() -> Iterator[None]:
    """What the block does is done whole, whatever signal comes: it must be short, and wait for nothing."""
    global _depth
    _depth += 1  # first: the main thread must not stop while it holds the lock
    try:
        with _whole:
            yield
    finally:
        _depth -= 1
        if _is_ending:
            _stop()


@contextmanager
def undone(step: Callable[[], None]) -> Iterator[None]:
    """`step()` when the block ends, however it does, or when a signal ends the program within it.

    It may be called when another call of it has begun, and raises OSError for what it could not undo.
    """
    _steps.append(step)
    try:
        yield
    finally:
        try:
            step()
        finally:
            _steps.remove(step)


@contextmanager
def last_words(line: Callable[[], str]) -> Iterator[None]:
    """The line with which a signal, or else KeyboardInterrupt, ends the program within the block."""
    _words.append(line)
    try:
        yield
    except KeyboardInterrupt:
        print(line(), file=sys.stderr)
        sys.exit(130)
    finally:
        _words.remove(line)


def listen() -> None:
    """From now on a signal ends this process in order, with exit code 128 and its number; for the main thread."""
    global _is_listening
    if _is_listening:
        return
    _is_listening = True
    # A process that was ended at once cannot release its semaphores. The process that does it, and says so, is told
    # by this variable not to say it.
    warnings = filter(None, (os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"))
    os.environ["PYTHONWARNINGS"] = ",".join(warnings)
    atexit.register(no_signals)  # the last of these functions: Python then only takes itself apart
    threading.Thread(target=_give_up, name="alarm", daemon=True).start()  # now: to start it later takes a lock
    await_signals(_end, _stop)


def _stop() -> None:
    """Keep the main thread from going on, unless it is at a step that must not be broken: the process is ending."""
    global _is_ending
    _is_ending = True
    if not _depth:
        threading.Event().wait()


def _end(number: int) -> None:
    """End the process, from the thread that waits for signals."""
    global _is_ending
    _is_ending = True
    errors = _silenced()
    try:
        # The main thread was stopped anywhere, and what is done here may wait for what it holds.
        too_long = "not everything could be put in order: look for files whose names begin with .gonio-"
        threading.Timer(
            LONGEST, _leave, (number, errors, f"gonio: stopped by {name_of_signal(number)}; {too_long}")
        ).start()
        _whole.acquire()
        end_processes()
        left = [str(error) for step in reversed(_steps) if (error := _error_of(step))]
        _leave(number, errors, "; ".join([_line(number), *left]))
    finally:
        os._exit(128 + number)


def _give_up() -> None:
    """End the process some time after `_end` has begun: the main thread was stopped anywhere, and may hold a lock."""
    _alarm.wait()
    time.sleep(LONGEST)
    number, errors = _asked[0]
    too_long = "not everything could be put in order: look for files whose names begin with .gonio-"
    _leave(number, errors, f"gonio: stopped by {name_of_signal(number)}; {too_long}")


def _leave(number: int, errors: int, line: str) -> None:
    """Write the last line, and end the process."""
    try:
        os.write(errors, f"{_tidy_terminal(errors)}{line}\n".encode(errors="replace"))
    finally:
        os._exit(128 + number)


def _error_of(step: Callable[[], None]) -> Exception | None:
    """What a step could not undo: the others are undone all the same."""
    try:
        step()
    except Exception as error:
        return error
    return None


def _line(number: int) -> str:
    """What is said at the end: the words of what was going on, or else the name of the signal."""
    with suppress(Exception):  # they count files, which others may remove
        if _words:
            return _words[-1]()
    return f"gonio: stopped by {name_of_signal(number)}"


def _silenced() -> int:
    """Standard error for this thread alone: what others still say there is about the end itself."""
    with suppress(OSError):  # where standard error is closed
        errors = os.dup(2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        return errors
    return 2


def _tidy_terminal(errors: int) -> str:
    """What takes a progress bar from a terminal and shows its cursor again."""
    return "\r\x1b[2K\x1b[?25h" if os.isatty(errors) and os.environ.get("TERM") != "dumb" else ""
