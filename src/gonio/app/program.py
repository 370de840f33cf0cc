"""The Typer program: one file a command in `commands`, loaded only when it is asked for.

`gonio --help` reads the first line of each command's docstring from its file and imports none of them, since that takes
the numerical libraries with it.
"""

import ast
import importlib
import keyword
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

# The commands in the order of a day's work; each is a file of that name in `commands`.
COMMANDS = (
    *("info", "fit", "compare", "plot", "check", "fit-stack"),
    *("import", "convert", "diff", "reduce", "fetch", "formats"),
    *("models", "eval", "draw", "materials", "demo"),
)
SETTINGS: dict[str, Any] = {
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,
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

    def list_commands(self, ctx: Any) -> list[str]:
        """Their names."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """One of them, None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        from gonio.app.options import with_options

        module = importlib.import_module(f"gonio.app.commands.{_file(cmd_name).stem}")
        alone = typer.Typer(**SETTINGS)
        alone.command(cmd_name)(with_options(module.command, getattr(module, "IN_PLACE", "")))
        return typer.main.get_command(alone)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Names and summaries, without importing anything."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, _summary(name)) for name in COMMANDS])


app = typer.Typer(
    cls=Commands,
    help="From goniometer readings to a BRDF, the analytic model that explains it, and how sure that is.",
    no_args_is_help=True,
    **SETTINGS,
)


@app.callback()
def _gonio() -> None:
    """Typer makes a group of what has a callback."""
