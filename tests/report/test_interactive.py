"""A report that ends in the page with sliders, and reads the same without scripts; and a PDF without a browser."""

import importlib.util
import re
import sys
import types

import html5lib
import pytest

import gonio
from gonio import Problem, catalogue, fit
from gonio.reporting import pdf
from gonio.reporting.interactive import kilobytes
from report.conftest import HELD, HOSTILE, painted
from viewing.opened import READY, from_elsewhere, opened

pytestmark = pytest.mark.xdist_group("viewer")
DATE = "2026-01-31"


@pytest.fixture(scope="module")
def solution():
    scan = painted()
    scan.attrs["history"] = f"read from {HOSTILE} as {HOSTILE}"
    return fit(Problem(catalogue["ggx"], scan, held=HELD, weighting="log"))


@pytest.fixture(scope="module")
def pages(solution, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports")
    plain = gonio.report(solution, folder / "plain.html", date=DATE)
    more = gonio.report(solution, folder / "more.html", date=DATE, interactive=True)
    return plain, more


def test_the_report_is_the_same_and_its_page_is_counted(pages):
    plain, more = (path.read_text(encoding="utf-8") for path in pages)
    section = re.search(r'<section id="interactive".*?</section>\n', more, re.DOTALL)
    assert section
    less = more.replace(section[0], "").replace('<li><a href="#interactive">Interactive page</a></li>\n', "")
    policy = r'<meta http-equiv="Content-Security-Policy"[^>]*>'
    same = re.sub(policy, "", less) == re.sub(policy, "", plain)
    assert same
    html5lib.HTMLParser(strict=True).parse(more)
    size = int(re.search(r"\((\d+) kB of this file\)", section[0])[1])
    assert 200 < size < 500
    assert len(more) - len(plain) == pytest.approx(1000 * size, rel=0.3)  # quotes and ampersands take more


def test_it_is_read_without_scripts_and_moved_with_them(chromium, pages):
    with opened(chromium, pages[1], java_script_enabled=False) as shown:
        words = shown.locator("main").inner_text()
        assert "It needs JavaScript, which this file brings" in words
        assert "PLAUSIBILITY" in words.upper()
        assert from_elsewhere(shown) in ([], ["about:srcdoc"])
    with opened(chromium, pages[1]) as shown:
        shown.locator("#interactive").scroll_into_view_if_needed()
        inside = shown.frame_locator("iframe")
        inside.locator(READY).wait_for()
        assert inside.locator(".parameter").count() == 5
        assert "harmed" not in shown.evaluate("Object.keys(window).join()")
        assert (shown.said, [url for url in from_elsewhere(shown) if url != "about:srcdoc"]) == ([], [])


def test_a_script_that_reached_the_report_would_not_run(chromium, pages, tmp_path):
    text = pages[1].read_text(encoding="utf-8").replace("</main>", "<script>window.harmed=1</script></main>")
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with opened(chromium, tmp_path / "page.html") as shown:
        assert shown.evaluate("window.harmed") is None
        assert any("Content Security Policy" in said for said in shown.said)


def test_text_and_pdf_have_no_sliders(solution, tmp_path):
    with pytest.raises(ValueError, match=r"stands in a report of HTML: name a file that ends in \.html"):
        gonio.report(solution, tmp_path / "page.md", interactive=True)
    assert list(tmp_path.iterdir()) == []


def test_sizes_in_words():
    assert (kilobytes(321_308), kilobytes(1_250_000)) == ("321 kB", "1.2 MB")


@pytest.fixture
def no_browser(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    pdf.browser.cache_clear()
    yield
    pdf.browser.cache_clear()


def test_without_a_browser_weasyprint_prints(no_browser, solution, tmp_path):
    pytest.importorskip("weasyprint", reason="no WeasyPrint: pip install gonio[pdf]")
    path = gonio.report(solution, tmp_path / "page.pdf", date=DATE)
    assert path.read_bytes().startswith(b"%PDF-")


def test_weasyprint_is_given_no_way_to_fetch(no_browser, monkeypatch, tmp_path):
    """As it is called, whether or not it is installed."""
    calls = {}

    class Fetcher:
        def __init__(self, **options):
            calls["fetcher"] = options

    class Html:
        def __init__(self, **options):
            calls["html"] = options["string"]

        def write_pdf(self, path):
            path.write_bytes(b"%PDF-")

    stand_in = types.SimpleNamespace(HTML=Html, urls=types.SimpleNamespace(URLFetcher=Fetcher))
    monkeypatch.setitem(sys.modules, "weasyprint", stand_in)
    monkeypatch.setattr(pdf, "find_spec", lambda name: object())
    assert pdf.write_pdf("<p>a", tmp_path / "a.pdf", force=False).read_bytes() == b"%PDF-"
    assert calls == {"html": "<p>a", "fetcher": {"allowed_protocols": ("data",)}}


def test_weasyprint_without_its_library_is_told_in_a_line(no_browser, monkeypatch, tmp_path):
    class Missing:
        def find_spec(self, name, *_):
            if name == "weasyprint":
                raise OSError("cannot load library 'libpango-1.0-0'\nmore")

    monkeypatch.delitem(sys.modules, "weasyprint", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Missing(), *sys.meta_path])
    monkeypatch.setattr(pdf, "find_spec", lambda name: object())
    with pytest.raises(
        ValueError, match=r"WeasyPrint cannot be loaded \(cannot load library 'libpango-1.0-0'\): install"
    ):
        pdf.write_pdf("<p>a", tmp_path / "a.pdf", force=False)
    assert importlib.util.find_spec("gonio")
    assert list(tmp_path.iterdir()) == []
