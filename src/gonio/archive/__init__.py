"""Public data by name: downloaded once, checked by its SHA-256, and available later without network."""

import os
from collections.abc import Callable
from pathlib import Path

from gonio.archive.collection import Collection, PublicFile, collections, named
from gonio.files import naming, refuse_no_folder
from gonio.processes.ending import undone

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
    """Download a public file, unless it is there already, and give its path.

    Parameters
    ----------
    name : str
        `collection/file`, such as `merl/aluminium`.
    base_url : str
        A mirror with the same paths as the archive.
    folder : str or Path, optional
        Where the file is written, by default a folder of the collection in the cache.
    accept : callable
        Called with the collection before its first download, to show licence and citation; an exception that it raises
        stops the download.
    progress : callable
        Called with the part that has arrived, 0 to 1.

    Returns
    -------
    Path
        The file, checked by its SHA-256.

    Raises
    ------
    KeyError
        No such file; the message has the nearest names.
    ValueError
        The archive's file is not the expected one.
    OSError
        The archive does not answer. FileExistsError where `folder` has another file of that name, FileNotFoundError
        where it would be made in a folder that is not there.

    """
    collection, file = named(name)
    root = cache() / collection.name if folder is None else Path(folder)
    target = root / file.basename
    if folder is not None:
        refuse_no_folder(root)
    if folder is not None and target.exists() and not _matches(target, file):
        raise FileExistsError(f"{target} exists and is another file: choose another folder")
    if not target.exists():
        _show_terms(collection, root, accept)
    return _downloaded(collection, file, base_url or collection.base_url, root, progress)


def _show_terms(collection: Collection, root: Path, accept: Callable[[Collection], None]) -> None:
    """Show licence and citation once for each folder, and write them there beside the data."""
    licence = root / f"{collection.name}-licence.txt"
    if not licence.exists():
        accept(collection)
        root.mkdir(parents=True, exist_ok=True)
        with naming(licence):
            licence.write_text(collection.terms + "\n", encoding="utf-8")


def _downloaded(
    collection: Collection, file: PublicFile, base_url: str, root: Path, progress: Callable[[float], None]
) -> Path:
    """The path of the file, downloaded by pooch unless it is in `root` with the right SHA-256."""
    import pooch

    from gonio.archive.download import Download

    if not base_url.startswith(("http://", "https://")):
        raise ValueError(f"{base_url} is no address: a mirror begins with https:// or http://")
    pooch.get_logger().setLevel("WARNING")  # it would name each download on standard error
    registry = pooch.create(
        path=root,
        base_url=f"{base_url.rstrip('/')}/",
        registry={file.basename: f"sha256:{file.sha256}"},
        urls={file.basename: f"{base_url.rstrip('/')}/{file.path}"},
    )
    download = Download(file, root / f"{file.basename}.part", progress)
    with undone(download.forget_targets):
        return Path(registry.fetch(file.basename, downloader=download))


def _matches(path: Path, file: PublicFile) -> bool:
    """Whether a file on disk is this public file, by size and SHA-256."""
    from gonio.archive.download import sha256

    return path.stat().st_size == file.size and sha256(path) == file.sha256
