"""Every way by which a file comes into gonio: what `make fuzz` asks of fits, stacks and scans beside `gonio.read`.

A file goes through `gonio info`, `gonio check`, `Solution.load` and the opening of `gonio fit-stack`. Each either takes
it, or says in one line that names the file what is wrong. A traceback, a warning or a second line is a failure.
"""

import contextlib
import io
import sys
from collections.abc import Callable
from pathlib import Path

import stacks
from gonio.app.cli import main
from gonio.files import FormatError
from gonio.fitting import Solution
from gonio.fitting.stack.run import StackFit, prepare

LONGEST_LINE = 1000  # characters beside the path


def command(name: str, path: Path) -> str:
    """What a command says to a file that it refuses; empty where it takes it. AssertionError for any other end."""
    out, errors, argv = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = ["gonio", name, str(path)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
            main()
        code: object = 0
    except SystemExit as end:
        code = end.code or 0
    finally:
        sys.argv = argv
    said = errors.getvalue()
    if code == 0:
        strange = [line for line in said.splitlines() if ": warning: " not in line or not line.isprintable()]
        assert strange == [], f"takes the file, and says {strange[0][:200]!r}"
        assert out.getvalue(), "takes the file, and prints nothing"
        return ""
    assert code == 1, f"ends with code {code}: {said[-300:]!r}"
    assert out.getvalue() == "", f"prints before it refuses: {out.getvalue()[:200]!r}"
    assert_one_line(said, path)
    return said


def assert_one_line(said: str, path: Path) -> None:
    """AssertionError unless a refusal is one printable line that names the file, and not a long one."""
    line = said.removesuffix("\n")
    assert line.isprintable(), f"is not one line of printable characters: {said[:300]!r}"
    assert str(path) in line, f"does not name the file: {line[:300]!r}"
    assert len(line) <= LONGEST_LINE + len(str(path)), f"is {len(line)} characters long: {line[:200]!r}"


def info(path: Path) -> str:
    """`gonio info`."""
    return command("info", path)


def check(path: Path) -> str:
    """`gonio check`."""
    return command("check", path)


def load(path: Path) -> str:
    """`Solution.load`, and the values that it gives."""
    try:
        solution = Solution.load(path)
        solution.parameters()
        solution.intervals()
    except FormatError as error:
        assert_one_line(str(error), path)
        return str(error)
    return ""


def open_of_fit_stack(path: Path) -> str:
    """What `gonio fit-stack` does before it fits the first block, but for compiling the search."""
    try:
        prepare(StackFit(stacks.LAMBERT, path, path.with_name("out.zarr"), fit_many=stacks.means))
    except ValueError as error:
        assert_one_line(str(error), path)
        return str(error)
    return ""


DOORS: tuple[Callable[[Path], str], ...] = (info, check, load, open_of_fit_stack)


def through_doors(path: Path, begin: Callable[[], None]) -> list[str]:
    """What each door says to a file, nothing where it takes it; AssertionError for a bad end.

    `begin` is called before each.
    """
    said = []
    for door in DOORS:
        begin()
        try:
            said.append(door(path))
        except AssertionError as error:
            raise AssertionError(f"{door.__name__} {error}") from None
    return said
