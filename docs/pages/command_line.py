"""Make docs/command-line.md and the man page docs/gonio.1 of what the commands declare: part of `make pages`.

`gonio --help` and `gonio COMMAND --help` show the same words.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import typer
from _pages import DOCS

import gonio
from gonio.app.help_page import ENVIRONMENT, EXIT_CODES, Example, sections, usage
from gonio.app.program import EXAMPLES, GROUPS, app

HEAD = """# The command line

`make pages` writes this page; do not edit it. `gonio --help` and `gonio COMMAND --help` show the same, and so does the man page
`gonio.1`, which is installed with the package.

"""
COMPLETION = """## Completion

`gonio --install-completion` teaches the shell that runs it (bash, zsh, fish or PowerShell) the commands, their options, and the
names of models, formats, materials and public files; `gonio --show-completion` only prints what it would install.

"""
TALK = """## How much is told

Results go to standard output, everything else to standard error. `-v` tells each step, `-q` prints results and errors only. Both
stand before the command or after it. `--json -` prints the results for programs. Progress is drawn on a terminal only.

"""


class Root:
    """The program, its context, and its commands with theirs."""

    def __init__(self) -> None:
        self.program: Any = typer.main.get_command(app)
        self.context = self.program.make_context("gonio", [], resilient_parsing=True)
        self.commands: dict[str, Any] = {
            name: self.program.get_command(self.context, name) for names in GROUPS.values() for name in names
        }

    def sections(self, name: str) -> Iterable[tuple[str, list[tuple[str, str]]]]:
        """The groups of options of a command; of the program itself for no name."""
        command = self.commands[name] if name else self.program
        context = command.make_context(name, [], resilient_parsing=True) if name else self.context
        return sections(command, context)


def page(root: Root) -> str:
    """The page in Markdown."""
    parts = [HEAD, "```\ngonio [OPTIONS] COMMAND ...\n```\n\n"]
    for title, names in GROUPS.items():
        parts.append(f"**{title}**\n\n")
        parts += [f"- [`gonio {name}`](#gonio-{name}): {_summary(root.commands[name])}\n" for name in names]
        parts.append("\n")
    parts += [_options(root.sections("")), _examples(EXAMPLES), TALK, COMPLETION]
    parts += ["## Exit codes\n\n", _table(("code", "meaning"), EXIT_CODES)]
    parts += ["## Environment\n\n", _table(("variable", "meaning"), [(f"`{n}`", w) for n, w in ENVIRONMENT])]
    for name, command in root.commands.items():
        parts += [f"## gonio {name}\n\n", f"{_paragraphs(command)}\n\n"]
        parts.append(f"```\ngonio {name} {' '.join(usage(command))}\n```\n\n")
        parts += [_options(root.sections(name)), _examples(command.examples)]
    return "".join(parts).rstrip() + "\n"


def _summary(command: Any) -> str:
    return command.help.splitlines()[0]


def _paragraphs(command: Any) -> str:
    return "\n\n".join(" ".join(part.split()) for part in command.help.split("\n\n"))


def _options(groups: Iterable[tuple[str, list[tuple[str, str]]]]) -> str:
    tables = (
        f"**{title}**\n\n" + _table(("", ""), [(f"`{_cell(typed)}`", _cell(meaning)) for typed, meaning in pairs])
        for title, pairs in groups
    )
    return "".join(tables)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads), *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines) + "\n\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _examples(examples: Sequence[Example]) -> str:
    return "```\n" + "\n".join(f"# {one.what}\n{one.line}" for one in examples) + "\n```\n\n"


def manual(root: Root) -> str:
    """The man page, in the macros of man(7)."""
    lines = [
        f'.TH GONIO 1 "" "gonio {gonio.__version__}" "User Commands"',
        ".SH NAME",
        "gonio \\- BRDF measurements: read, fit, compare, draw and convert",
        ".SH SYNOPSIS",
        ".B gonio",
        "[OPTIONS] COMMAND ...",
        ".SH DESCRIPTION",
        _roff(root.program.help),
    ]
    for title, names in GROUPS.items():
        lines += [".SS " + _roff(title), *(line for n in names for line in _entry(n, _summary(root.commands[n])))]
    for title, pairs in root.sections(""):
        lines += [f'.SH "OPTIONS ({title.upper()})"', *(line for pair in pairs for line in _entry(*pair))]
    for name, command in root.commands.items():
        lines += [f'.SH "gonio {name}"', f".B gonio {_roff(name)}", _roff(" ".join(usage(command)))]
        lines += [line for part in _paragraphs(command).split("\n\n") for line in (".PP", _roff(part))]
        for title, pairs in root.sections(name):
            lines += [f".SS {title}", *(line for pair in pairs for line in _entry(*pair))]
        lines += [".SS Examples", *_shown(command.examples)]
    lines += [".SH EXAMPLES", *_shown(EXAMPLES)]
    lines += [".SH EXIT STATUS", *(line for code in EXIT_CODES for line in _entry(*code))]
    lines += [".SH ENVIRONMENT", *(line for pair in ENVIRONMENT for line in _entry(*pair))]
    return "\n".join(lines) + "\n"


def _entry(typed: str, meaning: str) -> list[str]:
    return [".TP", f"\\fB{_roff(typed)}\\fR", _roff(" ".join(meaning.split()))]


def _shown(examples: Sequence[Example]) -> list[str]:
    """Each example on a line that is not filled."""
    return [line for one in examples for line in (".PP", f"{_roff(one.what)}:", ".EX", f"  {_roff(one.line)}", ".EE")]


def _roff(text: str) -> str:
    """Text without what roff would take for a command or for another hyphen or quote."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "")
    return re.sub(r"^\.", r"\\&.", text)


def main() -> None:
    """Write both."""
    root = Root()
    (DOCS / "command-line.md").write_text(page(root), encoding="utf-8")
    (DOCS / "gonio.1").write_text(manual(root), encoding="utf-8")


if __name__ == "__main__":
    main()
