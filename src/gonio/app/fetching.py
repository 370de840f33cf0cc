"""The command that fetches public data by name."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import Force, Json
from gonio.app.terminal import app

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.archive import Collection

NAME_HELP = "collection/file, as in merl/aluminium; a collection alone lists its files"


@app.command("fetch")
def fetch_data(
    name: Annotated[str, typer.Argument(help=NAME_HELP, show_default=False)] = "",
    to: Annotated[str, typer.Option("--to", metavar="DIR", help="put the file there instead of in the cache")] = "",
    base_url: Annotated[str, typer.Option("--base-url", metavar="URL", help="a mirror of the archive")] = "",
    licence: Annotated[bool, typer.Option("--licence", help="show licence and citation, and stop")] = False,
    json: Json = "",
    force: Force = False,
) -> None:
    """Fetch public measured data by name, or list what there is."""
    from gonio.app import present
    from gonio.archive import collections

    chosen = collections()[name.partition("/")[0]] if name else None
    if chosen and "/" in name and not licence:
        record: Any = _fetched(name, base_url, Path(to) if to else None)
        shown: list[Any] = [record["path"]]
    else:
        wanted = [chosen] if chosen else list(collections().values())
        record = [_record(collection) for collection in wanted]
        terms = [collection.terms for collection in wanted] if licence else []
        shown = terms or ([chosen.terms, _files(chosen)] if chosen else [_table(wanted)])
    if json:
        present.emit_json(record, json, force)
    if json != "-":
        for part in shown:
            if isinstance(part, str):
                print(part)
            else:
                present.console().print(part)


def _fetched(name: str, base_url: str, folder: Path | None) -> dict[str, Any]:
    from gonio.app import present
    from gonio.archive import fetch, named

    collection, file = named(name)
    with present.progress_bar(name) as progress:
        path = fetch(name, base_url, folder, _show, progress)
    return {
        "name": name,
        "path": str(path),
        "sha256": file.sha256,
        "size": file.size,
        "licence": collection.licence,
        "cite": list(collection.cite),
    }


def _show(collection: "Collection") -> None:
    typer.echo(collection.terms, err=True)


def _record(collection: "Collection") -> dict[str, Any]:
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


def _table(wanted: "list[Collection]") -> "Table":
    from gonio.app import present

    out = present.table("collection", "what it is", "licence", "files", "size", left=3)
    for c in wanted:
        out.add_row(c.name, c.title.partition(": ")[2], c.licence, str(len(c.files)), _size(c.size))
    return out


def _files(collection: "Collection") -> "Table":
    from gonio.app import present

    out = present.table("name", "file", "size", left=2)
    for file in collection.files.values():
        out.add_row(f"{collection.name}/{file.name}", file.basename, _size(file.size))
    return out


def _size(count: int) -> str:
    """Bytes in the unit that people read."""
    for unit, step in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= step:
            return f"{count / step:.1f} {unit}"
    return f"{count} B"
