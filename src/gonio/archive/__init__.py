"""Public data by name: downloaded once, held against its SHA-256, and found again without network."""

import os
from collections.abc import Callable
from pathlib import Path

from gonio.archive.collection import Collection, PublicFile, collections, named

__all__ = ["Collection", "PublicFile", "cache", "collections", "fetch", "named"]

FOLDER = "GONIO_DATA"  # environment variable: where fetched files are kept


def cache() -> Path:
    """The folder that keeps fetched files: that of GONIO_DATA, or the user's cache."""
    import pooch

    return Path(os.environ.get(FOLDER) or pooch.os_cache("gonio"))


def fetch(
    name: str,
    base_url: str = "",
    folder: str | Path | None = None,
    accept: Callable[[Collection], None] = lambda collection: None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Path:
    """The path of the public file `collection/file`, downloaded unless it is there already.

    `base_url` is a mirror that has the archive's own paths under it. `folder` takes the file itself; without one it
    lies under its collection in the cache. `accept` is called with the collection before its first download, to show
    licence and citation; what it raises stops the download.
    Raises KeyError with the nearest names, ValueError where the archive has something else than expected, OSError
    where it does not answer, FileExistsError where `folder` has another file of that name.
    """
    collection, file = named(name)
    root = cache() / collection.name if folder is None else Path(folder)
    target = root / file.basename
    if folder is not None and target.exists() and not _is(target, file):
        raise FileExistsError(f"{target} exists and is another file: choose another folder")
    if not target.exists():
        _show_terms(collection, root, accept)
    return _downloaded(collection, file, base_url or collection.base_url, root, progress)


def _show_terms(collection: Collection, root: Path, accept: Callable[[Collection], None]) -> None:
    """Show licence and citation once a folder, and leave them there beside the data."""
    kept = root / f"{collection.name}-licence.txt"
    if not kept.exists():
        accept(collection)
        root.mkdir(parents=True, exist_ok=True)
        kept.write_text(collection.terms + "\n", encoding="utf-8")


def _downloaded(
    collection: Collection, file: PublicFile, base_url: str, root: Path, progress: Callable[[float], None]
) -> Path:
    import pooch

    from gonio.archive.download import Download

    if not base_url.startswith(("http://", "https://")):
        raise ValueError(f"{base_url} is no address: a mirror begins with https:// or http://")
    pooch.get_logger().setLevel("WARNING")  # it would name each download on standard error
    known = pooch.create(
        path=root,
        base_url=f"{base_url.rstrip('/')}/",
        registry={file.basename: f"sha256:{file.sha256}"},
        urls={file.basename: f"{base_url.rstrip('/')}/{file.path}"},
    )
    partial = root / f"{file.basename}.part"
    return Path(known.fetch(file.basename, downloader=Download(file, partial, progress)))


def _is(path: Path, file: PublicFile) -> bool:
    from gonio.archive.download import sha256

    return path.stat().st_size == file.size and sha256(path) == file.sha256
