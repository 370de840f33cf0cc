"""The page of a figure: its size, text, resolution, title, style and formats, and that all of it has room."""

import itertools
import re
import zlib

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from PIL import Image

from gonio import catalogue, simulate
from gonio.app.views.evaluation import surface
from gonio.app.views.figures import draw, draw_model
from gonio.comparison.ranking import compare
from gonio.plotting.difference import difference_figure
from gonio.plotting.page import Page, drawn_on
from gonio.plotting.page.room import visible_texts
from gonio.plotting.style import house_style, save
from gonio.resampling.difference import difference

pytestmark = pytest.mark.xdist_group("figures")
COLUMN = Page(size="85x60mm", font=8)  # a column of a journal


@pytest.fixture(scope="module")
def ranked():
    values = {"rho_s": 0.2, "rho_d": 0.1, "width": 0.3}
    scan = simulate(
        catalogue["ggx"], values, [10.0, 20, 30, 40, 50, 60], np.arange(-70, 71, 10.0), noise=0.02, unit="sr-1"
    )
    return {"paint": (scan, compare(scan, [catalogue[name] for name in ("lambert", "ggx", "phong")]))}


def drawings(ranked):
    scan, _ = ranked["paint"]
    alone = surface(catalogue["ggx"], {"rho_s": 1.0, "width": 0.3}, "")
    yield from (
        (kind, lambda kind=kind: draw(kind, ranked)) for kind in ("curves", "residuals", "components", "errors")
    )
    yield "view", lambda: draw_model("hemisphere", alone, [60.0], ())
    yield "difference", lambda: difference_figure(difference(scan, scan), "a.csv", "b.csv")


def boxes(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return list(visible_texts(figure, canvas.get_renderer()))


def test_a_column_of_a_journal_holds_every_figure(ranked, tmp_path):
    """The file has the size to the pixel, every text is of 8 pt, inside the page, and over no other."""
    for name, drawing in drawings(ranked):
        with drawn_on(COLUMN), house_style():
            figure = drawing()
            (path,) = save(figure, tmp_path / name, (".png",))
            with Image.open(path) as picture:
                assert picture.size == (int(85 / 25.4 * 160), int(60 / 25.4 * 160)), name
            figure.set_dpi(300)
            texts = boxes(figure)
        sizes = {t.get_fontsize() for t in figure.findobj(Text) if t.get_text().strip() and t.get_visible()}
        assert sizes == {8.0}, name
        width, height = figure.get_size_inches() * 300
        for text, box in texts:
            inside = min(box.x0, box.y0) >= -5 and box.x1 <= width + 5 and box.y1 <= height + 5  # 0.4 mm
            assert inside, (name, text)
        for (one, a), (other, b) in itertools.combinations(texts, 2):
            apart = min(a.x1, b.x1) - max(a.x0, b.x0) <= 3 or min(a.y1, b.y1) - max(a.y0, b.y0) <= 3
            assert apart, (name, one, other)


def test_what_has_no_room_is_refused_and_not_written(ranked, tmp_path):
    for page in (Page(size="30x30mm"), Page(size="85x60mm", font=20), Page(title="a long title " * 40, size="85x60mm")):
        with drawn_on(page), house_style(), pytest.raises(ValueError, match=r"no room on .* mm with text of .*; give"):
            save(draw("curves", ranked), tmp_path / "f")
    assert not list(tmp_path.iterdir())


def test_what_is_left_out_on_a_small_page_is_told(ranked):
    with drawn_on(COLUMN), house_style():
        texts = [text for text, _ in boxes(draw("curves", ranked))]
    assert any("2 of 6 incidence angles" in text for text in texts)


def test_sizes_are_read_in_any_unit():
    for size in ("85x60mm", "8.5x6cm", "85 x 60 mm", "85×60mm", "8.5X6CM"):
        assert np.allclose(Page(size=size).sides, (85 / 25.4, 60 / 25.4)), size
    assert Page(size="3.5x2in").sides == (3.5, 2.0)
    for wrong in ("85x60", "85", "85mm", "x60mm", "85x60px", "-85x60mm", "85x60mmx3", "1.2.3x4mm"):
        with pytest.raises(ValueError, match="not of the form 85x60mm"):
            Page(size=wrong)
    for wrong in ("0x60mm", "85x19mm", "1201x60mm", f"{'9' * 400}x60mm"):
        with pytest.raises(ValueError, match="sides from 20 to 1200 mm"):
            Page(size=wrong)
    for wrong in ({"font": 0.0}, {"font": np.nan}, {"dpi": -1.0}, {"dpi": np.inf}):
        with pytest.raises(ValueError, match="give a number from"):
            Page(**wrong)
    with pytest.raises(ValueError, match="'eps': choose pdf, png or svg"):
        Page(format="pdf,eps")


def test_a_pdf_is_the_same_each_time_with_fonts_that_an_editor_reads(ranked, tmp_path):
    written = []
    for name in ("one", "two"):
        with drawn_on(COLUMN):
            (path,) = save(draw("curves", ranked), tmp_path / name, (".pdf",))
        written.append(path.read_bytes())
    assert written[0] == written[1]
    assert b"CreationDate" not in written[0]
    assert b"/CIDFontType2" in written[0]  # TrueType
    assert b"/Type3" not in written[0]
    box = re.search(rb"/MediaBox \[ ?0 0 ([0-9.]+) ([0-9.]+) ?\]", written[0])
    assert [float(side) * 25.4 / 72 for side in box.groups()] == pytest.approx([85, 60], abs=0.01)
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", written[0], re.DOTALL)
    sizes = set()
    for stream in streams:
        try:
            sizes |= set(re.findall(rb"/F\d+ ([0-9.]+) Tf", zlib.decompress(stream)))
        except zlib.error:
            continue
    assert b"8" in sizes
    assert {float(size) for size in sizes} <= {8.0, 5.6}  # 5.6: exponents, by Matplotlib's rule of 0.7


def test_a_title_of_ones_own_or_none(ranked):
    for title, shown in (("Paint $x$", True), ("", False)):
        with drawn_on(Page(title=title)), house_style():
            texts = [text for text, _ in boxes(draw("curves", ranked))]
        assert ("Paint $x$" in texts) is shown
        assert "paint" not in texts


def test_a_style_file_has_its_say_under_size_and_font(ranked, tmp_path):
    style = tmp_path / "journal.mplstyle"
    style.write_text(
        "# of a journal\nfigure.figsize: 4, 3\naxes.prop_cycle: cycler('color', ['FF0000', '00FF00'])\n"
        "lines.linewidth: 0.7\nfont.size: 7  # small\naxes.grid: False\n"
    )
    with drawn_on(Page(style=str(style))), house_style():
        figure = draw("curves", ranked)
    assert tuple(figure.get_size_inches()) == (4.0, 3.0)
    lines = [line for line in figure.axes[0].lines if line.get_label() in ("ggx", "lambert")]
    assert [(line.get_color(), line.get_linewidth()) for line in lines] == [("#FF0000", 0.7), ("#00FF00", 0.7)]
    with drawn_on(Page(style=str(style), font=8, size="85x60mm")), house_style():
        figure = draw("curves", ranked)
    assert figure.get_figwidth() == pytest.approx(85 / 25.4)
    assert {t.get_fontsize() for t in figure.findobj(Text) if t.get_text()} == {8.0}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("axes.grid: True\naxes.gird: True\n", "line 2: Matplotlib does not understand 'axes.gird'"),
        ("lines.linewidth: thick\n", "line 1: Matplotlib does not understand 'lines.linewidth' or its value"),
        ("backend: pdf\n", "line 1: backend does not belong to the style of a figure"),
        ("text.usetex: True\n", "line 1: text.usetex does not belong"),
        ("no colon at all\n", "line 1: Matplotlib does not understand 'no colon at all'"),
        ("axes.grid: True\naxes.grid: False\n", "Duplicate key"),
        ("\udcff", "is no text in UTF-8"),
    ],
)
def test_a_style_file_is_understood_whole_or_refused(tmp_path, caplog, text, words):
    style = tmp_path / "s.mplstyle"
    style.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ValueError, match=re.escape(words)) as error:
        Page(style=str(style)).sides  # noqa: B018
    assert "\n" not in str(error.value)
    assert not caplog.records
    with pytest.raises(FileNotFoundError, match="there is no such style file"):
        Page(style=str(tmp_path / "none.mplstyle"))


def test_a_png_of_too_many_pixels_is_refused(ranked, tmp_path):
    with drawn_on(Page(dpi=2400, size="1000x1000mm")), pytest.raises(ValueError, match="give fewer dpi, or write"):
        save(draw("errors", ranked), tmp_path / "f", (".png",))


def test_no_line_of_the_grid_runs_through_a_dot(ranked):
    figure = draw("curves", ranked)
    for ax in figure.axes:
        assert all(axis.get_zorder() < line.get_zorder() for axis in (ax.xaxis, ax.yaxis) for line in ax.lines[:1])
