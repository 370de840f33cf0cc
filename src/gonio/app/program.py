"""The Typer program: one file a command in `commands`, loaded only when it is asked for.

`gonio --help` reads the first line of each command's docstring from its file and imports none of them, since that takes
the numerical libraries with it.
"""

import ast
import importlib
import keyword
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from gonio.app import talk
from gonio.app.help_page import EXIT_CODES, Command, Example, write_examples, write_sections
from gonio.options import Panel

# The commands in the order of a day's work; each is a file of that name in `commands`.
GROUPS = {
    "Measurements and fits": ("info", "fit", "compare", "plot", "view", "check", "report", "stack", "fit-stack"),
    "Measuring": ("plan", "plan-next", "measure", "watch", "verify"),
    "Files": ("import", "convert", "export", "diff", "reduce", "fetch", "sample", "formats"),
    "Models": ("models", "eval", "complete", "draw", "albedo", "magnitude", "materials", "topography", "demo"),
}
COMMANDS = tuple(name for names in GROUPS.values() for name in names)
EXAMPLES = (
    Example("gonio info scan.csv", "See what a file holds and whether something is wrong with it"),
    Example("gonio import table.csv --out scan.csv", "Read a table of your own as a scan"),
    Example("gonio fit scan.csv", "Which model describes the scan, how well, and how sure"),
    Example("gonio fit --help", "Learn more about one command"),
)
SETTINGS: dict[str, Any] = {
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


def _file(name: str) -> Path:
    mark = "_" if keyword.iskeyword(name) else ""  # no module can be called `import`
    return Path(__file__).with_name("commands") / f"{name.replace('-', '_')}{mark}.py"


def _summary(name: str) -> str:
    """The first line of the docstring of a command."""
    tree = ast.parse(_file(name).read_text(encoding="utf-8"))
    function = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "command")
    return (ast.get_docstring(function) or "").splitlines()[0]


class Commands(TyperGroup):
    """The commands of COMMANDS, each imported when it is called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the words name; `plan next` is one of two words."""
        if args[:2] == ["plan", "next"]:
            args = ["plan-next", *args[2:]]
        return super().resolve_command(ctx, args)

    def list_commands(self, ctx: Any) -> list[str]:
        """Their names."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """One of them, None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        from gonio.app.flags import with_options

        module = importlib.import_module(f"gonio.app.commands.{_file(cmd_name).stem}")
        alone = typer.Typer(add_completion=False, **SETTINGS)
        alone.command(cmd_name, cls=Command)(with_options(module.command, getattr(module, "IN_PLACE", "")))
        command: Any = typer.main.get_command(alone)
        command.examples = module.EXAMPLES
        return command

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Names with summaries for a shell, without importing anything."""
        named: dict[str, Any] = {name: TyperCommand(name, help=_summary(name)) for name in COMMANDS}
        return TyperGroup(name=self.name, commands=named, params=self.params).shell_complete(ctx, incomplete)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """The commands in groups, and the options of the program itself."""
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, _summary(name)) for name in names])
        write_sections(self, ctx, formatter)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Examples, and what the exit codes mean."""
        write_examples(EXAMPLES, formatter)
        with formatter.section("Exit codes"):
            formatter.write_dl(list(EXIT_CODES))


app = typer.Typer(
    cls=Commands,
    help="From goniometer readings to a BRDF, the analytic model that explains it, and how sure that is.",
    invoke_without_command=True,
    **SETTINGS,
)


def _print_version(asked: bool) -> None:
    if asked:
        import gonio

        print(f"gonio {gonio.__version__}")
        raise typer.Exit


@app.callback()
def _gonio(
    ctx: typer.Context,
    verbose: talk.Verbose = False,
    quiet: talk.Quiet = False,
    version: Annotated[  # noqa: ARG001 - its callback answers it
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="print the version", rich_help_panel=Panel.GENERAL
        ),
    ] = False,
) -> None:
    talk.choose(verbose, quiet)
    if ctx.invoked_subcommand is None:
        print(ctx.get_help())
