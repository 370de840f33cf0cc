"""Public collections of measured data, as plain data and as tables."""

from typing import TYPE_CHECKING, Any

from gonio.app import output

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.archive import Collection


def record(collection: "Collection") -> dict[str, Any]:
    """A collection as plain data."""
    return {
        "name": collection.name,
        "title": collection.title,
        "licence": collection.licence,
        "cite": list(collection.cite),
        "citation": collection.citation,
        "homepage": collection.homepage,
        "note": collection.note,
        "files": [
            {"name": f"{collection.name}/{file.name}", "sha256": file.sha256, "size": file.size}
            for file in collection.files.values()
        ],
    }


def table(wanted: "list[Collection]") -> "Table":
    """The collections for people."""
    out = output.table("collection", "what it is", "licence", "files", "size", left=3)
    for c in wanted:
        out.add_row(c.name, c.title.partition(": ")[2], c.licence, str(len(c.files)), _size(c.size))
    return out


def files(collection: "Collection") -> "Table":
    """The files of one collection for people."""
    out = output.table("name", "file", "size", left=2)
    for file in collection.files.values():
        out.add_row(f"{collection.name}/{file.name}", file.basename, _size(file.size))
    return out


def _size(count: int) -> str:
    """Bytes in the unit that people read."""
    for unit, step in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= step:
            return f"{count / step:.1f} {unit}"
    return f"{count} B"
