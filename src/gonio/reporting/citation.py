"""How to cite gonio and what it builds on, from the files that declare it: CITATION.cff and references.bib."""

import re
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent  # where a wheel has these files; a checkout has them at its root
ROOT = Path(__file__).parents[3]
FIELD = re.compile(r"^\s*(\w+)\s*=\s*\{(.*)\},?\s*$", re.MULTILINE)
PLACES = ("journal", "booktitle", "school", "institution", "publisher", "howpublished", "note")


@cache
def _declared(name: str) -> str:
    path = next(folder / name for folder in (HERE, ROOT) if (folder / name).is_file())
    return path.read_text(encoding="utf-8")


def of_gonio() -> str:
    """The citation of gonio in words."""
    import yaml

    declared = yaml.safe_load(_declared("CITATION.cff"))
    authors = ", ".join(one.get("name") or f"{one['given-names']} {one['family-names']}" for one in declared["authors"])
    place = "".join(f", {declared[key]}" for key in ("doi", "url", "repository-code") if key in declared)
    return f"{authors}: {declared['title']}, version {declared['version']}, {declared['license']}{place}"


def reference(key: str) -> str:
    """The publication of that key in words; the key itself where it is of none that gonio knows."""
    entry = re.search(rf"^@\w+\{{{re.escape(key)},$.*?^\}}", _declared("references.bib"), re.MULTILINE | re.DOTALL)
    if not entry:
        return key or "not stated"
    fields = {
        name: value.replace("{", "").replace("}", "").replace("--", "–") for name, value in FIELD.findall(entry[0])
    }
    authors = ", ".join(" ".join(reversed(one.split(", ", 1))) for one in fields.get("author", key).split(" and "))
    place = next((fields[name] for name in PLACES if name in fields), "")
    where = " ".join(part for part in (place, fields.get("volume", "")) if part)
    numbers = ", ".join(part for part in (where, fields.get("pages", "")) if part)
    doi = f", doi {fields['doi']}" if "doi" in fields else ""
    year = f" ({fields['year']})" if "year" in fields else ""
    return f"{authors}: {fields.get('title', '')}. {numbers}{year}{doi} [{key}]"
