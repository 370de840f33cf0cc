"""The page as a reader sees it: on a telephone, on a screen and printed."""

import shutil
import subprocess

import pytest

from browser import shared
from report.conftest import KINDS

pytestmark = pytest.mark.xdist_group("report")  # one process, which makes the pages once
WIDTHS = (360, 1280)  # pixels: a telephone and a screen
A4 = 297.0  # mm
MARGINS = 34.0  # mm, above and below together
MM = 96 / 25.4  # pixels


@pytest.fixture
def shown(chromium, pages):
    """A page of a kind at a width; what it asked for and complained of must be nothing at the end."""
    tab, wrong = shared.tab(), []
    allowed = ("data:", *(path.as_uri() for path in pages.values()))
    listeners = {
        "console": lambda message: wrong.append(message.text),
        "pageerror": lambda error: wrong.append(str(error)),
        "request": lambda asked: None if asked.url.startswith(allowed) else wrong.append(asked.url),
    }
    for event, listener in listeners.items():
        tab.on(event, listener)

    def show(kind, width):
        tab.set_viewport_size({"width": width, "height": 900})
        tab.goto(pages[kind].as_uri())
        return tab

    yield show
    for event, listener in listeners.items():
        tab.remove_listener(event, listener)
    assert wrong == []


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_wider_than_the_screen(shown, kind):
    tab = shown(kind, WIDTHS[0])
    tab.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    for width in WIDTHS:
        tab.set_viewport_size({"width": width, "height": 900})
        assert tab.evaluate("document.scrollingElement.scrollWidth") <= width
        beyond = "e => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest('svg, thead')"
        assert tab.evaluate(f"Array.from(document.querySelectorAll('main *')).filter({beyond}).length") == 0
    assert tab.title()


@pytest.mark.parametrize("kind", ["coating", "causes", "hemisphere"])
def test_text_in_figures_can_be_read_on_a_telephone(shown, kind):
    """At least 8 pixels, of which a telephone shows two or three to a point of the page."""
    tab = shown(kind, 360)
    heights = tab.evaluate(
        "Array.from(document.querySelectorAll('figure svg')).map(s => {"
        " const scale = s.getBoundingClientRect().width / s.viewBox.baseVal.width;"
        " const sizes = Array.from(s.querySelectorAll('text')).map(t => parseFloat(getComputedStyle(t).fontSize));"
        " return scale * Math.min(...sizes)})"
    )
    assert heights
    assert min(heights) >= 8


@pytest.mark.parametrize("kind", ["coating", "causes", "spectral", "hemisphere", "two values"])
def test_it_is_printed_whole(shown, kind, tmp_path):
    tab = shown(kind, 1280)
    pdf = tmp_path / "page.pdf"
    tab.pdf(path=pdf, prefer_css_page_size=True)
    tab.emulate_media(media="print")
    tab.set_viewport_size({"width": int(180 * MM), "height": int((A4 - MARGINS) * MM)})  # as wide as the text of a page
    beyond = "e => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest('svg')"
    wide = tab.evaluate(
        f"Array.from(document.querySelectorAll('main *')).filter({beyond}).map(e => e.outerHTML.slice(0, 200))"
    )
    assert wide == []
    figures = tab.evaluate("Array.from(document.querySelectorAll('figure')).map(f => f.getBoundingClientRect().height)")
    assert 0 < max(figures) < (A4 - MARGINS) * MM  # which the style keeps on one page
    kept = "Array.from(document.querySelectorAll('figure')).map(f => getComputedStyle(f).breakInside)"
    assert set(tab.evaluate(kept)) == {"avoid"}
    folded = (
        "Array.from(document.querySelectorAll('details > :not(summary)')).map(e => e.getBoundingClientRect().height)"
    )
    assert 0 not in tab.evaluate(folded)
    if shutil.which("pdftotext"):
        text = subprocess.run(["pdftotext", "-layout", pdf, "-"], capture_output=True, check=True, text=True).stdout
        assert "Not stated" in text
        assert text.count("\f") <= 20
