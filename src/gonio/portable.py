"""What only some systems have, each with what stands in for it elsewhere: the one file that asks which system this is.

Linux, macOS and Windows differ in how a folder is written to the disk for certain, how many processor cores a process
may use, how memory is counted, and which signals there are. Everything else in gonio is the same everywhere. Processes
are always started afresh (`spawn`), which every system has, and never forked.
"""

import os
import signal
import sys
from pathlib import Path


def cores() -> int:
    """The processor cores that this process may use; all of the machine's where the system does not tell."""
    if hasattr(os, "process_cpu_count"):  # from Python 3.13 on
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):  # Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def peak_megabytes() -> float:
    """The most memory [MB] that this process has taken; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    unit = 2**20 if sys.platform == "darwin" else 2**10  # macOS counts bytes, Linux kilobytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


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
