"""The publications that gonio cites, read from references.yaml when one is asked for."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any


@dataclass(frozen=True)
class Reference:
    """One publication. `where` is its journal with volume and pages, or its publisher. What is not known is empty.

    `str(reference)` is the whole citation in one line.
    """

    key: str
    authors: tuple[str, ...]
    families: tuple[str, ...]
    year: str
    title: str
    where: str
    doi: str
    url: str

    @property
    def byline(self) -> str:
        """Authors and year: `B. Walter and H. Li (2007)`."""
        *others, last = self.authors
        names = f"{', '.join(others)} and {last}" if others else last
        return f"{names} ({self.year})" if self.year else names

    @property
    def short(self) -> str:
        """`Walter et al. 2007`: how a table cites it."""
        names = " and ".join(self.families) if len(self.families) < 3 else f"{self.families[0]} et al."
        return f"{names} {self.year}".strip()

    @property
    def link(self) -> str:
        """Address of the publication: of its DOI, or where it is on the Web; empty where neither is known."""
        return f"https://doi.org/{self.doi}" if self.doi else self.url

    @property
    def record(self) -> dict[str, Any]:
        """The reference as plain data."""
        return {
            "key": self.key,
            "authors": list(self.authors),
            "year": self.year,
            "title": self.title,
            "where": self.where,
            "doi": self.doi,
            "url": self.link,
        }

    def __str__(self) -> str:
        parts = [f"{self.byline}: {self.title}", self.where, self.link]
        return ". ".join(part for part in parts if part)


@functools.cache
def entries() -> Mapping[str, Mapping[str, Any]]:
    """The entries of references.yaml by key, as they stand there."""
    import yaml

    loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    text = files(__package__).joinpath("references.yaml").read_text(encoding="utf-8")
    return {entry["id"]: entry for entry in yaml.load(text, loader)}


@functools.cache
def reference(key: str) -> Reference | None:
    """The publication of this key; None where gonio does not cite it."""
    entry = entries().get(key)
    if entry is None:
        return None
    return Reference(
        key=key,
        authors=tuple(_named(author) for author in entry["author"]),
        families=tuple(author.get("literal") or author["family"] for author in entry["author"]),
        year=str(entry.get("issued", "")),
        title=entry["title"],
        where=_where(entry),
        doi=entry.get("DOI", ""),
        url=entry.get("URL", ""),
    )


def _named(author: Mapping[str, str]) -> str:
    """`B. Walter`, or the whole name of an institution."""
    return author.get("literal") or f"{author['given']} {author['family']}"


def _where(entry: Mapping[str, Any]) -> str:
    """Journal, volume, issue and pages; or collection, publisher and note."""
    journal = entry.get("container-title", "")
    if "volume" in entry:
        series = entry.get("collection-title", "")
        journal = ", ".join(part for part in (journal, series) if part) + f" {entry['volume']}"
    if "issue" in entry:
        journal += f"({entry['issue']})"
    more = [entry.get(name, "") for name in ("page", "genre", "publisher", "number", "medium", "note")]
    return ", ".join(part for part in (journal, *more) if part)
