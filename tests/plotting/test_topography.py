"""The figure of a height map: what it shows, units on every axis, and pages on which not all has room."""

import pytest

from gonio.plotting.page import Page, drawn_on
from gonio.plotting.style import fit_to_page
from gonio.plotting.topography import topography_figure
from gonio.topography import level, simulate_heights, summarise


@pytest.fixture(scope="module")
def summary():
    return summarise(level(simulate_heights(0.142, 2.0, points=(64, 64), pitch=0.5)), wavelength=632.8)


def panels(figure):
    return [ax for ax in figure.axes if ax.get_title()]


def test_map_spectrum_and_slopes_with_units(summary):
    figure = topography_figure(summary, title="panel 7")
    assert [ax.get_title() for ax in panels(figure)] == ["levelled heights", "height spectrum", "slopes"]
    labels = [label for ax in panels(figure) for label in (ax.get_xlabel(), ax.get_ylabel())]
    assert all("[" in label for label in labels), labels
    assert any(ax.get_ylabel() == "height z [µm]" for ax in figure.axes)
    assert figure.get_suptitle() == "panel 7"


@pytest.mark.parametrize(("size", "count"), [("85x60mm", 1), ("85x120mm", 2), ("85x200mm", 3), ("180x70mm", 3)])
def test_pages_hold_as_many_panels_as_have_room(summary, size, count):
    with drawn_on(Page(size=size, font=7.0)):
        figure = topography_figure(summary, title="panel 7")
        fit_to_page(figure)
    assert len(panels(figure)) == count
    assert (f"{count} of 3 panels have room" in figure.get_suptitle()) == (count < 3)
