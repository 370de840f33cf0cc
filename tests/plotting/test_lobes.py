"""Values as lengths: in plane on a polar axis, and over the hemisphere as a lobe in space."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Line3D, Poly3DCollection

from gonio import catalogue, fit, plot, simulate
from gonio.fitting import Problem
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.plotting.lobes.lobe import Lobe, lobes
from gonio.plotting.lobes.polar import Arc, polar
from gonio.plotting.lobes.radius import Radius

pytestmark = pytest.mark.xdist_group("figures")
RHO = np.pi * 0.2


@pytest.fixture(scope="module")
def lambert():
    return catalogue["lambert"]


@pytest.fixture(scope="module")
def scan(lambert):
    return simulate(lambert, {"rho": RHO}, [20.0, 50.0], np.arange(-80.0, 81, 10.0))


@pytest.fixture(scope="module")
def solution(lambert, scan):
    return fit(Problem(lambert, scan))


def words(figure):
    return figure.get_suptitle()


def test_a_radius_is_linear_or_counts_decades_above_its_floor():
    values = np.array([-1.0, 0.0, 2e-3, 0.5, 40.0])
    linear, logarithmic = Radius.of("linear", values), Radius.of("log", values)
    assert linear.lengths(values).tolist() == [0.0, 0.0, 2e-3, 0.5, 40.0]
    assert logarithmic.floor == pytest.approx(1e-3)
    np.testing.assert_allclose(logarithmic.lengths(values), [0, 0, np.log10(2), np.log10(500), np.log10(4e4)])
    assert np.isnan(logarithmic.lengths(np.array([np.nan]))).all()
    assert logarithmic.centre("sr-1") == "centre: 0.001 sr⁻¹ and less"
    assert linear.centre("sr-1") == ""
    assert Radius.of("log", np.array([1e-30, 1e-9, 7.0])).floor == pytest.approx(1e-6)  # no goniometer measures more
    for dark in ([0.0, -1.0], [np.nan], []):
        assert Radius.of("log", np.array(dark)).end == 1.05


@pytest.mark.parametrize("values", [[0.21, 0.35], [1e-5, 3e4], [0.02, 0.9], [3.0, 3.0], [1e-9, 2e-9], [0.0, 7e7]])
@pytest.mark.parametrize("scale", ["linear", "log"])
def test_circles_stand_at_their_values_and_apart(values, scale):
    radius = Radius.of(scale, np.array(values))
    lengths, labels = radius.circles()
    assert 1 <= len(lengths) <= 5
    assert len(set(labels)) == len(labels)
    assert np.all(np.diff([0.0, *lengths]) >= 0.19 * radius.end)
    for length, label in zip(lengths, labels, strict=True):
        plain = label.replace("$", "").replace(r"\mathdefault{", "").replace(r"\times", "*").replace("{", "(")
        plain = plain.replace("}}", ")").replace("}", "")
        value = float(label) if "$" not in label else _power(plain)
        assert radius.lengths(np.array([value]))[0] == pytest.approx(length)


def _power(text):
    mantissa, _, rest = text.rpartition("*")
    return float(mantissa or 1) * 10.0 ** int(rest.partition("^(")[2].rstrip(")"))


def test_a_polar_figure_has_values_as_radius_and_marks_the_specular_direction(scan, solution):
    figure = plot(scan, solution, "polar", scale="linear")
    (ax,) = figure.axes
    assert (ax.get_thetamin(), ax.get_thetamax()) == (-90, 90)
    speculars = [line for line in ax.lines if len(line.get_xdata()) == 2]
    assert [np.degrees(line.get_xdata()[0]) for line in speculars] == pytest.approx([20, 50])
    dots = [line for line in ax.lines if line.get_marker() == "o"]
    assert len(dots) == 2
    np.testing.assert_allclose(dots[0].get_ydata(), 0.2)
    np.testing.assert_allclose(np.degrees(dots[0].get_xdata()), np.arange(-80.0, 81, 10.0))
    models = [line for line in ax.lines if len(line.get_xdata()) > 100]
    np.testing.assert_allclose(models[1].get_ydata(), 0.2)
    assert "centre" not in words(figure)
    assert "centre: 0.1 sr⁻¹ and less" in words(plot(scan, solution, "polar", scale="log"))
    assert len(plot(scan, solution, "polar").axes) == 2
    assert any("BRDF [sr⁻¹]" in text.get_text() and "θᵣ [deg]" in text.get_text() for text in ax.texts)


def test_polar_dots_say_what_was_filled(scan):
    flat = scan.copy()
    flat["origin"] = ("direction", np.where(flat["theta_r"] > 60, 4, 1))
    figure = plot(flat, kind="polar", scale="linear")
    assert {"measured", "filled"} <= {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    hollow = [line for line in figure.axes[0].lines if line.get_markerfacecolor() == "white"]
    assert sum(len(line.get_xdata()) for line in hollow) == (flat["theta_r"] > 60).sum()


def test_an_arc_without_points_is_that_of_its_lines():
    theta_r = np.linspace(-89, 89, 100)
    figure = polar([Arc(30.0, {"one": (theta_r, np.full(100, 3.0))})], unit="sr-1", scales=("linear",))
    assert figure.axes[0].get_rmax() == pytest.approx(3.15)
    with pytest.raises(ValueError, match="need at least one array"):
        polar([], unit="sr-1")


class Kept(Poly3DCollection):
    """A surface that remembers its faces, which Matplotlib keeps under another name in each version."""

    def __init__(self, faces, **options):
        self.kept = np.asarray(faces)
        super().__init__(faces, **options)


@pytest.fixture(autouse=True)
def surfaces(monkeypatch):
    monkeypatch.setattr("mpl_toolkits.mplot3d.art3d.Poly3DCollection", Kept)


def corners(figure):
    """x, y and z of every corner of the surface."""
    (surface,) = (c for c in figure.axes[0].collections if isinstance(c, Kept))
    return surface.kept.reshape(-1, 3)


def test_a_lobe_has_the_value_as_its_distance(solution, scan):
    """Of a Lambertian surface it is half a sphere, on which the measured points lie."""
    figure = plot(scan, solution, "lobe", theta_i=50.0)
    np.testing.assert_allclose(np.linalg.norm(corners(figure), axis=-1), 0.2, rtol=1e-9)
    (dots,) = (line for line in figure.axes[0].lines if line.get_label() == "simulated")
    assert isinstance(dots, Line3D)
    places = np.array(dots.get_data_3d())
    assert places.shape == (3, 17)
    np.testing.assert_allclose(np.linalg.norm(places, axis=0), 0.2)
    forward = scan["phi"].values[scan["theta_i"] == 50] == 180
    assert (places[0][forward] >= -1e-12).all()
    assert (places[0][~forward] < 0).all()
    named = {text.get_text() for text in figure.axes[0].texts}
    assert {"forward [sr⁻¹]", "side [sr⁻¹]", "normal [sr⁻¹]"} <= named
    end = figure.axes[0].get_zlim()[1]
    (line,) = (line for line in figure.axes[0].lines if line.get_label() == "specular direction")
    np.testing.assert_allclose(
        np.array(line.get_data_3d())[:, 1], end * np.array([np.sin(50 / 180 * np.pi), 0, np.cos(50 / 180 * np.pi)])
    )


def test_a_narrow_lobe_reaches_its_peak():
    """Half a degree wide: a coarse grid would pass beside it."""

    def needle(geometry):
        x_i, y_i, z_i, x_r, y_r, z_r = geometry
        off = np.degrees(np.arccos(np.clip(-x_i * x_r - y_i * y_r + z_i * z_r, -1, 1)))
        return 1000.0 * np.exp(-((off / 0.5) ** 2))

    figure = lobes({"needle": Lobe(37.3, needle)}, unit="sr-1")
    assert np.linalg.norm(corners(figure), axis=-1).max() == pytest.approx(1000.0, rel=1e-3)


def test_a_measured_hemisphere_is_a_lobe_open_where_nothing_was_measured():
    theta_r, phi = (a.ravel() for a in np.meshgrid(np.arange(0.0, 61.0, 10.0), np.arange(0.0, 360.0, 30.0)))
    scan = make_scan(np.full(theta_r.size, 30.0), theta_r, np.full(theta_r.size, 0.5), phi)
    found = corners(plot(scan, kind="lobe"))
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 0.5)
    assert np.degrees(np.arccos(found[:, 2] / 0.5)).max() <= 60.0 + 1e-6
    with pytest.raises(ValueError, match=r"only of the plane of incidence.*draw curves or polar, or give a fit"):
        plot(simulate(catalogue["lambert"], {"rho": 0.5}, [30.0], np.arange(-60.0, 61, 10.0)), kind="lobe")


def test_directions_lie_where_they_point():
    """As in the view from above: forward is phi = 180 deg, and seen from above phi grows against the clock."""
    for phi, x, y in ((180.0, 1, 0), (0.0, -1, 0), (90.0, 0, -1), (270.0, 0, 1)):
        wanted = np.array(Geometry.from_degrees(0.0, 80.0, phi)[3:5], dtype=float)
        brdf = lambda g, wanted=wanted: np.where(g.x_r * wanted[0] + g.y_r * wanted[1] > 0.9, 1.0, 0.1)  # noqa: E731
        found = corners(lobes({"one": Lobe(0.0, brdf)}, unit="sr-1"))
        far = found[np.linalg.norm(found, axis=-1) > 0.9].mean(axis=0)
        assert (np.sign(far[:2].round(1)) == [x, y]).all(), phi
