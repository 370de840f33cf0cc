"""A light curve on a column of a journal: 85 mm, text of 9 pt."""

import numpy as np

import gonio
from gonio.photometry import Facet, light_curve
from gonio.plotting.page import Page, drawn_on
from gonio.plotting.sky import light_curve_figure
from gonio.plotting.style import save


def test_the_label_of_time_and_the_day_have_room(tmp_path):
    facets = [Facet(1.0, [0, 0, 1], gonio.catalogue["lambert"], {"rho": 0.3}, name=name) for name in ("body", "array")]
    curve = light_curve(facets, [0.0, 0.5, 1.0], np.array([[0.0, x, 5e5] for x in np.linspace(-4e5, 4e5, 5)]))
    times = np.datetime64("2022-01-25T13:20:00") + np.arange(5) * np.timedelta64(60, "s")
    with drawn_on(Page(size="85x80mm")):
        figure = light_curve_figure(curve, times, title="satellite")
        save(figure, tmp_path / "curve", [".png"])
    assert (tmp_path / "curve.png").exists()
