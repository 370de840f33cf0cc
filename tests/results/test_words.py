"""gonio.plot takes the page and the view by the words of the command line."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

import gonio
from results.conftest import surface


@pytest.mark.parametrize("size", [(85, 60), [85.0, 60.0], np.array([85, 60]), "85x60mm", "8.5x6cm"])
def test_a_page_in_words(single, size):
    figure = gonio.plot(surface(), single, size=size, font=8, title="Mine", scale="log")
    np.testing.assert_allclose(figure.get_size_inches() * 25.4, [85, 60], atol=1e-4)
    texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    assert {text.get_fontsize() for text in texts} == {8.0}
    assert figure.get_suptitle() == "Mine"
    assert all(ax.get_yscale() == "log" for ax in figure.axes)


def test_a_fit_takes_them_too_and_writes_the_file(single, tmp_path):
    before = dict(mpl.rcParams)
    out = tmp_path / "a.png"
    assert isinstance(single.plot(size=(85, 60), font=8, dpi=200, out=out), Figure)
    with Image.open(out) as picture:
        assert picture.size == (int(85 / 25.4 * 200), int(60 / 25.4 * 200))
    with pytest.raises(FileExistsError):
        single.plot(out=out)
    single.plot(out=out, force=True)
    single.plot(out=tmp_path / "b", format="pdf,svg")
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "b.pdf", "b.svg"}
    assert dict(mpl.rcParams) == before


def test_angles_and_bands(single):
    figure = single.plot(theta_i=50, scale="linear", band=True)
    assert [ax.get_title() for ax in figure.axes] == ["θᵢ = 50°"]
    assert "95 % band" in {text.get_text() for text in figure.legends[0].get_texts()}


@pytest.mark.parametrize(
    ("words", "error", "told"),
    [
        ({"sise": (85, 60)}, TypeError, "plot takes no 'sise': it takes size, font, dpi"),
        ({"size": (85, 60, 1)}, ValueError, "give width and height in mm"),
        ({"size": "85x60"}, ValueError, "not of the form 85x60mm"),
        ({"size": (8.5, 6)}, ValueError, "sides from 20 to 1200 mm"),
        ({"size": (30, 30)}, ValueError, "no room on 30 x 30 mm"),
        ({"font": 100}, ValueError, "font is 100: give a number from 4 to 72"),
        ({"scale": "logarithmic"}, ValueError, "scale is 'logarithmic': choose linear, log or both"),
        ({"style": "none.mplstyle"}, FileNotFoundError, "there is no such style file"),
        ({"theta_i": 33.0}, ValueError, "no incidence angle of 33 deg: choose of 20, 50"),
        ({"at": (1.0, 2.0)}, ValueError, "give theta_i, theta_r and phi in degrees"),
        ({"at": (30.0, 30.0, 180.0)}, ValueError, "leave --at out, or draw spectrum"),
        ({"out": "a.jpg"}, ValueError, "figures are written as .pdf, .png or .svg"),
        ({"ax": Figure().subplots(), "size": (85, 60)}, ValueError, "ax has a page of its own: leave size out"),
    ],
)
def test_what_is_no_word_or_no_page(single, words, error, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=told.replace("(", r"\(")):
        gonio.plot(surface(), single, **words)
    assert not list(tmp_path.iterdir())


def test_filled_values_are_marked_on_axes_of_ones_own():
    scan = surface()
    scan["origin"] = ("direction", np.where(scan["theta_r"] > 50, 3, 1))
    ax = Figure().subplots()
    gonio.plot(scan, ax=ax)
    labels = {line.get_label(): line for line in ax.lines}
    assert {"θᵢ = 20°", "θᵢ = 20°, by symmetry", "θᵢ = 50°", "θᵢ = 50°, by symmetry"} <= set(labels)
    assert labels["θᵢ = 20°, by symmetry"].get_markerfacecolor() == "white"
