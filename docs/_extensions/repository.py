"""Pages that lie beside docs/ in the repository, such as CONTRIBUTING.md: they are pages of the site too.

A page of docs/ links to them as in the repository (`../CONTRIBUTING.md`), and the page that stands for one here has its
text. Links to other files of the repository need nothing: MyST makes downloads of them. Pages that are read in the
repository too list what lies below them as links; the site gets that as a hidden table of contents.
"""

import re
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
PAGES = {"CHANGELOG.md": "changes", "CONTRIBUTING.md": "contributing", "README.md": "index"}
TEXTS = {"changes": "CHANGELOG.md", "contributing": "CONTRIBUTING.md"}
BELOW = {
    "howto/index": (
        "howto/*.md",
        "tables.md",
        "figures.md",
        "measuring.md",
        "reduction.md",
        "where-to-measure.md",
        "many.md",
        "adding-a-model.md",
        "faq.md",
    ),
    "models/index": ("models/*.md",),
}


def with_pages(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put the text of a file in the place of its page, and have links lead to such pages."""
    text = source[0]
    if docname in TEXTS:
        app.env.note_dependency(str(ROOT / TEXTS[docname]))
        text = (ROOT / TEXTS[docname]).read_text(encoding="utf-8")
        text = re.sub(r"\]\((?![\w+.-]+:|#)([^)]+)\)", r"](../\1)", text).replace("](../docs/", "](")
    up = "../" * docname.count("/")
    for name, page in PAGES.items():
        text = re.sub(rf"\]\((?:\.\./)+{re.escape(name)}(#[^)]*)?\)", rf"]({up}{page}.md\1)", text)
    if docname in BELOW and "{toctree}" not in text:
        listed = [path.relative_to(DOCS) for pattern in BELOW[docname] for path in sorted(DOCS.glob(pattern))]
        pages = [f"/{path.with_suffix('').as_posix()}" for path in listed if path.stem != "index"]
        text += "\n\n" + "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"]) + "\n"
    source[0] = text


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("source-read", with_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
