"""The page put together: of files that a server hands out, or all in one file."""

import base64
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from gonio.files import refuse_existing, replacing
from gonio.viewing.described import module, shader
from gonio.viewing.pairs import every_pair
from gonio.viewing.session import Session

STYLES = ("vendor/uplot.css", "style.css")
TYPES = {".js": "text/javascript", ".css": "text/css"}
# In one file a page asks nobody for anything: its scripts are those that it holds, named by their digests.
ALONE = (
    "default-src 'none'; script-src {digests} data: blob:; style-src 'unsafe-inline'; img-src data: blob:; "
    "connect-src 'none'; base-uri 'none'; form-action 'none'"
)
START = 'import "gonio/app.js";'


@cache
def parts() -> Mapping[str, str]:
    """The files of the page but index.html, by the name under which they are asked for."""
    root = files("gonio.viewing").joinpath("page")
    named = {f"{folder}{one.name}": one for folder, one in (*_in(root, ""), *_in(root.joinpath("vendor"), "vendor/"))}
    return {name: one.read_text(encoding="utf-8") for name, one in sorted(named.items()) if _suffix(name) in TYPES}


def _in(folder: Traversable, prefix: str) -> list[tuple[str, Traversable]]:
    return [(prefix, one) for one in folder.iterdir() if one.is_file()]


def _suffix(name: str) -> str:
    return name[name.rfind(".") :]


def _scripts() -> list[str]:
    return [name for name in parts() if name.endswith(".js")]


@cache
def served() -> tuple[str, str]:
    """The page of a server, and its Content-Security-Policy."""
    imports = {f"gonio/{name}": f"/page/{name}" for name in _scripts()} | {"model/": "/api/model/"}
    text = _import_map(imports)
    styles = "\n".join(f'<link rel="stylesheet" href="/page/{name}">' for name in STYLES)
    scripts = f'<script type="importmap">{text}</script>\n<script type="module" src="/page/app.js"></script>'
    policy = (
        f"default-src 'none'; script-src 'self' {_digest(text)}; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return _filled(styles, scripts), policy


def in_one_file(session: Session, models: list[str], notebook: bool = False) -> str:
    """The page with all that it needs: scans, fits, and the models that are named.

    notebook: whether it stands in a frame of a notebook, and exchanges messages with that.
    """
    known = [session.models[name] for name in models]
    told = session.described()
    for described, one in zip(told["sets"], session.opened, strict=True):
        described["findings"] = one.findings
    inside = {
        "session": told | {"models": [m for m in told["models"] if m["name"] in models]},
        "columns": [base64.b64encode(one.columns.encoded()).decode() for one in session.opened],
        "pairs": every_pair(session),
        "shaders": {model.name: shader(model) for model in known},
        "notebook": notebook,
    }
    imports = {f"gonio/{name}": _data(parts()[name]) for name in _scripts()}
    imports |= {f"model/{model.name}.js": _data(module(model)) for model in known}
    text = _import_map(imports)
    styles = "\n".join(f"<style>\n{parts()[name]}</style>" for name in STYLES)
    scripts = "\n".join(
        [
            f'<meta http-equiv="Content-Security-Policy" content="{policy([text, START])}">',
            f'<script type="application/json" id="gonio-held">{_inside(json.dumps(inside))}</script>',
            f'<script type="importmap">{text}</script>',
            f'<script type="module">{START}</script>',
        ]
    )
    return _filled(styles, scripts)


def written(page: str, path: Path, force: bool) -> Path:
    """A page written to a file of HTML."""
    refuse_unwritable(path, force)
    with replacing(path, force) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return path


def refuse_unwritable(path: Path, force: bool) -> None:
    """ValueError for a name that is none of a page, FileExistsError for a file that is there, without `force`."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"{path}: the page is HTML: give a name that ends in .html")
    refuse_existing(path, force)


def policy(scripts: Sequence[str]) -> str:
    """The Content-Security-Policy of a page in one file, whose own scripts are these."""
    return ALONE.format(digests=" ".join(map(_digest, scripts)))


def scripts_of(page: str) -> list[str]:
    """The scripts that stand in a page in one file: its import map, and what starts it."""
    return re.findall(r'<script type="(?:importmap|module)">(.*?)</script>', page, re.DOTALL)


def _digest(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _filled(styles: str, scripts: str) -> str:
    page = files("gonio.viewing").joinpath("page", "index.html").read_text(encoding="utf-8")
    return page.replace("<!-- styles -->", styles).replace("<!-- scripts -->", scripts)


def _import_map(imports: Mapping[str, str]) -> str:
    return _inside(json.dumps({"imports": imports}, ensure_ascii=False))


def _inside(text: str) -> str:
    """JSON that no text in it can end: the characters that HTML reads are written as numbers."""
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _data(script: str) -> str:
    """A script as an address: readable, and shorter than base64. Only what an address cannot hold is escaped."""
    for character in "%#\n\r\t":
        script = script.replace(character, f"%{ord(character):02X}")
    return "data:text/javascript;charset=utf-8," + script
