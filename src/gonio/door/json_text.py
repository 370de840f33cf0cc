"""JSON with the line of each value. The line is searched for only when an error is raised.

Numbers become floats. NaN and Infinity, names that occur twice in an object, and nesting beyond DEEPEST are refused.
"""

import itertools
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gonio.door.text import clip
from gonio.files import FormatError

DEEPEST = 64
MOST_PLACES = 200_000  # values that are searched for a place; a later value gets the place of what holds it
MOST_PARTS = 1_000_000  # lists and objects; each takes about a hundred bytes of memory, and two bytes in the file
# Possessive quantifiers: a text of millions of characters must not keep a backtracking state for each.
_TOKEN = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[{}\[\],:]|[^\s{}\[\],:"]++', re.DOTALL)
Step = str | int


class _RefusedError(ValueError):
    """Raised within the parser for what is refused; `_refusal` then searches for the place."""


@dataclass(frozen=True)
class Document:
    """The text of a file, and its JSON value."""

    path: Path
    text: str
    value: Any

    def wrong(self, what: str, *steps: Step) -> FormatError:
        """The error to raise for the value at these names and indexes; where it is missing, for what should hold it."""
        known, offset = 0, 0
        for at, place, _ in itertools.islice(_places(self.text), MOST_PLACES):
            if len(place) == known + 1 and tuple(place) == steps[: known + 1]:
                known, offset = known + 1, at
                if known == len(steps):
                    break
        return FormatError(self.path, what, _line(self.text, offset))

    def object(self, *steps: str) -> dict[str, Any]:
        """The object at these names. Raises FormatError where there is none."""
        value: Any = self.value
        for n, name in enumerate(steps):
            value = value.get(name)
            if not isinstance(value, dict):
                raise self.wrong(f"there is no object {clip(name)!r} here", *steps[: n + 1])
        return value


def load(path: Path) -> Document:
    """Read a file that holds one JSON object. Raises FormatError with the line, or the byte of what is not UTF-8."""
    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, "is not UTF-8 text: save the file as UTF-8", f"byte {error.start}") from error
    if text.count("[") + text.count("{") > MOST_PARTS:
        at = next(itertools.islice(re.finditer(r"[\[{]", text), MOST_PARTS, None)).start()
        raise FormatError(path, f"holds more than {MOST_PARTS} lists and objects", _line(text, at))
    try:
        value = json.loads(text, parse_int=float, parse_constant=_no_constant, object_pairs_hook=_unique)
    except json.JSONDecodeError as error:
        raise FormatError(path, f"is no JSON ({error.msg})", f"line {error.lineno}") from error
    except (RecursionError, _RefusedError) as error:
        raise _refusal(path, text) from error
    if not isinstance(value, dict):
        raise FormatError(path, "is JSON, but no object", "line 1")
    return Document(path, text, value)


def _no_constant(name: str) -> Any:
    raise _RefusedError(name)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        raise _RefusedError
    return members


def _refusal(path: Path, text: str) -> FormatError:
    """The error for the first thing that `load` refuses, found by a pass over the text."""
    seen: list[set[Step]] = []
    for at, place, token in _places(text):
        if len(place) > DEEPEST:
            return FormatError(path, f"values are nested more than {DEEPEST} deep", _line(text, at))
        if token in ("NaN", "Infinity", "-Infinity"):
            return FormatError(path, f"{token} is no JSON number: leave the value out", _line(text, at))
        del seen[len(place) :]
        seen += [set() for _ in range(len(place) - len(seen))]
        if place and isinstance(place[-1], str):
            if place[-1] in seen[-1]:
                return FormatError(path, f"the name {clip(place[-1])!r} occurs twice: keep one", _line(text, at))
            seen[-1].add(place[-1])
    return FormatError(path, "is no JSON that can be read", "line 1")


def _places(text: str) -> Iterator[tuple[int, list[Step], str]]:
    """Offset, names and indexes, and first token of every value, in order. One list is reused for all places."""
    place: list[Step] = []
    name = ""
    after = ""
    for match in _TOKEN.finditer(text.removeprefix("\ufeff")):
        token, at = match.group(), match.start()
        if token == ":":
            place[-1:] = [_text(name)]
        elif token == ",":
            if place and isinstance(place[-1], int):
                place[-1] += 1
        elif token in "}]":
            del place[-1:]
        else:
            name = token
            if after == ":" or not place or isinstance(place[-1], int):
                yield at, place, token
            if token in "{[":
                place.append("" if token == "{" else 0)
        after = token


def _text(token: str) -> str:
    try:
        return str(json.loads(token))
    except ValueError:
        return token


def _line(text: str, at: int) -> str:
    return f"line {text.count(chr(10), 0, at) + 1}"
