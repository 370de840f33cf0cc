"""A page of the refractiveindex.info database: YAML whose DATA list holds tables and dispersion formulas, in um."""

import html
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml

from gonio.door.yaml_text import composed, line_of
from gonio.files import FormatError
from gonio.materials.curves import EITHER, LONGEST_UM, Curve, joined, number, tabulated
from gonio.materials.formulas import Formula
from gonio.materials.material import Material

_KEYS = re.compile(r"^(REFERENCES|COMMENTS|DATA|SPECS|CONDITIONS|PROPERTIES)[ \t]*:", re.MULTILINE)


def recognises(text: str) -> bool:
    """Whether a line begins with a key of the database."""
    return bool(_KEYS.search(text))


def read(path: Path, text: str) -> Material:
    """A Material from a page of the database; FormatError names the line."""
    page = _mapping(path, composed(path, text, "page of refractiveindex.info"))
    if "DATA" not in page or not isinstance(page["DATA"], yaml.SequenceNode) or not page["DATA"].value:
        raise FormatError(path, "has no list DATA: give a file of refractiveindex.info's data-nk")
    found: dict[str, Curve] = {}
    for node in page["DATA"].value:
        entry = _mapping(path, node)
        for name, curve in _curves(path, node, entry):
            if name in found:
                raise FormatError(path, f"gives {name} twice: keep one entry of DATA", line_of(node))
            found[name] = curve
    cite, note = (_plain(page.get(key)) for key in ("REFERENCES", "COMMENTS"))
    return joined(path, found.get("n"), found.get("k"), cite, note)


def _mapping(path: Path, node: yaml.Node | None) -> dict[str, yaml.Node]:
    if not isinstance(node, yaml.MappingNode):
        raise FormatError(path, f"expected keys and values here: {EITHER}", line_of(node) if node else "")
    out: dict[str, yaml.Node] = {}
    for key, value in node.value:
        if key.value in out:
            raise FormatError(path, f"the key {key.value} occurs twice: keep one", line_of(key))
        out[str(key.value)] = value
    return out


def _scalar(path: Path, node: yaml.Node, entry: dict[str, yaml.Node], *keys: str) -> tuple[str, yaml.ScalarNode]:
    """The text under the first of `keys` that an entry has, and where it stands."""
    value = next((entry[key] for key in keys if key in entry), None)
    if not isinstance(value, yaml.ScalarNode):
        raise FormatError(path, f"an entry of DATA needs {keys[0]}", line_of(node))
    return str(value.value), value


def _plain(node: yaml.Node | None) -> str:
    """Text without the database's HTML, on one line."""
    text = str(node.value) if isinstance(node, yaml.ScalarNode) else ""
    return " ".join(html.unescape(re.sub(r"<[^<>]*>", "", text)).split())


def _curves(path: Path, node: yaml.Node, entry: dict[str, yaml.Node]) -> Iterator[tuple[str, Curve]]:
    text, at = _scalar(path, node, entry, "type")
    kind, _, which = " ".join(text.split()).partition(" ")
    if kind == "tabulated" and which in ("n", "k", "nk"):
        rows = list(_rows(path, node, entry, which))
        for column, name in enumerate(which, start=1):
            yield name, tabulated(path, name, [(line, cells[0], cells[column]) for line, cells in rows])
    elif kind == "formula" and re.fullmatch("[1-9]", which):
        yield "n", _formula(path, node, entry, int(which))
    else:
        what = f"type {text[:40]!r} is none of tabulated nk, tabulated n, tabulated k, formula 1 to formula 9"
        raise FormatError(path, what, line_of(at))


def _rows(path: Path, node: yaml.Node, entry: dict[str, yaml.Node], which: str) -> Iterator[tuple[int, list[float]]]:
    """Line and numbers of each row of a table."""
    text, at = _scalar(path, node, entry, "data")
    names = ("wavelength", *which)
    for offset, row in enumerate(text.split("\n")):
        # A literal block begins below its key; any other style has no lines of its own.
        line = at.start_mark.line + 1 + (offset + 1 if at.style == "|" else 0)
        if not row.strip():
            continue
        cells = row.split()
        if len(cells) != len(names):
            what = f"{len(cells)} numbers where {len(names)} are expected: {', '.join(names)}"
            raise FormatError(path, what, f"line {line}")
        yield line, _numbers(path, cells, f"line {line}")


def _numbers(path: Path, cells: list[str], where: str) -> list[float]:
    values = [number(cell) for cell in cells]
    if None in values:
        raise FormatError(path, f"{cells[values.index(None)][:40]!r} is not a finite number", where)
    return [v for v in values if v is not None]


def _formula(path: Path, node: yaml.Node, entry: dict[str, yaml.Node], which: int) -> Curve:
    text, at = _scalar(path, node, entry, "wavelength_range", "range")
    ends = _numbers(path, text.split(), line_of(at))
    if len(ends) != 2 or not 0 < ends[0] < ends[1] <= LONGEST_UM:
        raise FormatError(
            path, f"wavelength_range is {text[:40]!r}: two rising wavelengths in um are needed", line_of(at)
        )
    text, at = _scalar(path, node, entry, "coefficients")
    try:
        return Curve(np.array(ends), None, Formula(which, tuple(_numbers(path, text.split(), line_of(at)))))
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(path, str(error), line_of(at)) from error
