"""What only some systems have, each with what stands in for it elsewhere: the one file that asks which system this is.

Linux, macOS and Windows differ in how a folder is written to the disk for certain, how many processor cores a process
may use, how memory is counted, and which signals there are. Everything else in gonio is the same everywhere. Processes
are always started afresh (`spawn`), which every system has, and never forked.
"""

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def cores() -> int:
    """The processor cores that this process may use; all of the machine's where the system does not tell."""
    if hasattr(os, "process_cpu_count"):  # from Python 3.13 on
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def is_superuser() -> bool:
    """Whether this process may do everything, as root; never where the system has no such user."""
    return hasattr(os, "geteuid") and os.geteuid() == 0


def peak_megabytes() -> float:
    """The most memory [MB] that this process has taken; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    unit = 2**20 if sys.platform == "darwin" else 2**10  # macOS counts bytes, Linux kilobytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def available_memory() -> float:
    """The memory [bytes] that this process may still take; infinite where the system does not tell.

    On Linux what the kernel counts as available, or what is left of the limit of a container or of `ulimit -v`.
    """
    limits = [_of_container(), _of_address_space()]
    try:
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        limits.append(1024.0 * int(lines["MemAvailable"].split()[0]))
    except (OSError, KeyError, ValueError):  # no Linux
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            limits.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
    return max(min(limits), 0.0)


def _of_container() -> float:
    """What is left of the limit of the control group that this process is in, infinite without one.

    Cached files count as taken there, and are given up when the memory is needed.
    """
    group = Path("/sys/fs/cgroup")
    try:
        limit, taken = (float((group / f"memory.{name}").read_text()) for name in ("max", "current"))
        stated = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        return limit - taken + float(stated["file"])
    except (OSError, ValueError, KeyError):  # none, or the word `max`
        return math.inf


def _of_address_space() -> float:
    """What is left of this process's limit of address space, infinite without one."""
    try:
        import resource

        if (limit := resource.getrlimit(resource.RLIMIT_AS)[0]) == resource.RLIM_INFINITY:
            return math.inf
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (ImportError, OSError, ValueError):  # Windows, macOS
        return math.inf
    return float(limit - taken)


def limit_memory(room: int) -> None:
    """Let this process take so many more bytes of address space, and never more; nothing where no system limits it."""
    try:
        import resource

        taken = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        limit = taken + room if hard == resource.RLIM_INFINITY else min(taken + room, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    except (ImportError, OSError, ValueError):  # Windows, macOS
        return


def is_running(process: int) -> bool:
    """Whether a process of this machine is there; True where the system does not tell."""
    if os.name != "posix":  # a signal that ends nothing is of POSIX alone
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # there, and another user's
        return True
    return True


def ignore_interrupts() -> None:
    """Let Ctrl-C pass this process by.

    A terminal sends it to all processes of a command, and the first of them ends the others in order.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


ASK_TO_END = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, the usual `kill`, and a terminal that was closed


def await_signals(act: Callable[[int], None], meanwhile: Callable[[], None]) -> None:
    """Call `act` in a thread of its own with the number of the first signal of ASK_TO_END that comes.

    meanwhile: what the main thread does when it notices the signal, which in a long call of a library it does not.
    A signal that this process was told to ignore, as `nohup` does, stays ignored. Call this in the main thread.
    """
    there = [getattr(signal, name) for name in ASK_TO_END if hasattr(signal, name)]
    heard = [int(number) for number in there if signal.getsignal(number) is not signal.SIG_IGN]
    ear, mouth = os.pipe()
    if os.name == "posix":  # elsewhere a pipe is taken as it is
        os.set_blocking(mouth, False)
    signal.set_wakeup_fd(mouth, warn_on_full_buffer=False)

    def wait() -> None:
        while (number := os.read(ear, 1)[0]) not in heard:
            pass
        act(number)

    def heed(number: int, _frame: object) -> None:
        with suppress(BlockingIOError):  # Python has written it already, unless a library asked for it elsewhere
            os.write(mouth, bytes([number]))
        meanwhile()

    threading.Thread(target=wait, name="signals", daemon=True).start()
    for number in heard:
        signal.signal(number, heed)


def no_signals() -> None:
    """Ignore the signals of ASK_TO_END from now on."""
    for name in ASK_TO_END:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def name_of_signal(number: int) -> str:
    """What a person calls a signal."""
    return "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Processes that start within the block do not take Ctrl-C, from their first moment on, nor do threads.

    A process inherits from the thread that starts it which signals are held back. To set this in the process itself
    would be too late, while it still imports. What comes meanwhile reaches another thread of this process, or else this
    one at the end of the block.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    resource_tracker.ensure_running()  # it starts with the first process, and holds back no signal afterwards
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    if (pipe := resource_tracker.getfd()) is not None:
        _pipes.append(pipe)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_pipes: list[
    int
] = []  # to the process that `multiprocessing` starts beside the others, which ends when they are closed
QUIET, PATIENCE = 0.2, 2.0  # s without a new process until there will be none, and s for all of them to be gone


def end_processes() -> None:
    """End every process that `multiprocessing` started here, at once, and wait until they are gone.

    Another thread may be about to start one, or may replace one that died. So this looks until it finds none for QUIET.
    It imports nothing and takes no lock, which the main thread may hold that was stopped anywhere.
    """
    active_children = getattr(sys.modules.get("multiprocessing"), "active_children", list)
    end = time.monotonic() + PATIENCE
    quiet = time.monotonic() + (QUIET if _pipes or active_children() else 0)
    while time.monotonic() < min(quiet, end):
        for child in active_children():
            child.kill()
            quiet = time.monotonic() + QUIET
        time.sleep(0.01)
    for pipe in set(_pipes):
        with suppress(OSError):
            os.close(pipe)
    with suppress(ChildProcessError, AttributeError):  # there is none any more, or no such call
        while time.monotonic() < end and os.waitpid(-1, os.WNOHANG) is not None:
            time.sleep(0.01)


def give_usual_rights(path: Path) -> None:
    """Give what was made for its owner alone the rights of anything new; nothing where rights are no modes."""
    if os.name != "posix":
        return
    mask = os.umask(0)
    os.umask(mask)
    path.chmod((0o777 if path.is_dir() else 0o666) & ~mask)


def synchronise(path: Path) -> None:
    """Have a file, or the names in a folder, on the disk before anything that follows.

    Where the system opens no folders, as Windows does not, their names are written when it pleases.
    """
    is_folder = path.is_dir()
    try:
        handle = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR)
    except PermissionError:
        if is_folder:
            return
        raise
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def lock(file: int) -> bool:
    """Take an open file for this process alone, until it closes it or ends, however it ends; False where it is taken.

    True as well where the system has no such lock.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
