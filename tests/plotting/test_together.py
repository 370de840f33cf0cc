"""Several samples, channels and wavelengths in the same panels."""

import numpy as np
import pytest

from gonio import catalogue, join, simulate
from gonio.app.views.figures import draw
from gonio.comparison.ranking import compare
from gonio.measured.dataset import select
from gonio.plotting.panels import parted
from gonio.results.view import View

pytestmark = pytest.mark.xdist_group("figures")


def paint(rho, wavelength=500.0, angles=(10.0, 40.0)):
    return simulate(
        catalogue["lambert"], {"rho": rho}, list(angles), np.arange(-60, 61, 20.0), noise=0.01, wavelength=wavelength
    )


def dots(ax):
    return {line.get_label(): line.get_ydata() for line in ax.lines if line.get_linestyle() == "None"}


@pytest.fixture(scope="module")
def colours():
    """One scan of three wavelengths."""
    return join({str(k): paint(0.2 + k / 5, 450.0 + 100 * k) for k in range(3)}).drop_vars("scan")


def test_samples_share_a_panel_with_their_fits():
    scans = {"one": paint(0.2), "two": paint(0.8)}
    ranked = {name: (scan, compare(scan, [catalogue["lambert"]])) for name, scan in scans.items()}
    figure = draw("curves", ranked)
    assert len(figure.axes) == 4
    for ax, theta_i in zip(figure.axes[:2], (10.0, 40.0), strict=True):
        shown = dots(ax)
        assert list(shown) == ["one", "two"]
        for name, scan in scans.items():
            np.testing.assert_array_equal(shown[name], scan["brdf"].values[scan["theta_i"].values == theta_i])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert sorted(labels) == ["one", "one, lambert", "two", "two, lambert"]
    handles = {line.get_label(): line for line in figure.axes[0].lines}
    assert handles["one"].get_color() == handles["one, lambert"].get_color() != handles["two"].get_color()
    np.testing.assert_allclose(handles["two, lambert"].get_ydata(), 0.8 / np.pi, rtol=0.02)


def test_wavelengths_share_a_panel(colours):
    figure = draw("curves", {"paint": (colours, [])}, View(together=True, scales=("log",), theta_i=(40.0,)))
    (ax,) = figure.axes
    assert ax.get_yscale() == "log"
    shown = dots(ax)
    assert list(shown) == ["wavelength 450", "wavelength 550", "wavelength 650"]
    wanted = select(colours, {"wavelength": 550.0})
    np.testing.assert_array_equal(shown["wavelength 550"], wanted["brdf"].values[wanted["theta_i"].values == 40])
    assert len({line.get_color() for line in ax.lines if line.get_linestyle() == "None"}) == 3
    assert list(parted(paint(0.5))) == [""]


def test_an_angle_of_one_sample_alone_has_its_panel():
    figure = draw("curves", {"one": (paint(0.2), []), "two": (paint(0.8, angles=(25.0,)), [])})
    assert [list(dots(ax)) for ax in figure.axes[:3]] == [["one"], ["two"], ["one"]]


def test_what_shares_no_panel_is_refused(colours):
    other = simulate(catalogue["lambert"], {"rho": 0.5}, [10.0], np.arange(-60, 61, 20.0), unit="a.u.")
    with pytest.raises(ValueError, match=r"different units share no axis: one in .*, two in a.u."):
        draw("curves", {"one": (paint(0.2), []), "two": (other, [])})
    with pytest.raises(ValueError, match="9 sets of data are too many for one panel: choose at most 7"):
        draw("curves", {str(k): (colours, []) for k in range(3)}, View(together=True))
    with pytest.raises(ValueError, match="hemisphere does not show several sets together"):
        draw("hemisphere", {"one": (colours, [])}, View(together=True))
    with pytest.raises(ValueError, match="hemisphere shows one scan"):
        draw("hemisphere", {"one": (colours, []), "two": (colours, [])})
