"""XML as a tree of elements that know their line, read without recursion.

DTDs and entities are refused (by defusedxml), and depth, number and length of elements are limited.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from gonio.door.text import clip
from gonio.files import FormatError

DEEPEST = 40  # nested elements; no measurement has more
MOST_ELEMENTS = 100_000
LONGEST_TAG = 1_048_576  # bytes
_CHUNK = 65_536
_BEGIN = re.compile(rb"^(?:\xef\xbb\xbf)?[ \t]*<(?=[?!A-Za-z_])", re.MULTILINE)  # a line that begins with a tag


@dataclass(slots=True)
class Element:
    """One element: its name without namespace, its line, attributes, text (without that of children) and children."""

    path: Path
    tag: str
    line: int
    attributes: dict[str, str]
    text: str = ""
    children: list["Element"] = field(default_factory=list)

    def wrong(self, what: str, at: int = 0) -> FormatError:
        """The error to raise for what is wrong with the element, or `at` this character of its text."""
        return FormatError(self.path, what, f"line {self.line + self.text.count(chr(10), 0, at)}")

    def all(self, tag: str) -> list["Element"]:
        """All children of that name."""
        return [child for child in self.children if child.tag == tag]

    def find(self, tag: str) -> "Element | None":
        """The first child of that name; None where there is none."""
        return next(iter(self.all(tag)), None)

    def child(self, tag: str) -> "Element":
        """The first child of that name. Raises FormatError where there is none."""
        element = self.find(tag)
        if element is None:
            raise self.wrong(f"{self.tag} holds no {tag}")
        return element

    def word(self, tag: str) -> str:
        """The text of a child with single spaces, cut at 400 characters. Raises FormatError where there is none."""
        element = self.child(tag)
        text = " ".join(element.text[:400].split())
        if not text:
            raise element.wrong(f"{tag} is empty")
        return text


class _Builder:
    """The target of the parser, which builds the tree. It asks the parser for the line."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.root: Element | None = None
        self.remarks: list[str] = []
        self.parser: Any = None
        self.skipped = 0  # lines before the XML begins
        self._open: list[tuple[Element, list[str]]] = []
        self._count = 0

    @property
    def line(self) -> int:
        """The line of the file that the parser has reached."""
        return self.skipped + int(self.parser.parser.CurrentLineNumber)

    def _wrong(self, what: str) -> FormatError:
        return FormatError(self.path, what, f"line {self.line}")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Begin an element, within the limits of depth and number."""
        self._count += 1
        if len(self._open) >= DEEPEST:
            raise self._wrong(f"elements are nested more than {DEEPEST} deep")
        if self._count > MOST_ELEMENTS:
            raise self._wrong(f"there are more than {MOST_ELEMENTS} elements")
        element = Element(self.path, tag.rpartition("}")[2], self.line, dict(attributes))
        if self._open:
            self._open[-1][0].children.append(element)
        self._open.append((element, []))

    def data(self, text: str) -> None:
        """Add text to the innermost open element."""
        if self._open:
            self._open[-1][1].append(text)

    def comment(self, text: str) -> None:
        """Keep a remark before the root; of one within an element only the line ends, to count lines right."""
        if self._open:
            self._open[-1][1].append("\n" * text.count("\n") or " ")
        else:
            self.remarks += [line.strip() for line in text.splitlines() if line.strip()]

    def end(self, _tag: str) -> None:
        """Close the innermost element."""
        element, pieces = self._open.pop()
        element.text = "".join(pieces)
        if not self._open:
            self.root = element

    def close(self) -> Element | None:
        """The root element, which the parser returns at the end."""
        return self.root


def parse(path: Path) -> tuple[Element, list[str]]:
    """The root element of an XML file, and the lines of the remarks before it. Raises FormatError with the line.

    Lines of text before the XML, which programs print into such files and other readers skip, are remarks too.
    """
    with path.open("rb") as file:
        return parse_stream(path, file)


def parse_stream(path: Path, file: IO[bytes]) -> tuple[Element, list[str]]:
    """The same of an open file, such as a member of an archive; errors call it `path`."""
    from xml.etree.ElementTree import ParseError

    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser

    builder = _Builder(path)
    parser = DefusedXMLParser(target=builder, forbid_dtd=True)
    builder.parser = parser
    try:
        fed = 0
        while chunk := file.read(_CHUNK) if fed else _from_the_root_on(file.read(_CHUNK), builder):
            parser.feed(chunk)
            fed += len(chunk)
            if fed - parser.parser.CurrentByteIndex > LONGEST_TAG:
                raise FormatError(path, f"a tag is longer than {LONGEST_TAG} bytes", f"line {builder.line}")
        root = parser.close()
    except ParseError as error:
        raise FormatError(
            path, f"is no well-formed XML ({clip(str(error), 80)})", f"line {builder.skipped + error.position[0]}"
        ) from error
    except DefusedXmlException as error:
        message = "has a document type or entities, which a measurement does not need: delete them"
        raise FormatError(path, message, f"line {builder.line}") from error
    except FormatError:
        raise
    except (ValueError, LookupError) as error:  # an encoding that the parser does not know
        message = f"is in no encoding that can be read ({clip(str(error), 60)}): save it as UTF-8"
        raise FormatError(path, message, f"line {builder.line}") from error
    if root is None:
        raise FormatError(path, "holds no element", "line 1")
    return root, builder.remarks


def _from_the_root_on(start: bytes, builder: _Builder) -> bytes:
    """The first bytes of a file without the lines of text before its XML, which become remarks."""
    begin = _BEGIN.search(start)
    if begin is None or not (before := start[: begin.start()].removeprefix(b"\xef\xbb\xbf")).strip():
        return start
    builder.skipped = before.count(b"\n")
    lines = before.decode("utf-8", errors="replace").splitlines()
    builder.remarks += [line.strip() for line in lines if line.strip()]
    return start[begin.start() :]
