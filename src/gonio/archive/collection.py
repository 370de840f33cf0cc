"""Collections of measured surfaces in public archives: one TOML file each, beside this one."""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files

from gonio.model import NearestNames


@dataclass(frozen=True)
class PublicFile:
    """One file of an archive: its path under the archive's address, and the SHA-256 and size that it must have."""

    name: str
    path: str
    sha256: str
    size: int  # bytes

    @property
    def basename(self) -> str:
        """The name of the file without its folders."""
        return self.path.rpartition("/")[2]


@dataclass(frozen=True)
class Collection:
    """Files of one origin and licence; `note` says what gonio does not offer, and where to get that by hand."""

    name: str
    title: str
    base_url: str
    homepage: str
    licence: str
    cite: tuple[str, ...]
    citation: str
    note: str
    files: Mapping[str, PublicFile]

    @property
    def size(self) -> int:
        """Bytes of all files together."""
        return sum(file.size for file in self.files.values())

    @property
    def terms(self) -> str:
        """Licence and citation in words, for people to read before they use the data."""
        lines = [
            self.title,
            f"licence: {self.licence}",
            f"cite {', '.join(self.cite)}: {self.citation}",
            f"homepage: {self.homepage}",
        ]
        return "\n".join([*lines, *([self.note] if self.note else [])])


def _loaded(name: str, text: str) -> Collection:
    """A collection from the text of its TOML file."""
    entry = tomllib.loads(text)
    public_files = {key: PublicFile(key, **value) for key, value in entry.pop("files").items()}
    cite, note = tuple(entry.pop("cite")), entry.pop("note", "")
    return Collection(name, **entry, cite=cite, note=note, files=NearestNames(f"file of {name}", public_files))


@functools.cache
def collections() -> NearestNames[Collection]:
    """Every collection by name."""
    paths = sorted((p for p in files(__package__).iterdir() if p.name.endswith(".toml")), key=lambda p: p.name)
    texts = {p.name.removesuffix(".toml"): p.read_text(encoding="utf-8") for p in paths}
    return NearestNames("collection", {name: _loaded(name, text) for name, text in texts.items()})


def named(name: str) -> tuple[Collection, PublicFile]:
    """The collection and the file that `collection/file` names.

    Raises KeyError with the nearest names, ValueError where a collection has nothing to fetch.
    """
    collection, slash, file = name.partition("/")
    public_files = {f"{c.name}/{f}": (c, c.files[f]) for c in collections().values() for f in c.files}
    if slash and collection in collections() and not collections()[collection].files:
        raise ValueError(f"{name}: {collections()[collection].note} ({collections()[collection].homepage})")
    if not slash:
        return _of_collection(collection)
    return NearestNames("public file", public_files)[f"{collection}/{file}"]


def _of_collection(name: str) -> tuple[Collection, PublicFile]:
    """The only file of a collection; ValueError where there are several to choose from."""
    collection = collections()[name]
    if len(collection.files) != 1:
        first = ", ".join(f"{name}/{file}" for file in list(collection.files)[:3])
        raise ValueError(f"{name} is a collection of {len(collection.files)} files: name one, as in {first}")
    return collection, next(iter(collection.files.values()))
