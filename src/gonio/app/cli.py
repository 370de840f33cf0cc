"""Where the program `gonio` begins and ends: errors and signals become one line each.

It imports little, so that a signal finds it prepared a few milliseconds after Python has started.
"""

import io
import os
import sys
import warnings
from pathlib import Path
from typing import Any

from gonio.outside import PackageWarning, printable
from gonio.processes.ending import listen


def app() -> None:
    """The command that the arguments of the program name."""
    from gonio.app.program import app as commands

    commands(prog_name="gonio")


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    from gonio.app import talk

    talk.tell(f"gonio: {message}")


def _complain(message: str) -> None:
    print(f"gonio: {printable(message)}", file=sys.stderr)


TRACE = "GONIO_TRACEBACK"  # set in the environment, an error is raised as it is


def main() -> None:
    """Run the command line; whatever is wrong is one line on standard error and exit code 1.

    A signal that asks the program to end, such as Ctrl-C, is one line too, and exit code 128 and its number. Where a
    program calls this function that is not `gonio` itself, signals are that program's.
    """
    if _is_the_program() and not os.environ.get(TRACE):
        os.environ.setdefault("PYTHONWARNINGS", "ignore")  # of worker processes, whose filters are their own
        listen()
    if not os.environ.get(TRACE):
        # Those of NumPy, SciPy or Matplotlib name lines of code. What the user must know, gonio says in its own words.
        warnings.simplefilter("ignore")
        warnings.simplefilter("default", PackageWarning)
        warnings.showwarning = _warn
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal of another encoding lacks ± and µ, and no result for that
            stream.reconfigure(errors="replace")
    try:
        app()
    except Exception as error:
        if os.environ.get(TRACE):
            raise
        _complain(_in_a_line(error))
        sys.exit(1)


def _is_the_program() -> bool:
    """Whether the main module of this process is the program's script, which imports `main`."""
    return getattr(sys.modules.get("__main__"), "main", None) is main


def _in_a_line(error: Exception) -> str:
    """What went wrong: the message of an error that gonio raises for its users, and of any other its kind and place."""
    if isinstance(error, KeyError) and error.args:
        return str(error.args[0])
    if isinstance(error, ValueError | OSError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error or 'for this'}"
    trace = error.__traceback__
    while trace and trace.tb_next:
        trace = trace.tb_next
    place = f" ({Path(trace.tb_frame.f_code.co_filename).name}, line {trace.tb_lineno})" if trace else ""
    return f"{type(error).__name__}: {error}{place}; this is a mistake in gonio: {TRACE}=1 shows where"
