"""The site as `make docs` builds it: no warning, no dead link, nothing from elsewhere, readable on a telephone."""

import inspect
import os
import re
import shutil
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

import gonio
from gonio.fitting import ProblemOptions
from places import ROOT, loaded

pytest.importorskip("sphinx", reason="the site needs Sphinx: pip install gonio[docs]")

pytestmark = pytest.mark.xdist_group("site")  # built once, by one worker
DOCS = ROOT / "docs"
MADE = ("api", "examples")  # what a build writes beside its sources
LOOKED_AT = ("index", "api/gonio.fit", "examples/01_fit", "command-line", "conventions")
links = loaded(DOCS / "_extensions" / "links.py")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    for name in MADE:
        shutil.rmtree(DOCS / name, ignore_errors=True)
    out = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-E",
        "-d",
        out / "trees",
        DOCS,
        out / "html",
    ]
    environment = {name: value for name, value in os.environ.items() if name != "GONIO_DOCS_ONLINE"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.stderr.splitlines() == []
    assert (done.returncode, done.stdout) == (0, "")
    return out / "html"


def test_it_has_no_dead_link_and_loads_nothing_from_elsewhere(site):
    assert len(list(site.rglob("*.html"))) > 80
    assert links.faults(site) == []


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ('<a href="other.html">', "leads to other.html, which is not there"),
        ('<a href="#place">', "leads to #place: the page has no such place"),
        ('<a href="folder/page.html#place">', "leads to folder/page.html#place: the page has no such place"),
        ('<img src="figure.png">', "leads to figure.png, which is not there"),
        ('<script src="https://example.org/a.js"></script>', "loads https://example.org/a.js from elsewhere"),
        ('<img srcset="//example.org/a.png 2x">', "loads //example.org/a.png from elsewhere"),
        ('<p style="background: url(http://example.org/a.png)">', "loads http://example.org/a.png from elsewhere"),
    ],
)
def test_a_fault_of_a_page_is_found(tmp_path, body, fault):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "page.html").write_text('<h1 id="title">')
    (tmp_path / "index.html").write_text('<a href="folder/page.html#title"><a href="https://example.org">')
    assert links.faults(tmp_path) == []
    (tmp_path / "index.html").write_text(body)
    assert links.faults(tmp_path) == [f"index.html {fault}"]


def test_a_style_sheet_that_loads_from_elsewhere_is_found(tmp_path):
    (tmp_path / "a.css").write_text('@import "https://example.org/fonts.css";')
    assert links.faults(tmp_path) == ["a.css loads https://example.org/fonts.css from elsewhere"]


def test_every_public_name_has_its_page_with_its_signature(site):
    below = [f"{home}.{name}" for name, home in gonio._BELOW.items()]
    listed = (site / "api.html").read_text(encoding="utf-8")
    for name in [*(f"gonio.{name}" for name in gonio.__all__), *below]:
        assert f'href="api/{name}.html"' in listed, name
        page = (site / "api" / f"{name}.html").read_text(encoding="utf-8")
        signature = re.search(rf'<dt class="sig[^>]*id="{re.escape(name)}">(.*?)</dt>', page, re.DOTALL)
        assert signature, f"{name} has no signature"
        words = re.sub("<[^>]+>", " ", signature[1])
        if callable(thing := _thing(name)):
            assert all(re.search(rf"\b{each}\b", words) for each in inspect.signature(thing).parameters), name
        assert "<p>" in page[signature.end() :], f"{name} is not described"


def _thing(name: str) -> object:
    home, _, last = name.rpartition(".")
    return getattr(import_module(home), last)


def test_an_option_of_a_problem_is_described_on_its_page(site):
    page = (site / "api" / "gonio.Problem.html").read_text(encoding="utf-8")
    for option in fields(ProblemOptions):
        assert re.search(rf"<dt><strong>[^<]*\b{option.name}\b", page), option.name


def test_formulas_are_mathml(tmp_path):
    """One page with every kind of formula, built as the site is; a formula that cannot be drawn stops the build."""
    (tmp_path / "conf.py").write_text(
        f"import sys\nsys.path.insert(0, {str(DOCS / '_extensions')!r})\nextensions = ['myst_parser', 'mathml']\n"
        "html_math_renderer = 'mathml'\nmyst_enable_extensions = ['dollarmath', 'amsmath']\n"
    )
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", tmp_path, tmp_path / "out"]
    page = "# A\n\n$a_b$\n\n$$\\frac{a}{b}$$\n\n\\begin{align}a &= b \\\\ c &= d\\end{align}\n"
    (tmp_path / "index.md").write_text(page)
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    html = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert [html.count(f"<{tag}") for tag in ("msub", "mfrac", "mtable", 'script src="http')] == [1, 1, 1, 0]
    (tmp_path / "index.md").write_text("# A\n\n$$\\nonsense{a}$$\n")
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no MathML for" in done.stderr


def test_scripts_of_the_gallery_are_short():
    for path in sorted((DOCS / "gallery").glob("*.py")):
        text = re.sub(r'^""".*?"""', "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        code = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
        assert len(code) <= 30, f"{path.name} has {len(code)} lines of code"


def test_a_reader_sees_it_without_network_on_a_telephone_and_on_a_desk(site, chromium):
    for width in (360, 1280):
        page = chromium.new_page(viewport={"width": width, "height": 800})
        asked, wrong = [], []
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.on("console", lambda said, wrong=wrong: wrong.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error, wrong=wrong: wrong.append(str(error)))
        for name in LOOKED_AT:
            page.goto((site / f"{name}.html").as_uri())
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert (name, wide, wrong) == (name, width, [])
        assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
        assert asked
