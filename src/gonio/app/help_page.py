"""What `--help` shows of a command: its options by groups, and examples. The man page is made of the same.

Little is imported here, since `gonio --help` waits for it.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from typer.core import TyperCommand

from gonio.options import Panel


class Example(NamedTuple):
    """A line that can be typed as it is, and what it does."""

    line: str
    what: str


class ExitCode(NamedTuple):
    """A number that the program ends with, and what it means."""

    number: str
    meaning: str


EXIT_CODES = (
    ExitCode("0", "the command did what it was asked to do"),
    ExitCode("1", "an error: one line on standard error says what is wrong, where, and what to do"),
    ExitCode("2", "the command line was not understood: an unknown command or option, or one that is missing"),
    ExitCode("130", "stopped by Ctrl-C; any other signal gives 128 and its number"),
)

ENVIRONMENT = (
    ("GONIO_DATA", "the folder of files that gonio fetch has fetched"),
    ("GONIO_TRACEBACK", "set to 1, an error is shown with the lines of code that it came from"),
)


def sections(command: Any, ctx: Any) -> Iterable[tuple[str, list[tuple[str, str]]]]:
    """The arguments, then the options by their panels: each title with pairs of what is typed and what it means."""
    found: dict[str, list[tuple[str, str]]] = {"Arguments": [], **{panel: [] for panel in Panel}}
    for parameter in command.get_params(ctx):
        if (pair := parameter.get_help_record(ctx)) is None:
            continue
        if parameter.param_type_name == "argument":
            found["Arguments"].append((_argument(parameter), pair[1]))
        else:
            panel = getattr(parameter, "rich_help_panel", None) or Panel.GENERAL
            found.setdefault(str(panel), []).append(pair)
    return ((title, pairs) for title, pairs in found.items() if pairs)


def _argument(parameter: Any) -> str:
    """How an argument is written: `FILE`, or `FILE...` where there may be several."""
    return f"{parameter.metavar or parameter.name.upper()}{'...' * (parameter.nargs != 1)}"


def usage(command: Any) -> list[str]:
    """What may follow the name of a command; what may be left out is in brackets."""
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    return ["[OPTIONS]", *(_argument(p) if p.required else f"[{_argument(p)}]" for p in arguments)]


def write_sections(command: Any, ctx: Any, formatter: Any) -> None:
    """The arguments and options as a part of a help text."""
    for title, pairs in sections(command, ctx):
        with formatter.section(title):
            formatter.write_dl(pairs)


def write_examples(examples: Sequence[Example], formatter: Any) -> None:
    """Each example on a line of its own, however wide the terminal, so that it can be copied."""
    with formatter.section("Examples"):
        for number, example in enumerate(examples):
            formatter.write("\n" * (number > 0))
            formatter.write_text(f"{example.what}:")
            formatter.write(f"{'':>{formatter.current_indent + 2}}{example.line}\n")


class Command(TyperCommand):
    """A command whose help has its options in groups and ends with examples."""

    examples: Sequence[Example] = ()

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """The arguments as the help lists them."""
        return usage(self)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments and groups of options."""
        write_sections(self, ctx, formatter)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Examples."""
        write_examples(self.examples, formatter)
