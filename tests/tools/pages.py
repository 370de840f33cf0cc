"""The blocks of a page in Markdown, run one after the other as a reader would: files, commands, Python, printed text.

- A block after a line that ends in "`NAME`:" is the file NAME.
- `python` is run; all blocks of a page share their names.
- `sh` holds commands of gonio, one a line.
- `text` right below is what that block printed, white space apart. Numbers may differ in their last digits, and `...`
  stands for anything. Elsewhere it is an illustration.
- `sh not run: WHY` and `python not run: WHY` need what a test has not: another program, a cluster, the reader's files.
"""

import contextlib
import io
import math
import re
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from markdown_it import MarkdownIt

NOT_RUN = "not run: "
SHOWN = ("text", "toml", "yaml", "json", "csv", "bibtex")
DIGITS = 0.05  # numbers printed by other machines differ in what rounding and the last step of a search leave
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Block:
    """One fenced block: the first line of its text in the page, its language and the rest of its heading."""

    line: int
    language: str
    note: str
    text: str
    file: str  # the name of the file that it is; nothing where it is none
    follows: bool  # whether it stands right below another block


def blocks(page: Path) -> list[Block]:
    """Every block of a page, those by indentation too, of which the language is empty."""
    tokens = MarkdownIt().parse(page.read_text(encoding="utf-8"))
    out: list[Block] = []
    before, last = "", ""
    for token in tokens:
        if token.type in ("fence", "code_block"):
            language, _, note = token.info.partition(" ")
            name = re.search(r"`([\w./-]+)`:$", before.strip())
            out.append(
                Block(token.map[0] + 2, language, note, token.content, name[1] if name else "", last == token.type)
            )
        before = token.content if token.type in ("inline", "fence") else before
        last = token.type
    return out


class Reader:
    """Somebody who types a page into a terminal and a notebook, in the current folder."""

    def __init__(self, page: Path) -> None:
        self.page = page
        self.names: dict = {"__name__": "__main__"}
        self.printed = ""
        self.ran = False  # whether the block before was run

    def follow(self) -> None:
        for block in blocks(self.page):
            where = f"{self.page.name}, line {block.line}"
            ran, self.ran = self.ran, False
            if block.file:
                Path(block.file).write_text(block.text, encoding="utf-8")
            elif block.note.startswith(NOT_RUN):
                assert len(block.note) > len(NOT_RUN), f"{where}: say why it is not run"
            elif block.language in ("python", "sh"):
                self.ran = True
                self._run(block, where)
            elif block.language.startswith("{"):  # a directive of the site, which its build runs
                self.ran = ran
            elif block.language == "text" and ran and block.follows:
                compare(block.text, self.printed, where)
            else:
                assert block.language in SHOWN, f"{where}: nothing runs a block of {block.language or 'no language'}"

    def _run(self, block: Block, where: str) -> None:
        with contextlib.redirect_stdout(io.StringIO()) as out:
            if block.language == "python":
                exec(compile("\n" * (block.line - 1) + block.text, str(self.page), "exec"), self.names)
            else:
                for line in block.text.replace("\\\n", " ").splitlines():
                    self._command(line, where)
        self.printed = out.getvalue()

    def _command(self, line: str, where: str) -> None:
        words = shlex.split(line, comments=True)
        if not words:
            return
        assert words[0] == "gonio", f"{where}: {words[0]} is not run; mark the block `{NOT_RUN}WHY`"
        from gonio.app.cli import main

        code: object = 0
        with mock.patch.object(sys, "argv", words), contextlib.redirect_stderr(io.StringIO()) as err:
            try:
                main()
            except SystemExit as end:
                code = end.code
        assert not code, f"{where}: {line}: {err.getvalue()}"


def compare(expected: str, printed: str, where: str) -> None:
    """AssertionError with the first word that differs. `...` on a line, or at its end, stands for anything."""
    rest = printed.split()
    parts = [part.split() for part in re.split(r"(?:^|\s)\.\.\.(?:\s|$)", expected)]
    for k, words in enumerate(parts):
        starts = range(len(rest) - len(words) + 1) if k else range(1)
        found = next((at for at in starts if len(words) <= len(rest) and all(map(_alike, words, rest[at:]))), None)
        assert found is not None, f"{where}: {' '.join(words)!r} is not in: {printed}"
        rest = rest[found + len(words) :]
    assert not rest or not parts[-1], f"{where}: the page does not show {' '.join(rest)!r}"


def _alike(one: str, other: str) -> bool:
    """Whether two words are the same, numbers within DIGITS of each other."""
    a, b = (NUMBER.split(word) for word in (one, other))
    if a != b:
        return False
    return all(
        math.isclose(*map(_value, pair), rel_tol=DIGITS, abs_tol=1e-9)
        for pair in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    )


def _value(text: str) -> float:
    try:
        return float(text)
    except ValueError:  # 1.2.3 is no number, but a version or a heading
        return float(text.replace(".", ""))
