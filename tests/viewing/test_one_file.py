"""The page in one file: small, asking nobody for anything, in a sandbox without storage, whatever its names are."""

import json

import html5lib
import numpy as np
import pytest

import gonio
from gonio import Problem, catalogue, fit, simulate
from gonio.viewing import assembled
from gonio.viewing.assembled import in_one_file, parts, policy, scripts_of
from gonio.viewing.notebook import frame
from gonio.viewing.session import Opened, Session
from viewing.opened import READY, from_elsewhere, opened, until

pytestmark = pytest.mark.xdist_group("viewer")

HOSTILE = "a</script><script>window.harmed=1</script><img src=x onerror=window.harmed=1>\x1b[31m\u202e\u0000&amp;"
LARGEST = 500_000  # bytes of a page of 1000 points


@pytest.fixture(scope="module")
def fitted():
    """A fit of 1000 points."""
    model = catalogue["ggx"]
    values = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2, "index": 1.5, "extinction": 0.0}
    angles = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0]
    scan = simulate(model, values, angles, np.linspace(-80, 80, 125), noise=0.01, seed=1)
    return fit(Problem(model, scan, held={"index": 1.5, "extinction": 0.0}, weighting="log"))


@pytest.fixture(scope="module")
def page(fitted, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    gonio.view(fitted, out=path)
    return path


def test_it_is_small(page):
    assert page.stat().st_size < LARGEST


def test_it_is_html_with_two_scripts_and_their_digests(page):
    text = page.read_text(encoding="utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    assert len(scripts_of(text)) == 2
    assert policy(scripts_of(text)) in text
    assert "unsafe-inline' data" not in text.partition("script-src")[2].partition(";")[0]


def test_it_works_from_a_file_and_asks_for_nothing(chromium, page):
    with opened(chromium, page) as shown:
        shown.wait_for_selector(READY)
        assert shown.locator(".parameter").count() == 5
        before = shown.evaluate("gonio.store.get().result.cost")
        slider = shown.locator("#parameter-width")
        slider.focus()
        slider.press("Shift+ArrowRight")
        until(shown, f"gonio.store.get().result.cost !== {before}")
        assert "holds the model" in shown.locator(".alone").text_content()
        assert (shown.said, from_elsewhere(shown)) == ([], [])


def test_it_works_in_a_frame_without_storage_or_origin(chromium, page, tmp_path):
    """As a mail program, a forge or a notebook shows it: sandboxed, so that storage and cookies raise."""
    around = "<!doctype html><meta charset=utf-8><title>a</title><style>* {color: red; display: none}</style>"
    around = around.replace("display: none", "font-size: 99px")
    (tmp_path / "around.html").write_text(around + frame(page.read_text(encoding="utf-8")), encoding="utf-8")
    with opened(chromium, tmp_path / "around.html") as shown:
        inside = shown.frames[1]
        inside.wait_for_selector(READY)
        stored = "() => { try { return localStorage.length } catch (error) { return error.name } }"
        assert inside.evaluate(stored) == "SecurityError"
        assert inside.evaluate("getComputedStyle(document.querySelector('h1')).fontSize") == "16px"
        assert inside.locator("canvas").count() > 0
        assert (shown.said, [url for url in from_elsewhere(shown) if url != "about:srcdoc"]) == ([], [])


def hostile_session():
    """Whatever a file or a user can name, called HOSTILE."""
    name = HOSTILE.replace("\0", "")  # which no name on a disk has
    scan = simulate(catalogue["lambert"], {"rho": 0.4}, [10.0, 40.0], np.arange(-60, 61, 20.0), noise=0.01)
    scan = gonio.join({name: scan, "b": scan})
    scan.attrs["history"] = f"read from {HOSTILE} as {HOSTILE}"
    scan.attrs["quantity"] = HOSTILE
    solution = fit(Problem(catalogue["lambert"], scan, grouped={"rho": "scan"}))
    return Session([Opened(HOSTILE, scan, {HOSTILE: solution}), Opened("other", scan)], model="lambert")


def test_hostile_names_are_text(chromium, tmp_path):
    text = in_one_file(hostile_session(), ["lambert"])
    assert "<img" not in text
    assert text.count("</script>") == 3
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with opened(chromium, tmp_path / "page.html") as shown:
        shown.wait_for_selector(READY)
        shown.locator("summary").first.click()
        words = shown.evaluate("document.body.innerText + [...document.querySelectorAll('option')].map((o) => o.text)")
        assert shown.evaluate("window.harmed") is None
        assert shown.locator("img").count() == 0
        assert "<script>window.harmed=1</script>" in words
        assert not set("\x1b\u202e\0") & set(words)
        assert (shown.said, from_elsewhere(shown)) == ([], [])


def test_a_hostile_name_would_be_found(chromium, tmp_path):
    """The test above sees an element and a script, were a name put into the page as markup."""
    text = in_one_file(hostile_session(), ["lambert"]).replace("</body>", "<img src=x><p>\u202e</p></body>")
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with opened(chromium, tmp_path / "page.html") as shown:
        shown.wait_for_selector(READY)
        assert shown.locator("img").count() == 1
        assert "\u202e" in shown.evaluate("document.body.innerText")
        assert shown.said  # the policy refuses the picture


def test_a_script_that_is_not_the_pages_own_does_not_run(chromium, page, tmp_path):
    text = page.read_text(encoding="utf-8").replace("</body>", "<script>window.harmed=1</script></body>")
    (tmp_path / "page.html").write_text(text, encoding="utf-8")
    with opened(chromium, tmp_path / "page.html") as shown:
        shown.wait_for_selector(READY)
        assert shown.evaluate("window.harmed") is None
        assert len(shown.said) == 1
        assert "Content Security Policy" in shown.said[0]


def test_more_values_than_a_page_holds_are_thinned_and_it_says_so(chromium, tmp_path, monkeypatch):
    monkeypatch.setattr("gonio.viewing.columns.columns_of.__defaults__", (100,))
    scan = simulate(catalogue["lambert"], {"rho": 0.4}, np.arange(0.0, 80, 5), np.arange(-80, 81, 5.0), noise=0.01)
    gonio.view(scan, model="lambert", out=tmp_path / "page.html")
    with opened(chromium, tmp_path / "page.html") as shown:
        shown.wait_for_selector(READY)
        said = shown.locator("#panel").text_content()
        count = shown.evaluate("gonio.store.get().sets[0].value.length")
        assert 0 < count <= 100
        assert f"{scan['brdf'].size} simulated values" in said
        assert f"Shown are {count} of them" in said


def test_the_scripts_are_as_they_are_written(page):
    """What an address cannot hold is escaped, and no more: every module comes back as its file has it."""
    from urllib.parse import unquote

    imports = json.loads(scripts_of(page.read_text(encoding="utf-8"))[0])["imports"]
    head = "data:text/javascript;charset=utf-8,"
    for name, content in parts().items():
        if name.endswith(".js"):
            address = imports[f"gonio/{name}"]
            assert address.startswith(head)
            assert unquote(address.removeprefix(head)) == content, name
    assert set(imports) == {f"gonio/{n}" for n in parts() if n.endswith(".js")} | {"model/ggx.js"}


def test_json_cannot_end_its_script():
    assert assembled._inside('"</script><!--&') == '"\\u003c/script\\u003e\\u003c!--\\u0026'
