"""Make references.bib from src/gonio/literature/references.yaml, the one declaration: part of `make pages`."""

import sys
from collections.abc import Mapping
from typing import Any

from _pages import ROOT

from gonio.literature.references import entries

HEAD = "% Made by `make pages` from src/gonio/literature/references.yaml: edit that file.\n\n"
KINDS = {
    "article-journal": ("article", "container-title=journal"),
    "paper-conference": ("inproceedings", "container-title=booktitle"),
    "book": ("book", ""),
    "thesis": ("phdthesis", "publisher=school"),
    "report": ("techreport", "publisher=institution"),
    "document": ("misc", "medium=howpublished URL=howpublished"),
}
# Field of CSL, field of BibTeX.
FIELDS = {
    "container-title": "journal",
    "collection-title": "series",
    "publisher": "publisher",
    "volume": "volume",
    "issue": "number",
    "number": "number",
    "edition": "edition",
    "page": "pages",
    "medium": "howpublished",
    "URL": "url",
    "note": "note",
    "issued": "year",
    "DOI": "doi",
}
VERBATIM = ("DOI", "URL")  # what LaTeX reads letter by letter


def bibtex() -> str:
    """The whole bibliography."""
    return HEAD + "\n".join(entry(key, one) for key, one in entries().items())


def entry(key: str, one: Mapping[str, Any]) -> str:
    kind, special = KINDS[one["type"]]
    renamed = dict(pair.split("=") for pair in special.split())
    fields = [("author", " and ".join(map(author, one["author"]))), ("title", f"{{{escaped(one['title'])}}}")]
    for name, field in FIELDS.items():
        if name in one:
            value = str(one[name])
            fields.append((renamed.get(name, field), value if name in VERBATIM else escaped(value)))
    lines = ",\n".join(f"  {field} = {{{value}}}" for field, value in fields)
    return f"@{kind}{{{key},\n{lines}\n}}\n"


def author(name: Mapping[str, str]) -> str:
    """`Walter, B.`; an institution between braces, which keep its words together."""
    return f"{{{escaped(name['literal'])}}}" if "literal" in name else f"{name['family']}, {name['given']}"


def escaped(text: str) -> str:
    """Letters that LaTeX would take for commands, and dashes as it writes them."""
    for letter in "_&%#":
        text = text.replace(letter, f"\\{letter}")
    return text.replace("–", "--")


def main() -> int:
    (ROOT / "references.bib").write_text(bibtex(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
