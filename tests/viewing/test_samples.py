"""What the page draws of a file of every format: something in every plot, nothing too wide, no complaint."""

import io

import matplotlib.image
import numpy as np
import pytest

from gonio.formats import formats
from viewed import served
from viewing.opened import READY, opened

pytestmark = [pytest.mark.xdist_group("pages"), pytest.mark.no_cover]
LARGEST = 100_000  # bytes of a sample, where a format has one that is smaller
WIDTHS = (1280, 360)
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
# Lines of text on each other, by more than letters are. The footer is over what is scrolled, and legends are not seen.
COVERED = """() => {
  const lines = [];
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const { data, parentElement } = texts.currentNode;
    if (!data.trim() || !parentElement.checkVisibility()) continue;
    if (parentElement.closest("footer, legend, select, dialog, .scroll")) continue;
    const range = document.createRange();
    range.selectNodeContents(texts.currentNode);
    // What is below the end of its box is seen when that is scrolled.
    const end = parentElement.closest(".chips")?.getBoundingClientRect().bottom ?? Infinity;
    for (const { left, right, top, bottom, width } of range.getClientRects()) {
      if (width > 2) lines.push({ data, box: { left, right, top, bottom: Math.min(bottom, end) } });
    }
  }
  const shared = (a, b, from, to) => Math.min(a[to], b[to]) - Math.max(a[from], b[from]);
  const over = (a, b) => shared(a, b, "left", "right") > 2 && shared(a, b, "top", "bottom") > 4;
  const pairs = lines.flatMap((one, k) => lines.slice(k + 1).map((other) => [one, other]));
  return pairs.filter(([a, b]) => over(a.box, b.box)).map((both) => both.map(({ data }) => data.slice(0, 60)));
}"""
# Of its curves the first three: the sixth colour is grey, and curves may lie on each other.
CHOSEN = """async (k) => {
  await gonio.actions.chooseSet(k);
  const { sets, set, block, hidden } = gonio.store.get();
  const shown = sets[set].cells.map((_, n) => n).filter((n) => sets[set].cells[n].block === block && !hidden.has(n));
  gonio.store.set({ hidden: new Set([...hidden, ...shown.slice(3)]) });
}"""
DRAWN = """new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 50))"""


def chosen(paths):
    """The largest sample below LARGEST bytes, else the smallest; the size of a folder is that of its files."""

    def size(path):
        return sum(p.stat().st_size for p in path.rglob("*")) if path.is_dir() else path.stat().st_size

    return max(paths, key=lambda path: (size(path) < LARGEST, size(path) if size(path) < LARGEST else -size(path)))


@pytest.fixture(scope="module")
def files(sample_files):
    return {name: chosen(paths) for name, paths in sorted(sample_files.items())}


@pytest.fixture(scope="module")
def page(chromium, files, tmp_path_factory):
    """One page with a scan of every format, and what it complained of."""
    state = tmp_path_factory.mktemp("state") / "state.json"
    state.write_text('{"v": 1}')
    quick = ("--model", "lambert", "--state", state)  # a model that is soon drawn, and nothing is fitted
    with served(*files.values(), *quick) as address, opened(chromium, address) as shown:
        shown.wait_for_selector(READY)
        yield shown


def ink(picture, box, coloured):
    """How many pixels of a part of a picture are not as its corner is; of coloured ones alone, for grids are grey."""
    left, top, width, height = (max(0, round(v)) for v in box)
    part = picture[top : top + height, left : left + width, :3]
    if coloured:
        return int((np.ptp(part, axis=-1) > 0.15).sum())
    return int((np.abs(part - part[0, 0]) > 0.02).any(axis=-1).sum())


def fits(page, width):
    page.evaluate(DRAWN)
    assert page.evaluate("gonio.store.get().error") == ""
    assert page.evaluate("document.scrollingElement.scrollWidth") <= width
    assert page.evaluate(BEYOND, width) == []
    assert page.evaluate(COVERED) == []


@pytest.mark.parametrize("name", sorted(formats()))
def test_every_view_draws_every_format(name, page, files):
    page.said.clear()
    page.set_viewport_size({"width": WIDTHS[0], "height": 740})
    page.evaluate(CHOSEN, list(files).index(name))
    fits(page, WIDTHS[0])
    picture = matplotlib.image.imread(io.BytesIO(page.screenshot(full_page=True)))
    views = {view["id"]: view["boxes"] for view in page.evaluate(VIEWS)}
    assert views or page.inner_text("#curves .note")
    if not page.evaluate("gonio.store.get().result.count"):
        views["curves"] = views.get("curves", [])[:1]  # no residual: nothing that a model describes
    for view, boxes in views.items():
        for box in boxes:
            assert ink(picture, box, coloured=view == "curves") > INK, view
    page.set_viewport_size({"width": WIDTHS[1], "height": 740})
    fits(page, WIDTHS[1])
    assert page.said == []
