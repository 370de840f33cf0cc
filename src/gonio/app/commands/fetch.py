"""`gonio fetch`: public measured data by name."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app import names, talk
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.output import Plain, progress_bar
from gonio.app.views import archive as view
from gonio.archive import collections, fetch, named
from gonio.options import Option, Panel

if TYPE_CHECKING:
    from gonio.archive import Collection

EXAMPLES = (
    Example("gonio fetch", "List the collections"),
    Example("gonio fetch merl", "List the files of one, with its licence"),
    Example("gonio fetch merl/aluminium", "Fetch a file, check it by its hash, and print where it is"),
    Example("gonio fetch merl --licence", "Show licence and citation only"),
)


def command(
    output: OutputOptions,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="collection/file, as in merl/aluminium; a collection alone lists its files",
            show_default=False,
            autocompletion=Option("", names=names.public_files).completed,
        ),
    ] = "",
    to: Annotated[
        str, Option("put the file into this folder and not into the cache", metavar="DIR", panel=Panel.OUTPUT)
    ] = "",
    base_url: Annotated[str, Option("address of a mirror of the archive", metavar="URL", panel=Panel.DATA)] = "",
    licence: Annotated[bool, Option("show licence and citation, and fetch nothing", panel=Panel.OUTPUT)] = False,
) -> None:
    """Fetch public measured data by name, or list what there is."""
    chosen = collections()[name.partition("/")[0]] if name else None
    if chosen and "/" in name and not licence:
        record: Any = _fetched(name, base_url, Path(to) if to else None)
        shown: list[Any] = [Plain(record["path"])]
    else:
        wanted = [chosen] if chosen else list(collections().values())
        record = [view.record(collection) for collection in wanted]
        terms = [Plain(collection.terms) for collection in wanted] if licence else []
        shown = terms or ([Plain(chosen.terms), view.files(chosen)] if chosen else [view.table(wanted)])
    output.show(record, shown)


def _fetched(name: str, base_url: str, folder: Path | None) -> dict[str, Any]:
    collection, file = named(name)
    with progress_bar(name) as progress:
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
    for line in collection.terms.splitlines():
        talk.tell(line)
