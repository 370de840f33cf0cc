"""After the build, the pages as they lie there: no dead link between them, and nothing that is loaded from elsewhere.

Sphinx warns of links that it makes itself; this reads the HTML, so that links of the theme, of the gallery and of raw
HTML count too. Each fault is a warning, and so stops `make docs`. Links to other sites are for `make links`.
"""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sphinx.application import Sphinx
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)
LOADED = {
    "script": "src",
    "img": "src",
    "link": "href",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "audio": "src",
}
STYLES = re.compile(r"(?:@import\s*|url\()\s*[\"']?((?:https?:)?//[^\"')]+)", re.IGNORECASE)


class Page(HTMLParser):
    """What one page loads, where it leads, and the places that can be led to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.loads: set[str] = set()
        self.leads: set[str] = set()
        self.places: set[str] = {"", "top"}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """One element."""
        given = {name: value or "" for name, value in attrs}
        self.places |= {given.get("id", ""), given.get("name", "")}
        if tag == "a" and "href" in given:
            self.leads.add(given["href"])
        if LOADED.get(tag) in given:
            self.loads.add(given[LOADED[tag]])
        self.loads |= {one.split()[0] for one in given.get("srcset", "").split(",") if one.strip()}
        self.loads |= set(STYLES.findall(given.get("style", "")))


def faults(site: Path) -> list[str]:
    """Every dead link of the pages below a folder, and everything that they load from elsewhere, one a line."""
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html")) if "_static" not in path.parts}
    found = []
    for path, page in pages.items():
        name = path.relative_to(site.resolve()).as_posix()
        elsewhere = [url for url in page.loads if urlsplit(url).scheme not in ("", "data") or url.startswith("//")]
        found += [f"{name} loads {url} from elsewhere" for url in sorted(elsewhere)]
        for url in sorted(page.loads - set(elsewhere) | page.leads):
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                found.append(f"{name} leads to {url}, which is not there")
            elif target in pages and unquote(parts.fragment) not in pages[target].places:
                found.append(f"{name} leads to {url}: the page has no such place")
    for style in sorted(site.rglob("*.css")):
        loaded = STYLES.findall(style.read_text(encoding="utf-8"))
        found += [f"{style.relative_to(site)} loads {url} from elsewhere" for url in loaded]
    return found


def check(app: Sphinx, error: Exception | None) -> None:
    """Warn of every fault of a site that was built."""
    if error is None and app.builder.format == "html":
        for fault in faults(Path(app.outdir)):
            LOGGER.warning(fault, type="links")


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
