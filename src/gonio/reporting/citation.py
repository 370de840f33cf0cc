"""How to cite gonio and what it builds on, from what declares it: CITATION.cff and the references of `literature`."""

from functools import cache
from pathlib import Path

from gonio.literature import references as literature

NAME = "CITATION.cff"
PLACES = (Path(__file__).parent, Path(__file__).parents[3])  # of a wheel; a checkout has the file at its root


@cache
def _declared() -> str:
    path = next(folder / NAME for folder in PLACES if (folder / NAME).is_file())
    return path.read_text(encoding="utf-8")


def of_gonio() -> str:
    """The citation of gonio in words."""
    import yaml

    declared = yaml.safe_load(_declared())
    authors = ", ".join(one.get("name") or f"{one['given-names']} {one['family-names']}" for one in declared["authors"])
    place = "".join(f", {declared[key]}" for key in ("doi", "url", "repository-code") if key in declared)
    return f"{authors}: {declared['title']}, version {declared['version']}, {declared['license']}{place}"


def reference(key: str) -> str:
    """The publication of that key in words; the key itself where it is of none that gonio knows."""
    found = literature.reference(key)
    return f"{found} [{key}]" if found else key or "not stated"
