"""`gonio fetch`: public measured data by name."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import OutputOptions
from gonio.app.output import Plain, progress_bar
from gonio.app.views import archive as view
from gonio.archive import collections, fetch, named

if TYPE_CHECKING:
    from gonio.archive import Collection

NAME_HELP = "collection/file, as in merl/aluminium; a collection alone lists its files"


def command(
    output: OutputOptions,
    name: Annotated[str, typer.Argument(help=NAME_HELP, show_default=False)] = "",
    to: Annotated[str, typer.Option("--to", metavar="DIR", help="put the file there instead of in the cache")] = "",
    base_url: Annotated[str, typer.Option("--base-url", metavar="URL", help="a mirror of the archive")] = "",
    licence: Annotated[bool, typer.Option("--licence", help="show licence and citation, and stop")] = False,
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
    typer.echo(collection.terms, err=True)
