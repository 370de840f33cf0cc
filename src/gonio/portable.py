"""What only some systems have, each with what stands in for it elsewhere: the one file that asks which system this is.

Linux, macOS and Windows differ in how a folder is written to the disk for certain, how many processor cores a process
may use, how memory is counted, and which signals there are. Everything else in gonio is the same everywhere. Processes
are always started afresh (`spawn`), which every system has, and never forked.
"""

import math
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
