"""What the page draws of a file of every format: something in every plot, nothing too wide, no complaint."""

import io

import matplotlib.image
import numpy as np
import pytest

from gonio.formats import formats
from viewed import complaints, served

pytestmark = [pytest.mark.xdist_group("viewer"), pytest.mark.no_cover]
LARGEST = 100_000  # bytes of a sample, where a format has one that is smaller
WIDTHS = (360, 1280)
INK = 10  # pixels of colour that a view has at least where it draws anything: two dots of one curve
# Where a view is, and whether it says in words why it draws nothing.
VIEWS = """() => Array.from(document.querySelectorAll("main > section"))
  .filter((s) => s.checkVisibility() && s.querySelector("canvas"))
  .map((s) => ({ id: s.id, boxes: Array.from(s.querySelectorAll("canvas"))
    .filter((c) => c.checkVisibility())
    .map((c) => c.getBoundingClientRect())
    .map((b) => [b.left, b.top + scrollY, b.width, b.height]) }))"""
BEYOND = """(width) => Array.from(document.querySelectorAll("body *"))
  .filter((e) => e.checkVisibility() && !e.closest(".scroll, svg, dialog"))
  .filter((e) => e.getBoundingClientRect().right > width + 1)
  .map((e) => e.outerHTML.slice(0, 120))"""
DRAWN = """(k) => gonio.actions.chooseSet(k).then(() => new Promise((done) => setTimeout(() =>
  requestAnimationFrame(() => requestAnimationFrame(done)), 50)))"""


def chosen(paths):
    """The largest sample below LARGEST bytes, else the smallest; the size of a folder is that of its files."""

    def size(path):
        return sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size

    return max(paths, key=lambda path: (size(path) < LARGEST, size(path) if size(path) < LARGEST else -size(path)))


@pytest.fixture(scope="module")
def files(sample_files):
    return {name: chosen(paths) for name, paths in sorted(sample_files.items())}


@pytest.fixture(scope="module")
def page(chromium, files):
    """One page with a scan of every format, and what it complained of."""
    with served(*files.values(), "--set", "width=0.05") as address:
        tab = chromium.new_page(viewport={"width": WIDTHS[0], "height": 740})
        tab.wrong = complaints(tab)
        tab.goto(address)
        tab.wait_for_selector("html[data-ready=true]")
        yield tab
        tab.close()


def ink(picture, box, coloured):
    """How many pixels of a part of a picture are not as its corner is; of coloured ones alone, for grids are grey."""
    left, top, width, height = (max(0, round(v)) for v in box)
    part = picture[top : top + height, left : left + width, :3]
    if coloured:
        return int((np.ptp(part, axis=-1) > 0.15).sum())
    return int((np.abs(part - part[0, 0]) > 0.02).any(axis=-1).sum())


@pytest.mark.parametrize("name", sorted(formats()))
def test_every_view_draws_every_format(name, page, files):
    place = list(files).index(name)
    page.wrong.clear()
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 740})
        page.evaluate(DRAWN, place)
        assert page.evaluate("gonio.store.get().error") == ""
        assert page.evaluate("document.scrollingElement.scrollWidth") <= width
        assert page.evaluate(BEYOND, width) == []
    picture = matplotlib.image.imread(io.BytesIO(page.screenshot(full_page=True)))
    views = {view["id"]: view["boxes"] for view in page.evaluate(VIEWS)}
    assert views or page.inner_text("#curves .note")
    if not page.evaluate("gonio.store.get().result.count"):
        views["curves"] = views.get("curves", [])[:1]  # no residual: nothing that a model describes
    for view, boxes in views.items():
        for box in boxes:
            assert ink(picture, box, coloured=view == "curves") > INK, view
    assert page.wrong == []
